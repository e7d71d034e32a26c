"""The yardstick of a blind trial: what the true model itself reaches on the same rows, fitted as a hypothesis is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration import Calibrated, calibrate_drive
from cablecomp.diagnosis.errors_left import errors_of
from cablecomp.diagnosis.explain.model import searching
from cablecomp.diagnosis.explain.scores import Groups, Lead, lead, left_out, make_groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects import catalogue
from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.parameter import of_effect
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.estimation.simulate import knows_rates
from cablecomp.signal.smoothing import FloatArray
from cablecomp.trials.sealed import Truth

_HELD = ("phase_rad", "time_s", "reference_degC")
EVALUATIONS = 12


@dataclass(frozen=True)
class Yardstick:
    """What the truth reaches.

    `true_rmse_rad`: RMSE of the true model with true parameters; `baseline_rmse_rad`: held-out RMSE of the recalibrated drive;
    `decidable`: the true effects, refitted, beat the recalibrated drive on data left out by what an effect has to bring
    (in a pair: each of them beats the model without it as well); `gain`: share of the baseline's square on data left
    out that they take off, with its `z`.
    """

    true_rmse_rad: float
    baseline_rmse_rad: float
    decidable: bool
    gain: float
    z: float


def measure_truth(
    config: JointConfig, recordings: Sequence[Mapping[str, FloatArray]], truth: Truth, seed: int = 0
) -> Yardstick:
    """Fit the true effects with the calibration and compare them with the drive alone, on data left out.

    Raises InputError if the joint cannot follow the recordings.
    """
    rng = np.random.default_rng(seed)
    body = gather_body(config, {f"recording-{k + 1}": c for k, c in enumerate(recordings)}, "one")
    drive = calibrate_drive(config, body.used, rng)
    groups = make_groups(drive.fit)
    true = replace(
        drive.fit.problem, config=truth.model, parameters=(), fine=knows_rates(truth.model), bases={}
    )
    rmse = _rms(true.left(np.empty(0)), true)
    baseline = errors_of(drive.fit, body.final, groups.by).heldout_rmse_rad
    known = [e.id for e in truth.effects if e.known]
    whole = _with(drive, truth, known) if known else None
    if whole is None:
        return Yardstick(rmse, baseline, False, 0.0, 0.0)
    step = _step(whole, _with(drive, truth, [], whole.problem), groups)
    decidable = _enough(step)
    for name in known if len(known) > 1 else ():
        less = _with(drive, truth, [n for n in known if n != name], whole.problem)
        decidable = decidable and less is not None and _enough(_step(whole, less, groups))
    return Yardstick(rmse, baseline, decidable, step.gain, step.z)


def _step(whole: Fit, less: Fit | None, groups: Groups) -> Lead:
    assert less is not None
    return lead(left_out(whole, groups), left_out(less, groups), groups)


def _enough(step: Lead) -> bool:
    return step.z > LIMITS.z and step.gain > LIMITS.gain


def _with(drive: Calibrated, truth: Truth, names: Sequence[str], like: Problem | None = None) -> Fit | None:
    """These true effects fitted with the calibration from their true values; None where the drive cannot follow.

    `like`: take its weights and its way to run, so that both fits compare. Without it, the weights are those with which a
    search leaves the model that holds these effects.
    """
    config = drive.fit.problem.config
    entries = tuple(e for e in truth.model.effect if e.id in names)
    free = list(drive.fit.problem.parameters)
    for entry in entries:
        effect = catalogue()[entry.id]
        values = {
            k: float(v)
            for k, v in entry.parameters.items()
            if not isinstance(v, str) and v and k not in _HELD
        }
        free += of_effect(effect, values, config)
    problem = replace(
        drive.fit.problem,
        config=config.model_copy(update={"effect": (*config.effect, *entries)}),
        parameters=tuple(free),
        fine=like.fine if like else knows_rates(truth.model),
    )
    start = np.array([p.x(float(truth.true.get(p.base, p.start))) for p in free])
    try:
        if like is not None:
            return solve(problem.with_weighing(like.weighing), start, EVALUATIONS)
        fit = solve(problem, start, EVALUATIONS)
        return solve(problem.with_weighing(_sharper(fit, drive)), fit.x, EVALUATIONS)
    except InputError:
        return None


def _sharper(fit: Fit, drive: Calibrated) -> Weighing:
    """A search's weights beyond the better of this fit and the drive alone."""
    mine, theirs = searching(fit), searching(drive.fit)
    sigma = {c: min(mine.sigma[c], theirs.sigma[c]) for c in mine.sigma}
    return Weighing(sigma, mine.zero_sd)


def _rms(parts: Sequence[FloatArray], problem: Problem) -> float:
    """RMS on counted rows, weighed by the time that they stand for."""
    joined = np.concatenate([
        (e.weight * p)[e.counted["joint_position_rad"]] for e, p in zip(problem.evidence, parts, strict=True)
    ])  # fmt: skip
    return sqrt(float(np.mean(joined**2)))
