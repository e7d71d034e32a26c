"""The 8-byte MIT "mini-cheetah" frame of CubeMars AK, RobStride and Katz drives, device side (Damiao's builds on
it: `damiao`).

Command, identifier = drive id, most significant bit first: position 16, velocity 12, kp 12, kd 12, torque
12 bits, each mapped linearly from its range to 0 … 2^bits - 1 and truncated. Reply, identifier `reply_id` (0
unless configured): byte 0 = drive id, position 16, velocity 12, torque 12, then temperature and error
(CubeMars) or the temperature in tenths over two bytes (RobStride); the original mini-cheetah firmware sends the
first six bytes alone. FF x7 + FC enters, FD leaves, FE zeroes, FB clears faults (Damiao, RobStride). A drive
that hears nothing makes no torque until it hears again and reports no error. A CubeMars drive that is told to take
the present position as zero does so while it is enabled too, and says nothing for about a second.

Sources: CubeMars, AK Series Actuator Driver Manual V1.0.8, section 5.3, and V3.0.1, 4.3.1 (error codes); B. Katz,
mini-cheetah motor controller (ranges, truncation, CAN_TIMEOUT); TMotorCANControl (silence after zeroing); RobStride
sample program (reply, fault frame) and user manuals (ranges).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from firmware_sim.errors import SimError
from firmware_sim.firmware import Drive, DriveFlag, DriveReport, DriveState, Request, Setpoint
from firmware_sim.wire.base import Answer, Heard
from firmware_sim.wire.frame import Frame

SPECIAL = b"\xff" * 7
SILENCE_AFTER_ZERO_S = 1.0
REQUESTS = {0xFC: Request.ENABLE, 0xFD: Request.DISABLE, 0xFE: Request.SET_ZERO, 0xFB: Request.CLEAR_FAULTS}


class MitModel(NamedTuple):
    """Ranges of one model: ± position (rad), ± velocity (rad/s), ± torque (Nm), 0…kp (Nm/rad), 0…kd
    (Nms/rad); its maker."""

    position: float
    velocity: float
    torque: float
    kp: float = 500.0
    kd: float = 5.0
    maker: str = "cubemars"


def _dm(position: float, velocity: float, torque: float) -> MitModel:
    return MitModel(position, velocity, torque, maker="damiao")


def _rs(velocity: float, torque: float, kp: float = 500.0, kd: float = 5.0) -> MitModel:
    return MitModel(4.0 * math.pi, velocity, torque, kp, kd, "robstride")


MODELS: dict[str, MitModel] = {
    "AK10-9": MitModel(12.5, 50.0, 65.0),
    "AK60-6": MitModel(12.5, 45.0, 15.0),
    "AK70-10": MitModel(12.5, 50.0, 25.0),
    "AK80-6": MitModel(12.5, 76.0, 12.0),
    "AK80-8": MitModel(12.5, 37.5, 32.0),
    "AK80-9": MitModel(12.5, 50.0, 18.0),
    "AK80-64": MitModel(12.5, 8.0, 144.0),
    "AK80-80": MitModel(12.5, 8.0, 144.0),
    "DM3507": _dm(12.566, 50.0, 5.0),
    "DM4310": _dm(12.5, 30.0, 10.0),
    "DM4310P": _dm(12.5, 50.0, 10.0),
    "DM4340": _dm(12.5, 8.0, 28.0),
    "DM4340P": _dm(12.5, 10.0, 28.0),
    "DM6006": _dm(12.5, 45.0, 20.0),
    "DM8006": _dm(12.5, 45.0, 40.0),
    "DM8009": _dm(12.5, 45.0, 54.0),
    "DM10010": _dm(12.5, 20.0, 200.0),
    "DM10010L": _dm(12.5, 25.0, 200.0),
    "DMH3510": _dm(12.5, 280.0, 1.0),
    "DMG6215": _dm(12.5, 45.0, 10.0),
    "DMH6220": _dm(12.5, 45.0, 10.0),
    "DM6248P": _dm(12.566, 20.0, 120.0),
    "RS00": _rs(33.0, 14.0),
    "RS01": _rs(44.0, 17.0),
    "RS02": _rs(44.0, 17.0),
    "RS03": _rs(20.0, 60.0, 5000.0, 100.0),
    "RS04": _rs(15.0, 120.0, 5000.0, 100.0),
    "RS05": _rs(50.0, 5.5),
    "RS06": _rs(50.0, 36.0, 5000.0, 100.0),
    "mini-cheetah": MitModel(12.5, 65.0, 18.0, maker="katz"),
}
ALIASES = {"DM-J4310-2EC": "DM4310", "J4310": "DM4310", "DM-J4340-2EC": "DM4340", "DM-J8009-2EC": "DM8009"}


def model_of(name: str) -> MitModel:
    """Ranges of a model by its maker's name; raises SimError."""
    key = ALIASES.get(name, name)
    if key not in MODELS:
        raise SimError(f"mit: unknown model {name!r}; one of {', '.join(MODELS)} is accepted")
    return MODELS[key]


def to_uint(value: float, low: float, high: float, bits: int) -> int:
    """Linear map of low…high to 0…2^bits-1, clamped, truncated as the drives do."""
    clamped = min(max(value, low), high)
    return int((clamped - low) * ((1 << bits) - 1) / (high - low))


def to_float(raw: int, low: float, high: float, bits: int) -> float:
    """Inverse of `to_uint` up to truncation."""
    return raw * (high - low) / ((1 << bits) - 1) + low


def decode_command(model: MitModel, data: bytes) -> Setpoint:
    """Targets of a command."""
    bits = int.from_bytes(data, "big")
    return Setpoint(
        to_float(bits >> 48, -model.position, model.position, 16),
        to_float(bits >> 36 & 0xFFF, -model.velocity, model.velocity, 12),
        to_float(bits & 0xFFF, -model.torque, model.torque, 12),
        to_float(bits >> 24 & 0xFFF, 0.0, model.kp, 12),
        to_float(bits >> 12 & 0xFFF, 0.0, model.kd, 12),
    )


def encode_reply(model: MitModel, first: int, report: DriveReport, tail: tuple[int, int]) -> bytes:
    """The eight bytes of a reply; `first` and the two of `tail` are the maker's."""
    bits = to_uint(report.position_rad, -model.position, model.position, 16)
    bits = bits << 12 | to_uint(report.velocity_rad_s, -model.velocity, model.velocity, 12)
    bits = bits << 12 | to_uint(report.torque_Nm, -model.torque, model.torque, 12)
    return bytes((first,)) + bits.to_bytes(5, "big") + bytes(tail)


class MitWire:
    """A drive that speaks MIT frames; `drive_id` 1…127."""

    def __init__(self, drive_id: int, model: str = "AK80-9", reply_id: int = 0) -> None:
        self.model = model_of(model)
        top = 15 if self.model.maker == "damiao" else 127
        if not 1 <= drive_id <= top:
            raise SimError(f"mit: drive id {drive_id} of a {model}; 1 to {top} is accepted")
        self.drive_id = drive_id
        self.reply_id = reply_id
        self.reset()

    def identifiers(self) -> Iterable[int]:
        """The drive's own id."""
        return (self.drive_id,)

    def broadcasts(self) -> Iterable[int]:
        """None."""
        return ()

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """A special frame asks the state table, any other is a command; both are answered by the drive's
        state."""
        if now_s < self._deaf_until_s:
            return Heard()
        if frame.remote or frame.extended or len(frame.data) != 8:
            drive.flags |= DriveFlag.BAD_FRAME
            return Heard()
        if frame.data[:7] == SPECIAL and frame.data[7] in REQUESTS:
            self._special(REQUESTS[frame.data[7]], drive, now_s)
            return Heard((Answer.STATE,) if now_s >= self._deaf_until_s else ())
        drive.command(decode_command(self.model, frame.data), now_s)
        return Heard((Answer.STATE,), steps=True)

    def _special(self, request: Request, drive: Drive, now_s: float) -> None:
        maker = self.model.maker
        if request is Request.DISABLE and drive.state is DriveState.FAULT and maker in ("cubemars", "katz"):
            request = Request.CLEAR_FAULTS  # has no frame of its own for it: leaving motor mode clears
        if request is Request.SET_ZERO and maker != "damiao":
            drive.set_position(0.0)
            self._deaf_until_s = now_s + (SILENCE_AFTER_ZERO_S if maker == "cubemars" else 0.0)
            return
        drive.request(request, now_s)

    def answer(self, answer: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """The reply frame."""
        report = drive.report()
        maker, degrees = self.model.maker, report.temperature_degC
        degrees = 0.0 if math.isnan(degrees) else min(max(degrees, 0.0), 255.0)
        if maker == "robstride":
            if report.state is DriveState.FAULT:
                return Frame(self.reply_id, bytes((self.drive_id,)) + robstride_faults(report))
            tail = divmod(round(10.0 * degrees), 256)
        else:
            tail = (round(degrees), cubemars_error(report))
        data = encode_reply(self.model, self.drive_id, report, tail)
        return Frame(self.reply_id, data[:6] if maker == "katz" else data)

    def cyclic(self, drive: Drive, now_s: float) -> list[Frame]:
        """Nothing: an MIT drive speaks only when spoken to."""
        return []

    def reset(self) -> None:
        """Power cycle."""
        self._deaf_until_s = -math.inf


def cubemars_error(report: DriveReport) -> int:
    """Error byte of an AK drive: 0 none, 1 motor over temperature, 2 over current (whatever else stopped it), 5
    encoder; 6 and 7 (MOSFETs, lock-up) do not happen here."""
    if report.state is not DriveState.FAULT:
        return 0
    if report.flags & DriveFlag.OVER_TEMPERATURE:
        return 1
    return 5 if report.flags & (DriveFlag.MOTOR_ENCODER | DriveFlag.INDEX_NOT_FOUND) else 2


def robstride_faults(report: DriveReport) -> bytes:
    """Bytes 1 to 7 of a RobStride drive's fault frame: bit 0 over temperature, 3 encoder, 14 overload."""
    bits = 0
    if report.flags & DriveFlag.OVER_TEMPERATURE:
        bits |= 1
    if report.flags & (DriveFlag.MOTOR_ENCODER | DriveFlag.INDEX_NOT_FOUND):
        bits |= 1 << 3
    return (bits or 1 << 14).to_bytes(2, "little") + bytes(5)
