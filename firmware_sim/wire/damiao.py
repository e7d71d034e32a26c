"""A Damiao drive, device side: the MIT frame, its registers (identifier 0x7FF), its own position, velocity and
force-position loops (identifiers 0x100, 0x200 and 0x300 above its number).

Byte 0 of the reply = id | state << 4, bytes 6 and 7 the temperatures of MOSFETs and rotor. Register request: drive
number u16, 0x33 read | 0x55 write | 0xAA save | 0xCC report state, register, value; the answer repeats them. A
frame for another control mode than that of register 10 is not obeyed, and answered all the same. Sources: Damiao,
DM-J4310-2EC manual V1.0 (feedback frame, status codes, registers, modes); the maker's DM_CAN; python-damiao-driver
(register table, unit of the timeout: 50 us).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable
from dataclasses import replace

from firmware_sim.firmware import Drive, DriveFlag, DriveReport, DriveState, Mode, Setpoint
from firmware_sim.wire.base import Answer, Heard
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.mit import SPECIAL, MitWire, encode_reply

REGISTERS = 0x7FF
READ, WRITE, SAVE, REPORT = 0x33, 0x55, 0xAA, 0xCC
MST_ID, ESC_ID, TIMEOUT, CTRL_MODE, PMAX, VMAX, TMAX, KP_ASR, KP_APR, P_M, XOUT = (
    7, 8, 9, 10, 21, 22, 23, 25, 27, 80, 81,
)  # fmt: skip
TIMEOUT_UNIT_S = 50e-6
WHOLE = (MST_ID, ESC_ID, TIMEOUT, CTRL_MODE, 13, 14, 15, 16, 35, 36)
MIT, POSITION, VELOCITY, FORCE_POSITION = 1, 2, 3, 4


class DamiaoWire(MitWire):
    """A drive that speaks Damiao's messages."""

    def __init__(self, drive_id: int, model: str = "DM4310", reply_id: int = 0) -> None:
        super().__init__(drive_id, model, reply_id)
        p, v, t = self.model.position, self.model.velocity, self.model.torque
        self.values: dict[int, float] = {
            MST_ID: reply_id, ESC_ID: drive_id, CTRL_MODE: MIT, 14: 5013, 16: 14,
            20: 10.0, PMAX: p, VMAX: v, TMAX: t, KP_ASR: 0.05, KP_APR: 20.0, 35: 4, 60: 24.0,
        }  # fmt: skip

    def identifiers(self) -> Iterable[int]:
        """Its number, and those of the other modes above it."""
        return tuple(base + self.drive_id for base in (0, 0x100, 0x200, 0x300))

    def broadcasts(self) -> Iterable[int]:
        """Register requests, which name the drive."""
        return (REGISTERS,)

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """Apply one frame."""
        if frame.identifier == REGISTERS:
            return self._hear_register(frame, drive, now_s)
        mode = 1 + (frame.identifier - self.drive_id) // 0x100
        if frame.data[:7] == SPECIAL:
            return super().hear(frame, drive, now_s)
        if mode != self.values[CTRL_MODE]:
            return Heard((Answer.STATE,))
        if mode == MIT:
            return super().hear(frame, drive, now_s)
        return self._hear_loop(mode, frame, drive, now_s)

    def _hear_loop(self, mode: int, frame: Frame, drive: Drive, now_s: float) -> Heard:
        if len(frame.data) < (4 if mode == VELOCITY else 8):
            drive.flags |= DriveFlag.BAD_FRAME
            return Heard()
        target = drive.setpoint.position_rad
        if mode == VELOCITY:
            (velocity,) = struct.unpack_from("<f", frame.data)
        elif mode == POSITION:
            target, limit = struct.unpack("<ff", frame.data)
            velocity = 0.0
            drive.set_limits(velocity_rad_s=limit)
        else:
            target, hundredths, share = struct.unpack("<fHH", frame.data)
            velocity = 0.0
            drive.set_limits(1e-2 * hundredths, 1e-4 * share * self.model.torque)
        drive.command(Setpoint(target, velocity), now_s)
        return Heard((Answer.STATE,), steps=True)

    def _hear_register(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        if len(frame.data) != 8:
            return Heard()
        node, kind, register = struct.unpack_from("<HBB", frame.data)
        if node != self.drive_id:
            return Heard()
        if kind == REPORT:
            return Heard((Answer.STATE,))
        if kind == WRITE and (register in self.values or register == TIMEOUT):
            code = "<I" if register in WHOLE else "<f"
            (value,) = struct.unpack_from(code, frame.data, 4)
            return self._write(register, value, drive)
        known = register in self.values or register in (TIMEOUT, P_M, XOUT)
        return Heard((Answer.ASKED,)) if kind == SAVE or known else Heard()

    def _write(self, register: int, value: float, drive: Drive) -> Heard:
        if register == CTRL_MODE:
            modes = {MIT: Mode.IMPEDANCE, VELOCITY: Mode.VELOCITY}
            drive.set_mode(modes.get(int(value), Mode.POSITION))
        if register == TIMEOUT:
            drive.config = replace(drive.config, command_timeout_s=value * TIMEOUT_UNIT_S)
            return Heard((Answer.ASKED,))
        self.values[register] = value
        if register in (MST_ID, ESC_ID):
            self.reply_id, self.drive_id = int(self.values[MST_ID]), int(self.values[ESC_ID])
        p, v, t = (self.values[n] for n in (PMAX, VMAX, TMAX))
        self.model = self.model._replace(position=p, velocity=v, torque=t)
        return Heard((Answer.ASKED,), moved=register == ESC_ID)

    def answer(self, answer: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """The state, or what a register holds."""
        if answer is Answer.ASKED:
            _, kind, register = struct.unpack_from("<HBB", frame.data)
            head = struct.pack("<HBB", self.drive_id, kind, register)
            if kind == SAVE:
                return Frame(self.reply_id, head + bytes(4))
            value = self._value(register, drive)
            body = struct.pack("<I", int(value)) if register in WHOLE else struct.pack("<f", value)
            return Frame(self.reply_id, head + body)
        return self._state(drive.report())

    def _value(self, register: int, drive: Drive) -> float:
        if register in (P_M, XOUT):
            return drive.position_rad
        if register == TIMEOUT:
            return round(drive.config.command_timeout_s / TIMEOUT_UNIT_S)
        return self.values[register]

    def _state(self, report: DriveReport) -> Frame:
        degrees = report.temperature_degC
        whole = 0 if math.isnan(degrees) else min(max(round(degrees), 0), 255)
        first = self.drive_id & 0x0F | damiao_status(report) << 4
        return Frame(self.reply_id, encode_reply(self.model, first, report, (whole, whole)))


def damiao_status(report: DriveReport) -> int:
    """Upper four bits of byte 0: 0 disabled, 1 enabled, C rotor temperature, D communication lost, E overload
    (whatever else stopped it)."""
    if report.state is not DriveState.FAULT:
        return 1 if report.state is DriveState.ENABLED else 0
    if report.flags & DriveFlag.COMMAND_TIMEOUT:
        return 0xD
    return 0xC if report.flags & DriveFlag.OVER_TEMPERATURE else 0xE
