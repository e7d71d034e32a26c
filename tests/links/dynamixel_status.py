"""A device's answer in Dynamixel protocol 2.0, for the tests that speak for it."""

from __future__ import annotations

from cablecomp.links import dynamixel as ours


def status(node: int, error: int, data: bytes) -> bytes:
    return ours.pack(node, bytes([0x55, error]) + data)
