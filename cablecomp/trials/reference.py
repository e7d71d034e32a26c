"""The yardstick of a blind trial: what the true law itself, whatever its form, takes off the recalibrated drive.

The plant's own noise-free contribution of an effect is taken off the recorded angle, and off the recorded motor torque
where that alone shows it, and the drive is calibrated again: that is what a catalogue that held the very law could
reach.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.answer.errors import errors_of
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import Calibrated, calibrate_drive
from cablecomp.diagnosis.explain.model import searching
from cablecomp.diagnosis.explain.scores import ScoreDifference, left_out, score_difference
from cablecomp.diagnosis.folds import Groups, make_groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, MOTOR, Evidence, rms_by_time
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.problem import Weighing
from cablecomp.estimation.steadying import as_read
from cablecomp.signal.smoothing import FloatArray
from cablecomp.trials.sealed import Truth

EVALUATIONS = 8


@dataclass(frozen=True)
class Yardstick:
    """What the truth reaches.

    `true_rmse_rad`: RMS of the recorded angle about the true one (noise alone); `baseline_rmse_rad`: held-out
    RMSE of the recalibrated drive; `decidable`: the true laws beat the recalibrated drive on data left out by
    what an effect has to bring (in a pair: each of them beats the drive with the other one as well); `gain`:
    share of the baseline's square on data left out that they take off, with its `z`.
    """

    true_rmse_rad: float = nan
    baseline_rmse_rad: float = nan
    decidable: bool = False
    gain: float = 0.0
    z: float = 0.0


def measure_truth(
    config: JointConfig,
    recordings: Mapping[str, Mapping[str, FloatArray]],
    truth: Truth,
    angles: Mapping[str, FloatArray],
    seed: int = 0,
) -> Yardstick:
    """Compare the drive with and without its true effects, on data left out.

    `angles`: `time_s_k`, `joint_rad_k` (as it is), `plain_rad_k` (without any effect), `without_<id>_rad_k` of
    recordings k = 1, 2, … in order, and `joint_motor_Nm_k`, … where the motor's torque alone shows it. Raises
    InputError if the joint cannot follow the recordings.
    """
    rng = np.random.default_rng(seed)
    body = gather_body(config, recordings)
    places = {name: k for k, name in enumerate(recordings, start=1)}
    drive = _as_read(calibrate_drive(config, body.used, rng))
    groups = make_groups(drive.fit)
    evidence = drive.fit.problem.evidence
    rmse = _noise(evidence, places, angles)
    baseline = errors_of(drive.fit, body.final, groups.by).heldout_rmse_rad
    if not truth.main:
        return Yardstick(rmse, baseline)
    # companions stay: both sides have them
    lacking = [k for k in angles if k.startswith("without_") and "_rad_" in k]
    parts = {k.partition("without_")[2].rpartition("_rad_")[0] for k in lacking}
    mine = [p for p in parts if any(p.partition(".")[0] == e.id for e in truth.main)]
    single = "plain" if len(mine) != 1 else f"without_{mine[0]}"
    whole = _told(drive, places, angles, single)
    if whole is None:
        return Yardstick(rmse, baseline)
    step = _step(whole, drive, drive.fit.problem.evidence, groups)
    decidable = _enough(step)
    for name in mine if len(mine) > 1 else ():
        rest = _without(evidence, places, angles, "plain", f"without_{name}")
        decidable = decidable and _enough(_step(whole, drive, rest, groups))
    return Yardstick(rmse, baseline, decidable, step.gain, step.z)


def _as_read(drive: Calibrated) -> Calibrated:
    """The drive about readings as they are on judged rows, nothing averaged: what can be told has one yardstick,
    whatever a diagnosis makes of what lies between them."""
    problem = drive.fit.problem
    raw = problem.with_evidence([as_read(e) for e in problem.evidence])
    return replace(drive, fit=solve(raw, drive.fit.x, EVALUATIONS))


def _noise(
    evidence: Sequence[Evidence], places: Mapping[str, int], angles: Mapping[str, FloatArray]
) -> float:
    """RMS of recorded minus true angle on counted rows, weighed by the time that they stand for."""
    parts, weights = [], []
    for e in evidence:
        k, kept = places[e.name], e.counted[JOINT]
        off = (e.at_rows(JOINT) - _at(e, angles[f"time_s_{k}"], angles[f"joint_rad_{k}"])[e.rows])[kept]
        parts.append(off - np.median(off))
        weights.append(e.weight[kept])
    return rms_by_time(np.concatenate(parts), np.concatenate(weights))


def _at(e: Evidence, time: FloatArray, values: FloatArray) -> FloatArray:
    """Values of a recording at its fine rows."""
    return np.asarray(np.interp(e.columns["time_s"] - e.shift_s, time, values))


def _without(
    evidence: Sequence[Evidence],
    places: Mapping[str, int],
    angles: Mapping[str, FloatArray],
    lack: str,
    own: str = "joint",
) -> list[Evidence]:
    """The recordings with what `own` has and `lack` has not taken off the channels that show it."""
    found = []
    for e in evidence:
        k, columns = places[e.name], dict(e.columns)
        for channel, unit in ((JOINT, "rad"), (MOTOR, "motor_Nm")):
            mine, theirs = angles.get(f"{own}_{unit}_{k}"), angles.get(f"{lack}_{unit}_{k}")
            if mine is not None and theirs is not None and channel in columns:
                columns[channel] = columns[channel] - _at(e, angles[f"time_s_{k}"], mine - theirs)
        found.append(replace(e, columns=columns))
    return found


def _told(
    drive: Calibrated, places: Mapping[str, int], angles: Mapping[str, FloatArray], lack: str
) -> Fit | None:
    """The drive calibrated on what its effects leave, with the weights with which a search leaves such a model."""
    problem = drive.fit.problem.with_evidence(_without(drive.fit.problem.evidence, places, angles, lack))
    try:
        fit = solve(problem, drive.fit.x, EVALUATIONS)
        return solve(problem.with_weighing(_sharper(fit, drive)), fit.x, EVALUATIONS)
    except InputError:
        return None


def _sharper(fit: Fit, drive: Calibrated) -> Weighing:
    """A search's weights beyond the better of this fit and the drive alone."""
    mine, theirs = searching(fit), searching(drive.fit)
    sigma = {c: min(mine.sigma[c], theirs.sigma[c]) for c in mine.sigma}
    return replace(mine, sigma=sigma)


def _step(whole: Fit, drive: Calibrated, evidence: Sequence[Evidence], groups: Groups) -> ScoreDifference:
    """The score of the whole truth against the drive on this evidence, under the same weights."""
    problem = whole.problem.with_evidence(list(evidence))
    less = solve(problem, drive.fit.x, EVALUATIONS)
    return score_difference(left_out(whole, groups), left_out(less, groups), groups)


def _enough(step: ScoreDifference) -> bool:
    return step.z > LIMITS.z and step.gain > LIMITS.gain
