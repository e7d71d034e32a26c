"""What flows between the floors: one sample in, one estimate out. SI units; NaN = the channel is absent."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

NAN = float("nan")


class Sample(NamedTuple):
    """Readings of one instant.

    Signs: motor and joint angle positive together; joint torque is the external moment on the output pulley,
    positive along +q_out; motor torque is what the motor applies to the input pulley, positive along +q_in.
    """

    time_s: float
    motor_position_rad: float
    joint_torque_Nm: float = NAN
    joint_position_rad: float = NAN
    motor_torque_Nm: float = NAN
    temperature_degC: float = NAN
    other: tuple[float, ...] = ()


class Estimate(NamedTuple):
    """What the observer says of one instant.

    `deflection_rad` = predicted q_out - (product of r/R) q_in, `deflection_low_rad`/`deflection_high_rad`
    contain the true value for every admissible initial history (NaN where no guarantee exists);
    `joint_position_rad` is what the joint encoder should read, its offset taken off; tensions are those of the
    output stage's cables at the output pulley (l is NaN in an open circuit);
    `motor_torque_Nm` is what the motor's torque sensor should read.
    """

    time_s: float
    deflection_rad: float
    deflection_low_rad: float
    deflection_high_rad: float
    joint_position_rad: float
    joint_torque_Nm: float
    tension_h_N: float
    tension_l_N: float
    motor_torque_Nm: float = NAN


class Grid(NamedTuple):
    """Values that a message can carry: `origin + n step` from `low` to `high`; `step` 0 = any value between."""

    origin: float = 0.0
    step: float = 0.0
    low: float = -inf
    high: float = inf


class Wire(NamedTuple):
    """What a command's message can carry of the motor's position (rad), velocity (rad/s) and torque (Nm)."""

    position: Grid = Grid()
    velocity: Grid = Grid()
    torque: Grid = Grid()


ANY_WIRE = Wire()
"""Carries whatever it is given."""
