"""Subframes of the moteus register protocol, device side: parsing what a host wrote and asks, and packing the
answer.

A subframe: 0x00 | kind << 2 | n writes, 0x10 | … reads n registers from a first one on, 0x20 | … answers; n = 0: the
count follows as a varuint; kind 0 int8, 1 int16, 2 int32, 3 float32; 0x30 refuses a write, 0x31 a read; 0x50 fills
up. As integers, values have the units of `SCALES`, the lowest integer stands for NaN. Source: mjbots, moteus "CAN
Protocol" and "Register Reference".
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import NamedTuple

NOP = 0x50
FLOAT = 3
LENGTHS: tuple[int, ...] = (*range(9), 12, 16, 20, 24, 32, 48, 64)
_CODES, _SIZES = "bhif", (1, 2, 4, 4)

# int8, int16, int32 per unit
POSITION = (0.01, 1e-4, 1e-5)
VELOCITY = (0.1, 2.5e-4, 1e-5)
TORQUE = (0.5, 0.01, 1e-3)
CURRENT = (1.0, 0.1, 1e-3)
VOLTAGE = (0.5, 0.1, 1e-3)
TEMPERATURE = (1.0, 0.1, 1e-3)
TIME = (0.01, 1e-3, 1e-6)
SHARE = (1 / 127, 1 / 32767, 1 / 2147483647)
WHOLE = (1.0, 1.0, 1.0)
Scale = tuple[float, float, float]


class BadFrame(ValueError):
    """The data end within a subframe, or begin none."""


class Write(NamedTuple):
    """A register that the host writes; `raw` as it came."""

    register: int
    kind: int
    raw: float


class Read(NamedTuple):
    """Registers that the host asks for, from `first` on."""

    first: int
    registers: int
    kind: int


def parse(data: bytes) -> Iterator[Write | Read]:
    """Subframes in order; raises BadFrame."""
    at = 0

    def number() -> int:
        nonlocal at
        value = shift = 0
        while True:
            if at >= len(data) or shift > 28:
                raise BadFrame
            byte = data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if not byte & 0x80:
                return value

    while at < len(data):
        head = data[at]
        at += 1
        if head == NOP:
            continue
        if head >= 0x20:
            raise BadFrame
        kind = head >> 2 & 3
        count = head & 3 or number()
        first = number()
        if head & 0x10:
            yield Read(first, count, kind)
            continue
        for k in range(count):
            if at + _SIZES[kind] > len(data):
                raise BadFrame
            (raw,) = struct.unpack_from("<" + _CODES[kind], data, at)
            at += _SIZES[kind]
            yield Write(first + k, kind, raw)


def decode(write: Write, scale: Scale) -> float:
    """The value that a write means; the lowest integer is NaN."""
    if write.kind == FLOAT:
        return write.raw
    bits = 8 * _SIZES[write.kind]
    return math.nan if write.raw == -(1 << bits - 1) else write.raw * scale[write.kind]


def answer(read: Read, values: list[tuple[float, Scale] | None]) -> bytes:
    """The subframes that answer a read: runs of known registers, an error for each unknown one."""
    out, run = b"", b""
    start = 0
    for k, value in enumerate([*values, None]):
        if value is not None:
            start = k if not run else start
            run += _encode(value[0], value[1], read.kind)
            continue
        if run:
            count = len(run) // _SIZES[read.kind]
            head = 0x20 | read.kind << 2
            first = varuint(read.first + start)
            out += (bytes([head | count]) if count < 4 else bytes([head]) + varuint(count)) + first + run
            run = b""
        if k < len(values):
            out += b"\x31" + varuint(read.first + k) + b"\x01"
    return out


def _encode(value: float, scale: Scale, kind: int) -> bytes:
    if kind == FLOAT:
        return struct.pack("<f", value)
    top: int = (1 << 8 * _SIZES[kind] - 1) - 1
    n = -top - 1 if math.isnan(value) else min(max(round(value / scale[kind]), -top), top)
    return struct.pack("<" + _CODES[kind], n)


def varuint(value: int) -> bytes:
    """Seven bits a byte, lowest first, bit 7 set on all but the last."""
    out = b""
    while value > 0x7F:
        out += bytes([value & 0x7F | 0x80])
        value >>= 7
    return out + bytes([value])


def filled(data: bytes) -> bytes:
    """Data with as many NOPs as an FD frame needs; raises BadFrame beyond 64 bytes."""
    for length in LENGTHS:
        if len(data) <= length:
            return data + bytes([NOP]) * (length - len(data))
    raise BadFrame
