"""A CubeMars AK drive on extended identifiers, device side: servo mode and, as boards V3 have it beside, force
control; identifier = function << 8 | drive id, big-endian.

Commands: 1 current (int32 mA), 3 velocity (int32 ERPM), 4 position (int32 1e-4 deg of the output shaft), 5 origin
(0 until power-off, 1 for good), 6 position with limits (int32 1e-4 deg, int16 10 ERPM, int16 10 ERPM/s), 8 force
control (kp 12, kd 12, position 16, velocity 12, torque 12 bits), 15 leave the mode (V3.2). Any but the last enables;
none for the command timeout, and the drive lets go without an error. Status (0x29), by itself at every n-th
sample: int16 0.1 deg, int16 10 ERPM, int16 0.01 A, int8 degC, error code. Sources: CubeMars, AK Series Module
Product Manual V3.0.1 and V3.2.0, 4.1 to 4.3; the maker's AK-V3.ino.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable
from typing import NamedTuple

from firmware_sim.errors import SimError
from firmware_sim.firmware import Drive, DriveFlag, DriveReport, DriveState, Mode, Request, Setpoint
from firmware_sim.wire.base import Answer, Heard
from firmware_sim.wire.frame import EXTENDED, Frame
from firmware_sim.wire.mit import MitModel, cubemars_error, to_float

CURRENT, BRAKE, VELOCITY, POSITION, ORIGIN, POSITION_VELOCITY, FORCE, DISABLE = 1, 2, 3, 4, 5, 6, 8, 15
STATUS = 0x29
FUNCTIONS = (CURRENT, VELOCITY, POSITION, ORIGIN, POSITION_VELOCITY, FORCE, DISABLE)
LENGTHS = {CURRENT: 4, VELOCITY: 4, POSITION: 4, ORIGIN: 1, POSITION_VELOCITY: 8, FORCE: 8, DISABLE: 0}


class AkModel(NamedTuple):
    """Ranges of the force control, Nm per A at the output shaft, electrical turns per turn of it."""

    velocity: float
    torque: float
    per_A: float
    electrical_turns: int


MODELS: dict[str, AkModel] = {
    "AK10-9": AkModel(28.0, 54.0, 1.3137, 189),
    "AK60-6": AkModel(60.0, 12.0, 0.5994, 84),
    "AK80-9": AkModel(65.0, 18.0, 0.5701, 189),
}


class CubeMarsWire:
    """A drive that speaks servo mode and force control; `every`: samples between two statuses of its own."""

    def __init__(self, drive_id: int, model: str = "AK80-9", every: int = 1) -> None:
        if model not in MODELS:
            raise SimError(f"cubemars: unknown model {model!r}; one of {', '.join(MODELS)} is accepted")
        self.model, self.drive_id, self.every = MODELS[model], drive_id, every
        self.range = MitModel(12.56, self.model.velocity, self.model.torque)
        self.erpm = 60.0 / (2.0 * math.pi) * self.model.electrical_turns
        self.reset()

    def reset(self) -> None:
        """Power cycle."""
        self._samples = 0

    def identifiers(self) -> Iterable[int]:
        """Its functions."""
        return tuple(EXTENDED | f << 8 | self.drive_id for f in FUNCTIONS)

    def broadcasts(self) -> Iterable[int]:
        """None."""
        return ()

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """Apply one command."""
        function = frame.identifier >> 8
        if frame.remote or len(frame.data) < LENGTHS[function]:
            drive.flags |= DriveFlag.BAD_FRAME
            return Heard()
        if function == ORIGIN:
            drive.set_position(0.0)
            return Heard()
        if function == DISABLE:
            drive.request(Request.DISABLE, now_s)
            return Heard()
        mode, target = self._target(function, frame.data, drive)
        if drive.state is DriveState.FAULT:
            drive.request(Request.CLEAR_FAULTS, now_s)
        if drive.state is not DriveState.ENABLED:
            drive.request(Request.ENABLE, now_s)
        if mode is not drive.mode:
            drive.set_mode(mode)
        drive.command(target, now_s)
        return Heard(steps=True)

    def _target(self, function: int, data: bytes, drive: Drive) -> tuple[Mode, Setpoint]:
        if function == FORCE:
            return Mode.IMPEDANCE, decode_force(self.range, data)
        (n,) = struct.unpack_from(">i", data)
        if function == CURRENT:
            return Mode.TORQUE, Setpoint(torque_Nm=1e-3 * n * self.model.per_A)
        if function == VELOCITY:
            return Mode.VELOCITY, Setpoint(velocity_rad_s=n / self.erpm)
        if function == POSITION_VELOCITY:
            tens = struct.unpack_from(">h", data, 4)[0]
            drive.set_limits(velocity_rad_s=10.0 * tens / self.erpm)
        return Mode.POSITION, Setpoint(math.radians(1e-4 * n))

    def answer(self, answer: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """Nothing: the status comes by itself."""
        return None

    def cyclic(self, drive: Drive, now_s: float) -> list[Frame]:
        """The status, at every n-th sample."""
        self._samples += 1
        return [] if self._samples % self.every else [self._status(drive.report())]

    def _status(self, report: DriveReport) -> Frame:
        position = _int16(math.degrees(report.position_rad) / 0.1, 32_000)
        velocity = _int16(report.velocity_rad_s * self.erpm / 10.0, 32_000)
        current = _int16(report.torque_Nm / self.model.per_A / 0.01, 6_000)
        degrees = 0 if math.isnan(report.temperature_degC) else _int16(report.temperature_degC, 127)
        data = struct.pack(">hhhbB", position, velocity, current, degrees, cubemars_error(report))
        return Frame(STATUS << 8 | self.drive_id, data, extended=True)


def decode_force(model: MitModel, data: bytes) -> Setpoint:
    """Targets of a force-control command."""
    bits = int.from_bytes(data, "big")
    return Setpoint(
        to_float(bits >> 24 & 0xFFFF, -model.position, model.position, 16),
        to_float(bits >> 12 & 0xFFF, -model.velocity, model.velocity, 12),
        to_float(bits & 0xFFF, -model.torque, model.torque, 12),
        to_float(bits >> 52, 0.0, model.kp, 12),
        to_float(bits >> 40 & 0xFFF, 0.0, model.kd, 12),
    )


def _int16(value: float, top: int) -> int:
    return min(max(round(value), -top), top)
