"""moteus: registers, written and read by subframes of CAN FD frames; turns of the output shaft, turns/s, N m.

Identifier = source << 8 | destination, bit 15 asks for a reply, whose identifier is drive << 8 | source; extended
where 11 bits are not enough. Numbers little end first; what an FD frame has to have more is filled with 0x50.
Sources: mjbots, moteus "CAN Protocol" and "Register Reference"; its firmware (`moteus_controller.cc`: the write of
the mode begins a command, what it leaves out is at its default; units of the registers).
"""

from __future__ import annotations

from enum import IntEnum
from math import nan
from struct import Struct, error, unpack_from
from typing import Final

from cablecomp.errors import InputError
from cablecomp.links.records import EXTENDED, FD, FD_LENGTHS, NUMBER, SWITCH, DriveState, Frame

NOP: Final = 0x50
_REPLY: Final = 0x8000
_WRITE_MODE: Final = b"\x01\x00"
_WRITE_POSITION: Final = bytes([0x0C, 6, 0x20])
_WRITE_INTEGRAL: Final = bytes([0x0D, 0x2B])
_SIX: Final = Struct("<6f")
_ONE: Final = Struct("<f")
_SET_POSITION: Final = bytes([0x0D, 0xB1, 0x02])
_SIZES: Final = (1, 2, 4, 4)
_FORMS: Final = ("b", "h", "i", "f")
_INT8, _F32 = 0, 3


class Register(IntEnum):
    """Registers that are read."""

    MODE = 0x000
    POSITION = 0x001
    VELOCITY = 0x002
    TORQUE = 0x003
    CURRENT = 0x004
    VOLTAGE = 0x00D
    TEMPERATURE = 0x00E
    FAULT = 0x00F
    ENCODER_0 = 0x050
    ENCODER_VALIDITY = 0x058


class ServoMode(IntEnum):
    """Values of the register mode that matter here; the others between them move the motor too."""

    STOPPED = 0
    FAULT = 1
    ENABLING = 2
    CALIBRATED = 4
    POSITION = 10
    TIMEOUT = 11


QUERY: Final = bytes([0x1C, 5, Register.MODE, 0x13, Register.VOLTAGE])
"""Asks for mode, position, velocity, torque, current as float32; voltage, temperature, fault as int8."""
_ASKED: Final = {
    _F32: {0, 1, 2, 3, 4, *range(0x50, 0x56)},
    _INT8: {Register.VOLTAGE, Register.TEMPERATURE, Register.FAULT, Register.ENCODER_VALIDITY},
}
_UNITS: Final[dict[int, float]] = {Register.VOLTAGE: 0.5}

FAULTS: Final[dict[int, str]] = {
    11: "no command came in time",
    32: "calibration fault",
    33: "motor driver fault",
    34: "over voltage",
    35: "encoder fault",
    36: "motor not configured",
    37: "PWM cycle overrun",
    38: "over temperature",
    39: "outside limit",
    40: "under voltage",
    41: "configuration changed",
    42: "no valid commutation encoder",
    43: "no valid output encoder",
    44: "driver enable fault",
    45: "stop position deprecated",
    46: "timing violation",
    47: "back-EMF feed-forward without acceleration limit",
    48: "invalid limits",
}
"""Register 0x00F in mode 1; 11 stands for the mode of that number."""


def query_encoder(slot: int) -> bytes:
    """Asks for position and velocity of an encoder as float32, and which encoders are valid."""
    return bytes([0x1E, Register.ENCODER_0 + 2 * slot, 0x11, Register.ENCODER_VALIDITY])


def identifier(node: int, host: int, reply: bool = True) -> int:
    """Identifier of a frame to a drive, with the flags of an FD frame."""
    number = (_REPLY if reply else 0) | host << 8 | node
    return number | FD | SWITCH | (EXTENDED if number > 0x7FF else 0)


def reply_identifiers(node: int, host: int) -> tuple[int, ...]:
    """Identifiers that a reply may have: 29 bits, also where 11 are enough."""
    number = node << 8 | host
    return (number | EXTENDED | FD,) if number > 0x7FF else (number | FD, number | EXTENDED | FD)


def number(identifier: int) -> int:
    """An identifier without the flags of FD, as arbitration on the bus sees it."""
    return identifier & (NUMBER | EXTENDED)


def frame(node: int, host: int, data: bytes) -> Frame:
    """A frame that asks for a reply, filled up to a length that FD frames have."""
    length = next(n for n in FD_LENGTHS if n >= len(data))
    return Frame(identifier(node, host), data + bytes([NOP]) * (length - len(data)))


def position_mode(
    position: float, velocity: float, torque: float, kp: float, kd: float, top: float, integral: float
) -> bytes:
    """Command in turns, turns/s and N m: `kp`, `kd`, `integral` in parts of the drive's own gains and integral
    limit, `top` the most torque; NaN: the present position, the drive's own limit."""
    return (
        _WRITE_MODE
        + bytes([ServoMode.POSITION])
        + _WRITE_POSITION
        + _SIX.pack(position, velocity, torque, kp, kd, top)
        + _WRITE_INTEGRAL
        + _ONE.pack(integral)
    )


def no_force() -> bytes:
    """The position mode without any torque."""
    return position_mode(nan, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def stop() -> bytes:
    """Let go, and clear a fault."""
    return _WRITE_MODE + bytes([ServoMode.STOPPED])


def set_position(turns: float) -> bytes:
    """Declare the present output position."""
    return _SET_POSITION + _ONE.pack(turns)


def parse(data: bytes) -> dict[int, float]:
    """Registers of a reply, as far as they were asked for in this form; raises InputError where the frame is cut
    or no sequence of subframes."""
    found: dict[int, float] = {}
    at = 0
    try:
        while at < len(data):
            head = data[at]
            at += 1
            if head == NOP:
                continue
            if head & 0xFE == 0x30:  # a register that this firmware does not have
                _, at = _varuint(data, at)
                _, at = _varuint(data, at)
                continue
            if head & 0xF0 != 0x20:
                raise InputError(f"moteus reply: subframe 0x{head:02X}; replies, errors and NOP are accepted")
            kind, count = head >> 2 & 3, head & 3
            if not count:
                count, at = _varuint(data, at)
            start, at = _varuint(data, at)
            values = unpack_from(f"<{count}{_FORMS[kind]}", data, at)
            at += count * _SIZES[kind]
            asked = _ASKED.get(kind, ())
            for register, value in enumerate(values, start):
                if register in asked and not (kind == _INT8 and value == -128):  # which stands for NaN
                    found[register] = _UNITS.get(register, 1.0) * value
    except (IndexError, error):
        raise InputError(f"moteus reply of {len(data)} bytes: it ends within a subframe") from None
    return found


def _varuint(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 35, 7):
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise InputError("moteus reply: a number of more than five bytes; up to 32 bits are accepted")


def state_of(mode: int) -> DriveState:
    """State that a mode stands for."""
    if mode == ServoMode.STOPPED:
        return DriveState.DISABLED
    if mode in (ServoMode.FAULT, ServoMode.TIMEOUT):
        return DriveState.FAULT
    enabling = ServoMode.ENABLING <= mode <= ServoMode.CALIBRATED
    return DriveState.CALIBRATING if enabling else DriveState.ENABLED
