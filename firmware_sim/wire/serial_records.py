"""The same messages on a serial line: COBS-framed records with a CRC.

Record = identifier (u32, little-endian; bit 31 = 29-bit identifier, bit 30 = remote request, bit 29 = FD
frame) | length of the data (u8, 0…8, FD 0…64) |
data | CRC-16/CCITT-FALSE of all that precedes (big-endian, so that the CRC over a whole record is 0). On
the line: COBS of
the record, then one zero byte. Identifiers and data are those of the CAN bus.
COBS: Cheshire and Baker, "Consistent Overhead Byte Stuffing", IEEE/ACM Trans. Networking 7(2), 1999.
CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, not reflected; of "123456789" it is 0x29B1.
"""

from __future__ import annotations

import struct

from firmware_sim.wire.frame import Frame

EXTENDED, REMOTE, FD = 1 << 31, 1 << 30, 1 << 29
LONGEST = 80  # bytes between two zeros beyond which a piece is noise


def _table() -> tuple[int, ...]:
    rows = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
        rows.append(crc)
    return tuple(rows)


_CRC = _table()


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _CRC[crc >> 8 ^ byte]
    return crc


def cobs_encode(data: bytes) -> bytes:
    """Code without a zero byte, at most one byte longer per 254."""
    out = bytearray(b"\x00")
    code_at, open_block = 0, True
    for i, byte in enumerate(data):
        if byte:
            out.append(byte)
        if byte == 0 or len(out) - code_at == 255:
            out[code_at] = len(out) - code_at
            code_at, open_block = len(out), byte == 0 or i + 1 < len(data)
            if open_block:
                out.append(0)
    if open_block:
        out[code_at] = len(out) - code_at
    return bytes(out)


def cobs_decode(code: bytes) -> bytes | None:
    """Inverse of `cobs_encode`; None where the code is broken."""
    out = bytearray()
    i = 0
    while i < len(code):
        length = code[i]
        if length == 0 or i + length > len(code):
            return None
        block = code[i + 1 : i + length]
        if 0 in block:
            return None
        out += block
        i += length
        if length < 255 and i < len(code):
            out.append(0)
    return bytes(out)


def encode_record(frame: Frame) -> bytes:
    """The bytes of one frame on the line, closing zero included."""
    identifier = frame.identifier | (EXTENDED if frame.extended else 0) | (REMOTE if frame.remote else 0)
    identifier |= FD if frame.fd else 0
    body = struct.pack("<IB", identifier, len(frame.data)) + frame.data
    return cobs_encode(body + struct.pack(">H", crc16(body))) + b"\x00"


def decode_record(code: bytes) -> Frame | None:
    """One frame from what lay between two zeros; None if it is not whole."""
    body = cobs_decode(code)
    if body is None or len(body) < 7 or crc16(body) != 0 or len(body) != 7 + body[4]:
        return None
    (identifier,) = struct.unpack_from("<I", body)
    remote, extended, fd = bool(identifier & REMOTE), bool(identifier & EXTENDED), bool(identifier & FD)
    if body[4] > (64 if fd else 8):
        return None
    return Frame(identifier & 0x1FFF_FFFF, body[5:-2], remote, extended, fd)


class RecordReader:
    """Cuts a byte stream into frames; counts what it had to throw away."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.bad_records = 0

    def feed(self, data: bytes) -> list[Frame]:
        """Frames that are complete with these bytes."""
        frames = []
        self._buffer += data
        while (end := self._buffer.find(0)) >= 0:
            code = bytes(self._buffer[:end])
            del self._buffer[: end + 1]
            if not code:
                continue
            frame = decode_record(code)
            if frame is None:
                self.bad_records += 1
            else:
                frames.append(frame)
        if len(self._buffer) > LONGEST:
            self._buffer.clear()
            self.bad_records += 1
        return frames

    def reset(self) -> None:
        """Forget a half-received record."""
        self._buffer.clear()
