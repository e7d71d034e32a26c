"""Dynamixel protocol 2.0: packets with stuffing and CRC, instructions, the control table of the X series.

Packet = FF FF FD 00, id, length (u16), instruction, parameters, CRC-16; numbers little end first. The CRC runs over
all that precedes it, polynomial 0x8005, start 0, not reflected. FF FF FD within instruction and parameters is
followed by one more FD. Sources: Robotis e-Manual, "DYNAMIXEL Protocol 2.0", "CRC", "XM430-W350" (control table).
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from struct import Struct
from typing import Final, NamedTuple

HEADER: Final = b"\xff\xff\xfd\x00"
BROADCAST: Final = 0xFE
MOST_NODE: Final = 0xFC
_LONGEST: Final = 1024
_HEAD: Final = 7
_U16: Final = Struct("<H")
_STATUS: Final = 0x55


class Instruction(IntEnum):
    """Instructions that are sent."""

    READ = 0x02
    WRITE = 0x03
    REBOOT = 0x08
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    BULK_WRITE = 0x93


class Item(NamedTuple):
    """An item of the control table."""

    address: int
    size: int


OPERATING_MODE: Final = Item(11, 1)
CURRENT_LIMIT: Final = Item(38, 2)
VELOCITY_LIMIT: Final = Item(44, 4)
TORQUE_ENABLE: Final = Item(64, 1)
STATUS_RETURN_LEVEL: Final = Item(68, 1)
HARDWARE_ERROR: Final = Item(70, 1)
BUS_WATCHDOG: Final = Item(98, 1)
GOAL_CURRENT: Final = Item(102, 2)
GOAL_VELOCITY: Final = Item(104, 4)
GOAL_POSITION: Final = Item(116, 4)
PRESENT_CURRENT: Final = Item(126, 2)
PRESENT_VELOCITY: Final = Item(128, 4)
PRESENT_POSITION: Final = Item(132, 4)
PRESENT_VOLTAGE: Final = Item(144, 2)
PRESENT_TEMPERATURE: Final = Item(146, 1)
INDIRECT_ADDRESS: Final = 168
INDIRECT_DATA: Final = 224

CURRENT_MODE, VELOCITY_MODE, EXTENDED_POSITION_MODE = 0, 1, 4
COUNTS_PER_TURN: Final = 4096
TURNS_PER_S: Final = 0.229 / 60
"""Velocity of one count."""
VOLT: Final = 0.1
WATCHDOG_S: Final = 0.02
WATCHDOG_ERROR: Final = 0xFF
POSITION_TOP: Final = 1_048_575
ANSWER_READS: Final = 1
"""Status return level: reads are answered, writes are not."""

GATHERED: Final = (
    STATUS_RETURN_LEVEL, TORQUE_ENABLE, HARDWARE_ERROR, BUS_WATCHDOG,
    PRESENT_CURRENT, PRESENT_VELOCITY, PRESENT_POSITION, PRESENT_VOLTAGE, PRESENT_TEMPERATURE,
)  # fmt: skip
"""What indirect addresses put side by side, so that one read tells everything: of the RAM (64 to 661), since they take
no others. The status return level is first since after a restart the indirect data are 0 instead."""
TOLD: Final = Struct("<BBBBhiiHB")

HARDWARE_ERRORS: Final[dict[int, str]] = {
    1 << 0: "input voltage",
    1 << 2: "overheating",
    1 << 3: "motor encoder",
    1 << 4: "electrical shock",
    1 << 5: "overload",
}
"""Bits of the hardware error status."""


def _crc_table() -> tuple[int, ...]:
    rows = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ (0x8005 if crc & 0x8000 else 0)
        rows.append(crc & 0xFFFF)
    return tuple(rows)


_CRC: Final = _crc_table()


def crc16(data: bytes) -> int:
    """CRC-16 (0x8005) of `data`; of a whole packet with its CRC the other end first it is 0."""
    crc = 0
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _CRC[crc >> 8 ^ byte]
    return crc


def pack(node: int, body: bytes) -> bytes:
    """The packet of instruction and parameters."""
    stuffed = body.replace(HEADER[:3], HEADER[:3] + b"\xfd")
    packet = HEADER + bytes((node,)) + _U16.pack(len(stuffed) + 2) + stuffed
    return packet + _U16.pack(crc16(packet))


def read(item: Item) -> bytes:
    """Ask for an item."""
    return bytes((Instruction.READ,)) + _U16.pack(item.address) + _U16.pack(item.size)


def write(item: Item, value: int) -> bytes:
    """Set an item."""
    return write_bytes(item.address, value.to_bytes(item.size, "little", signed=value < 0))


def write_bytes(address: int, data: bytes) -> bytes:
    """Set what lies from an address on."""
    return bytes((Instruction.WRITE,)) + _U16.pack(address) + data


def sync_read(address: int, size: int, nodes: list[int]) -> bytes:
    """Ask several drives for the same stretch of their tables; they answer in this order."""
    return bytes((Instruction.SYNC_READ,)) + _U16.pack(address) + _U16.pack(size) + bytes(nodes)


def write_goals(goals: dict[int, tuple[Item, bytes]]) -> bytes:
    """Set an item of several drives at once: sync write, or bulk write where the items differ."""
    items = {item for item, _ in goals.values()}
    if len(items) == 1:
        item = items.pop()
        head = bytes((Instruction.SYNC_WRITE,)) + _U16.pack(item.address) + _U16.pack(item.size)
        return head + b"".join(bytes((node,)) + data for node, (_, data) in goals.items())
    return bytes((Instruction.BULK_WRITE,)) + b"".join(
        bytes((node,)) + _U16.pack(item.address) + _U16.pack(item.size) + data
        for node, (item, data) in goals.items()
    )


def gathering() -> bytes:
    """What the indirect addresses are set to: every byte of `GATHERED`, in order."""
    addresses = (item.address + k for item in GATHERED for k in range(item.size))
    return b"".join(_U16.pack(address) for address in addresses)


def error_words(bits: int) -> str:
    """Words for a hardware error status."""
    return ", ".join(name for bit, name in HARDWARE_ERRORS.items() if bits & bit) or f"bits 0x{bits:02X}"


class StatusReader:
    """Cuts a byte stream into status packets: `sink(id, error and parameters)` for each whole one.

    `invalid` counts packets whose CRC or length is wrong and pieces between packets; instructions, which some
    adapters echo, are left out.
    """

    __slots__ = ("_rest", "flags", "invalid", "overflows")

    def __init__(self) -> None:
        self._rest = b""
        self.flags = -1
        self.invalid = 0
        self.overflows = 0

    def question(self) -> bytes:
        """A serial line is asked nothing."""
        return b""

    def feed(self, chunk: bytes, sink: Callable[[int, bytes], None]) -> int:
        """Take bytes; return how many packets they completed."""
        data, found, at = self._rest + chunk, 0, 0
        while True:
            start = data.find(HEADER, at)
            if start < 0:
                at = max(at, len(data) - len(HEADER) + 1)
                break
            self.invalid += start > at
            at = start
            if len(data) < at + _HEAD:
                break
            length = _U16.unpack_from(data, at + 5)[0]
            end = at + _HEAD + length
            if not 3 <= length <= _LONGEST:
                self.invalid += 1
                at += 1
                continue
            if len(data) < end:
                break
            if crc16(data[at : end - 2]) != _U16.unpack_from(data, end - 2)[0]:
                self.invalid += 1
                at += 1  # the length may be what was damaged
                continue
            body = data[at + _HEAD : end - 2].replace(HEADER[:3] + b"\xfd", HEADER[:3])
            if body[0] == _STATUS:
                sink(data[at + 4], body[1:])
                found += 1
            at = end
        self._rest = data[at:]
        return found
