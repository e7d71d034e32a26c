"""Words that every link shares: channels, commands, states. Plain integers where a cycle touches them a
thousand times a second."""

from __future__ import annotations

from enum import IntEnum, StrEnum
from typing import Final, NamedTuple

EXTENDED: Final = 0x8000_0000
"""Identifier flag: 29-bit frame (CAN_EFF_FLAG of linux/can.h)."""
REMOTE: Final = 0x4000_0000
"""Identifier flag: remote transmission request (CAN_RTR_FLAG of linux/can.h)."""
ERROR: Final = 0x2000_0000
"""Identifier flag: error message of the controller, not a frame on the wire (CAN_ERR_FLAG of linux/can.h)."""

FD: Final = 0x1_0000_0000
"""Identifier flag: a CAN FD frame of up to 64 bytes; beyond the 32 bits of linux/can.h, where the length of
`struct canfd_frame` says it. Frames of both kinds may share an identifier and are told apart by it."""
SWITCH: Final = 0x2_0000_0000
"""Flag of an FD frame to send: its data go at the second, quicker bit rate; never set on what was received."""
FD_LENGTHS: Final = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
"""Lengths that an FD frame can have, in the order of their codes (ISO 11898-1)."""
NUMBER: Final = 0x1FFF_FFFF
"""The identifier itself, without its flags."""

CHANNELS: Final = (
    "motor_position_rad",
    "motor_velocity_rad_s",
    "motor_torque_Nm",
    "motor_current_A",
    "joint_position_rad",
    "joint_velocity_rad_s",
    "joint_torque_Nm",
    "temperature_degC",
    "tension_h_N",
    "tension_l_N",
)
"""Channels that every joint has a place for, in this order; a link may add `other_<name>` after them."""

(
    MOTOR_POSITION,
    MOTOR_VELOCITY,
    MOTOR_TORQUE,
    MOTOR_CURRENT,
    JOINT_POSITION,
    JOINT_VELOCITY,
    JOINT_TORQUE,
    TEMPERATURE,
    TENSION_H,
    TENSION_L,
) = range(len(CHANNELS))

CLIP_POSITION: Final = 1
CLIP_VELOCITY: Final = 2
CLIP_TORQUE: Final = 4
CLIP_STIFFNESS: Final = 8
CLIP_DAMPING: Final = 16
NOT_TAKEN: Final = 32
"""Beside the CLIP_* bits: the bus did not take the command; the drive still has the one before."""


class BusState(IntEnum):
    """What the adapter knows of its bus; `LOST` = the port itself is gone (cable pulled, interface down)."""

    CLOSED = 0
    ACTIVE = 1
    PASSIVE = 2
    OFF = 3
    LOST = 4


class DriveState(IntEnum):
    """State of a drive, whatever its protocol calls it."""

    UNKNOWN = -1
    DISABLED = 0
    CALIBRATING = 1
    ENABLED = 2
    FAULT = 3


class Mode(StrEnum):
    """What the drive closes a loop on."""

    TORQUE = "torque"
    VELOCITY = "velocity"
    POSITION = "position"
    IMPEDANCE = "impedance"


class Request(StrEnum):
    """What a drive can be asked for besides motion; `STOP` is the protocol's quickest way to a powerless
    drive. `REPORT`: say where you are; it never makes a drive move, and where a protocol knows no such
    question it is one to let go, which is answered."""

    ENABLE = "enable"
    DISABLE = "disable"
    STOP = "stop"
    CALIBRATE = "calibrate"
    CLEAR_FAULTS = "clear_faults"
    SET_ZERO = "set_zero"
    RESET = "reset"
    REPORT = "report"


class MotorCommand(NamedTuple):
    """One command for the motor, at the input pulley: SI units, signs as in `Sample`, `None` = the link's own
    gain.

    Motor torque = `stiffness (position - q_in) + damping (velocity - dq_in/dt) + torque` in the mode
    "impedance"; the other modes leave out what they do not close a loop on.
    """

    position_rad: float = 0.0
    velocity_rad_s: float = 0.0
    torque_Nm: float = 0.0
    stiffness_Nm_per_rad: float | None = None
    damping_Nms_per_rad: float | None = None


class Frame(NamedTuple):
    """One frame to send: identifier with its flags (`EXTENDED`, `REMOTE`, `FD`, `SWITCH`) and 0…8 data bytes,
    with `FD` one of `FD_LENGTHS`."""

    identifier: int
    data: bytes
