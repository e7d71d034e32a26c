"""What drive and sensor node are told and what they tell, apart from any wire."""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import NamedTuple


class DriveState(IntEnum):
    """Rows of the drive's state table."""

    DISABLED = 0
    CALIBRATING = 1
    ENABLED = 2
    FAULT = 3


class Request(IntEnum):
    """What may be asked of the state table."""

    DISABLE = 0
    CALIBRATE = 1
    ENABLE = 2
    CLEAR_FAULTS = 3
    SET_ZERO = 4
    RESET = 5
    STOP = 6


class Mode(IntEnum):
    """Control modes of an enabled drive."""

    TORQUE = 0
    VELOCITY = 1
    POSITION = 2
    IMPEDANCE = 3


class DriveFlag(IntFlag):
    """Error flags of the drive; those in `FAULTS` stop it, the others only tell."""

    COMMAND_TIMEOUT = 1 << 0
    OVER_TORQUE = 1 << 1
    OVER_VELOCITY = 1 << 2
    POSITION_LIMIT = 1 << 3
    MOTOR_ENCODER = 1 << 4
    INDEX_NOT_FOUND = 1 << 5
    OVER_TEMPERATURE = 1 << 6
    EMERGENCY_STOP = 1 << 7
    BAD_FRAME = 1 << 8
    STARTED_AFRESH = 1 << 9
    NOT_CALIBRATED = 1 << 10
    BAD_MODE = 1 << 11


FAULTS = (
    DriveFlag.COMMAND_TIMEOUT
    | DriveFlag.OVER_VELOCITY
    | DriveFlag.POSITION_LIMIT
    | DriveFlag.MOTOR_ENCODER
    | DriveFlag.INDEX_NOT_FOUND
    | DriveFlag.OVER_TEMPERATURE
    | DriveFlag.EMERGENCY_STOP
    | DriveFlag.BAD_MODE
)


class SensorFlag(IntFlag):
    """Error flags of the joint-side sensor node."""

    ENCODER_LOST = 1 << 0
    ENCODER_JUMPED = 1 << 1
    TORQUE_SATURATED = 1 << 2
    OVER_TEMPERATURE = 1 << 3
    STARTED_AFRESH = 1 << 4


class Setpoint(NamedTuple):
    """Targets of the drive: angle (rad), velocity (rad/s), torque or feed-forward torque (Nm), impedance
    gains."""

    position_rad: float = 0.0
    velocity_rad_s: float = 0.0
    torque_Nm: float = 0.0
    kp_Nm_per_rad: float = 0.0
    kd_Nms_per_rad: float = 0.0


class Sample(NamedTuple):
    """One sample of the sensor node; `sequence` counts them, modulo 256."""

    joint_position_rad: float
    joint_torque_Nm: float
    sequence: int


class Status(NamedTuple):
    """State of the sensor node at the sample that `sequence` names; `device_time_us` runs since its start,
    modulo 2^32."""

    device_time_us: int
    temperature_degC: float
    error_flags: SensorFlag
    sequence: int
