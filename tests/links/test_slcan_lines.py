"""slcan text against the adapters' manuals."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablecomp.links.records import EXTENDED, REMOTE
from cablecomp.links.slcan_frames import LineReader, pack_line, parse_line

PUBLISHED = [
    # Lawicel CAN232/CANUSB manual; EasySYNC USB2-F-7x01 guide 4.1.10, 4.1.11; Titan USB-2CAN manual 8.3
    ("t10021133", 0x100, "11 33"),
    ("t34580123456789ABCDEF", 0x345, "01 23 45 67 89 AB CD EF"),
    ("t4560", 0x456, ""),
    ("T1234567880123456789ABCDEF", 0x12345678 | EXTENDED, "01 23 45 67 89 AB CD EF"),
    ("t00231199FF", 0x002, "11 99 FF"),
]


@pytest.mark.parametrize(("line", "identifier", "data"), PUBLISHED)
def test_published_lines(line: str, identifier: int, data: str) -> None:
    assert parse_line(line.encode()) == (identifier, bytes.fromhex(data))
    assert pack_line(identifier, bytes.fromhex(data)) == line.encode() + b"\r"


def test_time_stamp_and_remote() -> None:
    assert parse_line(b"t100211334D67") == (0x100, bytes.fromhex("11 33"))
    assert parse_line(b"r0023") == (0x002 | REMOTE, b"")


@pytest.mark.parametrize(
    "line",
    [
        *("t1002113", "t10021", "t1009112233445566778899", "tXYZ0", "q", "t100311334"),
        # no hexadecimal digits, though `int` reads numbers in them
        *(
            "t-12100",
            "t+12100",
            "t 12100",
            "t12 100",
            "t1_2100",
            "T-1234560",
            "r-120",
            "t0x1100",
            "t1000 1D6",
        ),
    ],
)
def test_damaged_lines(line: str) -> None:
    assert parse_line(line.encode()) is None


@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=6), st.integers(1, 7))
def test_frames_come_whole_however_the_stream_is_cut(frames: list[tuple[int, bytes]], n: int) -> None:
    stream = b"z\r".join(pack_line(*f) for f in frames)
    reader, out = LineReader(), []
    for i in range(0, len(stream), n):
        reader.feed(stream[i : i + n], lambda identifier, data: out.append((identifier, data)))
    assert out == frames
    assert reader.invalid == 0


def test_refusals_and_noise_are_counted() -> None:
    reader, out = LineReader(), []
    chunk = b"z\r\a\aV1013\rt1zz\rt0011AA\r"
    reader.feed(chunk, lambda identifier, data: out.append((identifier, data)))
    assert out == [(1, b"\xaa")]
    assert (reader.overflows, reader.invalid) == (2, 1)


def test_a_refusal_leads_to_one_question_and_its_answer() -> None:
    reader = LineReader()
    assert reader.question() == b""
    reader.feed(b"\a", lambda identifier, data: None)
    assert (reader.question(), reader.question()) == (b"F\r", b"")
    reader.feed(b"F80\r", lambda identifier, data: None)
    assert (reader.flags, reader.invalid) == (0x80, 0)
    for k, noise in enumerate((b"F8x\r", b"F-1\r", b"F 1\r")):
        reader.feed(noise, lambda identifier, data: None)
        assert (reader.flags, reader.invalid) == (0x80, 1 + k)
