"""RobStride's own protocol on extended identifiers: type in bits 28 to 24, 16 bits of data, drive or host number.

Angles, velocities, torques and gains are 16-bit counts of their ranges, big end first. Sources: RobStride's sample
program (`RobStride.cpp`: types 1 to 6, 17, 18, 21, layout of the identifiers), its SDK (`protocol.py`, `bus.py`).
"""

from __future__ import annotations

from enum import IntEnum
from struct import Struct
from typing import Final, NamedTuple

from cablecomp.links.mit import P_TOP, MitRange, clipping, count, value_of
from cablecomp.links.records import EXTENDED, Frame

_FOUR: Final = Struct(">4H")
_PARAMETER: Final = Struct("<HHI")
RUN_MODE: Final = 0x7005


class Kind(IntEnum):
    """Type of a message."""

    CONTROL = 1
    STATUS = 2
    ENABLE = 3
    STOP = 4
    SET_ZERO = 6
    WRITE = 18
    FAULTS = 21
    ACTIVE_STATUS = 24


class DriveMode(IntEnum):
    """Bits 23 and 22 of a status's identifier."""

    RESET = 0
    CALIBRATION = 1
    RUN = 2


FAULTS: Final[dict[int, str]] = {
    1: "under voltage",
    2: "drive",
    4: "over temperature",
    8: "magnetic encoder",
    16: "stall or overload",
    32: "not calibrated",
}
"""Bits 16 to 21 of a status's identifier."""


class Status(NamedTuple):
    """Counts of a status frame, and the temperature in degC."""

    position: int
    velocity: int
    torque: int
    temperature_degC: float


def identifier(kind: Kind, data: int, to: int) -> int:
    """Identifier of a message: type, data field, number of whom it is for."""
    return EXTENDED | kind << 24 | data << 8 | to


def status_identifiers(node: int, host: int) -> dict[int, tuple[DriveMode, int]]:
    """Identifiers that a drive's status may have -> its mode and fault bits."""
    return {
        identifier(kind, mode << 14 | faults << 8 | node, host): (mode, faults)
        for kind in (Kind.STATUS, Kind.ACTIVE_STATUS)
        for mode in DriveMode
        for faults in range(64)
    }


def control(
    scale: MitRange, node: int, position: float, velocity: float, kp: float, kd: float, torque: float
) -> tuple[Frame, int]:
    """One command, and its CLIP_* bits; raises InputError on NaN or infinity."""
    clipped = clipping(scale, position, velocity, kp, kd, torque)
    p, v, t, kp_top, kd_top = scale
    data = _FOUR.pack(
        count(position, -p, p, P_TOP),
        count(velocity, -v, v, P_TOP),
        count(kp, 0.0, kp_top, P_TOP),
        count(kd, 0.0, kd_top, P_TOP),
    )
    return Frame(identifier(Kind.CONTROL, count(torque, -t, t, P_TOP), node), data), clipped


def ask(kind: Kind, node: int, host: int, first: int = 0) -> Frame:
    """A message without numbers but its first byte."""
    return Frame(identifier(kind, host, node), bytes([first]) + bytes(7))


def write(node: int, host: int, parameter: int, value: int) -> Frame:
    """Set a parameter of whole numbers, until the next power cycle."""
    return Frame(identifier(Kind.WRITE, host, node), _PARAMETER.pack(parameter, 0, value))


def parse_status(data: bytes) -> Status:
    """Counts and temperature of a status of eight bytes."""
    position, velocity, torque, tenths = _FOUR.unpack(data)
    return Status(position, velocity, torque, 0.1 * tenths)


def value(counts: int, top: float) -> float:
    """Value of a count over -top…top."""
    return value_of(counts, -top, top, P_TOP)


def fault_words(faults: int) -> str:
    """The maker's words for fault bits; an empty text for 0."""
    return ", ".join(name for bit, name in FAULTS.items() if faults & bit)
