"""Dynamixel protocol 2.0: the packets that the maker's manual prints, and the maker's own SDK."""

from __future__ import annotations

from typing import Any

import pytest
from dynamixel_status import status
from hypothesis import given, settings
from hypothesis import strategies as st

from cablecomp.links import dynamixel as ours


# e-Manual, "DYNAMIXEL Protocol 2.0": the examples of each instruction, CRC included
@pytest.mark.parametrize(
    ("node", "body", "packet"),
    [
        (1, b"\x01", "fffffd00 01 0300 01 194e"),
        (1, ours.read(ours.Item(132, 4)), "fffffd00 01 0700 02 84000400 1d15"),
        (1, ours.write(ours.GOAL_POSITION, 512), "fffffd00 01 0900 03 740000020000 ca89"),
        (1, b"\x08", "fffffd00 01 0300 08 2f4e"),
        (0xFE, ours.sync_read(132, 4, [1, 2]), "fffffd00 fe 0900 82 840004000102 cefa"),
        (
            0xFE,
            ours.write_goals(
                {n: (ours.GOAL_POSITION, v.to_bytes(4, "little")) for n, v in ((1, 150), (2, 170))}
            ),
            "fffffd00 fe 1100 83 74000400 0196000000 02aa000000 8287",
        ),
    ],
)
def test_instructions_of_the_manual(node: int, body: bytes, packet: str) -> None:
    assert ours.pack(node, body) == bytes.fromhex(packet)


@pytest.mark.parametrize(
    ("packet", "node", "data"),
    [
        ("fffffd00 01 0700 55 00 060426 655d", 1, "00060426"),
        ("fffffd00 02 0700 55 00 060426 6f6d", 2, "00060426"),
        ("fffffd00 01 0800 55 00 a6000000 8cc0", 1, "00a6000000"),
        ("fffffd00 02 0500 55 00 24 8ba9", 2, "0024"),
        ("fffffd00 01 0400 55 00 a10c", 1, "00"),
    ],
)
def test_status_packets_of_the_manual(packet: str, node: int, data: str) -> None:
    found: list[tuple[int, bytes]] = []
    assert ours.StatusReader().feed(bytes.fromhex(packet), lambda i, d: found.append((i, d))) == 1
    assert found == [(node, bytes.fromhex(data))]


@settings(max_examples=25, deadline=None)
@given(st.lists(st.sampled_from([0xFF, 0xFD, 0x00, 0x12]), max_size=40))
def test_stuffing_and_crc_are_the_sdks(data: list[int]) -> None:
    """By its parts: the SDK's `txPacket` leaves out what its own `addStuffing` returns."""
    sdk = pytest.importorskip("dynamixel_sdk", reason="peer not installed: pip install 'cablecomp[peers]'")
    handler, size = sdk.Protocol2PacketHandler(), len(data) + 3
    packet = handler.addStuffing([0xFF, 0xFF, 0xFD, 0, 1, size & 0xFF, size >> 8, 0x03, *data, 0, 0])
    crc = handler.updateCRC(0, packet, len(packet) - 2)
    assert bytes(packet[:-2]) + crc.to_bytes(2, "little") == ours.pack(1, bytes([0x03, *data]))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 252), st.binary(max_size=30)), max_size=6), st.data())
def test_packets_come_whole_however_a_line_is_cut(packets: list[tuple[int, bytes]], data: Any) -> None:
    stream = b"".join(status(node, 0, body) for node, body in packets)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=5)))
    reader, found = ours.StatusReader(), []
    for begin, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        reader.feed(stream[begin:end], lambda i, d: found.append((i, d[1:])))
    assert (found, reader.invalid) == (packets, 0)


@settings(max_examples=25, deadline=None)
@given(st.binary(max_size=40))
def test_a_whole_packet_is_found_behind_noise(noise: bytes) -> None:
    reader, found = ours.StatusReader(), []
    packet = status(1, 0, b"\x05")
    for _ in range(60):  # noise may look like the head of the longest packet
        reader.feed(noise + packet, lambda i, d: found.append((i, d)))
        noise = b""
    assert found
    assert set(found) == {(1, b"\x00\x05")}


def test_no_flipped_bit_delivers_a_packet() -> None:
    packet = status(1, 0, bytes(range(18)))
    for bit in range(8 * len(packet)):
        damaged = bytearray(packet)
        damaged[bit // 8] ^= 1 << bit % 8
        assert ours.StatusReader().feed(bytes(damaged), lambda i, d: None) == 0
