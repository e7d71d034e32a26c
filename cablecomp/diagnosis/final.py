"""The last fit: every coordinate free, shapes too; values with their uncertainties, dependence counted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student

from cablecomp.config import EffectEntry, JointConfig
from cablecomp.diagnosis.blocks import Layout
from cablecomp.diagnosis.fitting import INFLATION, Model, Problem, prior_of, sensitivities, solve
from cablecomp.diagnosis.forms import PHASE, Form
from cablecomp.diagnosis.hypotheses import free_shapes
from cablecomp.diagnosis.valley import TWO_SIDED, walked
from cablecomp.signal.smoothing import FloatArray

LEVERAGE = 0.8  # of one block, beyond which its say in the fit is not counted out further


@dataclass(frozen=True)
class Value:
    """A fitted value with its 1-sigma uncertainty, both in the parameter's unit."""

    value: float
    sd: float


@dataclass(frozen=True)
class Final:
    """The final model: configuration with calibrated values and effects, uncertainties, residual of
    every row (rad).
    """

    config: JointConfig
    model: Model
    calibration: Mapping[str, Value]
    effects: tuple[tuple[Form, EffectEntry, Mapping[str, Value]], ...]
    strength: tuple[float, ...]
    """Of each effect: its amplitudes together, in standard deviations (root of Wald's statistic)."""
    residual_rad: FloatArray
    at_bound: tuple[str, ...]


def finish(problem: Problem, model: Model, layout: Layout) -> Final:
    """Free all shapes, fit to all rows, and work out the uncertainties."""
    forms, z = free_shapes(model)
    mask = layout.heldout | layout.training
    found = solve(problem, forms, z, mask, iterations=30, renew=True)
    if found is None:
        forms, found = model.forms, model
    J = sensitivities(problem, forms, found.z, found.residual)
    found = replace(found, J=J)
    moved = problem.moved(problem.joint(found.c, found.entries())) / (problem.sigma * INFLATION)
    covariance = walked(problem, found, mask, sandwich(problem, found, layout, moved))
    n = len(problem.parameters)
    calibration = {
        p.name: Value(p.value(float(v)), abs(p.slope(float(v))) * float(np.sqrt(covariance[k, k])))
        for k, (p, v) in enumerate(zip(problem.parameters, found.c, strict=True))
    }
    effects, strength = [], []
    for form, x in zip(forms, found.x, strict=True):
        own = covariance[n : n + form.size, n : n + form.size]
        effects.append((form, form.entry(list(x)), _values(form, x, own)))
        size = form.size - len(form.shapes)
        strength.append(float(np.sqrt(x[:size] @ np.linalg.pinv(own[:size, :size], rcond=1e-10) @ x[:size])))
        n += form.size
    config = problem.joint(found.c, found.entries())
    edge = tuple(
        p.name
        for p, v in zip(problem.parameters, found.c, strict=True)
        if min(float(v) - p.low, p.high - float(v)) < 1e-3 * (p.high - p.low)
    )
    left = found.residual * problem.sigma * INFLATION
    return Final(config, found, calibration, tuple(effects), tuple(strength), left, edge)


def sandwich(problem: Problem, model: Model, layout: Layout, moved: FloatArray) -> FloatArray:
    """Covariance of z: curvature of the cost, with the scatter of its gradient.

    The larger one counts for each coordinate: the scatter between blocks (dependence inside blocks kept), or
    what white noise and noise on the inputs (`moved`, its bias included) do to the gradient. It is large enough
    for 1.96 sd to be a 95 % interval, few as the blocks are.
    """
    mask = layout.heldout | layout.training
    prior = prior_of(problem, model.forms)
    J, r = model.J[mask], model.residual[mask]
    A = J.T @ J + np.diag(prior)
    root = _root(A)
    block = layout.block[mask]
    scores = np.stack([_score(J[block == b], r[block == b], root) for b in np.unique(block)])
    scores -= scores.mean(axis=0)
    known = root.T @ (prior[:, None] * root)
    scatter = scores.T @ scores * len(scores) / max(1, len(scores) - 1) + known
    pushes = moved[:, mask] @ J
    white = J.T @ J / INFLATION**2 + pushes.T @ pushes / max(1, len(pushes)) + np.diag(prior)
    by_block, by_noise = root @ scatter @ root.T, root @ (root.T @ white @ root) @ root.T
    grow = np.sqrt(np.maximum(np.diag(by_noise) / np.maximum(np.diag(by_block), 1e-300), 1.0))
    few = float(student.ppf(0.975, max(1, len(scores) - 1))) / TWO_SIDED
    covariance: FloatArray = by_block * np.outer(grow, grow) * few**2
    return covariance


def _root(A: FloatArray) -> FloatArray:
    """R with R'A R = 1, so that R R' is the (pseudo-)inverse of A."""
    scale = np.sqrt(np.maximum(np.diag(A), 1e-300))
    values, vectors = np.linalg.eigh(A / np.outer(scale, scale))
    kept = values > 1e-11 * values[-1]
    return np.asarray((vectors[:, kept] / np.sqrt(values[kept])) / scale[:, None])


def _score(J: FloatArray, r: FloatArray, root: FloatArray) -> FloatArray:
    """Gradient of one block in coordinates in which the curvature is 1, as it would be had the block not been
    fitted: (1 - H)^-1 R'J'r, H = R'J'J R (jackknife; MacKinnon and White, J. Econometrics 29, 1985).
    """
    W = J @ root
    values, vectors = np.linalg.eigh(W.T @ W)
    out = 1.0 / (1.0 - np.minimum(values, LEVERAGE))
    return np.asarray(vectors @ (out * (vectors.T @ (W.T @ r))))


def _values(form: Form, x: FloatArray, covariance: FloatArray) -> dict[str, Value]:
    """Parameters of one effect with their sd, by the slope of each with every coordinate."""
    entry = form.entry(list(x)).parameters
    found = {}
    for name in [p.name for p in form.effect.parameters]:
        if not isinstance(entry.get(name), float):
            continue
        slope = np.zeros(len(x))
        for k in range(len(x)):
            moved = x.copy()
            moved[k] += 1e-4
            other = form.entry(list(moved)).parameters[name]
            change = other - entry[name]
            if name == PHASE:
                change = (change + np.pi) % (2.0 * np.pi) - np.pi
            slope[k] = change / 1e-4
        variance = float(slope @ covariance @ slope)
        found[name] = Value(entry[name], math.sqrt(max(variance, 0.0)))
    return found
