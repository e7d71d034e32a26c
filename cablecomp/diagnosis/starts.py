"""Fits from many starts: friction leaves valleys in the misfit from which no slope leads to the deepest one."""

from __future__ import annotations

import numpy as np

from cablecomp.diagnosis.fitting import INFLATION, Mask, Model, Problem, cost, prior_of, solve
from cablecomp.signal.smoothing import FloatArray

STARTS = 8  # of the calibrated drive
FEW = 4  # of a drive with effects, where its calibration has become unlikely
SEED = 1  # of the starts; the same ones each time
BETTER = 0.01  # share of the cost that another valley must be deeper by
STEPS = 10  # of a rough fit
UNLIKELY = 2.0  # prior standard deviations
AT_NOISE = 1.05  # mean square over the floor, at which there is nothing deeper
CAREFULLY = 30  # steps of a careful fit


def deepest(problem: Problem, model: Model, mask: Mask) -> Model:
    """The model, or what is found from calibrations drawn from their priors, if that fits better.

    The starts are fitted with a simulation step for each row, the best of them as the problem states. A drive
    with effects is spared them where its calibration is a likely one.
    """
    if float(np.mean((model.residual[mask] * INFLATION) ** 2)) < AT_NOISE:
        return model
    if model.forms and float(np.max(np.abs(pulls(problem, model)), initial=0.0)) < UNLIKELY:
        return model
    rough = problem.rough()
    prior = prior_of(problem, model.forms)

    def reached(found: Model | None) -> float:
        return np.inf if found is None else cost(found.residual, found.z, prior, mask)

    here = solve(rough, model.forms, model.z, mask, iterations=STEPS, renew=True)
    drawn = _drawn(problem, model, FEW if model.forms else STARTS)
    tried = [solve(rough, model.forms, z, mask, iterations=STEPS, renew=True) for z in drawn]
    best = min(tried, key=reached, default=None)
    if best is None or reached(best) > (1.0 - BETTER) * reached(here):
        return model
    found = solve(problem, model.forms, best.z, mask, iterations=CAREFULLY, renew=True)
    return found if found is not None and reached(found) < reached(model) else model


def pulls(problem: Problem, model: Model) -> FloatArray:
    """Calibration in prior standard deviations (0 where there is no prior)."""
    return np.array([v / p.prior_sd for p, v in zip(problem.parameters, model.c, strict=True)])


def _drawn(problem: Problem, model: Model, count: int) -> list[FloatArray]:
    """Coordinates with the calibration drawn from its priors; what has none stays, and effects do."""
    rng = np.random.default_rng(SEED)
    sd = np.array([p.prior_sd for p in problem.parameters])
    known = np.isfinite(sd)
    starts = []
    for _ in range(count):
        z = model.z
        z[: len(sd)][known] = sd[known] * rng.standard_normal(int(known.sum()))
        starts.append(z)
    return starts
