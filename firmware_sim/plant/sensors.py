"""Sensors: noise, resolution, bias and gain on top of noise-free channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from firmware_sim.plant.errors import PlantError


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
