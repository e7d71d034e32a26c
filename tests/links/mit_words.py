"""What MIT frames say, by the counts and scales that the link itself uses: for tests to read back."""

from __future__ import annotations

from typing import NamedTuple

from cablecomp.links.mit import P_TOP, V_TOP, MitRange, reply_counts, saturation, value_of


class MitReply(NamedTuple):
    """A drive's answer, at the shaft that it reports; bytes 6 and 7 are None in the 6-byte form.

    `first_byte` carries the drive number (CubeMars: the whole byte) and, with Damiao, the
    state. `saturated`: bits CLIP_POSITION, CLIP_VELOCITY, CLIP_TORQUE, set where the count stands at an end
    of its range.
    """

    first_byte: int
    position_rad: float
    velocity_rad_s: float
    torque_Nm: float
    byte_6: int | None
    byte_7: int | None
    saturated: int


class MitCommand(NamedTuple):
    """What a command frame says, at the shaft that the drive reports."""

    position_rad: float
    velocity_rad_s: float
    kp_Nm_per_rad: float
    kd_Nms_per_rad: float
    torque_Nm: float


def unpack_command(scale: MitRange, data: bytes) -> MitCommand:
    """What a command frame of 8 bytes says."""
    word = int.from_bytes(data, "big")
    p, v, t, kp, kd = scale
    return MitCommand(
        value_of(word >> 48, -p, p, P_TOP),
        value_of(word >> 36 & 0xFFF, -v, v, V_TOP),
        value_of(word >> 24 & 0xFFF, 0.0, kp, V_TOP),
        value_of(word >> 12 & 0xFFF, 0.0, kd, V_TOP),
        value_of(word & 0xFFF, -t, t, V_TOP),
    )


def unpack_reply(scale: MitRange, data: bytes) -> MitReply:
    """A drive's answer of 6 or 8 bytes: byte 0, position 16, velocity 12, torque 12 bits, two more bytes in
    the long form.

    Source: CubeMars manual p. 49; Damiao manual, feedback frame.
    """
    if len(data) == 8:
        word = int.from_bytes(data, "big")
        tail: tuple[int | None, int | None] = (word >> 8 & 0xFF, word & 0xFF)
        word >>= 16
    else:
        word, tail = int.from_bytes(data, "big"), (None, None)
    n_p, n_v, n_t = reply_counts(word)
    p, v, t, _, _ = scale
    return MitReply(
        word >> 40,
        value_of(n_p, -p, p, P_TOP),
        value_of(n_v, -v, v, V_TOP),
        value_of(n_t, -t, t, V_TOP),
        *tail,
        saturation(n_p, n_v, n_t),
    )
