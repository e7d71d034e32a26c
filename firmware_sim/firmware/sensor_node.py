"""The joint-side sensor node: joint encoder, torque sensor, temperature; published with a sequence
counter."""

from __future__ import annotations

import math
from dataclasses import dataclass

from firmware_sim.errors import SimError
from firmware_sim.firmware.records import Sample, SensorFlag, Status
from firmware_sim.plantlike import Readings


@dataclass(frozen=True)
class SensorNodeConfig:
    """Parameters of the node; `clock_drift_ppm` > 0 makes its clock fast.

    `status_phase`: how many samples earlier than another node's its status comes, so that many nodes on a
    bus do not all send theirs at once.
    """

    status_every: int = 10
    status_phase: int = 0
    torque_range_Nm: float = 80.0
    temperature_limit_degC: float = 90.0
    jump_rad: float = 0.2
    clock_drift_ppm: float = 0.0

    def __post_init__(self) -> None:
        if self.status_every < 1:
            raise SimError(f"sensor node: status_every is {self.status_every}; 1 or more is accepted")


class SensorNode:
    """One node; `sample` is called at each of its periods and says what to publish."""

    def __init__(self, config: SensorNodeConfig) -> None:
        self.config = config
        self.reset(0.0)

    def reset(self, now_s: float) -> None:
        """Power cycle: the counter and the clock start again."""
        self._boot_s = now_s
        self._count = -1
        self._position = math.nan
        self._told: SensorFlag | None = None
        self._fresh = SensorFlag.STARTED_AFRESH

    def device_time_us(self, now_s: float) -> int:
        """The node's own clock (us since its start, modulo 2^32)."""
        elapsed = (now_s - self._boot_s) * (1.0 + 1e-6 * self.config.clock_drift_ppm)
        return round(elapsed * 1e6) % (1 << 32)

    def sample(self, readings: Readings, now_s: float) -> tuple[Sample, Status | None]:
        """Take one sample, NaN where a sensor gives nothing; the status comes with every n-th sample and
        whenever the flags change."""
        flags = self._fresh | self._flags(readings)
        self._position = readings.joint_position_rad
        limit = self.config.torque_range_Nm
        torque = readings.joint_torque_Nm
        torque = min(max(torque, -limit), limit) if math.isfinite(torque) else math.nan
        self._count += 1
        sequence = self._count % 256
        sample = Sample(self._position, torque, sequence)
        if (self._count + self.config.status_phase) % self.config.status_every and flags == self._told:
            return sample, None
        self._told, self._fresh = flags, SensorFlag(0)
        return sample, Status(self.device_time_us(now_s), readings.temperature_degC, flags, sequence)

    def _flags(self, readings: Readings) -> SensorFlag:
        c, flags = self.config, SensorFlag(0)
        if not math.isfinite(readings.joint_position_rad):
            flags |= SensorFlag.ENCODER_LOST
        elif abs(readings.joint_position_rad - self._position) > c.jump_rad:
            flags |= SensorFlag.ENCODER_JUMPED
        if abs(readings.joint_torque_Nm) > c.torque_range_Nm:
            flags |= SensorFlag.TORQUE_SATURATED
        if readings.temperature_degC > c.temperature_limit_degC:
            flags |= SensorFlag.OVER_TEMPERATURE
        return flags
