"""Drives that speak the MIT frame on 11-bit identifiers: their ranges, and what they put beside position,
velocity and torque.

Sources: CubeMars "AK Series Actuator Driver Manual" V1.0.8, p. 49-50 (table of ranges, reply of 8 bytes; AK80-8
from its own data sheet) and "AK Series Module Product Manual" V3.0.1, 4.3.1 (error codes, of which 6 was "phase
currents unbalanced" before, and 7 was none); AK80-6 and AK80-9 V1.1 as measured by mini-cheetah-tmotor-python-can
(pull request 3). Damiao motors: makers' table of default PMAX/VMAX/TMAX (`Limit_Param` of DM_CAN) and manual
DM-J4310-2EC V1.0 (state nibble, two temperatures, feedback sent to the master's identifier). RobStride: its sample
program's MIT functions, temperature in tenths over two bytes; ranges as its user manuals have them, revisions 251112 to
260713 (4.1.2 type 1 and chapter 6, MIT), read in transcriptions and in what others cite of them, RS06 in two codes that
cite it alone. Its SDK (`table.py`) and ROS sample state
others for RS00 (50 rad/s, 17 Nm), RS03 (50 rad/s), RS05 (33 rad/s, 17 Nm) and RS06 (20 rad/s, 60 Nm): the full scale
of an RS03, measured against its position, is 20 rad/s, as the manual says, and the maker's EDULITE_A3 has the manuals'
numbers of RS00 and RS05 too. "mini-cheetah": B. Katz's own firmware (6-byte reply to identifier 0). PMAX, VMAX and TMAX
of a Damiao drive can be changed in the drive: it is asked for them, and a drive that has others than the link is not
enabled.
"""

from __future__ import annotations

import difflib
from typing import Final, Literal, NamedTuple

from cablecomp.errors import InputError
from cablecomp.links.mit import MitRange
from cablecomp.links.records import DriveState

Family = Literal["cubemars", "damiao", "katz", "robstride"]


class MitProfile(NamedTuple):
    """One model: ranges, who made the firmware, length of its reply in bytes, and the source of the
    numbers."""

    scale: MitRange
    family: Family
    reply_length: int
    source: str


_AK = "CubeMars AK Series Actuator Driver Manual V1.0.8 p. 49-50"
_AK_OLD = "AK V1.1 as measured by mini-cheetah-tmotor-python-can"
_DM = "Damiao, default PMAX/VMAX/TMAX (Limit_Param of DM_CAN); DM-J4310-2EC manual V1.0"
_RS = "RobStride user manual of the model, 4.1.2 and 6, as cited (SDK and ROS sample differ for RS00, RS03, RS05, RS06)"
_KATZ = "B. Katz, hobbyking_cheetah motor firmware"


def _ak(velocity: float, torque: float, source: str = _AK) -> MitProfile:
    return MitProfile(MitRange(12.5, velocity, torque), "cubemars", 8, source)


def _dm(velocity: float, torque: float, position: float = 12.5, note: str = "") -> MitProfile:
    return MitProfile(MitRange(position, velocity, torque), "damiao", 8, _DM + note)


def _rs(velocity: float, torque: float, kp: float = 500.0, kd: float = 5.0) -> MitProfile:
    return MitProfile(MitRange(12.566370614359172, velocity, torque, kp, kd), "robstride", 8, _RS)


PROFILES: Final[dict[str, MitProfile]] = {
    "AK10-9": _ak(50.0, 65.0),
    "AK60-6": _ak(45.0, 15.0),
    "AK70-10": _ak(50.0, 25.0),
    "AK80-6": _ak(76.0, 12.0),
    "AK80-6-V1.1": _ak(22.5, 12.0, _AK_OLD),
    "AK80-8": _ak(37.5, 32.0),
    "AK80-9": _ak(50.0, 18.0),
    "AK80-9-V1.1": _ak(22.5, 18.0, _AK_OLD),
    "AK80-64": _ak(8.0, 144.0),
    "AK80-80": _ak(8.0, 144.0),
    "DM3507": _dm(50.0, 5.0, 12.566),
    "DM4310": _dm(30.0, 10.0),
    "DM4310P": _dm(50.0, 10.0),
    "DM4340": _dm(8.0, 28.0, note="; VMAX is 8 in some of the maker's files and 10 in others"),
    "DM4340P": _dm(10.0, 28.0),
    "DM6006": _dm(45.0, 20.0),
    "DM6248P": _dm(20.0, 120.0, 12.566),
    "DM8006": _dm(45.0, 40.0),
    "DM8009": _dm(45.0, 54.0),
    "DM10010": _dm(20.0, 200.0),
    "DM10010L": _dm(25.0, 200.0),
    "DMG6215": _dm(45.0, 10.0),
    "DMH3510": _dm(280.0, 1.0),
    "DMH6220": _dm(45.0, 10.0),
    "RS00": _rs(33.0, 14.0),
    "RS01": _rs(44.0, 17.0),
    "RS02": _rs(44.0, 17.0),
    "RS03": _rs(20.0, 60.0, 5000.0, 100.0),
    "RS04": _rs(15.0, 120.0, 5000.0, 100.0),
    "RS05": _rs(50.0, 5.5),
    "RS06": _rs(50.0, 36.0, 5000.0, 100.0),
    "mini-cheetah": MitProfile(MitRange(12.5, 65.0, 18.0), "katz", 6, _KATZ),
}
"""Model -> profile. AK80-64 and AK80-80 share the manual's last column."""

CUBEMARS_ERRORS: Final[dict[int, str]] = {
    1: "motor over temperature",
    2: "over current",
    3: "over voltage",
    4: "under voltage",
    5: "encoder",
    6: "MOSFET over temperature",
    7: "motor lock-up",
}
DAMIAO_ERRORS: Final[dict[int, str]] = {
    0x8: "over voltage",
    0x9: "under voltage",
    0xA: "over current",
    0xB: "MOSFET over temperature",
    0xC: "motor over temperature",
    0xD: "communication lost",
    0xE: "overload",
}

ROBSTRIDE_FAULTS: Final[dict[int, str]] = {
    1 << 0: "over temperature",
    1 << 1: "drive",
    1 << 2: "under voltage",
    1 << 3: "encoder",
    1 << 7: "not calibrated",
    1 << 14: "overload",
}
"""Bits of the fault frame (RobStride sample program, `mapFaults`)."""


class MitStatus(NamedTuple):
    """State that a reply carries: drive number, state (UNKNOWN where the protocol does not say), error code
    (0 = none)."""

    node: int
    state: DriveState
    error: int


def profile(model: str) -> MitProfile:
    """Profile of a model; raises InputError with the models there are."""
    found = PROFILES.get(model)
    if found is None:
        close = difflib.get_close_matches(model, PROFILES, 1)
        hint = f"did you mean `{close[0]}`?" if close else f"known: {', '.join(PROFILES)};"
        raise InputError(f"unknown MIT model `{model}`; {hint} or give `range` for another drive")
    return found


def status_of(family: Family, first_byte: int, byte_7: int | None) -> MitStatus:
    """What byte 0 and byte 7 of a reply say about the drive.

    CubeMars: byte 0 is the drive number, byte 7 the error code; whether the motor mode is on is not reported.
    Damiao: low nibble of byte 0 is the drive number, high nibble 0 disabled, 1 enabled, 8…E a fault. Katz and
    RobStride: byte 0 only (RobStride tells faults in a frame of their own).
    """
    if family == "damiao":
        node, code = first_byte & 0x0F, first_byte >> 4
        if code <= 1:
            return MitStatus(node, DriveState.ENABLED if code else DriveState.DISABLED, 0)
        return MitStatus(node, DriveState.FAULT, code)
    error = byte_7 if family == "cubemars" and byte_7 is not None else 0
    return MitStatus(first_byte, DriveState.FAULT if error else DriveState.UNKNOWN, error)


def error_text(family: Family, error: int) -> str:
    """The maker's word for an error code; an empty text for 0."""
    if error == 0:
        return ""
    if family == "robstride":
        names = [name for bit, name in ROBSTRIDE_FAULTS.items() if error & bit]
        return ", ".join(names) or f"fault bits 0x{error:X}"
    table = DAMIAO_ERRORS if family == "damiao" else CUBEMARS_ERRORS
    return table.get(error, f"error code {error}")
