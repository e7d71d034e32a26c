"""How far parameters can go together before the misfit tells: intervals where the valley of the misfit bends.

A curvature at the best fit tells of a straight valley. Friction, pretension and a law of friction can trade
places along a bent one, far beyond what the curvature says.
"""

from __future__ import annotations

import numpy as np

from cablecomp.diagnosis.fitting import Mask, Model, Problem, bounds_of, cost, evaluate, prior_of
from cablecomp.signal.smoothing import FloatArray

DIRECTIONS = 2  # the weakest ones are walked
PACES = 2  # to the end of an interval where the valley is straight
FARTHEST = 14  # paces at most
DESCENTS = 3  # to the floor of the valley after each pace
TWO_SIDED = 1.96  # standard deviations of a 95 % interval


def walked(problem: Problem, model: Model, mask: Mask, covariance: FloatArray) -> FloatArray:
    """The covariance of z, widened for each coordinate to where a walk along the valley's floor ends.

    Walked is either way along the weakest eigenvectors v of the curvature A (coordinates in tolerances and in
    sizes that show), the others following down to the least misfit there, until the cost has risen by
    1.96^2 (v'Cv)/(v'A^-1 v): where a straight valley would have the end of its 95 % interval under the
    covariance C.
    """
    prior = prior_of(problem, model.forms)
    A = model.J[mask].T @ model.J[mask] + np.diag(prior)
    values, vectors = np.linalg.eigh(A)
    reach = np.zeros(len(values))
    for k in range(min(DIRECTIONS, len(values))):
        v = vectors[:, k]
        own = float(v @ covariance @ v)
        straight = 1.0 / max(float(values[k]), 1e-12)
        level = TWO_SIDED**2 * own / straight
        for way in (1.0, -1.0):
            end = _walk(problem, model, mask, way * v, TWO_SIDED * np.sqrt(own) / PACES, level)
            reach = np.maximum(reach, np.abs(end - model.z))
    stated = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    grow = np.maximum(reach / TWO_SIDED / stated, 1.0)
    return np.asarray(covariance * np.outer(grow, grow))


def _walk(problem: Problem, model: Model, mask: Mask, v: FloatArray, pace: float, level: float) -> FloatArray:
    """Coordinates where the cost has risen by `level`, walking from the model along the unit vector v."""
    prior, (low, high) = prior_of(problem, model.forms), bounds_of(problem, model.forms)
    z, J = model.z, model.J
    bottom = cost(model.residual, z, prior, mask)
    risen = 0.0
    for _ in range(FARTHEST):
        at, r = z + pace * v, None
        if np.any(at < low) or np.any(at > high):
            return z
        reached, best, moved = np.inf, at, np.zeros(0)
        for step in range(DESCENTS + 1):
            found = evaluate(problem, model.forms, at)
            if found is None:
                break
            now = cost(found, at, prior, mask)
            if r is not None and moved.any():
                J = J + np.outer((r - found) - J @ moved, moved) / float(moved @ moved)
            if now >= reached:
                break
            reached, best, r = now, at, found
            if step < DESCENTS:
                moved = _down(J[mask], found[mask], at, prior, v)
                at = np.clip(at + moved, low, high)
                moved = at - best
        if not np.isfinite(reached):
            return z
        if reached - bottom >= level:
            share = (level - risen) / max(reached - bottom - risen, 1e-12)
            return np.asarray(z + share * (best - z))
        z, risen = best, max(reached - bottom, 0.0)
    return z


def _down(J: FloatArray, r: FloatArray, z: FloatArray, prior: FloatArray, v: FloatArray) -> FloatArray:
    """Gauss-Newton step across v: the other directions go to their least misfit."""
    A = J.T @ J + np.diag(prior)
    across = np.linalg.svd(v[None, :])[2][1:].T  # columns span what is across v
    inner = across.T @ A @ across
    scale = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    inner = inner / np.outer(scale, scale) + 1e-9 * np.eye(len(scale))
    return np.asarray(across @ (np.linalg.solve(inner, across.T @ (J.T @ r - prior * z) / scale) / scale))
