"""Which physics a path needs: effects added one at a time, each judged on recordings that it was not fitted
to."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, log
from typing import Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.effects import catalogue
from cablecomp.errors import InputError
from cablecomp.identification.path_fit import JOINT, MOTOR, Channel, PathFit, Unknown, fit_path
from cablecomp.identification.transmission_path import (
    FRICTION,
    BoolArray,
    PathRecording,
    predict_path,
    with_path_effects,
)
from cablecomp.signal.smoothing import FloatArray

_FREE_KEYS: Final = ("input_radius_m", "EA_N", "pretension_N")
_HELD: Final = ("load_coefficient",)
_DECADE: Final = log(10.0)
_GAIN: Final = 0.05
_BEAM: Final = 2


@dataclass(frozen=True)
class Loop:
    """Size of a recording's loops: half of the motor's torque [N m], half of the joint's lost motion
    [rad]."""

    torque_Nm: float
    lost_rad: float


@dataclass(frozen=True)
class Trial:
    """One hypothesis: effects, mean square over scale on the held-out recordings (1 = as large as `scale`),
    its fit."""

    effects: tuple[str, ...]
    heldout: float
    fit: PathFit


def loop_of(recordings: Sequence[PathRecording]) -> Loop:
    """Half the difference of motor torque, and of joint angle, between the two directions at mid-travel
    (medians)."""
    torque, lost = [], []
    for r in recordings:
        motor = r.columns["motor_position_rad"]
        middle = r.counted & (np.abs(motor - 0.5 * (motor.max() + motor.min())) < 0.25 * np.ptp(motor))
        up = np.gradient(motor) > 0.0
        gain = float(np.polyfit(motor[middle], r.columns[JOINT][middle], 1)[0])
        left = r.columns[JOINT] - gain * motor
        lost.append(0.5 * abs(_between(left, middle, up)))
        torque.append(0.5 * abs(_between(r.columns[MOTOR], middle, up)) if MOTOR in r.columns else np.nan)
    return Loop(float(np.nanmedian(torque)), float(np.median(lost)))


def stage_unknowns(config: JointConfig, loop: Loop | None = None) -> tuple[Unknown, ...]:
    """What of the drive itself is free: ratio, EA and pretension within [tolerance]; with `loop`, the
    motor's friction."""
    stage = config.drive.stage[-1]
    found = []
    for key in _FREE_KEYS:
        if (tolerance := config.tolerance.get(key, 0.0)) > 0.0:
            nominal, reach = float(getattr(stage, key)), min(tolerance, 1.0)
            found.append(
                Unknown(key, nominal, nominal * 0.005**reach, nominal * 200.0**reach, reach * _DECADE)
            )
    if loop is not None:
        found.append(Unknown(FRICTION, 0.4 * loop.torque_Nm, 1e-3 * loop.torque_Nm, 5.0 * loop.torque_Nm))
    return tuple(found)


def effect_unknowns(effect: str, config: JointConfig, loop: Loop) -> tuple[Unknown, ...]:
    """Parameters of an effect with starts of the size of the loop; bounds are those of its law.

    Parameters of the catalogue that have no start here begin in the middle of their prior range; a
    bearing's growth with load is left out, for the path's friction already grows with it.
    """
    stage = config.drive.stage[-1]
    starts: Mapping[str, float] = {
        "mu_angle": 0.3,
        "arc_length_m": 0.25 * stage.free_length_m,
        "torque_Nm": 0.25 * loop.torque_Nm,
        "presliding_rad": loop.lost_rad,
        "moment_Nm": 0.25 * loop.torque_Nm,
        "gap_rad": loop.lost_rad,
        "compliance_rad_per_Nm": 0.25 * loop.lost_rad / loop.torque_Nm,
        "stiffening": 0.5,
        "fraction": 0.5,
        "yield_N": loop.torque_Nm / stage.output_radius_m,
        "eccentricity_m": 0.02 * stage.output_radius_m,
    }
    found = []
    for p in catalogue()[effect].parameters:
        if p.name in _HELD:
            continue
        low, high = p.bounds(config)
        start, name = starts.get(p.name, _middle(low, high, p.log)), f"effect.{effect}.{p.name}"
        if low >= 0.0 and start > 0.0 and p.name != "stiffening":
            most = min(1e3 * start, p.maximum)
            found.append(Unknown(name, start, 1e-3 * start, most, _DECADE))
        else:
            least = p.minimum if isfinite(p.minimum) else low
            found.append(
                Unknown(name, start, least, p.maximum if isfinite(p.maximum) else high, logarithmic=False)
            )
    return tuple(found)


def fit_effects(
    config: JointConfig,
    effects: Sequence[str],
    recordings: Sequence[PathRecording],
    scale: Mapping[Channel, float],
    iterations: int = 20,
) -> PathFit:
    """Fit the drive with these effects, all parameters free, from the configuration's orders of magnitude."""
    loop = loop_of(recordings)
    unknowns = [*stage_unknowns(config, loop if MOTOR in scale else None)]
    given: dict[str, dict[str, float]] = {}
    for effect in effects:
        mine = effect_unknowns(effect, config, loop)
        unknowns += mine
        given[effect] = {**catalogue()[effect].neutral(), **{u.name.rsplit(".", 1)[1]: u.start for u in mine}}
    joint = with_path_effects(config, given)
    return fit_path(joint, recordings, unknowns, scale=scale, iterations=iterations, weigh=False)


def select_effects(
    config: JointConfig,
    train: Sequence[PathRecording],
    judge: Sequence[PathRecording],
    candidates: Sequence[str],
    scale: Mapping[Channel, float],
    progress: Callable[[Trial], None] | None = None,
) -> list[Trial]:
    """Beam search: the plain drive, then every candidate added to the two best of the round before.

    It goes on as long as the best of a round takes 5 % off the held-out square of the best before. Every
    hypothesis is fitted to `train` alone, together with the drive's own parameters, and judged on `judge`
    with the zeros found in `train`. Two are kept because two kinds of friction may look alike until a third
    effect is there. Returns every trial, in the order tried; `best_of` them is the verdict.
    """
    trials: list[Trial] = []
    kept: list[tuple[str, ...]] = [()]
    best: Trial | None = None
    while kept:
        wanted = (
            {frozenset((*k, c)): (*k, c) for k in kept for c in candidates if c not in k}
            if best
            else {frozenset(): ()}
        )
        round_: list[Trial] = []
        for effects in wanted.values():
            try:
                fit = fit_effects(config, effects, train, scale)
            except InputError:
                continue  # under this hypothesis the drive cannot follow the recordings at all
            round_.append(Trial(effects, heldout_square(fit, judge, scale), fit))
            if progress is not None:
                progress(round_[-1])
        trials += round_
        round_.sort(key=lambda t: t.heldout)
        if not round_ or (best is not None and round_[0].heldout > (1.0 - _GAIN) * best.heldout):
            break
        best = round_[0]
        kept = [t.effects for t in round_[:_BEAM]]
    return trials


def best_of(trials: Iterable[Trial]) -> Trial:
    """The trial that the selection ends on: each effect more must take 5 % off the best held-out square
    with fewer."""
    ordered = sorted(trials, key=lambda t: (len(t.effects), t.heldout))
    best = ordered[0]
    for trial in ordered[1:]:
        if len(trial.effects) > len(best.effects) and trial.heldout <= (1.0 - _GAIN) * best.heldout:
            best = trial
    return best


def heldout_square(
    fit: PathFit, recordings: Sequence[PathRecording], scale: Mapping[Channel, float]
) -> float:
    """Mean square misfit over `scale`, summed over the channels, with the zeros found in the fit."""
    squares = dict.fromkeys(scale, 0.0)
    rows = 0
    for r in recordings:
        found = predict_path(fit.config, fit.values, r)
        rows += r.rows
        if JOINT in scale:
            miss = (r.columns[JOINT] - found.joint_position_rad)[r.counted] - fit.zero_rad[r.session]
            squares[JOINT] += float(miss @ miss)
        if MOTOR in scale:
            zero, slope = fit.motor_zero[r.session]
            miss = (
                r.columns[MOTOR] - found.motor_torque_Nm - zero - slope * r.columns["motor_position_rad"]
            )[r.counted]
            squares[MOTOR] += float(miss @ miss)
    return sum(squares[c] / rows / scale[c] ** 2 for c in scale)


def _between(values: FloatArray, middle: BoolArray, up: BoolArray) -> float:
    return float(np.mean(values[middle & up]) - np.mean(values[middle & ~up]))


def _middle(low: float, high: float, logarithmic: bool) -> float:
    return float(np.sqrt(low * high)) if logarithmic and low > 0.0 else 0.5 * (low + high)
