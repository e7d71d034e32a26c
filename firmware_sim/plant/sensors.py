"""Sensors: noise, resolution, bias and gain on top of noise-free channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from firmware_sim.plant.bench import PlantRun
from firmware_sim.plant.errors import PlantError
from firmware_sim.plant.records import Floats


@dataclass(frozen=True)
class SensorSpec:
    """What the joint's sensors add: 1-sigma white noise, then rounding to the resolution; 0 = ideal.

    The torque sensor shows gain · M + offset, and yields by its compliance between output pulley and joint
    encoder. Velocities are differences of the measured angles through a first-order low-pass of
    `velocity_bandwidth_Hz`.
    """

    motor_position_noise_rad: float = 0.0
    motor_position_resolution_rad: float = 0.0
    joint_position_noise_rad: float = 0.0
    joint_position_resolution_rad: float = 0.0
    joint_position_offset_rad: float = 0.0
    joint_torque_noise_Nm: float = 0.0
    joint_torque_resolution_Nm: float = 0.0
    joint_torque_gain: float = 1.0
    joint_torque_offset_Nm: float = 0.0
    joint_torque_compliance_rad_per_Nm: float = 0.0
    motor_torque_noise_Nm: float = 0.0
    motor_torque_resolution_Nm: float = 0.0
    temperature_noise_K: float = 0.0
    velocity_bandwidth_Hz: float = 150.0

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            signed = f.name.endswith(("offset_rad", "offset_Nm"))
            if not np.isfinite(value) or (value < 0 and not signed):
                raise PlantError(f"sensors: `{f.name}` is {value!r}; a finite number >= 0 is accepted")

    @classmethod
    def from_table(cls, table: Mapping[str, float]) -> SensorSpec:
        """From a configuration's [sensors] table; keys that only the observer knows are left aside."""
        known = {f.name for f in fields(cls)}
        return cls(**{k: float(v) for k, v in table.items() if k in known})


def rounded(value: Floats, resolution: float) -> Floats:
    """Round to whole counts; resolution 0 leaves the value alone."""
    return value if resolution <= 0 else np.round(value / resolution) * resolution


def measure(run: PlantRun, sensors: SensorSpec, rng: np.random.Generator) -> dict[str, Floats]:
    """The recording that the sensors make of a run: canonical channel names, SI units, one value per sample.

    Tensions, which no usual joint measures, are left out; `rng` draws all noise, in the order of the
    channels below.
    """
    n = len(run.time_s)

    def noisy(value: Floats, sigma: float, resolution: float) -> Floats:
        return rounded(value + sigma * rng.standard_normal(n), resolution)

    s = sensors
    joint = run.joint_position_rad + s.joint_torque_compliance_rad_per_Nm * run.load_path_Nm
    channels = {
        "time_s": run.time_s.copy(),
        "motor_position_rad": noisy(
            run.motor_position_rad, s.motor_position_noise_rad, s.motor_position_resolution_rad
        ),
        "joint_position_rad": noisy(
            joint + s.joint_position_offset_rad, s.joint_position_noise_rad, s.joint_position_resolution_rad
        ),
        "joint_torque_Nm": noisy(
            s.joint_torque_gain * run.joint_torque_Nm + s.joint_torque_offset_Nm,
            s.joint_torque_noise_Nm,
            s.joint_torque_resolution_Nm,
        ),
        "motor_torque_Nm": noisy(run.motor_torque_Nm, s.motor_torque_noise_Nm, s.motor_torque_resolution_Nm),
        "temperature_degC": noisy(run.temperature_degC, s.temperature_noise_K, 0.0),
        "other_1": run.other_1.copy(),
    }
    return channels
