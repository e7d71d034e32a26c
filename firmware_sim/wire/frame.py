"""One frame on a wire, and the number-to-bits helpers that the codecs share."""

from __future__ import annotations

import math
from typing import NamedTuple

EXTENDED = 0x8000_0000
"""Marks a 29-bit identifier where identifiers of both lengths stand side by side."""
FD = 0x2_0000_0000
"""Marks an FD frame in the same place."""
LAST_BYTE = 0x1_0000_0000
"""`LAST_BYTE | n`: every 29-bit identifier that ends in the byte n."""


class Frame(NamedTuple):
    """A CAN frame or a serial record: identifier, 0 to 8 bytes, whether it asks (remote) instead of telling;
    FD frames have up to 64 bytes, sent at the data bit rate with `switch`."""

    identifier: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False
    fd: bool = False
    switch: bool = False

    @property
    def key(self) -> int:
        """Identifier, marked where it has 29 bits and where the frame is an FD one."""
        return self.identifier | (EXTENDED if self.extended else 0) | (FD if self.fd else 0)


def to_raw(value: float, scale: float, bits: int) -> int:
    """Signed integer nearest to value/scale; the lowest one is kept for "no value" (NaN), the others
    saturate."""
    top = (1 << (bits - 1)) - 1
    if math.isnan(value):
        return -top - 1
    return min(
        max(round(value / scale) if math.isfinite(value) else int(math.copysign(top, value)), -top), top
    )
