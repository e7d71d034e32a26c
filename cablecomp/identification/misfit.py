"""Measured less predicted joint position of several recordings, each sample weighted by its noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.signal.noise import InputNoise, channel_noise, residual_floor
from cablecomp.signal.smoothing import FloatArray, group_means

Columns = Mapping[str, FloatArray]


@dataclass(frozen=True)
class Prepared:
    """One recording, ready to be fitted.

    `columns`: channels in means of `group` samples, `sigma_rad`: 1-sigma noise of each mean, `first`: first
    row that counts. `inputs`: what the observer is given, in steps of `group / each` samples; `each` steps
    of its prediction are averaged to one row.
    """

    columns: dict[str, FloatArray]
    sigma_rad: FloatArray
    group: int
    first: int
    inputs: dict[str, FloatArray]
    each: int = 1

    def means(self) -> dict[str, FloatArray]:
        """The inputs in means of a row."""
        return {k: group_means(v, self.each) for k, v in self.inputs.items()}

    @property
    def rows(self) -> int:
        """Rows that count."""
        return len(self.sigma_rad) - self.first


def prepare(columns: Columns, config: JointConfig, group: int, skip_s: float) -> Prepared:
    """Average in groups, and say how noisy each mean is: joint encoder, and torque through the drive's
    compliance.

    Noise comes from [sensors] where stated, else from the recording. Raises InputError if a channel is
    missing.
    """
    for name in ("time_s", "motor_position_rad", "joint_position_rad"):
        if name not in columns:
            raise InputError(
                f"calibration: channel `{name}` is missing; the recording has {', '.join(columns)}"
            )
    time = np.asarray(columns["time_s"], dtype=np.float64)
    means = {k: group_means(np.asarray(v, dtype=np.float64), group) for k, v in columns.items()}
    joint = _stated(config.sensors.joint_position_noise_rad, config.sensors.joint_position_resolution_rad)
    if joint is None:
        joint = channel_noise(time, np.asarray(columns["joint_position_rad"], dtype=np.float64)).sigma
    motor = _stated(config.sensors.motor_position_noise_rad, config.sensors.motor_position_resolution_rad)
    if motor is None:
        motor = channel_noise(time, np.asarray(columns["motor_position_rad"], dtype=np.float64)).sigma
    inputs = [InputNoise(motor, _ratio(config)), *_torque_noise(columns, config, time)]
    floor = residual_floor(joint, inputs, len(means["time_s"])) / sqrt(group)
    floor = np.maximum(floor, 0.05 * joint + 1e-9)  # means of quantised readings are not as good as 1/sqrt(n)
    first = int(np.searchsorted(means["time_s"], means["time_s"][0] + skip_s))
    return Prepared(means, floor, group, min(first, len(floor) - 2), means)


def predicted(config: JointConfig, part: Prepared) -> FloatArray:
    """Joint position of each row that the observer predicts, without any offset; raises InputError where it
    cannot follow."""
    found: FloatArray = Observer(config).run(part.inputs)["joint_position_rad"]
    return found if part.each == 1 else group_means(found, part.each)


def groups_for(recordings: Sequence[Columns], rows: int) -> int:
    """Group size that leaves at most `rows` rows in all."""
    total = sum(len(r["time_s"]) for r in recordings)
    return max(1, -(-total // rows))


def _stated(noise: float | None, resolution: float | None) -> float | None:
    if noise is None and resolution is None:
        return None
    return hypot(noise or 0.0, (resolution or 0.0) / sqrt(12.0))


def _ratio(config: JointConfig) -> float:
    return float(np.prod([s.input_radius_m / s.output_radius_m for s in config.drive.stage]))


def _torque_noise(columns: Columns, config: JointConfig, time: FloatArray) -> list[InputNoise]:
    name = "motor_torque_Nm" if config.observer.load == "motor_torque" else "joint_torque_Nm"
    if config.observer.load == "both_encoders" or name not in columns:
        return []
    s = config.sensors
    noise = (s.motor_torque_noise_Nm, s.motor_torque_resolution_Nm) if name[0] == "m" else None
    sigma = _stated(*(noise or (s.joint_torque_noise_Nm, s.joint_torque_resolution_Nm)))
    load = np.asarray(columns[name], dtype=np.float64)
    if sigma is None:
        sigma = channel_noise(time, load).sigma
    if name[0] == "m":
        sigma /= _ratio(config)
    # secant compliance over the recording: deflection's spread over load's
    deflection = np.asarray(columns["joint_position_rad"]) - _ratio(config) * np.asarray(
        columns["motor_position_rad"]
    )
    spread = float(np.std(load))
    compliance = float(np.std(deflection)) / spread if spread > 0.0 else 0.0
    return [InputNoise(sigma, compliance)]
