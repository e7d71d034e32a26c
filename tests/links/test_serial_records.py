"""COBS and CRC against published examples; records on a noisy line."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablecomp.errors import InputError
from cablecomp.links.serial_frames import RecordReader, cobs_decode, cobs_encode, crc16, pack_record

IDENTIFIERS = st.integers(0, 2**32 - 1).filter(lambda n: not n & 0x2000_0000)  # bit 29 marks an FD frame
RUN = bytes(range(1, 255))
PUBLISHED = [
    # Cheshire & Baker 1999, section III: the first bytes of an IP packet
    ("45 00 00 2C 4C 79 00 00 40 06 4F 37", "02 45 01 04 2C 4C 79 01 05 40 06 4F 37"),
    # the customary list of examples
    ("00", "01 01"),
    ("00 00", "01 01 01"),
    ("00 11 00", "01 02 11 01"),
    ("11 22 00 33", "03 11 22 02 33"),
    ("11 22 33 44", "05 11 22 33 44"),
    ("11 00 00 00", "02 11 01 01 01"),
    (RUN.hex(), "FF" + RUN.hex()),
    ("00" + RUN.hex(), "01 FF" + RUN.hex()),
    (RUN.hex() + "FF", "FF" + RUN.hex() + "02 FF"),
    (RUN[1:].hex() + "FF 00", "FF" + RUN[1:].hex() + "FF 01 01"),
    (RUN[2:].hex() + "FF 00 01", "FE" + RUN[2:].hex() + "FF 02 01"),
]


def collect(reader: RecordReader, data: bytes) -> list[tuple[int, bytes]]:
    out: list[tuple[int, bytes]] = []
    reader.feed(data, lambda identifier, payload: out.append((identifier, payload)))
    return out


def test_crc_check_value() -> None:
    assert crc16(b"123456789") == 0x29B1
    assert crc16(b"") == 0xFFFF


@pytest.mark.parametrize(("plain", "code"), PUBLISHED)
def test_published_codes(plain: str, code: str) -> None:
    assert cobs_encode(bytes.fromhex(plain)) == bytes.fromhex(code)
    assert cobs_decode(bytes.fromhex(code)) == bytes.fromhex(plain)


@given(st.binary(max_size=600))
def test_codes_have_no_zero_a_bounded_length_and_an_inverse(data: bytes) -> None:
    code = cobs_encode(data)
    assert 0 not in code
    assert len(data) + 1 <= len(code) <= len(data) + 1 + len(data) // 254
    assert cobs_decode(code) == data


@pytest.mark.parametrize("code", ["", "00", "05 11 22", "02 00", "03 11"])
def test_what_is_no_code_is_refused(code: str) -> None:
    assert cobs_decode(bytes.fromhex(code)) is None


def test_a_record_worked_out_by_hand() -> None:
    # 0x601, two bytes AA 00: body 01 06 00 00 02 AA 00, CRC of it big end first, then COBS by hand
    body = bytes.fromhex("01 06 00 00 02 AA 00")
    high, low = divmod(crc16(body), 256)
    assert high
    assert low
    by_hand = bytes([0x03, 0x01, 0x06, 0x01, 0x03, 0x02, 0xAA, 0x03, high, low, 0x00])
    assert pack_record(0x601, b"\xaa\x00") == by_hand
    assert collect(RecordReader(), by_hand) == [(0x601, b"\xaa\x00")]


@given(
    st.lists(st.tuples(IDENTIFIERS, st.binary(max_size=8)), max_size=8),
    st.randoms(use_true_random=False),
)
def test_records_come_whole_however_the_stream_is_cut(
    frames: list[tuple[int, bytes]], rng: random.Random
) -> None:
    stream = b"".join(pack_record(*f) for f in frames)
    reader, out = RecordReader(), []
    while stream:
        n = rng.randint(1, 9)
        out += collect(reader, stream[:n])
        stream = stream[n:]
    assert out == frames
    assert reader.invalid == 0


def test_no_single_flipped_bit_delivers_a_wrong_record() -> None:
    frame = (0x12345678, bytes.fromhex("00 FF 10 00 7F 80 01 02"))
    good = pack_record(*frame)
    for bit in range(8 * len(good)):
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        reader = RecordReader()
        out = collect(reader, bytes(bad) + b"\x00" + good)
        # A flipped closing zero leaves the damaged piece to the next zero; the good record comes after it.
        assert out in ([frame], [])
        assert reader.invalid >= 1 or out == [frame]


def test_noise_is_counted_and_the_next_record_is_found() -> None:
    rng = random.Random(7)
    reader = RecordReader()
    good, found = 0, []
    for k in range(300):
        noise = bytes(rng.randrange(1, 256) for _ in range(rng.randrange(0, 60)))
        found += collect(reader, noise + b"\x00")
        found += collect(reader, pack_record(k, bytes([k & 0xFF])))
        good += 1
    assert found == [(k, bytes([k & 0xFF])) for k in range(good)]
    assert reader.invalid > 250


def test_an_endless_piece_does_not_grow() -> None:
    reader = RecordReader()
    for _ in range(1000):
        assert collect(reader, b"\x55" * 1000) == []
    assert len(reader._rest) < 100
    assert collect(reader, b"\x00" + pack_record(5, b"")) == [(5, b"")]
    assert reader.invalid == 1


def test_too_long_data_are_refused() -> None:
    with pytest.raises(InputError, match="0 to 8 are accepted"):
        pack_record(1, bytes(9))
