"""What the tests of CAN ports and of serial lines share."""

from __future__ import annotations

import select

from cablecomp.links.records import EXTENDED, REMOTE

FRAMES = [(0x123, b"\x01\x02"), (0x1ABCDEF0 | EXTENDED, bytes(8)), (0x7F7 | REMOTE, b"")]


class Catch(list):
    def __call__(self, identifier: int, data: bytes) -> None:
        self.append((identifier, bytes(data)))


def settle(fd: int) -> None:
    """Wait until something can be read (a kernel buffer, not a clock)."""
    assert select.select([fd], [], [], 5.0)[0]
