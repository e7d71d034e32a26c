"""CAN frames as text on a serial line (slcan): `t1233AABBCC`, `T` extended, `r`/`R` remote, closed by a
carriage return.

Source: Lawicel CANUSB/CAN232 manual (ASCII commands t, T, r, R; `z`/`Z` or an empty line acknowledges, BEL
refuses).
"""

from __future__ import annotations

from collections.abc import Callable

from cablecomp.links.records import EXTENDED, REMOTE

Sink = Callable[[int, bytes], None]
MAX_LINE = 32


def pack_line(identifier: int, data: bytes) -> bytes:
    """Text of one frame with its carriage return; flags EXTENDED and REMOTE choose the letter."""
    remote = identifier & REMOTE
    if identifier & EXTENDED:
        head = f"{'R' if remote else 'T'}{identifier & 0x1FFF_FFFF:08X}{len(data)}"
    else:
        head = f"{'r' if remote else 't'}{identifier & 0x7FF:03X}{len(data)}"
    return (head if remote else head + data.hex().upper()).encode() + b"\r"


def parse_line(line: bytes) -> tuple[int, bytes] | None:
    """Identifier with flags and data of one line (without its end), None if it is not a frame."""
    kind = line[:1]
    if kind in (b"t", b"r"):
        split, flags = 4, 0
    elif kind in (b"T", b"R"):
        split, flags = 9, EXTENDED
    else:
        return None
    try:
        identifier = int(line[1:split], 16)
        length = int(line[split : split + 1])
        if kind in (b"r", b"R"):
            return (identifier | flags | REMOTE, b"") if length <= 8 else None
        data = bytes.fromhex(line[split + 1 : split + 1 + 2 * length].decode("ascii"))
    except ValueError:
        return None
    # A time stamp of four digits may follow the data; anything else means that bytes were lost.
    extra = len(line) - (split + 1 + 2 * length)
    return (identifier | flags, data) if len(data) == length <= 8 and extra in (0, 4) else None


class LineReader:
    """Cuts a byte stream into slcan lines; frames go to `sink`, acknowledgements are passed over, the rest is
    counted.

    `overflows` counts BEL answers (the adapter could not send, or did not understand), `invalid` lines that
    are no frame. `flags`: the adapter's last answer to `F` (bit 7 bus error, bit 5 error passive; -1 = no
    answer).
    """

    __slots__ = ("_asked", "_rest", "flags", "invalid", "overflows")

    def __init__(self) -> None:
        self._rest = b""
        self._asked = 0
        self.invalid = 0
        self.overflows = 0
        self.flags = -1

    def feed(self, chunk: bytes, sink: Sink) -> int:
        """Take bytes; call `sink(identifier, data)` for every frame; return how many there were."""
        if b"\a" in chunk:
            self.overflows += chunk.count(b"\a")
            chunk = chunk.replace(b"\a", b"\r")
        lines = (self._rest + chunk).split(b"\r")
        self._rest = lines.pop()[-2 * MAX_LINE :]
        found = 0
        for line in lines:
            frame = parse_line(line)
            if frame is not None:
                sink(*frame)
                found += 1
            elif line not in (b"", b"z", b"Z"):
                self._take_answer(line)
        return found

    def _take_answer(self, line: bytes) -> None:
        try:
            if line[:1] == b"F" and len(line) == 3:
                self.flags = int(line[1:], 16)
                return
        except ValueError:
            pass
        self.invalid += line[:1] not in b"VN"

    def question(self) -> bytes:
        """What to ask the adapter next: its flags, after it has refused something; else nothing."""
        if self.overflows == self._asked:
            return b""
        self._asked = self.overflows
        return b"F\r"
