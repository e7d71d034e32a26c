"""Registers of a Damiao drive: asked for on identifier 0x7FF, answered on that of its states.

Request: drive number (u16, little end first), 0x33 read | 0x55 write | 0xAA save | 0xCC report state, register,
four bytes of value (float32 or uint32, little end first). A reply repeats number, kind and register. Sources:
DM-J4310-2EC manual V1.0 (register table), the maker's DM_CAN.
"""

from __future__ import annotations

from struct import Struct
from typing import Final, NamedTuple

from cablecomp.links.records import Frame

REGISTERS: Final = 0x7FF
READ, WRITE, SAVE, REPORT = 0x33, 0x55, 0xAA, 0xCC
CTRL_MODE, PMAX, VMAX, TMAX = 10, 21, 22, 23
MIT, POSITION, VELOCITY = 1, 2, 3
"""Values of CTRL_MODE."""
LAST_REGISTER: Final = 81
_HEAD: Final = Struct("<HBB")
_UINT: Final = Struct("<HBBI")
_FLOAT: Final = Struct("<HBBf")


class Register(NamedTuple):
    """A register as a drive told it, its value read as float32."""

    number: int
    value: float


def read(node: int, register: int) -> Frame:
    """Ask for a register."""
    return Frame(REGISTERS, _UINT.pack(node, READ, register, 0))


def write_uint(node: int, register: int, value: int) -> Frame:
    """Set a register of whole numbers, until the next power cycle."""
    return Frame(REGISTERS, _UINT.pack(node, WRITE, register, value))


def report(node: int) -> Frame:
    """Ask for the drive's state, whatever it is doing."""
    return Frame(REGISTERS, _UINT.pack(node, REPORT, 0, 0))


def is_reply(data: bytes) -> bool:
    """Whether eight bytes answer a register request (anybody's) and are no state.

    Read as a state they would stand at the very end of the position's range and turn at more than a third of
    the velocity's.
    """
    node, kind, register = _HEAD.unpack_from(data)
    return node <= 0x7FF and kind in (READ, WRITE, SAVE) and register <= LAST_REGISTER


def parse(data: bytes) -> Register:
    """What a reply tells of a float register."""
    _, _, number, value = _FLOAT.unpack(data)
    return Register(number, value)


def node_of(data: bytes) -> int:
    """Whose reply it is."""
    node: int = _HEAD.unpack_from(data)[0]
    return node
