"""A RobStride drive in its own protocol, device side: type in bits 28 to 24 of the extended identifier, 16 bits of
data, number of whom it is for; numbers as 16-bit counts, big-endian, parameters little-endian.

Heard: 0 (who is there), 1 (control), 3 (enable), 4 (stop; byte 0 = 1 clears faults), 6 (zero), 17 (read parameter),
18 (write parameter). Told: 2, the status, in answer to 1, 3, 4, 6 and 18, with mode and faults in its identifier; 17.
A drive that hears nothing for `canTimeout` (parameter 0x7028, in units of 1/20000 s) stops with the fault "stall or
overload" here. Sources: RobStride sample program (`RobStride.cpp`), SDK (`protocol.py`, `bus.py`).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable
from dataclasses import replace

from firmware_sim.errors import SimError
from firmware_sim.firmware import Drive, DriveFlag, DriveReport, DriveState, Mode, Request, Setpoint
from firmware_sim.wire.base import Answer, Heard
from firmware_sim.wire.frame import LAST_BYTE, Frame
from firmware_sim.wire.mit import model_of, to_float, to_uint

WHO, CONTROL, STATUS, ENABLE, STOP, ZERO, READ, WRITE = 0, 1, 2, 3, 4, 6, 17, 18
RUN_MODE, CAN_TIMEOUT = 0x7005, 0x7028
MODES = {0: Mode.IMPEDANCE, 1: Mode.POSITION, 2: Mode.VELOCITY, 3: Mode.TORQUE, 5: Mode.POSITION}
POSITION_TARGET, VELOCITY_TARGET, CURRENT_TARGET = 0x7016, 0x700A, 0x7006
MECHANICAL_POSITION, MECHANICAL_VELOCITY, VBUS = 0x7019, 0x701B, 0x701C
TIMEOUT_UNIT_S = 1.0 / 20_000.0


class RobStrideWire:
    """A drive `drive_id` 1…127."""

    def __init__(self, drive_id: int, model: str = "RS01") -> None:
        self.model = model_of(model)
        if self.model.maker != "robstride":
            raise SimError(f"robstride: {model!r} is none; RS00 to RS06 are accepted")
        self.drive_id = drive_id
        self.reset()

    def reset(self) -> None:
        """Power cycle."""
        self.run_mode = 0
        self.host = 0xFD

    def identifiers(self) -> Iterable[int]:
        """Whom a message is for stands in its last byte."""
        return (LAST_BYTE | self.drive_id,)

    def broadcasts(self) -> Iterable[int]:
        """None."""
        return ()

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """Apply one message."""
        kind, data = frame.identifier >> 24, frame.data
        if len(data) != 8:
            drive.flags |= DriveFlag.BAD_FRAME
            return Heard()
        if kind == CONTROL:
            drive.command(self._target(frame), now_s)
            return Heard((Answer.STATE,), steps=True)
        if kind == ENABLE:
            drive.request(Request.ENABLE, now_s)
        elif kind == STOP:
            drive.request(Request.CLEAR_FAULTS if data[0] else Request.DISABLE, now_s)
        elif kind == ZERO:
            drive.set_position(0.0)
        elif kind == WRITE:
            self._write(data, drive, now_s)
        elif kind in (WHO, READ):
            return Heard((Answer.ASKED,))
        else:
            return Heard()
        return Heard((Answer.STATE,))

    def _target(self, frame: Frame) -> Setpoint:
        m = self.model
        torque = frame.identifier >> 8 & 0xFFFF
        p, v, kp, kd = struct.unpack(">4H", frame.data)
        return Setpoint(
            to_float(p, -m.position, m.position, 16),
            to_float(v, -m.velocity, m.velocity, 16),
            to_float(torque, -m.torque, m.torque, 16),
            to_float(kp, 0.0, m.kp, 16),
            to_float(kd, 0.0, m.kd, 16),
        )

    def _write(self, data: bytes, drive: Drive, now_s: float) -> None:
        (parameter,) = struct.unpack_from("<H", data)
        (real,) = struct.unpack_from("<f", data, 4)
        if parameter == RUN_MODE:
            self.run_mode = data[4]
            drive.set_mode(MODES.get(data[4], Mode.IMPEDANCE))
        elif parameter == CAN_TIMEOUT:
            units = struct.unpack_from("<I", data, 4)[0]
            drive.config = replace(drive.config, command_timeout_s=units * TIMEOUT_UNIT_S)
        elif parameter == POSITION_TARGET:
            drive.command(drive.setpoint._replace(position_rad=real), now_s)
        elif parameter == VELOCITY_TARGET:
            drive.command(drive.setpoint._replace(velocity_rad_s=real), now_s)

    def answer(self, answer: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """The status, or what was asked for."""
        kind = frame.identifier >> 24
        if kind != CONTROL:  # which has the torque where the others have the host
            self.host = frame.identifier >> 8 & 0xFF
        host = self.host
        if answer is Answer.STATE:
            return self._status(host, drive.report())
        if kind == WHO:
            return Frame(self.drive_id << 8 | 0xFE, bytes(range(8)), extended=True)
        (parameter,) = struct.unpack_from("<H", frame.data)
        body = self._read(parameter, drive)
        data = struct.pack("<HH", parameter, 0) + body
        return Frame(READ << 24 | self.drive_id << 8 | host, data, extended=True)

    def _read(self, parameter: int, drive: Drive) -> bytes:
        if parameter == RUN_MODE:
            return struct.pack("<I", self.run_mode)
        if parameter == CAN_TIMEOUT:
            return struct.pack("<I", round(drive.config.command_timeout_s / TIMEOUT_UNIT_S))
        reals = {
            MECHANICAL_POSITION: drive.position_rad,
            MECHANICAL_VELOCITY: drive.velocity_rad_s,
            VBUS: 24.0,
        }
        return struct.pack("<f", reals.get(parameter, 0.0))

    def cyclic(self, drive: Drive, now_s: float) -> list[Frame]:
        """Nothing: it speaks when spoken to."""
        return []

    def _status(self, host: int, report: DriveReport) -> Frame:
        m = self.model
        mode = 2 if report.state is DriveState.ENABLED else 1 if report.state is DriveState.CALIBRATING else 0
        degrees = 0.0 if math.isnan(report.temperature_degC) else report.temperature_degC
        data = struct.pack(
            ">4H",
            to_uint(report.position_rad, -m.position, m.position, 16),
            to_uint(report.velocity_rad_s, -m.velocity, m.velocity, 16),
            to_uint(report.torque_Nm, -m.torque, m.torque, 16),
            round(10.0 * max(degrees, 0.0)),
        )
        extra = mode << 14 | faults(report) << 8 | self.drive_id
        return Frame(STATUS << 24 | extra << 8 | host, data, extended=True)


def faults(report: DriveReport) -> int:
    """Fault bits: 4 over temperature, 8 encoder, 16 stall or overload (whatever else stopped it)."""
    if report.state is not DriveState.FAULT:
        return 0
    if report.flags & DriveFlag.OVER_TEMPERATURE:
        return 4
    return 8 if report.flags & (DriveFlag.MOTOR_ENCODER | DriveFlag.INDEX_NOT_FOUND) else 16
