"""What a mismatch may depend on: covariates out of a recording's own channels.

Reversals are counted by own code: SciPy's peaks look at prominence, not at how far a channel has turned back so far.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cablecomp.errors import InputError
from cablecomp.mechanics.jit import njit
from cablecomp.signal.noise import channel_noise
from cablecomp.signal.smoothing import FloatArray, IntArray, Smooth, fit_to_noise, step_s

UNITS: Final[Mapping[str, str]] = {
    "time": "s",
    "load": "N·m",
    "load_direction": "",
    "load_rate": "N·m/s",
    "dwell": "s",
    "reversal": "N·m",
    "motor_angle": "rad",
    "joint_angle": "rad",
    "velocity": "rad/s",
    "acceleration": "rad/s²",
    "temperature": "°C",
}
"""Public names of the covariates, and their units; further channels follow as in `FURTHER`."""
FURTHER: Final = ("other:", "condition:")
"""What stands before a further channel's name: `other:<name>`, or `condition:<name>` of one that tells how the drive
stood."""


@dataclass(frozen=True)
class Covariates:
    """Covariates of one or several recordings, one value per sample.

    `values`: public name -> array. `load_direction` is -1, 0 (not yet moved), +1; `load_rate` in N m/s;
    `dwell`: time since the load stopped moving, 0 while it moves; `reversal`: load travelled since the
    load's last reversal (N m, >= 0); `velocity`, `acceleration`: of the joint (of the motor if the joint
    angle is missing). `motion_reversal` (rad, >= 0) and `motion_direction` (-1, 0, +1): the same for the
    joint's motion. `starts`: index of each recording's first sample. `resting_share`: share of samples with
    the load at rest.
    """

    values: Mapping[str, FloatArray]
    motion_direction: FloatArray
    motion_reversal: FloatArray
    starts: IntArray
    resting_share: float

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.values["time"])

    def at(self, rows: NDArray[np.int64 | np.bool_]) -> Covariates:
        """The same on some of the samples; `starts` stays that of all."""
        return replace(
            self,
            values={k: v[rows] for k, v in self.values.items()},
            motion_direction=self.motion_direction[rows],
            motion_reversal=self.motion_reversal[rows],
        )

    def unit(self, name: str) -> str:
        """Unit of a covariate, empty if it has none or it is not known."""
        return UNITS.get(name, "")


class Reversals(tuple[FloatArray, FloatArray]):
    """Direction of motion (-1, 0, +1) and distance since the last reversal, one value per sample."""

    __slots__ = ()

    @property
    def direction(self) -> FloatArray:
        """-1, 0 before the first motion, +1."""
        return self[0]

    @property
    def distance(self) -> FloatArray:
        """Distance since the last reversal, >= 0, in the channel's unit."""
        return self[1]


def covariates(columns: Mapping[str, FloatArray], predicted: FloatArray | None = None) -> Covariates:
    """Work out the covariates of one recording from its canonical channels.

    Rates come from zero-phase local fits as wide as the channel's own noise allows; a reversal counts once
    the channel has turned back by more than six times what noise leaves after that fit, and by more than a
    hundredth of the channel's span. `predicted`: the joint's angle [rad] as a fit has it; how the joint moves is then
    told by both (`_by_both`), for noise that is in the residual would otherwise be in its acceleration too.

    Raises InputError if `time_s`, `joint_torque_Nm` or `motor_position_rad` is missing.
    """
    for needed in ("time_s", "joint_torque_Nm", "motor_position_rad"):
        if needed not in columns:
            raise InputError(
                f"channel {needed} is missing; diagnosis needs time_s, motor_position_rad, joint_torque_Nm"
            )
    time = np.asarray(columns["time_s"], dtype=np.float64)
    load, load_sigma = _smoothed(time, columns["joint_torque_Nm"])
    motor, motor_sigma = _smoothed(time, columns["motor_position_rad"])
    joint, joint_sigma = motor, motor_sigma
    if "joint_position_rad" in columns:
        joint, joint_sigma = _smoothed(time, _by_both(time, columns["joint_position_rad"], predicted))
    turn = reversals(load.value, _least_turn(load, load_sigma))
    motion = reversals(joint.value, _least_turn(joint, joint_sigma))
    still = _still(load, load_sigma)
    values: dict[str, FloatArray] = {
        "time": time,
        "load": load.value,
        "load_direction": turn.direction,
        "load_rate": load.slope,
        "dwell": _since_stop(time, still),
        "reversal": turn.distance,
        "motor_angle": motor.value,
    }
    if "joint_position_rad" in columns:
        values["joint_angle"] = joint.value
    values["velocity"] = joint.slope
    values["acceleration"] = joint.curvature
    if "temperature_degC" in columns and np.isfinite(columns["temperature_degC"]).sum() >= 2:
        values["temperature"] = _filled(time, columns["temperature_degC"])
    for name, channel in columns.items():
        if name.startswith("other_") and np.isfinite(channel).sum() >= 2:
            values["other:" + name.removeprefix("other_")] = _filled(time, channel)
    return Covariates(
        values, motion.direction, motion.distance, np.zeros(1, dtype=np.int64), float(np.mean(still))
    )


def join(parts: Sequence[Covariates]) -> Covariates:
    """Put the covariates of several recordings one after the other; those that not all have are left out."""
    common = [name for name in parts[0].values if all(name in part.values for part in parts)]
    lengths = np.array([part.samples for part in parts])
    offsets = np.concatenate(([0], np.cumsum(lengths)[:-1]))
    starts = np.concatenate([part.starts + offset for part, offset in zip(parts, offsets, strict=True)])
    return Covariates(
        {name: np.concatenate([part.values[name] for part in parts]) for name in common},
        np.concatenate([part.motion_direction for part in parts]),
        np.concatenate([part.motion_reversal for part in parts]),
        starts.astype(np.int64),
        float(np.average([part.resting_share for part in parts], weights=lengths)),
    )


def reversals(values: FloatArray, threshold: float) -> Reversals:
    """Find direction and distance since the last reversal; turning back by `threshold` or less is no
    reversal.
    """
    return Reversals(_reversals(np.asarray(values, dtype=np.float64), float(threshold)))


def _by_both(time: FloatArray, measured: FloatArray, predicted: FloatArray | None) -> FloatArray:
    """The joint's angle out of what is measured and what is predicted, each by the other's variance: the one mean of
    them whose noise goes along with nothing of their difference, the residual."""
    measured = _filled(time, measured)
    if predicted is None:
        return measured
    own, other = (channel_noise(time, x).sigma ** 2 for x in (measured, predicted))
    return measured if own + other == 0.0 else (other * measured + own * predicted) / (own + other)


def _smoothed(time: FloatArray, channel: FloatArray) -> tuple[Smooth, float]:
    channel = _filled(time, channel)
    sigma = channel_noise(time, channel).sigma
    return fit_to_noise(time, channel, sigma), sigma


def _least_turn(smooth: Smooth, sigma: float) -> float:
    return max(6.0 * sigma * smooth.gain, 0.01 * float(np.ptp(smooth.value)))


def _filled(time: FloatArray, channel: FloatArray) -> FloatArray:
    good = np.isfinite(channel)
    if good.all():
        return np.asarray(channel, dtype=np.float64)
    return np.asarray(np.interp(time, time[good], channel[good]), dtype=np.float64)


def _still(load: Smooth, sigma: float) -> FloatArray:
    """1 where the load rests: its rate is below a twentieth of the usual one (more if noisy)."""
    speed = np.abs(load.slope)
    usual = float(np.sqrt(np.mean(load.slope**2)))
    usual = float(np.median(speed[speed > 0.3 * usual])) if usual > 0.0 else 0.0
    limit = np.clip(3.0 * sigma * load.slope_gain, 0.05 * usual, 0.3 * usual)
    return np.asarray(speed <= limit, dtype=np.float64)


def _since_stop(time: FloatArray, still: FloatArray) -> FloatArray:
    """Time since the load stopped; passing through zero rate at a turning point is no stop."""
    index = np.arange(len(time))
    moved = np.maximum.accumulate(np.where(still > 0.0, -1, index))
    begin = np.where(moved < 0, 0, np.minimum(moved + 1, len(time) - 1))
    dwell = np.where(still > 0.0, time - time[begin], 0.0)
    ends = np.append(np.flatnonzero((still[1:] == 0.0) & (still[:-1] > 0.0)), len(time) - 1)
    shortest = max(5.0 * step_s(time), 0.002 * float(time[-1] - time[0]))
    for end in ends:
        if still[end] > 0.0 and dwell[end] < shortest:
            dwell[begin[end] : end + 1] = 0.0
    return np.asarray(dwell, dtype=np.float64)


@njit
def _reversals(values: FloatArray, threshold: float) -> tuple[FloatArray, FloatArray]:
    n = len(values)
    direction, distance = np.zeros(n), np.zeros(n)
    heading, extreme, turned = 0.0, values[0], values[0]
    for i in range(n):
        x = values[i]
        if heading == 0.0:
            if abs(x - turned) > threshold:
                heading = 1.0 if x > turned else -1.0
                extreme = x
        elif (x - extreme) * heading >= 0.0:
            extreme = x
        elif (extreme - x) * heading > threshold:
            turned, heading, extreme = extreme, -heading, x
        direction[i] = heading
        distance[i] = abs(x - turned)
    return direction, distance
