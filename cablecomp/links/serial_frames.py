"""Records on a serial line: COBS( identifier u32 little-endian, length u8, data, CRC-16 big-endian ), closed
by one zero byte.

Identifiers and data are those of the CAN bus; bit 29 of the identifier marks an FD frame of up to 64 bytes.
COBS: Cheshire & Baker, "Consistent Overhead Byte Stuffing",
IEEE/ACM Trans. Networking 7(2), 1999: no zero inside a record, one byte more per 254. CRC-16/CCITT-FALSE:
polynomial 0x1021, start 0xFFFF, not reflected, check value 0x29B1 for "123456789".
"""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Callable
from struct import Struct

from cablecomp.errors import InputError
from cablecomp.links.records import FD, FD_LENGTHS, SWITCH

_HEAD = Struct("<IB")
_FD_BIT = 0x2000_0000
MAX_RECORD = 5 + 64 + 2
MAX_ENCODED = MAX_RECORD + 1
Sink = Callable[[int, bytes], None]


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE of `data`."""
    return crc_hqx(data, 0xFFFF)


def cobs_encode(data: bytes) -> bytes:
    """COBS code of `data`, without the closing zero."""
    out = bytearray()
    blocks = data.split(b"\x00")
    for i, block in enumerate(blocks):
        last = i == len(blocks) - 1
        while len(block) > 253:
            out.append(0xFF)
            out += block[:254]
            block = block[254:]
            if not block and last:
                return bytes(out)
        out.append(len(block) + 1)
        out += block
    return bytes(out)


def cobs_decode(code: bytes) -> bytes | None:
    """The data of a COBS code (without its closing zero), None if it is not one: empty, a zero inside, or cut
    short."""
    end = len(code)
    if end == 0 or 0 in code:
        return None
    out = bytearray()
    at = 0
    while at < end:
        n = code[at]
        stop = at + n
        if stop > end:
            return None
        out += code[at + 1 : stop]
        if n != 0xFF and stop < end:
            out.append(0)
        at = stop
    return bytes(out)


def pack_record(identifier: int, data: bytes) -> bytes:
    """One record with its closing zero; raises InputError for more than 8 data bytes, with FD for a length that
    an FD frame cannot have."""
    if identifier & FD:
        if len(data) not in FD_LENGTHS:
            raise InputError(
                f"serial record: {len(data)} data bytes; {FD_LENGTHS} are accepted in an FD frame"
            )
        identifier = identifier & ~(FD | SWITCH) | _FD_BIT
    elif len(data) > 8:
        raise InputError(f"serial record: {len(data)} data bytes; 0 to 8 are accepted")
    body = _HEAD.pack(identifier, len(data)) + data
    return cobs_encode(body + crc16(body).to_bytes(2, "big")) + b"\x00"


class RecordReader:
    """Cuts a byte stream into records: bytes in as they come, whole records out to `sink`; what does not
    check is counted.

    `invalid` counts pieces between two zero bytes that are no record (noise, a lost byte, a wrong CRC or
    length); empty pieces are not counted, so extra zeros may be used to flush a line.
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

    def feed(self, chunk: bytes, sink: Sink) -> int:
        """Take bytes; call `sink(identifier, data)` for every whole record; return how many there were."""
        pieces = (self._rest + chunk).split(b"\x00")
        self._rest = pieces.pop()
        if len(self._rest) > MAX_ENCODED:
            # No record is that long: keep a stub so that the piece is still found wanting at the next zero.
            self._rest = self._rest[: MAX_ENCODED + 1]
        found = 0
        for piece in pieces:
            if not piece:
                continue
            body = cobs_decode(piece) if len(piece) <= MAX_ENCODED else None
            # The CRC register of data followed by its own CRC ends at zero.
            if body is None or len(body) < 7 or crc16(body) or body[4] != len(body) - 7:
                self.invalid += 1
                continue
            identifier = int.from_bytes(body[:4], "little")
            if identifier & _FD_BIT:
                identifier ^= _FD_BIT | FD
            elif len(body) > 15:
                self.invalid += 1
                continue
            sink(identifier, body[5:-2])
            found += 1
        return found
