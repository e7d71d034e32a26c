"""The yardstick of a blind trial: what the true model itself reaches on the same rows and blocks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.fitting import INFLATION, Problem, solve
from cablecomp.diagnosis.forms import PHASE
from cablecomp.diagnosis.hypotheses import Fold, all_rows, fold_of
from cablecomp.diagnosis.judge import judge
from cablecomp.diagnosis.selection import LEVEL
from cablecomp.diagnosis.setting import Setting, set_up
from cablecomp.effects import catalogue
from cablecomp.errors import InputError
from cablecomp.identification.parameters import free_parameters
from cablecomp.signal.smoothing import FloatArray
from cablecomp.trials.sealed import Truth

_HELD = (PHASE, "time_s", "reference_degC")


@dataclass(frozen=True)
class Yardstick:
    """What the truth reaches.

    `true_rmse_rad`: RMSE of the true model with true parameters; `baseline_rmse_rad`: held-out RMSE of the
    recalibrated drive; `decidable`: the true effects, refitted, beat the recalibrated drive on held-out
    blocks beyond the margin (in a pair: each of them beats the model without it as well); `gain`: share of
    the baseline's held-out mean square that they remove, with `z` and `margin`.
    """

    true_rmse_rad: float
    baseline_rmse_rad: float
    decidable: bool
    gain: float
    z: float
    margin: float


def measure_truth(
    config: JointConfig, recordings: Sequence[Mapping[str, FloatArray]], truth: Truth, seed: int = 0
) -> Yardstick:
    """Fit the true effects and the calibration on either half, judge them on the other, as a hypothesis is.

    Raises InputError if the joint cannot follow the recordings.
    """
    rng = np.random.default_rng(seed)
    setting = set_up(config, recordings, rng)
    both = all_rows(setting.layout)
    rows = both.heldout
    unit = setting.problem.sigma * INFLATION
    true = replace(setting.problem, config=truth.model).residual(truth.model) * unit
    baseline = fold_of(setting.problem, setting.calibrated, setting.layout)
    known = [e.id for e in truth.effects if e.known]
    rmse, base = _rms(true[rows]), _rms(baseline.residual_rad[rows])
    if not known:
        return Yardstick(rmse, base, False, 0.0, 0.0, 0.0)
    whole = _fold_with(setting, truth, known)
    if whole is None:
        return Yardstick(rmse, base, False, 0.0, 0.0, 0.0)
    verdict = judge(baseline.residual_rad, {"truth": whole.residual_rad}, both, rng, LEVEL)
    score = verdict.scores[0]
    decidable = score.supported
    for name in known if len(known) > 1 else ():
        less = _fold_with(setting, truth, [n for n in known if n != name])
        if less is not None:
            alone = judge(less.residual_rad, {"truth": whole.residual_rad}, both, rng, LEVEL).scores[0]
            decidable = decidable and alone.supported
    return Yardstick(rmse, base, decidable, score.heldout_gain, score.z, score.margin)


def _fold_with(setting: Setting, truth: Truth, names: Sequence[str]) -> Fold | None:
    """These true effects fitted with the calibration, from their true values, on either half."""
    entries = tuple(e for e in truth.model.effect if e.id in names)
    config = setting.problem.config.model_copy(update={"effect": entries})
    free = [p.name for p in setting.problem.parameters]
    for entry in entries:
        known = catalogue()[entry.id]
        free += [
            f"effect.{entry.id}.{p.name}" for p in known.parameters if _is_free(p.name, entry.parameters)
        ]
    problem = replace(setting.problem, config=config, parameters=free_parameters(config, free))
    start = _true_coordinates(problem, truth)
    mask = setting.layout.heldout | setting.layout.training
    try:
        model = solve(problem, (), start, mask, iterations=15, renew=True)
    except InputError:
        return None
    return None if model is None else fold_of(problem, model, setting.layout)


def _is_free(name: str, values: Mapping[str, float | str]) -> bool:
    value = values.get(name)
    return isinstance(value, float | int) and value != 0.0 and name not in _HELD


def _true_coordinates(problem: Problem, truth: Truth) -> FloatArray:
    """Calibration at the truth; effects stand there already."""
    values = {**truth.true, "joint_position_offset_rad": truth.offset_rad}
    found = np.zeros(len(problem.parameters))
    for k, p in enumerate(problem.parameters):
        if p.name in values:
            value = values[p.name]
            x = np.log(value / p.nominal) / p.unit if p.logarithmic else (value - p.nominal) / p.unit
            found[k] = float(np.clip(x, p.low, p.high))
    return found


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
