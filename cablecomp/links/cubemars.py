"""CubeMars AK drives on extended identifiers, `function << 8 | drive number`: servo mode, and the force control
("MIT") of driver boards V3, whose fields stand in another order than in the 11-bit frame.

All numbers big end first. Positions in degrees of the output shaft, velocities in electrical revolutions per
minute (rotor turns times pole pairs), current in amperes. Sources: CubeMars "AK Series Module Product Manual"
V3.0.1 and V3.2.0, 4.1 (servo commands), 4.2 (force control, table of ranges and torque constants), 4.3.1 (the
status that the drive sends by itself); AK-V3.ino, the maker's example (order of the fields).
"""

from __future__ import annotations

from enum import IntEnum
from math import isfinite
from struct import Struct
from typing import Final, NamedTuple

from cablecomp.errors import InputError
from cablecomp.links.mit import P_TOP, V_TOP, MitRange, Packed, clipping, count
from cablecomp.links.records import EXTENDED, Frame

POSITION_PER_DEG: Final = 10_000.0
STATUS_STEP_DEG: Final = 0.1
CURRENT_PER_A: Final = 1000.0
INT32: Final = 2**31 - 1
_INT: Final = Struct(">i")
_STATUS: Final = Struct(">hhhbB")


class Function(IntEnum):
    """Upper bits of the identifier."""

    CURRENT = 1
    VELOCITY = 3
    POSITION = 4
    ORIGIN = 5
    FORCE_CONTROL = 8
    DISABLE = 15
    STATUS = 0x29


class Status(NamedTuple):
    """What a drive sends by itself: output shaft in degrees, ERPM, A, driver board in degC, error code."""

    position_deg: float
    velocity_erpm: float
    current_A: float
    temperature_degC: int
    error: int


class CubeMarsModel(NamedTuple):
    """A drive with a V3 board: ranges of the force control, torque per ampere at the output shaft, and electrical
    turns per turn of the output shaft (0 = not known here)."""

    scale: MitRange
    torque_Nm_per_A: float
    electrical_turns: int = 0


def _v3(velocity: float, torque: float, per_A: float, electrical_turns: int = 0) -> CubeMarsModel:
    return CubeMarsModel(MitRange(12.56, velocity, torque), per_A, electrical_turns)


MODELS: Final[dict[str, CubeMarsModel]] = {
    "AK10-9": _v3(28.0, 54.0, 1.3137, 21 * 9),
    "AK60-6": _v3(60.0, 12.0, 0.5994, 14 * 6),
    "AK60-39": _v3(10.0, 80.0, 3.4616),
    "AK70-9": _v3(30.0, 32.0, 1.0621),
    "AK80-8": _v3(38.0, 32.0, 1.0569),
    "AK80-9": _v3(65.0, 18.0, 0.5701, 21 * 9),
    "AKE60-8": _v3(40.0, 15.0, 0.7382),
    "AKE80-8": _v3(20.0, 35.0, 1.7909),
    "AKE90-8": _v3(20.0, 150.0, 1.8265),
    "AKH70-16": _v3(13.0, 110.0, 2.8334),
    "AKH70-48": _v3(5.0, 280.0, 8.8123),
}
"""Manual V3.2.0, 4.2; pole pairs times reduction where they are sure."""


def identifier(function: Function, node: int) -> int:
    """`function << 8 | node`, 29 bits."""
    return EXTENDED | function << 8 | node


def force_control(
    scale: MitRange, node: int, position: float, velocity: float, kp: float, kd: float, torque: float
) -> Packed:
    """Bytes of one force-control command: kp 12, kd 12, position 16, velocity 12, torque 12 bits; raises
    InputError on NaN or infinity, saturates beyond the range and says so."""
    clipped = clipping(scale, position, velocity, kp, kd, torque)
    p, v, t, kp_top, kd_top = scale
    word = (
        count(kp, 0.0, kp_top, V_TOP) << 52
        | count(kd, 0.0, kd_top, V_TOP) << 40
        | count(position, -p, p, P_TOP) << 24
        | count(velocity, -v, v, V_TOP) << 12
        | count(torque, -t, t, V_TOP)
    )
    return Packed(word.to_bytes(8, "big"), clipped)


def servo(function: Function, node: int, counts: float) -> tuple[Frame, bool]:
    """A servo command of one int32, and whether it had to be saturated; raises InputError on NaN or
    infinity."""
    if not isfinite(counts):
        raise InputError(
            f"CubeMars {function.name.lower()}: {counts}; finite numbers are accepted; nothing was sent"
        )
    n = min(max(round(counts), -INT32), INT32)
    return Frame(identifier(function, node), _INT.pack(n)), n != round(counts)


def no_current(node: int) -> Frame:
    """No current: the quickest way to a powerless motor that all boards know."""
    return Frame(identifier(Function.CURRENT, node), _INT.pack(0))


def let_go(node: int) -> tuple[Frame, Frame]:
    """No current, then the request to leave its mode, which firmware before V3.2 does not know."""
    return no_current(node), Frame(identifier(Function.DISABLE, node), bytes(8))


def set_origin(node: int) -> Frame:
    """Take the present position as zero until the power is switched off."""
    return Frame(identifier(Function.ORIGIN, node), b"\x00")


def parse_status(data: bytes) -> Status:
    """A status frame: int16 0.1 deg, int16 10 ERPM, int16 0.01 A, int8 degC, error; raises InputError unless
    eight bytes."""
    if len(data) != 8:
        raise InputError(f"CubeMars status: {len(data)} bytes; 8 are accepted")
    position, velocity, current, temperature, error = _STATUS.unpack(data)
    return Status(STATUS_STEP_DEG * position, 10.0 * velocity, 0.01 * current, temperature, error)
