"""Messages described by a DBC, compiled to shifts: cantools reads the table, plain integers move the bits.

A signal of `length` bits sits at `start` counted from the least significant bit of the message taken as one
little-endian
number (Intel), or at `8 n - 1 - …` of it taken as one big-endian number (Motorola); value = raw scale +
offset.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from typing import Any, NamedTuple


class _Signal(NamedTuple):
    name: str
    shift: int
    length: int
    scale: float
    offset: float
    signed: bool
    big: bool
    real: bool


class PackedMessage:
    """Encoder and decoder of one message of a table; signals not given are sent as raw 0."""

    def __init__(self, message: Any) -> None:
        self.name: str = message.name
        self.identifier: int = message.frame_id
        self.extended: bool = bool(message.is_extended_frame)
        self.length: int = message.length
        self.signals = tuple(_compile(s, message.length) for s in message.signals)
        self._by_name = {s.name: s for s in self.signals}

    def encode(self, values: Mapping[str, float]) -> bytes:
        """Bytes of the message; values outside of a signal's range saturate, NaN is the lowest raw value."""
        little = big = 0
        for name, value in values.items():
            s = self._by_name[name]
            raw = _raw(s, value)
            if s.big:
                big |= raw << s.shift
            else:
                little |= raw << s.shift
        return (int.from_bytes(big.to_bytes(self.length, "big"), "little") | little).to_bytes(
            self.length, "little"
        )

    def decode(self, data: bytes) -> dict[str, float]:
        """Physical value of every signal."""
        little, big = int.from_bytes(data, "little"), int.from_bytes(data, "big")
        return {
            s.name: _value(s, (big if s.big else little) >> s.shift & (1 << s.length) - 1)
            for s in self.signals
        }


def _compile(signal: Any, length: int) -> _Signal:
    big = signal.byte_order == "big_endian"
    if big:
        # A Motorola start bit names the most significant bit: byte = start // 8, bit within it = start % 8.
        top = 8 * (length - 1 - signal.start // 8) + signal.start % 8
        shift = top - signal.length + 1
    else:
        shift = signal.start
    conversion = signal.conversion
    return _Signal(
        signal.name,
        shift,
        signal.length,
        float(conversion.scale),
        float(conversion.offset),
        bool(signal.is_signed),
        big,
        bool(conversion.is_float),
    )


def _raw(s: _Signal, value: float) -> int:
    mask = (1 << s.length) - 1
    if s.real:
        kind = "<f" if s.length == 32 else "<d"
        return int.from_bytes(struct.pack(kind, (value - s.offset) / s.scale), "little")
    low, high = (-(mask >> 1) - 1, mask >> 1) if s.signed else (0, mask)
    if math.isnan(value):
        return low & mask
    return min(max(round((value - s.offset) / s.scale), low), high) & mask


def _value(s: _Signal, raw: int) -> float:
    if s.real:
        kind, size = ("<f", 4) if s.length == 32 else ("<d", 8)
        return float(struct.unpack(kind, raw.to_bytes(size, "little"))[0]) * s.scale + s.offset
    if s.signed and raw >> (s.length - 1):
        raw -= 1 << s.length
    return raw * s.scale + s.offset
