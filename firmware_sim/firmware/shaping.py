"""How a drive takes its inputs: as they come, or through a ramp, a filter or a trajectory.

Laws as in ODrive's controller (`Controller::update` and `TrapezoidalTrajectory` of its published firmware), in
rad instead of turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from firmware_sim.firmware.records import Setpoint

TURN = 2.0 * math.pi


class InputMode(IntEnum):
    """ODrive's numbers of the input modes that are simulated."""

    INACTIVE = 0
    PASSTHROUGH = 1
    VEL_RAMP = 2
    POS_FILTER = 3
    TRAP_TRAJ = 5
    TORQUE_RAMP = 6


@dataclass
class ShapingConfig:
    """Rates and limits; ODrive's defaults, in rad."""

    velocity_ramp_rad_s2: float = 10.0 * TURN
    torque_ramp_Nm_s: float = 0.01
    filter_bandwidth_per_s: float = 20.0
    inertia_Nms2_per_rad: float = 0.0
    trajectory_velocity_rad_s: float = 2.0 * TURN
    trajectory_acceleration_rad_s2: float = 0.5 * TURN
    trajectory_deceleration_rad_s2: float = 0.5 * TURN


class Trapezoid(NamedTuple):
    """A move from `start` (angle, velocity) to `end`: three parts of constant acceleration."""

    start_rad: float
    end_rad: float
    start_rad_s: float
    cruise_rad_s: float
    speed_up_rad_s2: float
    slow_down_rad_s2: float
    speed_up_s: float
    cruise_s: float
    slow_down_s: float

    @property
    def duration_s(self) -> float:
        """Time of the whole move."""
        return self.speed_up_s + self.cruise_s + self.slow_down_s

    def at(self, t: float) -> tuple[float, float, float]:
        """Angle, velocity and acceleration after `t`."""
        if t < self.speed_up_s:
            return (
                self.start_rad + self.start_rad_s * t + 0.5 * self.speed_up_rad_s2 * t * t,
                self.start_rad_s + self.speed_up_rad_s2 * t,
                self.speed_up_rad_s2,
            )
        if t < self.speed_up_s + self.cruise_s:
            reached = self.start_rad + 0.5 * (self.start_rad_s + self.cruise_rad_s) * self.speed_up_s
            return reached + self.cruise_rad_s * (t - self.speed_up_s), self.cruise_rad_s, 0.0
        if t < self.duration_s:
            left = self.duration_s - t
            deceleration = self.slow_down_rad_s2
            return self.end_rad + 0.5 * deceleration * left * left, -deceleration * left, deceleration
        return self.end_rad, 0.0, 0.0


def plan(start_rad: float, start_rad_s: float, end_rad: float, config: ShapingConfig) -> Trapezoid:
    """The quickest trapezoid from a moving start to rest at `end_rad` within the trajectory's limits.

    A start that is faster than allowed slows down by the deceleration limit, one that moves the wrong way
    turns round by the smaller of both (ODrive takes the acceleration limit for both, and jumps where that
    cannot reach the end).
    """
    top, up, down = (
        config.trajectory_velocity_rad_s,
        config.trajectory_acceleration_rad_s2,
        config.trajectory_deceleration_rad_s2,
    )
    stop = math.copysign(start_rad_s**2 / (2.0 * down), start_rad_s)
    sign = math.copysign(1.0, end_rad - start_rad - stop)
    distance, start = sign * (end_rad - start_rad), sign * start_rad_s
    first = -down if start > top else up if start >= 0.0 else min(up, down)
    shortest = (top**2 - start**2) / (2.0 * first) + top**2 / (2.0 * down)
    if distance >= shortest:
        peak, cruise_s = top, (distance - shortest) / top
    else:
        inverse = 0.5 / first + 0.5 / down
        peak, cruise_s = math.sqrt(max((distance + 0.5 * start**2 / first) / inverse, 0.0)), 0.0
    return Trapezoid(
        start_rad,
        end_rad,
        start_rad_s,
        sign * peak,
        sign * first,
        -sign * down,
        (peak - start) / first,
        cruise_s,
        peak / down,
    )


class Shaper:
    """Turns the inputs into what the controller follows, period by period."""

    def __init__(self, config: ShapingConfig | None = None) -> None:
        self.config = ShapingConfig() if config is None else config
        self.mode = InputMode.PASSTHROUGH
        self.trajectory_done = True
        self._now = Setpoint()
        self._move: Trapezoid | None = None
        self._aimed_at: float | None = None
        self._moving_s = 0.0

    def hold(self, position_rad: float) -> None:
        """Start from here, at rest and without torque."""
        self._now = Setpoint(position_rad)
        self._move, self._aimed_at, self.trajectory_done = None, None, True

    def step(self, wanted: Setpoint, dt_s: float) -> Setpoint:
        """What the controller follows in this period."""
        mode = self.mode
        if mode is InputMode.PASSTHROUGH:
            self._now = wanted
        elif mode is InputMode.VEL_RAMP:
            self._ramp_velocity(wanted, dt_s)
        elif mode is InputMode.TORQUE_RAMP:
            self._ramp_torque(wanted, dt_s)
        elif mode is InputMode.POS_FILTER:
            self._filter(wanted, dt_s)
        elif mode is InputMode.TRAP_TRAJ:
            self._follow(wanted, dt_s)
        return self._now

    def _ramp_velocity(self, wanted: Setpoint, dt_s: float) -> None:
        most, now = self.config.velocity_ramp_rad_s2 * dt_s, self._now
        step = min(max(wanted.velocity_rad_s - now.velocity_rad_s, -most), most)
        torque = step / dt_s * self.config.inertia_Nms2_per_rad
        self._now = now._replace(velocity_rad_s=now.velocity_rad_s + step, torque_Nm=torque)

    def _ramp_torque(self, wanted: Setpoint, dt_s: float) -> None:
        most, now = self.config.torque_ramp_Nm_s * dt_s, self._now
        step = min(max(wanted.torque_Nm - now.torque_Nm, -most), most)
        self._now = now._replace(velocity_rad_s=wanted.velocity_rad_s, torque_Nm=now.torque_Nm + step)

    def _filter(self, wanted: Setpoint, dt_s: float) -> None:
        now, ki = self._now, 2.0 * self.config.filter_bandwidth_per_s
        kp = 0.25 * ki * ki
        acceleration = kp * (wanted.position_rad - now.position_rad)
        acceleration += ki * (wanted.velocity_rad_s - now.velocity_rad_s)
        velocity = now.velocity_rad_s + dt_s * acceleration
        torque = acceleration * self.config.inertia_Nms2_per_rad
        self._now = now._replace(
            position_rad=now.position_rad + dt_s * velocity, velocity_rad_s=velocity, torque_Nm=torque
        )

    def _follow(self, wanted: Setpoint, dt_s: float) -> None:
        now = self._now
        if wanted.position_rad != self._aimed_at:
            self._aimed_at, self._moving_s = wanted.position_rad, 0.0
            self._move = plan(now.position_rad, now.velocity_rad_s, wanted.position_rad, self.config)
            self.trajectory_done = False
        if self._move is None:
            return
        self._moving_s += dt_s
        position, velocity, acceleration = self._move.at(self._moving_s)
        torque = acceleration * self.config.inertia_Nms2_per_rad
        self._now = now._replace(position_rad=position, velocity_rad_s=velocity, torque_Nm=torque)
        self.trajectory_done = self._moving_s >= self._move.duration_s
