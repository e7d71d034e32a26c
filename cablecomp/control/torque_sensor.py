"""The joint's torque sensor as the controller knows it: samples and estimates hold readings, references true loads."""

from __future__ import annotations

from typing import NamedTuple


class TorqueSensor(NamedTuple):
    """Reading = g M + zero [Nm], as `[sensors] joint_torque_gain` and `joint_torque_offset_Nm` state it."""

    gain: float
    zero_Nm: float

    def load(self, reading_Nm: float) -> float:
        """The load behind a reading."""
        return (reading_Nm - self.zero_Nm) / self.gain

    def reading(self, load_Nm: float) -> float:
        """What it reads under a load."""
        return self.gain * load_Nm + self.zero_Nm
