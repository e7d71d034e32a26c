"""MIT frames against the makers' tables and published bytes; never against the project's own encoder
alone."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mit_words import unpack_command, unpack_reply

from cablecomp.errors import InputError
from cablecomp.links import mit
from cablecomp.links.mit import MitRange, pack_command
from cablecomp.links.mit_profiles import PROFILES, error_text, profile, status_of
from cablecomp.links.records import (
    CLIP_DAMPING,
    CLIP_POSITION,
    CLIP_STIFFNESS,
    CLIP_TORQUE,
    CLIP_VELOCITY,
    DriveState,
)

AK80_9 = PROFILES["AK80-9"].scale
# Full scales for which a count is the number itself.
COUNTS = MitRange(65535 / 2, 4095 / 2, 4095 / 2, 4095.0, 4095.0)


def float32(x: float) -> float:
    return struct.unpack("<f", struct.pack("<f", x))[0]


def truncated(x: float, low: float, high: float, bits: int) -> int:
    """The drives' own routine (mini-cheetah firmware): cut off, do not round."""
    x = min(max(x, low), high)
    return int((x - low) * ((1 << bits) - 1) / (high - low))


def test_special_frames_are_the_manuals() -> None:
    # CubeMars AK manual V1.0.8 p. 48
    assert list(mit.ENTER) == [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFC]
    assert list(mit.EXIT) == [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFD]
    assert list(mit.ZERO) == [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFE]


@pytest.mark.parametrize("model", PROFILES)
def test_the_zero_command_is_the_one_that_makers_publish(model: str) -> None:
    packed = pack_command(PROFILES[model].scale, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert packed.data == bytes.fromhex("7F FF 7F F0 00 00 07 FF")
    assert packed.clipped == 0


def test_each_field_lies_where_the_manual_puts_it() -> None:
    # p. 49: position 16, velocity 12, kp 12, kd 12, torque 12 bits; by hand for counts 1234 567 89A BCD EF0
    low = COUNTS.position_rad, COUNTS.velocity_rad_s, COUNTS.torque_Nm
    packed = pack_command(COUNTS, 0x1234 - low[0], 0x567 - low[1], 0x89A, 0xBCD, 0xEF0 - low[2])
    assert packed.data == bytes.fromhex("12 34 56 78 9A BC DE F0")


def test_a_published_command_differs_by_rounding_alone() -> None:
    # -0.6 rad, kp 100, kd 2 in +-12.5 rad: published as 79 DA 7F F3 33 66 67 FF (31194.66 cut off to 31194)
    packed = pack_command(AK80_9, -0.6, 0.0, 100.0, 2.0, 0.0)
    assert packed.data == bytes.fromhex("79 DB 7F F3 33 66 67 FF")


def test_ends_of_the_ranges() -> None:
    top = pack_command(AK80_9, 12.5, 50.0, 500.0, 5.0, 18.0)
    bottom = pack_command(AK80_9, -12.5, -50.0, 0.0, 0.0, -18.0)
    assert (top.data, top.clipped) == (b"\xff" * 8, 0)
    assert (bottom.data, bottom.clipped) == (b"\x00" * 8, 0)


def test_ranges_are_the_manuals_table() -> None:
    # CubeMars AK manual V1.0.8 p. 50, columns AK10-9, AK60-6, AK70-10, AK80-6, AK80-9, AK80-80/64
    table = {
        "AK10-9": (50, 65),
        "AK60-6": (45, 15),
        "AK70-10": (50, 25),
        "AK80-6": (76, 12),
        "AK80-9": (50, 18),
        "AK80-64": (8, 144),
        "AK80-80": (8, 144),
        "DM4310": (30, 10),
        "DM4340": (8, 28),
    }
    for model, (velocity, torque) in table.items():
        assert profile(model).scale == (12.5, velocity, torque, 500.0, 5.0)
        assert profile(model).source


@given(
    st.sampled_from(sorted(PROFILES)),
    *(st.floats(-1.0, 1.0) for _ in range(3)),
    *(st.floats(0.0, 1.0) for _ in range(2)),
)
def test_error_is_half_a_count_and_counts_are_the_drives_or_one_more(
    model: str, p: float, v: float, t: float, kp: float, kd: float
) -> None:
    scale = PROFILES[model].scale
    x = (p * scale[0], v * scale[1], kp * scale[3], kd * scale[4], t * scale[2])
    packed = pack_command(scale, *x)
    back = unpack_command(scale, packed.data)
    word = int.from_bytes(packed.data, "big")
    fields = ((48, 16, scale[0], True), (36, 12, scale[1], True), (24, 12, scale[3], False))
    fields += ((12, 12, scale[4], False), (0, 12, scale[2], True))
    assert packed.clipped == 0
    for value, decoded, (shift, bits, top, symmetric) in zip(x, back, fields, strict=True):
        low = -top if symmetric else 0.0
        step = (top - low) / ((1 << bits) - 1)
        n = word >> shift & ((1 << bits) - 1)
        assert abs(decoded - value) <= step * (0.5 + 1e-6)
        assert n - truncated(value, low, top, bits) in (0, 1)


@pytest.mark.parametrize(
    ("place", "value", "bit"),
    [
        (0, 12.6, CLIP_POSITION),
        (1, -50.1, CLIP_VELOCITY),
        (2, 501.0, CLIP_STIFFNESS),
        (2, -1.0, CLIP_STIFFNESS),
        (3, 5.1, CLIP_DAMPING),
        (4, -18.1, CLIP_TORQUE),
    ],
)
def test_saturation_is_reported_field_by_field(place: int, value: float, bit: int) -> None:
    x = [0.0, 0.0, 10.0, 1.0, 0.0]
    x[place] = value
    packed = pack_command(AK80_9, *x)
    assert packed.clipped == bit
    held = list(x)
    low = (-12.5, -50.0, 0.0, 0.0, -18.0)[place]
    high = (12.5, 50.0, 500.0, 5.0, 18.0)[place]
    held[place] = min(max(value, low), high)
    assert packed.data == pack_command(AK80_9, *held).data


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(5))
def test_nan_and_infinity_are_refused(bad: float, place: int) -> None:
    x = [0.0, 0.0, 10.0, 1.0, 0.0]
    x[place] = bad
    with pytest.raises(InputError, match="finite numbers are accepted") as caught:
        pack_command(AK80_9, *x)
    assert "\n" not in str(caught.value)


def test_reply_bytes_as_the_manual_lays_them_out() -> None:
    # p. 49: id, position 16, velocity 12, torque 12, temperature, error; by hand: 1234 567 89A, 41 degC, 2
    reply = unpack_reply(COUNTS, bytes.fromhex("05 12 34 56 78 9A 29 02"))
    assert reply.first_byte == 5
    assert reply.position_rad == pytest.approx(0x1234 - 65535 / 2, abs=1e-9)
    assert reply.velocity_rad_s == pytest.approx(0x567 - 4095 / 2, abs=1e-9)
    assert reply.torque_Nm == pytest.approx(0x89A - 4095 / 2, abs=1e-9)
    assert (reply.byte_6, reply.byte_7, reply.saturated) == (41, 2, 0)
    short = unpack_reply(COUNTS, bytes.fromhex("05 12 34 56 78 9A"))
    assert short[:4] == reply[:4]
    assert short.byte_6 is None


def test_reply_at_an_end_of_its_range_says_so() -> None:
    assert unpack_reply(AK80_9, bytes.fromhex("01 FF FF 80 08 00")).saturated == CLIP_POSITION
    assert unpack_reply(AK80_9, bytes.fromhex("01 80 00 80 00 00")).saturated == CLIP_TORQUE
    assert unpack_reply(AK80_9, bytes.fromhex("01 80 00 FF F8 00")).saturated == CLIP_VELOCITY


def test_what_replies_say_of_the_drive() -> None:
    # Damiao: ID | ERR << 4; 0 disabled, 1 enabled, 8…E faults. CubeMars: error byte, p. 39
    assert status_of("damiao", 0x03, 0) == (3, DriveState.DISABLED, 0)
    assert status_of("damiao", 0x13, 0) == (3, DriveState.ENABLED, 0)
    assert status_of("damiao", 0xD3, 0) == (3, DriveState.FAULT, 0xD)
    assert error_text("damiao", 0xD) == "communication lost"
    assert status_of("cubemars", 7, 0) == (7, DriveState.UNKNOWN, 0)
    assert status_of("cubemars", 7, 4) == (7, DriveState.FAULT, 4)
    assert error_text("cubemars", 4) == "under voltage"
    assert status_of("katz", 1, None) == (1, DriveState.UNKNOWN, 0)


def test_an_unknown_model_is_told_the_known_ones() -> None:
    with pytest.raises(InputError, match="AK80-9"):
        profile("AK81-9")


def test_float32_drives_read_the_same_count() -> None:
    # A drive that maps in float32 must land on the value to within float32's own resolution.
    for n in (0, 1, 1000, 32767, 32768, 65535):
        value = mit.value_of(n, -12.5, 12.5, 65535)
        drive = float32(float32(n * float32(25.0)) / float32(65535.0)) + float32(-12.5)
        assert value == pytest.approx(drive, abs=4e-6)
