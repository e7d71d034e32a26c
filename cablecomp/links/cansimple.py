"""ODrive's CANSimple: identifier `node << 5 | command`, little-endian payloads, turns and turns/s at the
ODrive's encoder. What the two firmwares share; what differs lies in `cansimple_firmware`.

Sources: ODrive documentation, "CAN Protocol" (message table; 1 << 5 | 0x0C = 0x2C), and the message tables (DBC)
that ODrive publishes for firmware 0.5.6 and 0.6.10: a message of one float has eight bytes there, four of them
zero, and whoever reads by the table refuses a shorter one.
"""

from __future__ import annotations

from enum import IntEnum
from math import isfinite
from struct import Struct
from typing import Final, NamedTuple

from cablecomp.errors import InputError
from cablecomp.links.records import (
    CLIP_POSITION,
    CLIP_TORQUE,
    CLIP_VELOCITY,
    REMOTE,
    Frame,
)

FLOAT_TOP: Final = 3.4028234663852886e38
_F: Final = Struct("<f4x")
_FF: Final = Struct("<ff")
_FHH: Final = Struct("<fhh")
_II: Final = Struct("<II")
_I: Final = Struct("<I4x")
_COUNT: Final = Struct("<i4x")
_HEARTBEAT: Final = Struct("<IB3s")
_SDO: Final = Struct("<BHBf")
_READ: Final = 0


class Cmd(IntEnum):
    """Command numbers (lower five bits of the identifier) that mean the same to both firmwares."""

    HEARTBEAT = 0x01
    ESTOP = 0x02
    SET_AXIS_STATE = 0x07
    GET_ENCODER_ESTIMATES = 0x09
    SET_CONTROLLER_MODE = 0x0B
    SET_INPUT_POS = 0x0C
    SET_INPUT_VEL = 0x0D
    SET_INPUT_TORQUE = 0x0E
    SET_LIMITS = 0x0F
    GET_IQ = 0x14
    REBOOT = 0x16
    GET_BUS_VOLTAGE_CURRENT = 0x17
    CLEAR_ERRORS = 0x18


class Cmd05(IntEnum):
    """Command numbers of firmware 0.5 alone."""

    SET_LINEAR_COUNT = 0x19


class Cmd06(IntEnum):
    """Command numbers of firmware 0.6 that 0.5 does not have, or uses for something else."""

    RX_SDO = 0x04
    TX_SDO = 0x05
    GET_TEMPERATURE = 0x15
    SET_ABSOLUTE_POSITION = 0x19
    GET_TORQUES = 0x1C
    GET_POWERS = 0x1D


class AxisState(IntEnum):
    """States of an axis; those but UNDEFINED, IDLE and CLOSED_LOOP are busy ones."""

    UNDEFINED = 0
    IDLE = 1
    STARTUP_SEQUENCE = 2
    FULL_CALIBRATION = 3
    MOTOR_CALIBRATION = 4
    ENCODER_INDEX_SEARCH = 6
    ENCODER_OFFSET_CALIBRATION = 7
    CLOSED_LOOP = 8
    LOCKIN_SPIN = 9
    ENCODER_DIR_FIND = 10
    HOMING = 11
    HALL_POLARITY_CALIBRATION = 12
    HALL_PHASE_CALIBRATION = 13
    ANTICOGGING_CALIBRATION = 14


class ControlMode(IntEnum):
    """What the controller closes a loop on."""

    VOLTAGE = 0
    TORQUE = 1
    VELOCITY = 2
    POSITION = 3


class InputMode(IntEnum):
    """How inputs are taken; PASSTHROUGH = as they come."""

    INACTIVE = 0
    PASSTHROUGH = 1


class Heartbeat(NamedTuple):
    """Axis error bits, axis state, and the last three bytes (their meaning depends on the firmware)."""

    error: int
    axis_state: int
    rest: bytes


class Pair(NamedTuple):
    """The two numbers of a payload, in the order of the message table."""

    first: float
    second: float


class Encoded(NamedTuple):
    """A frame, and the CLIP_* bits of what had to be saturated to fit."""

    frame: Frame
    clipped: int


def identifier(node: int, command: int) -> int:
    """`node << 5 | command`; raises InputError for a node beyond 0…63."""
    if not 0 <= node <= 0x3F:
        raise InputError(f"ODrive node {node}; 0 to 63 are accepted (11-bit identifiers)")
    return node << 5 | command


def request(node: int, command: int) -> Frame:
    """Remote frame that asks an axis to answer with that command's payload."""
    return Frame(identifier(node, command) | REMOTE, b"")


def parse_heartbeat(data: bytes) -> Heartbeat:
    """Heartbeat: error u32, state u8, three more bytes; raises InputError unless 8 bytes."""
    if len(data) != 8:
        raise InputError(f"ODrive heartbeat: {len(data)} bytes; 8 are accepted")
    return Heartbeat(*_HEARTBEAT.unpack(data))


def parse_pair(data: bytes) -> Pair:
    """Two float32: encoder estimates (turns, turns/s), Iq (set, measured A), temperature (FET, motor degC),
    bus (V, A), torques (target, estimate Nm); raises InputError unless 8 bytes."""
    if len(data) != 8:
        raise InputError(f"ODrive payload: {len(data)} bytes; 8 are accepted")
    return Pair(*_FF.unpack(data))


def read_endpoint(node: int, number: int) -> Frame:
    """RxSdo: ask for a parameter by its endpoint (firmware 0.6)."""
    return Frame(identifier(node, Cmd06.RX_SDO), _SDO.pack(_READ, number, 0, 0.0))


def parse_endpoint(data: bytes) -> tuple[int, float]:
    """TxSdo: an endpoint's number, and its float32; raises InputError unless 8 bytes."""
    if len(data) != 8:
        raise InputError(f"ODrive TxSdo: {len(data)} bytes; 8 are accepted")
    _, number, _, value = _SDO.unpack(data)
    return number, value


def set_axis_state(node: int, state: AxisState) -> Frame:
    """Ask for an axis state."""
    return Frame(identifier(node, Cmd.SET_AXIS_STATE), _I.pack(state))


def set_controller_mode(node: int, control: ControlMode, inputs: InputMode = InputMode.PASSTHROUGH) -> Frame:
    """Choose the loop and how inputs are taken."""
    return Frame(identifier(node, Cmd.SET_CONTROLLER_MODE), _II.pack(control, inputs))


def set_limits(node: int, velocity_turns_s: float, current_A: float) -> Frame:
    """Velocity and current limit; raises InputError unless both are finite and positive."""
    if not (isfinite(velocity_turns_s) and isfinite(current_A) and velocity_turns_s > 0 and current_A > 0):
        raise InputError(
            f"ODrive limits {velocity_turns_s} turns/s, {current_A} A; positive numbers are accepted"
        )
    return Frame(identifier(node, Cmd.SET_LIMITS), _FF.pack(velocity_turns_s, current_A))


def estop(node: int) -> Frame:
    """Emergency stop: no payload."""
    return Frame(identifier(node, Cmd.ESTOP), b"")


def set_absolute_position(node: int, position_turns: float) -> Frame:
    """Make the present position read `position_turns` (firmware 0.6)."""
    _finite("Set_Absolute_Position", position_turns)
    return Frame(identifier(node, Cmd06.SET_ABSOLUTE_POSITION), _F.pack(position_turns))


def set_linear_count(node: int, count: int) -> Frame:
    """Make the present position read `count` encoder counts (firmware 0.5)."""
    return Frame(identifier(node, Cmd05.SET_LINEAR_COUNT), _COUNT.pack(count))


def set_input_pos(
    node: int, position_turns: float, velocity_ff_turns_s: float, torque_ff_Nm: float
) -> Encoded:
    """Position target with feed-forwards in thousandths (int16), saturated at +-32.767; raises InputError on
    NaN/infinity."""
    _finite("Set_Input_Pos", position_turns, velocity_ff_turns_s, torque_ff_Nm)
    position, c0 = _real(position_turns, CLIP_POSITION)
    velocity, c1 = _thousandths(velocity_ff_turns_s, CLIP_VELOCITY)
    torque, c2 = _thousandths(torque_ff_Nm, CLIP_TORQUE)
    return Encoded(
        Frame(identifier(node, Cmd.SET_INPUT_POS), _FHH.pack(position, velocity, torque)), c0 | c1 | c2
    )


def set_input_vel(node: int, velocity_turns_s: float, torque_ff_Nm: float) -> Encoded:
    """Velocity target with torque feed-forward; raises InputError on NaN or infinity."""
    _finite("Set_Input_Vel", velocity_turns_s, torque_ff_Nm)
    velocity, c0 = _real(velocity_turns_s, CLIP_VELOCITY)
    torque, c1 = _real(torque_ff_Nm, CLIP_TORQUE)
    return Encoded(Frame(identifier(node, Cmd.SET_INPUT_VEL), _FF.pack(velocity, torque)), c0 | c1)


def set_input_torque(node: int, torque_Nm: float) -> Encoded:
    """Torque target; raises InputError on NaN or infinity."""
    _finite("Set_Input_Torque", torque_Nm)
    torque, clipped = _real(torque_Nm, CLIP_TORQUE)
    return Encoded(Frame(identifier(node, Cmd.SET_INPUT_TORQUE), _F.pack(torque)), clipped)


def _finite(message: str, *values: float) -> None:
    if not isfinite(sum(values)):
        raise InputError(f"{message}: {values}; finite numbers are accepted; nothing was sent")


def _real(value: float, bit: int) -> tuple[float, int]:
    if -FLOAT_TOP <= value <= FLOAT_TOP:
        return value, 0
    return (FLOAT_TOP if value > 0 else -FLOAT_TOP), bit


def _thousandths(value: float, bit: int) -> tuple[int, int]:
    n = round(value * 1000.0)
    if -32768 <= n <= 32767:
        return n, 0
    return (32767 if n > 0 else -32768), bit
