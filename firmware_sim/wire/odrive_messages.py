"""What a simulated ODrive tells: the payload of every message of both firmwares, from the axis and its drive's report.

Sources: as of `odrive.py`.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass

from firmware_sim.firmware import Drive, DriveReport, DriveState
from firmware_sim.wire.odrive_errors import Codes

TURN = 2.0 * math.pi
IDLE, INDEX_SEARCH, CLOSED_LOOP = 1, 6, 8
SUCCESS, BUSY, DISARMED, INVALID_STATE, NOT_CALIBRATED = 0, 1, 3, 13, 14
COUNTS_PER_TURN = 8192
BUS_V = 24.0


@dataclass
class Axis:
    """What the messages tell beside the drive: address, serial number, torque per current (Nm/A), error words, the
    last request's result, why the drive let go."""

    node: int
    serial: int
    torque_constant: float
    codes: Codes
    result: int = SUCCESS
    disarm_reason: int = 0

    def errors_and_state(self, report: DriveReport) -> tuple[int, int]:
        """The axis's error word and state."""
        state = {DriveState.ENABLED: CLOSED_LOOP, DriveState.CALIBRATING: INDEX_SEARCH}.get(
            report.state, IDLE
        )
        errors = self.codes.axis(report)
        if errors:
            self.disarm_reason = errors
        return errors, state


def _version(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return bytes((2, 4, 4, 58, 0, 6, 10, 0))


def _heartbeat(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    errors, state = axis.errors_and_state(report)
    result = DISARMED if errors else BUSY if state == INDEX_SEARCH else axis.result
    return struct.pack("<IBBBB", errors, state, result, drive.shaper.trajectory_done, 0)


def _heartbeat_05(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    errors, state = axis.errors_and_state(report)
    c = axis.codes
    controller = (c.controller(report) != 0) | drive.shaper.trajectory_done << 7
    return struct.pack("<IBBBB", errors, state, c.motor(report) != 0, c.encoder(report) != 0, controller)


def _error(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return struct.pack("<II", axis.codes.axis(report), axis.disarm_reason)


def _motor_error(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return struct.pack("<Q", axis.codes.motor(report))


def _encoder_error(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return struct.pack("<II", axis.codes.encoder(report), 0)


def _controller_error(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return struct.pack("<II", axis.codes.controller(report), 0)


def _nothing(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return bytes(8)  # sensorless estimator and its errors: there is none here


def _address(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return bytes((axis.node,)) + axis.serial.to_bytes(6, "little") + b"\x00"


def _encoder(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return struct.pack("<ff", report.position_rad / TURN, report.velocity_rad_s / TURN)


def _count(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    count = round(report.position_rad / TURN * COUNTS_PER_TURN)
    return struct.pack("<ii", count, count % COUNTS_PER_TURN)


def _iq(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return struct.pack("<ff", report.torque_command_Nm / axis.torque_constant, report.current_A)


def _temperature(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return struct.pack("<ff", report.temperature_degC, report.temperature_degC)


def _bus(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return struct.pack("<ff", BUS_V, report.torque_Nm * report.velocity_rad_s / BUS_V)


def _torques(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    return struct.pack("<ff", report.torque_command_Nm, report.torque_Nm)


def _powers(axis: Axis, drive: Drive, report: DriveReport) -> bytes:
    power = report.torque_Nm * report.velocity_rad_s
    return struct.pack("<ff", power, power)  # the simulated motor loses nothing


Tell = Callable[[Axis, Drive, DriveReport], bytes]
_TELL: dict[int, Tell] = {
    0x09: _encoder,
    0x14: _iq,
    0x17: _bus,
}
TELL_05: dict[int, Tell] = {
    **_TELL,
    0x01: _heartbeat_05,
    0x03: _motor_error,
    0x04: _encoder_error,
    0x05: _nothing,
    0x0A: _count,
    0x15: _nothing,
    0x1D: _controller_error,
}
TELL_06: dict[int, Tell] = {
    **_TELL,
    0x00: _version,
    0x01: _heartbeat,
    0x03: _error,
    0x06: _address,
    0x15: _temperature,
    0x1C: _torques,
    0x1D: _powers,
}
