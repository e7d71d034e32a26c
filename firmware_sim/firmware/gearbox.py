"""What lies between the shaft that a drive knows and the input pulley."""

from __future__ import annotations

from typing import NamedTuple

from firmware_sim.plantlike import Readings


class Gearbox(NamedTuple):
    """A gear without loss or play: `shaft angle = turns (pulley angle + offset_rad)`; `turns` of the shaft per turn of
    the pulley, negative where they turn against each other."""

    turns: float = 1.0
    offset_rad: float = 0.0

    def at_shaft(self, seen: Readings) -> Readings:
        """Readings as the drive has them; the joint's own stay."""
        sign = 1.0 if self.turns > 0.0 else -1.0
        return seen._replace(
            motor_position_rad=self.turns * (seen.motor_position_rad + self.offset_rad),
            motor_velocity_rad_s=self.turns * seen.motor_velocity_rad_s,
            motor_torque_Nm=seen.motor_torque_Nm / self.turns,
            motor_current_A=sign * seen.motor_current_A,
        )

    def at_pulley(self, torque_Nm: float) -> float:
        """Torque on the pulley of the shaft's torque."""
        return self.turns * torque_Nm
