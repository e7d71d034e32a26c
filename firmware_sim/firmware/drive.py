"""A motor drive: what it may be asked, command watchdog, limits, index search, error flags."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from firmware_sim.firmware.drive_config import DriveConfig
from firmware_sim.firmware.index_search import IndexSearch
from firmware_sim.firmware.laws import Brake, MotionLaw
from firmware_sim.firmware.records import FAULTS, DriveFlag, DriveState, Mode, Request, Setpoint
from firmware_sim.firmware.shaping import InputMode, Shaper
from firmware_sim.firmware.states import TABLE
from firmware_sim.plantlike import Readings

_SEARCH_INTEGRATOR_PER_S = 20.0
"""Integral over proportional gain of a search for the index: what holds the motor back is overcome bit by bit."""


class DriveReport(NamedTuple):
    """What the drive tells of itself; the angle is NaN-free and counts from the encoder's own zero. The second
    encoder is the one at the joint, for drives that have an input for it."""

    state: DriveState
    mode: Mode
    flags: DriveFlag
    position_rad: float
    velocity_rad_s: float
    torque_Nm: float
    torque_command_Nm: float
    current_A: float
    temperature_degC: float
    homed: bool
    second_position_rad: float = math.nan
    second_velocity_rad_s: float = math.nan


class Drive:
    """The drive of one motor: told by `request` and `command`, driven by `update` at each of its own
    periods."""

    def __init__(self, config: DriveConfig) -> None:
        self.base = config
        self._boot(0.0)

    def _boot(self, now_s: float) -> None:
        self.config = self.base
        self.state = DriveState.DISABLED
        self.mode = self.config.mode
        self.flags = DriveFlag.STARTED_AFRESH
        self.setpoint = Setpoint()
        self.shaper = Shaper()
        self.homed = self.config.index_position_rad is None
        self.refused = 0
        self._raw_zero: float | None = 0.0 if self.homed else None
        self._last_command_s = now_s
        self._last_raw: float | None = None
        self._checked_raw: float | None = None
        self._brake = Brake()
        self._law = MotionLaw()
        self._index = self._new_search(now_s)
        self._enable_when_homed = False
        self._torque_command = 0.0
        self._unheard = False
        self._readings: Readings | None = None

    # ---- what the host may ask -------------------------------------------------------------------

    def request(self, request: Request, now_s: float) -> bool:
        """Ask the state table; returns False where the table has no such entry."""
        target = TABLE.get((self.state, request))
        if target is None:
            self.refused += 1
            return False
        if request is Request.RESET:
            raw = self._last_raw
            self._boot(now_s)
            if self._raw_zero is None:
                self._raw_zero = raw  # an incremental encoder counts from where it woke up
            return True
        if request is Request.STOP:
            self._fault(DriveFlag.EMERGENCY_STOP)
            return True
        if request is Request.CLEAR_FAULTS:
            self.flags = DriveFlag(0)
        if request is Request.SET_ZERO and self._last_raw is not None:
            self._raw_zero = self._last_raw
        self._enter(target, now_s)
        return True

    def command(self, setpoint: Setpoint, now_s: float) -> None:
        """New targets; feeds the watchdog whatever the state."""
        if not all(map(math.isfinite, setpoint)):
            self.flags |= DriveFlag.BAD_FRAME
            return
        self._last_command_s = now_s
        self.setpoint = setpoint

    def feed_watchdog(self, now_s: float) -> None:
        """A message that is not a target but shows that the host lives."""
        self._last_command_s = now_s

    def set_mode(self, mode: Mode, inputs: InputMode = InputMode.PASSTHROUGH) -> None:
        """Change the control mode and how inputs are taken; targets start from where the motor is."""
        self.mode = mode
        self.shaper.mode = inputs
        self._hold()

    def refuse_mode(self) -> None:
        """A mode was asked for that this drive does not have: it lets go, aloud."""
        self._fault(DriveFlag.BAD_MODE)

    def set_limits(self, velocity_rad_s: float | None = None, torque_Nm: float | None = None) -> None:
        """Narrow the limits; none can exceed what the drive was built for."""
        if velocity_rad_s is not None and velocity_rad_s > 0.0:
            limit = min(velocity_rad_s, self.base.velocity_limit_rad_s)
            self.config = replace(self.config, velocity_limit_rad_s=limit)
        if torque_Nm is not None and torque_Nm > 0.0:
            self.config = replace(self.config, torque_limit_Nm=min(torque_Nm, self.base.torque_limit_Nm))

    def set_gains(
        self, position: float | None = None, velocity: float | None = None, integrator: float | None = None
    ) -> None:
        """Gains of the cascaded position and velocity loops (1/s, Nms/rad, Nm/rad)."""
        c = self.config
        self.config = replace(
            c,
            position_gain_per_s=c.position_gain_per_s if position is None else position,
            velocity_gain_Nms_per_rad=c.velocity_gain_Nms_per_rad if velocity is None else velocity,
            velocity_integrator_Nm_per_rad=c.velocity_integrator_Nm_per_rad
            if integrator is None
            else integrator,
        )

    def set_position(self, position_rad: float) -> None:
        """Declare the present angle to be `position_rad`."""
        if self._last_raw is not None:
            self._raw_zero = self._last_raw - position_rad
            self._hold()

    # ---- its own period --------------------------------------------------------------------------

    def update(self, readings: Readings, dt_s: float, now_s: float) -> float:
        """One period of the drive: checks, then the torque (Nm) that the motor is told to make."""
        if self._raw_zero is None and math.isfinite(readings.motor_position_rad):
            self._raw_zero = readings.motor_position_rad
        self._check(readings, dt_s, now_s)
        self.observe(readings)
        if self.state is DriveState.CALIBRATING:
            wanted = self._search(dt_s, now_s)
        elif self.state is DriveState.ENABLED:
            wanted = 0.0 if self._unheard else self._follow(dt_s)
        else:
            in_fault = self.state is DriveState.FAULT
            wanted = self._brake.torque_Nm(self.config, in_fault, self._last_raw, self.velocity_rad_s)
        if self.state in (DriveState.CALIBRATING, DriveState.ENABLED):
            self._brake.open()
        limit = self.config.torque_limit_Nm
        if abs(wanted) > limit:
            self.flags |= DriveFlag.OVER_TORQUE
            wanted = math.copysign(limit, wanted)
        self._torque_command = wanted
        return wanted

    def observe(self, readings: Readings) -> None:
        """Take in readings without acting on them; what `report` then tells is as fresh as they are."""
        self._readings = readings
        if math.isfinite(readings.motor_position_rad):
            self._last_raw = readings.motor_position_rad

    @property
    def position_rad(self) -> float:
        """Angle as the drive knows it: the encoder's count less its zero."""
        raw = self._last_raw
        return 0.0 if raw is None or self._raw_zero is None else raw - self._raw_zero

    @property
    def velocity_rad_s(self) -> float:
        """Motor velocity, 0 before the first reading."""
        readings = self._readings
        if readings is None or not math.isfinite(readings.motor_velocity_rad_s):
            return 0.0
        return readings.motor_velocity_rad_s

    def report(self) -> DriveReport:
        """State, flags and readings as the wire sends them."""
        r = self._readings
        return DriveReport(
            self.state,
            self.mode,
            self.flags,
            self.position_rad,
            self.velocity_rad_s,
            0.0 if r is None else r.motor_torque_Nm,
            self._torque_command,
            0.0 if r is None else r.motor_current_A,
            25.0 if r is None else r.temperature_degC,
            self.homed,
            math.nan if r is None else r.joint_position_rad,
            math.nan if r is None else r.joint_velocity_rad_s,
        )

    # ---- inside ----------------------------------------------------------------------------------

    def _enter(self, target: DriveState, now_s: float) -> None:
        if target is DriveState.ENABLED and not self.homed:
            if not self.config.calibrate_on_enable:
                self.flags |= DriveFlag.NOT_CALIBRATED
                return
            self._enable_when_homed = True
            target = DriveState.CALIBRATING
        if target is DriveState.CALIBRATING and self.homed and self.config.index_position_rad is None:
            target = DriveState.DISABLED  # an absolute encoder has nothing to search
        if target is DriveState.DISABLED:
            self._enable_when_homed = False
        if target is DriveState.CALIBRATING:
            self._index = self._new_search(now_s)
            self._law.reset()
        if target is DriveState.ENABLED and self.state is not DriveState.ENABLED:
            self._hold()
        self.state = target
        self._last_command_s = now_s

    def _hold(self) -> None:
        self._law.reset()
        self.setpoint = Setpoint(position_rad=self.position_rad)
        self.shaper.hold(self.position_rad)

    def _fault(self, flag: DriveFlag) -> None:
        self.flags |= flag
        self._enable_when_homed = False
        self.state = DriveState.FAULT

    def _check(self, readings: Readings, dt_s: float, now_s: float) -> None:
        c, raw, before = self.config, readings.motor_position_rad, self._checked_raw
        self._checked_raw = raw
        active = self.state in (DriveState.ENABLED, DriveState.CALIBRATING)
        if not active:
            return
        found = DriveFlag(0)
        if not math.isfinite(raw):
            found |= DriveFlag.MOTOR_ENCODER
        elif before is not None and abs(raw - before) > 4.0 * c.velocity_limit_rad_s * dt_s + 1e-2:
            found |= DriveFlag.MOTOR_ENCODER  # no motor within its velocity limit moves so far in one period
        if abs(readings.motor_velocity_rad_s) > 1.2 * c.velocity_limit_rad_s:
            found |= DriveFlag.OVER_VELOCITY
        if readings.temperature_degC > c.temperature_limit_degC:
            found |= DriveFlag.OVER_TEMPERATURE
        waited = now_s - self._last_command_s
        self._unheard = self.state is DriveState.ENABLED and 0.0 < c.command_timeout_s < waited
        if self._unheard:
            self.flags |= DriveFlag.COMMAND_TIMEOUT
            found |= DriveFlag.COMMAND_TIMEOUT if c.timeout_faults else DriveFlag(0)
        if self.homed and not c.position_min_rad - 0.05 <= self.position_rad <= c.position_max_rad + 0.05:
            found |= DriveFlag.POSITION_LIMIT
        if found & FAULTS:
            self._fault(found)

    def _follow(self, dt_s: float) -> float:
        wanted = self.shaper.step(self.setpoint, dt_s)
        return self._law.torque_Nm(
            self.mode, wanted, self.position_rad, self.velocity_rad_s, self.config, dt_s
        )

    def _new_search(self, now_s: float) -> IndexSearch:
        return IndexSearch(self.config.index_position_rad, self.config.search_range_rad, now_s)

    def _search(self, dt_s: float, now_s: float) -> float:
        """Turn slowly until the index passes, or the search is given up."""
        c, index = self.config, self._index
        if self._last_raw is None or c.index_position_rad is None:
            return 0.0
        sign = index.sign
        index.look(self._last_raw, now_s)
        if index.zero_rad is not None:
            self._raw_zero, self.homed = index.zero_rad, True
            self.flags &= ~DriveFlag.NOT_CALIBRATED
            self._enter(DriveState.ENABLED if self._enable_when_homed else DriveState.DISABLED, now_s)
            return 0.0
        if index.lost:
            self._fault(DriveFlag.INDEX_NOT_FOUND)
            return 0.0
        if index.sign != sign:
            self._law.reset()
        gain = _SEARCH_INTEGRATOR_PER_S * c.velocity_gain_Nms_per_rad
        return self._law.turn(index.sign * c.search_velocity_rad_s, self.velocity_rad_s, gain, c, dt_s)
