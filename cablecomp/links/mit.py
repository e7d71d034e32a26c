"""The 8-byte MIT "mini-cheetah" frame: position, velocity and gains packed into 16/12/12/12/12 bits, big end
first.

Sources: B. Katz, "A low cost modular actuator for dynamic robots" (MIT 2018) and its motor-driver notes;
CubeMars "AK Series Actuator Driver Manual" V1.0.8, section 5.3, pages 48-52; Damiao DM-J4310-2EC manual V1.0.
Two slips in the CubeMars listing are known: page 51 scales by 2^n/span, which overflows at the upper end
where the drives themselves use (2^n - 1)/span, and it prints `kp_int` where the upper four bits of the torque
belong.
"""

from __future__ import annotations

from math import ceil, isfinite
from typing import Final, NamedTuple

from cablecomp.errors import InputError
from cablecomp.links.records import (
    CLIP_DAMPING,
    CLIP_POSITION,
    CLIP_STIFFNESS,
    CLIP_TORQUE,
    CLIP_VELOCITY,
)

ENTER: Final = bytes.fromhex("FFFFFFFFFFFFFFFC")
"""Enter motor mode; also asks for one reply while disabled."""
EXIT: Final = bytes.fromhex("FFFFFFFFFFFFFFFD")
"""Leave motor mode: the drive lets go of the motor."""
ZERO: Final = bytes.fromhex("FFFFFFFFFFFFFFFE")
"""Take the present position as zero."""
CLEAR: Final = bytes.fromhex("FFFFFFFFFFFFFFFB")
"""Clear errors (Damiao only)."""

_HALF: Final = 0.5 + 1e-9  # so that a tie goes down whatever the last bit of the quotient
P_TOP: Final = 65535
V_TOP: Final = 4095


class MitRange(NamedTuple):
    """Full scale of a drive's frames, at the shaft that the drive reports: +-position, +-velocity, +-torque,
    0…kp, 0…kd."""

    position_rad: float
    velocity_rad_s: float
    torque_Nm: float
    kp_Nm_per_rad: float = 500.0
    kd_Nms_per_rad: float = 5.0


class Packed(NamedTuple):
    """A command's bytes, and the CLIP_* bits of what had to be saturated to fit."""

    data: bytes
    clipped: int


def count(value: float, low: float, high: float, top: int) -> int:
    """Nearest count of `value` in `low…high` mapped onto 0…top; ties go down.

    `n = ceil((value - low) top / (high - low) - 1/2)`, so the error is at most half a count where the makers'
    routine, which cuts off, errs by up to one; both give 7FFF, 7FF for zero in a symmetric range. Saturates.
    """
    if value <= low:
        return 0
    if value >= high:
        return top
    return ceil((value - low) * top / (high - low) - _HALF)


def value_of(n: int, low: float, high: float, top: int) -> float:
    """Value of a count: `low + n (high - low)/top` (CubeMars manual p. 52, `uint_to_float`)."""
    return low + n * ((high - low) / top)


def clipping(
    scale: MitRange,
    position_rad: float,
    velocity_rad_s: float,
    kp_Nm_per_rad: float,
    kd_Nms_per_rad: float,
    torque_Nm: float,
) -> int:
    """CLIP_* bits of what lies beyond the range; raises InputError on NaN or infinity."""
    if not isfinite(position_rad + velocity_rad_s + kp_Nm_per_rad + kd_Nms_per_rad + torque_Nm):
        raise InputError(
            f"MIT command: position {position_rad}, velocity {velocity_rad_s}, kp {kp_Nm_per_rad}, "
            f"kd {kd_Nms_per_rad}, torque {torque_Nm}; finite numbers are accepted; nothing was sent"
        )
    p, v, t, kp, kd = scale
    clipped = 0
    if not -p <= position_rad <= p:
        clipped = CLIP_POSITION
    if not -v <= velocity_rad_s <= v:
        clipped |= CLIP_VELOCITY
    if not -t <= torque_Nm <= t:
        clipped |= CLIP_TORQUE
    if not 0.0 <= kp_Nm_per_rad <= kp:
        clipped |= CLIP_STIFFNESS
    if not 0.0 <= kd_Nms_per_rad <= kd:
        clipped |= CLIP_DAMPING
    return clipped


def pack_command(
    scale: MitRange,
    position_rad: float,
    velocity_rad_s: float,
    kp_Nm_per_rad: float,
    kd_Nms_per_rad: float,
    torque_Nm: float,
) -> Packed:
    """Bytes of one command; raises InputError on NaN or infinity, saturates beyond the range and says so in
    `clipped`.

    Bits from the top: position 16, velocity 12, kp 12, kd 12, torque 12 (CubeMars manual p. 49).
    """
    clipped = clipping(scale, position_rad, velocity_rad_s, kp_Nm_per_rad, kd_Nms_per_rad, torque_Nm)
    p, v, t, kp, kd = scale
    word = (
        count(position_rad, -p, p, P_TOP) << 48
        | count(velocity_rad_s, -v, v, V_TOP) << 36
        | count(kp_Nm_per_rad, 0.0, kp, V_TOP) << 24
        | count(kd_Nms_per_rad, 0.0, kd, V_TOP) << 12
        | count(torque_Nm, -t, t, V_TOP)
    )
    return Packed(word.to_bytes(8, "big"), clipped)


def reply_counts(word: int) -> tuple[int, int, int]:
    """Counts of position, velocity and torque in the lower 40 bits of a reply's first six bytes."""
    return word >> 24 & 0xFFFF, word >> 12 & 0xFFF, word & 0xFFF


def saturation(n_position: int, n_velocity: int, n_torque: int) -> int:
    """CLIP_* bits of the counts that stand at an end of their range: the true value may lie beyond."""
    bits = 0
    if n_position in (0, P_TOP):
        bits = CLIP_POSITION
    if n_velocity in (0, V_TOP):
        bits |= CLIP_VELOCITY
    if n_torque in (0, V_TOP):
        bits |= CLIP_TORQUE
    return bits
