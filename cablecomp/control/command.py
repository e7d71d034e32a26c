"""What the control floor takes and gives: references in, motor commands out. SI units; NaN = not stated."""

from __future__ import annotations

from typing import NamedTuple

from cablecomp.signals import NAN


class Reference(NamedTuple):
    """What is wanted of the joint at one instant.

    `joint_torque_Nm` is the external moment on the output pulley, positive along +q_out, sensors' errors taken off: in
    position mode the load that is expected (NaN = unknown), in force mode the load that is wanted (the joint
    then pushes on its surroundings with the opposite torque), in impedance mode the load wanted at zero
    position error.
    """

    joint_position_rad: float = 0.0
    joint_velocity_rad_s: float = 0.0
    joint_torque_Nm: float = NAN
    joint_acceleration_rad_s2: float = 0.0


class Command(NamedTuple):
    """What the motor is asked for, at the input pulley, and what the compensator believed when it asked.

    `deflection_rad`, `joint_position_rad`, `tension_*`, `joint_torque_Nm` are the observer's for the sample
    just taken in; `deflection_ahead_rad` is the one compensated, predicted for the load of the next instant.
    """

    motor_position_rad: float
    motor_velocity_rad_s: float
    motor_torque_Nm: float
    deflection_ahead_rad: float = NAN
    deflection_rad: float = NAN
    deflection_low_rad: float = NAN
    deflection_high_rad: float = NAN
    joint_position_rad: float = NAN
    joint_torque_Nm: float = NAN
    tension_h_N: float = NAN
    tension_l_N: float = NAN


class Feed(NamedTuple):
    """How far feed-forward may be trusted this cycle: `weight` 1 = wholly, 0 = not at all; `held` = keep the
    last one."""

    weight: float = 1.0
    held: bool = False


FULL = Feed()
