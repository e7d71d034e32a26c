"""CANopen as far as a drive needs it: NMT, SYNC, heartbeats, emergencies, expedited SDO, and PDOs that are mapped
anew.

Identifiers are function + node number; numbers little end first. Sources: CiA 301 4.2.0, 7.2 (services), 7.3.3
(predefined connection set), 7.5.2 (objects 0x1016, 0x1017, 0x1400…0x1BFF).
"""

from __future__ import annotations

from enum import IntEnum
from struct import Struct
from typing import Final, NamedTuple

from cablecomp.links.records import Frame

NMT: Final = 0x000
SYNC: Final = 0x080
EMERGENCY: Final = 0x080
TPDO: Final = (0x180, 0x280, 0x380, 0x480)
RPDO: Final = 0x200
SDO_REPLY: Final = 0x580
SDO_REQUEST: Final = 0x600
HEARTBEAT: Final = 0x700
BOOT_UP, OPERATIONAL = 0x00, 0x05
"""States that a heartbeat tells."""
START, PRE_OPERATIONAL = 0x01, 0x80
"""Commands of NMT."""

_OFF: Final = 0x8000_0000
_NO_REMOTE: Final = 0x4000_0000
_EVERY_SYNC: Final = 1
_SDO: Final = Struct("<BHBI")
_WRITE: Final = {1: 0x2F, 2: 0x2B, 4: 0x23}
_WRITTEN: Final = 0x60
_ABORT: Final = 0x80
_READ: Final = 0x40
_SIZE_OF_READ: Final = {0x4F: 1, 0x4B: 2, 0x47: 3, 0x43: 4, 0x42: 4}
_EMERGENCY: Final = Struct("<HB5x")


class Object(NamedTuple):
    """An entry of the object dictionary, and its length in bytes."""

    number: int
    sub: int
    size: int


class Step(NamedTuple):
    """One transfer of a set-up: `value` is written, or read and compared if `check`; `may_lack`: a device without
    the object will do."""

    entry: Object
    value: int
    may_lack: bool = False
    check: bool = False


class SdoReply(NamedTuple):
    """What an SDO server answered: the object, the value read (0 for a write), the abort code (0 = done)."""

    number: int
    sub: int
    value: int
    abort: int


class Emergency(NamedTuple):
    """Error code (0 = all errors are gone) and error register."""

    code: int
    register: int


class Mapping(NamedTuple):
    """Objects that a PDO carries, in order; none = the PDO is off."""

    communication: int
    parameter: int
    identifier: int
    entries: tuple[Object, ...]


LACKING: Final = (0x0602_0000, 0x0609_0011)
"""Abort codes: no such object, no such sub-index."""
ABORTS: Final[dict[int, str]] = {
    0x0601_0000: "unsupported access",
    0x0601_0001: "write only",
    0x0601_0002: "read only",
    0x0602_0000: "no such object",
    0x0604_0041: "cannot be mapped",
    0x0604_0042: "too long for a PDO",
    0x0607_0010: "another data type",
    0x0609_0011: "no such sub-index",
    0x0609_0030: "value out of range",
    0x0800_0000: "general error",
    0x0800_0021: "local control",
    0x0800_0022: "not in this state",
}


def nmt(command: int, node: int) -> Frame:
    """An NMT command to one node."""
    return Frame(NMT, bytes((command, node)))


def sync() -> Frame:
    """SYNC without a counter."""
    return Frame(SYNC, b"")


def alive(host: int) -> Frame:
    """A heartbeat of this side."""
    return Frame(HEARTBEAT + host, bytes((OPERATIONAL,)))


def sdo(node: int, step: Step) -> Frame:
    """The request of one step."""
    number, sub, size = step.entry
    if step.check:
        return Frame(SDO_REQUEST + node, _SDO.pack(_READ, number, sub, 0))
    value = step.value & ((1 << 8 * size) - 1)
    return Frame(SDO_REQUEST + node, _SDO.pack(_WRITE[size], number, sub, value))


def parse_sdo(data: bytes) -> SdoReply | None:
    """An expedited reply; None for anything else."""
    if len(data) != 8:
        return None
    kind, number, sub, value = _SDO.unpack(data)
    if kind == _WRITTEN:
        return SdoReply(number, sub, 0, 0)
    if kind == _ABORT:
        return SdoReply(number, sub, 0, value)
    size = _SIZE_OF_READ.get(kind)
    return None if size is None else SdoReply(number, sub, value & ((1 << 8 * size) - 1), 0)


def parse_emergency(data: bytes) -> Emergency | None:
    """An emergency; None unless eight bytes."""
    return Emergency(*_EMERGENCY.unpack(data)) if len(data) == 8 else None


def map_pdo(mapping: Mapping) -> tuple[Step, ...]:
    """Steps that map a PDO anew and make it synchronous, in the order that CiA 301 asks for: off, mapping cleared,
    entries, their number, on."""
    remote = _NO_REMOTE if mapping.communication >= 0x1800 else 0
    number = remote | mapping.identifier
    turn_off = Step(Object(mapping.communication, 1, 4), _OFF | number, may_lack=not mapping.entries)
    if not mapping.entries:
        return (turn_off,)
    count = Object(mapping.parameter, 0, 1)
    return (
        turn_off,
        Step(Object(mapping.communication, 2, 1), _EVERY_SYNC),
        Step(count, 0),
        *(
            Step(Object(mapping.parameter, k, 4), e.number << 16 | e.sub << 8 | 8 * e.size)
            for k, e in enumerate(mapping.entries, 1)
        ),
        Step(count, len(mapping.entries)),
        Step(Object(mapping.communication, 1, 4), number),
    )


class Register(IntEnum):
    """Objects of the communication profile that a set-up writes."""

    CONSUMER_HEARTBEAT = 0x1016
    PRODUCER_HEARTBEAT = 0x1017
