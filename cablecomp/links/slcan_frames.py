"""CAN frames as text on a serial line (slcan): `t1233AABBCC`, `T` extended, `r`/`R` remote, closed by a
carriage return; CAN FD: `d`/`D`, with the quicker data rate `b`/`B`, the length as a code of one hexadecimal
digit.

Source: Lawicel CANUSB/CAN232 manual (ASCII commands t, T, r, R; `z`/`Z` or an empty line acknowledges, BEL
refuses); CANable 2.0's firmware and python-can (`d`, `D`, `b`, `B`).
"""

from __future__ import annotations

from collections.abc import Callable

from cablecomp.links.records import EXTENDED, FD, FD_LENGTHS, REMOTE, SWITCH

Sink = Callable[[int, bytes], None]
MAX_LINE = 144
_DIGITS = b"0123456789ABCDEFabcdef"
_FD_CODES = {length: f"{code:X}" for code, length in enumerate(FD_LENGTHS)}


def pack_line(identifier: int, data: bytes) -> bytes:
    """Text of one frame with its carriage return; flags choose the letter."""
    if identifier & FD:
        letter = "b" if identifier & SWITCH else "d"
        if identifier & EXTENDED:
            head = f"{letter.upper()}{identifier & 0x1FFF_FFFF:08X}"
        else:
            head = f"{letter}{identifier & 0x7FF:03X}"
        return f"{head}{_FD_CODES[len(data)]}{data.hex().upper()}\r".encode()
    remote = identifier & REMOTE
    if identifier & EXTENDED:
        head = f"{'R' if remote else 'T'}{identifier & 0x1FFF_FFFF:08X}{len(data)}"
    else:
        head = f"{'r' if remote else 't'}{identifier & 0x7FF:03X}{len(data)}"
    return (head if remote else head + data.hex().upper()).encode() + b"\r"


def parse_line(line: bytes) -> tuple[int, bytes] | None:
    """Identifier with flags and data of one line (without its end), None if it is not a frame."""
    kind = line[:1]
    fd = kind in (b"d", b"D", b"b", b"B")
    if kind in (b"t", b"r", b"d", b"b"):
        split, flags = 4, 0
    elif kind in (b"T", b"R", b"D", b"B"):
        split, flags = 9, EXTENDED
    else:
        return None
    if line[1:].strip(_DIGITS):  # what `int` would pass as well: a sign, blanks, underscores
        return None
    try:
        identifier = int(line[1:split], 16)
        code = line[split : split + 1]
        length = FD_LENGTHS[int(code, 16)] if fd else int(code)
        if kind in (b"r", b"R"):
            return (identifier | flags | REMOTE, b"") if length <= 8 else None
        data = bytes.fromhex(line[split + 1 : split + 1 + 2 * length].decode("ascii"))
    except ValueError:
        return None
    # A time stamp of four digits may follow the data; anything else means that bytes were lost.
    extra = len(line) - (split + 1 + 2 * length)
    whole = len(data) == length <= (64 if fd else 8) and extra in (0, 4)
    return (identifier | flags | (FD if fd else 0), data) if whole else None


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
            if line[:1] == b"F" and len(line) == 3 and not line[1:].strip(_DIGITS):
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
