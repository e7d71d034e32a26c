"""The torque that a drive makes: impedance, cascaded position and velocity, holding brake (Nm, at the input pulley)."""

from __future__ import annotations

from firmware_sim.firmware.drive_config import DriveConfig
from firmware_sim.firmware.records import Mode, Setpoint


def _within(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


class MotionLaw:
    """Torque from targets and the motor's motion; remembers the velocity loop's integral."""

    def __init__(self) -> None:
        self._integral_Nm = 0.0

    def reset(self) -> None:
        """The integral starts afresh."""
        self._integral_Nm = 0.0

    def torque_Nm(
        self,
        mode: Mode,
        wanted: Setpoint,
        position_rad: float,
        velocity_rad_s: float,
        config: DriveConfig,
        dt_s: float,
    ) -> float:
        """One period of the mode's law."""
        c, s = config, wanted
        position = _within(s.position_rad, c.position_min_rad, c.position_max_rad)
        if mode is Mode.TORQUE:
            return s.torque_Nm
        if mode is Mode.IMPEDANCE:
            spring = s.kp_Nm_per_rad * (position - position_rad)
            return spring + s.kd_Nms_per_rad * (s.velocity_rad_s - velocity_rad_s) + s.torque_Nm
        velocity = s.velocity_rad_s
        if mode is Mode.POSITION:
            velocity += c.position_gain_per_s * (position - position_rad)
        return self.turn(velocity, velocity_rad_s, c.velocity_integrator_Nm_per_rad, c, dt_s) + s.torque_Nm

    def turn(
        self,
        wanted_rad_s: float,
        velocity_rad_s: float,
        integrator_Nm_per_rad: float,
        config: DriveConfig,
        dt_s: float,
    ) -> float:
        """One period of the velocity loop."""
        c = config
        error = _within(wanted_rad_s, -c.velocity_limit_rad_s, c.velocity_limit_rad_s) - velocity_rad_s
        self._integral_Nm += integrator_Nm_per_rad * error * dt_s
        self._integral_Nm = _within(self._integral_Nm, -c.torque_limit_Nm, c.torque_limit_Nm)
        return c.velocity_gain_Nms_per_rad * error + self._integral_Nm


class Brake:
    """Torque on a motor that is let go: shorted windings, and a holding brake that closes where the motor is."""

    def __init__(self) -> None:
        self._closed_at_rad: float | None = None

    def open(self) -> None:
        """Let the motor turn."""
        self._closed_at_rad = None

    def torque_Nm(
        self, config: DriveConfig, in_fault: bool, raw_rad: float | None, velocity_rad_s: float
    ) -> float:
        """One period with the brake closed; `raw_rad`: the encoder's count, None before the first."""
        c = config
        damped = in_fault or c.brake_Nm_per_rad > 0.0
        wanted = -c.fault_damping_Nms_per_rad * velocity_rad_s if damped else 0.0
        if raw_rad is None or c.brake_Nm_per_rad == 0.0:
            return wanted
        if self._closed_at_rad is None:
            self._closed_at_rad = raw_rad
        return wanted + c.brake_Nm_per_rad * (self._closed_at_rad - raw_rad)
