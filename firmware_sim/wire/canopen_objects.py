"""The object dictionary of a simulated CANopen device and its SDO server: expedited transfers, abort codes.

Source: CiA 301 4.2.0, 7.2.4.3 (SDO), 7.5 (objects).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

TOO_LONG, UNSUPPORTED, READ_ONLY, NO_OBJECT, NO_SUB, WRONG_LENGTH, RANGE, STATE, UNKNOWN_COMMAND = (
    0x0604_0042, 0x0601_0000, 0x0601_0002, 0x0602_0000, 0x0609_0011, 0x0607_0010, 0x0609_0030, 0x0800_0022,
    0x0504_0001,
)  # fmt: skip


class Abort(Exception):
    """An SDO transfer is refused with this code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"0x{code:08X}")
        self.code = code


@dataclass
class Entry:
    """A number of `size` bytes: `value` as stored, or what `tell` says; `accept` may raise `Abort`."""

    size: int
    value: int = 0
    signed: bool = False
    writable: bool = True
    tell: Callable[[], int] | None = None
    accept: Callable[[int], None] | None = None

    @property
    def now(self) -> int:
        """Present value, within its size."""
        if self.tell is None:
            return self.value
        n = self.tell()
        low = -(1 << 8 * self.size - 1) if self.signed else 0
        return min(max(n, low), low + (1 << 8 * self.size) - 1)

    @property
    def data(self) -> bytes:
        """Present value as it lies in a PDO."""
        return self.now.to_bytes(self.size, "little", signed=self.signed)


Key = tuple[int, int]


class Objects:
    """Entries by index and sub-index."""

    def __init__(self) -> None:
        self.entries: dict[Key, Entry] = {}

    def find(self, key: Key) -> Entry:
        """The entry, or an abort that says what is missing."""
        found = self.entries.get(key)
        if found is None:
            raise Abort(NO_SUB if any(index == key[0] for index, _ in self.entries) else NO_OBJECT)
        return found

    def put(self, key: Key, data: bytes) -> None:
        """Write, from a PDO or an SDO."""
        entry = self.find(key)
        value = int.from_bytes(data, "little", signed=entry.signed)
        if entry.accept is not None:
            entry.accept(value)
        entry.value = value

    def serve(self, request: bytes) -> bytes:
        """The answer to an SDO request of eight bytes."""
        command, key = request[0], (int.from_bytes(request[1:3], "little"), request[3])
        head = request[1:4]
        try:
            if command == 0x40:
                entry = self.find(key)
                return bytes([0x43 | (4 - entry.size) << 2]) + head + entry.data.ljust(4, b"\0")
            if command & 0xE3 == 0x23 or command == 0x22:
                entry = self.find(key)
                size = 4 - (command >> 2 & 3) if command & 1 else entry.size
                if not entry.writable:
                    raise Abort(READ_ONLY)
                if size != entry.size:
                    raise Abort(WRONG_LENGTH)
                self.put(key, request[4 : 4 + size])
                return b"\x60" + head + bytes(4)
            raise Abort(UNKNOWN_COMMAND)
        except Abort as abort:
            return b"\x80" + head + abort.code.to_bytes(4, "little")
