"""COBS, CRC and slcan of the simulated side against their documents."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.wire.frame import Frame
from firmware_sim.wire.serial_records import (
    RecordReader,
    cobs_decode,
    cobs_encode,
    crc16,
    decode_record,
    encode_record,
)
from firmware_sim.wire.slcan import SlcanAdapter

FRAMES = st.builds(
    Frame,
    st.integers(0, 0x7FF),
    st.binary(max_size=8),
    fd=st.just(False),
    switch=st.just(False),
)


def test_crc_check_value() -> None:
    # catalogue of parametrised CRC algorithms: CRC-16/CCITT-FALSE ("IBM-3740"), check = 0x29B1
    assert crc16(b"123456789") == 0x29B1
    assert crc16(b"") == 0xFFFF
    assert crc16(b"123456789\x29\xb1") == 0


def span(first: int, last: int) -> bytes:
    return bytes(range(first, last + 1))


# Cheshire and Baker, "Consistent Overhead Byte Stuffing" (section 3), and the worked table of the
# encyclopaedia article
# on it, without the closing zero.
COBS_EXAMPLES = [
    (b"", "01"),
    (b"\x00", "0101"),
    (b"\x00\x00", "010101"),
    (bytes.fromhex("00110000"), "0102110101"),
    (bytes.fromhex("11220033"), "0311220233"),
    (bytes.fromhex("11223344"), "0511223344"),
    (bytes.fromhex("11000000"), "0211010101"),
    (span(0x01, 0xFE), "FF" + span(0x01, 0xFE).hex()),
    (span(0x00, 0xFE), "01FF" + span(0x01, 0xFE).hex()),
    (span(0x01, 0xFF), "FF" + span(0x01, 0xFE).hex() + "02FF"),
    (span(0x02, 0xFF) + b"\x00", "FF" + span(0x02, 0xFF).hex() + "0101"),
    (span(0x03, 0xFF) + b"\x00\x01", "FE" + span(0x03, 0xFF).hex() + "0201"),
]


@pytest.mark.parametrize(("data", "code"), COBS_EXAMPLES)
def test_cobs_examples(data: bytes, code: str) -> None:
    assert cobs_encode(data) == bytes.fromhex(code)
    assert cobs_decode(bytes.fromhex(code)) == data


@given(st.binary(max_size=600))
def test_cobs_has_no_zero_and_one_byte_in_254(data: bytes) -> None:
    code = cobs_encode(data)
    assert 0 not in code
    assert len(code) <= len(data) + len(data) // 254 + 1
    assert cobs_decode(code) == data


def test_record_layout() -> None:
    # 0x601, two bytes: 01 06 00 00 | 02 | AA BB | CRC big-endian
    body = bytes.fromhex("01060000 02 AABB".replace(" ", ""))
    crc = crc16(body)
    assert encode_record(Frame(0x601, b"\xaa\xbb")) == cobs_encode(body + crc.to_bytes(2, "big")) + b"\x00"
    remote = encode_record(Frame(0x21, remote=True))
    assert cobs_decode(remote[:-1])[:4] == bytes.fromhex("21000040")


@given(st.lists(FRAMES, max_size=12), st.integers(1, 9))
def test_records_come_through_in_any_pieces(frames: list[Frame], piece: int) -> None:
    line = b"".join(encode_record(frame) for frame in frames)
    reader = RecordReader()
    heard = [frame for i in range(0, len(line), piece) for frame in reader.feed(line[i : i + piece])]
    assert heard == frames
    assert reader.bad_records == 0


@given(FRAMES, FRAMES, st.data())
def test_a_hit_record_is_lost_alone(first: Frame, second: Frame, data: st.DataObject) -> None:
    line = bytearray(encode_record(first))
    at = data.draw(st.integers(0, len(line) - 2))
    line[at] ^= data.draw(st.integers(1, 255))
    reader = RecordReader()
    heard = reader.feed(bytes(line) + encode_record(second))
    assert heard[-1] == second
    assert first not in heard[:-1]
    assert reader.bad_records >= 1


def test_noise_without_end_does_not_fill_memory() -> None:
    reader = RecordReader()
    for _ in range(1000):
        reader.feed(b"\x55" * 100)
    assert reader.feed(b"\x00" + encode_record(Frame(1, b"x"))) == [Frame(1, b"x")]
    assert decode_record(b"") is None


# Lawicel CANUSB manual: "t10021133[CR]" sends a standard frame 0x100 with two bytes 0x11 0x33;
# "T0000010021133[CR]" the
# same as an extended frame; CR answers, BEL refuses, z and Z acknowledge.
def test_slcan_commands_of_the_manual() -> None:
    adapter = SlcanAdapter()
    assert adapter.feed(b"t10021133\r") == ([], b"\x07")  # the channel is closed
    assert adapter.feed(b"S8\rO\r") == ([], b"\r\r")
    assert adapter.feed(b"S6\r").answers == b"\x07"  # only while closed
    assert adapter.feed(b"t100211") == ([], b"")
    assert adapter.feed(b"33\r") == ([Frame(0x100, b"\x11\x33")], b"z\r")
    assert adapter.feed(b"T0000010021133\r") == ([Frame(0x100, b"\x11\x33", extended=True)], b"Z\r")
    assert adapter.feed(b"r1000\r").frames == [Frame(0x100, remote=True)]
    assert adapter.feed(b"t1002113\rt800000\rhello\r") == ([], b"\x07\x07\x07")
    assert adapter.feed(b"V\rN\rF\r").answers == b"V1013\rNSIM1\rF00\r"
    assert adapter.encode(Frame(0x100, b"\x11\x33"), 0.0) == b"t10021133\r"
    assert adapter.encode(Frame(0x100, b"\x11\x33", extended=True), 0.0) == b"T0000010021133\r"
    adapter.feed(b"Z1\r")
    assert adapter.encode(Frame(0x21, remote=True), 61.5) == b"r021005DC\r"  # 1500 ms past the minute
    adapter.feed(b"C\r")
    assert adapter.encode(Frame(0x100), 0.0) == b""
    adapter.bus_off = True
    adapter.feed(b"O\r")
    assert adapter.feed(b"t10021133\r") == ([], b"\x07")
    assert adapter.feed(b"F\r").answers == b"F80\r"
