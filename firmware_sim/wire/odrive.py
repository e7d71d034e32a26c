"""ODrive CANSimple, device side: identifier = node << 5 | command, little-endian, angles in turns.

Heartbeat (0x01), encoder estimates (0x09), Iq (0x14), temperature (0x15), bus voltage and current (0x17)
and torques
(0x1C) go out by themselves at the rates of the configuration; each of them, and version (0x00) and error
(0x03), also
answers a remote request. Source: ODrive documentation, "CAN Protocol", and its message table (firmware 0.6).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from firmware_sim.errors import SimError
from firmware_sim.firmware import Drive, DriveFlag, DriveReport, DriveState, Mode, Request, Setpoint
from firmware_sim.wire.base import Answer, Heard
from firmware_sim.wire.frame import Frame

TURN = 2.0 * math.pi
IDLE, INDEX_SEARCH, CLOSED_LOOP = 1, 6, 8
CALIBRATIONS = (3, 4, 6, 7)
MODES = {1: Mode.TORQUE, 2: Mode.VELOCITY, 3: Mode.POSITION}
PASSTHROUGH = 1
SUCCESS, BUSY, DISARMED, INVALID_STATE, NOT_CALIBRATED = 0, 1, 3, 13, 14
ERRORS = (
    (DriveFlag.STARTED_AFRESH, 0),
    (DriveFlag.MOTOR_ENCODER, 0x8),
    (DriveFlag.OVER_TEMPERATURE, 0x2000),
    (DriveFlag.OVER_VELOCITY, 0x8000),
    (DriveFlag.POSITION_LIMIT, 0x1_0000),
    (DriveFlag.COMMAND_TIMEOUT, 0x100_0000),
    (DriveFlag.EMERGENCY_STOP, 0x200_0000),
    (DriveFlag.INDEX_NOT_FOUND, 0x4000_0000),
)


@dataclass(frozen=True)
class OdriveRates:
    """Cyclic messages: every how many samples each goes out; 0 = only when asked."""

    heartbeat: int = 100
    encoder: int = 1
    iq: int = 0
    temperature: int = 100
    bus: int = 0
    torques: int = 1


def error_bits(report: DriveReport) -> int:
    """Active errors in ODrive's bits."""
    if report.state is not DriveState.FAULT:
        return 0
    return sum(bit for flag, bit in ERRORS if report.flags & flag)


class OdriveWire:
    """A drive that speaks CANSimple; `node` 0…62, `torque_constant` in Nm/A turns current limits into
    torque limits."""

    def __init__(self, node: int, rates: OdriveRates | None = None, torque_constant: float = 0.1) -> None:
        if not 0 <= node <= 0x3E:
            raise SimError(f"odrive: node {node}; 0 to 62 is accepted")
        self.node = node
        self.rates = OdriveRates() if rates is None else rates
        self.torque_constant = torque_constant
        self._disarm_reason = 0
        self._result = SUCCESS
        self.reset()

    def reset(self) -> None:
        """Power cycle: counts start again."""
        self._samples = 0
        self._told: tuple[int, int] | None = None
        self._result = SUCCESS

    def identifiers(self) -> Iterable[int]:
        """Every command of the node."""
        return (self.node << 5 | command for command in range(32))

    # ---- from the host ---------------------------------------------------------------------------

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """Apply one frame; a remote request is answered, a frame too short for its command is counted as
        bad."""
        command = frame.identifier & 0x1F
        if frame.remote:
            return Heard((Answer.ASKED,)) if command in TELL else Heard()
        action = HEAR.get(command)
        if action is None or len(frame.data) < action[0]:
            if command not in TELL:
                drive.flags |= DriveFlag.BAD_FRAME
            return Heard()
        action[1](self, frame.data, drive, now_s)
        drive.feed_watchdog(now_s)
        if command == 0x07:
            return Heard((Answer.STATUS,))
        return Heard(steps=command in (0x0C, 0x0D, 0x0E))

    def _stop(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.request(Request.STOP, now_s)

    def _axis_state(self, data: bytes, drive: Drive, now_s: float) -> None:
        (wanted,) = struct.unpack_from("<I", data)
        if wanted == IDLE:
            accepted = drive.request(Request.DISABLE, now_s)
        elif wanted in CALIBRATIONS:
            accepted = drive.request(Request.CALIBRATE, now_s)
        elif wanted == CLOSED_LOOP:
            accepted = drive.request(Request.ENABLE, now_s)
        else:
            accepted = False
        self._result = SUCCESS if accepted else INVALID_STATE
        if drive.flags & DriveFlag.NOT_CALIBRATED:
            self._result = NOT_CALIBRATED

    def _controller_mode(self, data: bytes, drive: Drive, now_s: float) -> None:
        control, shaping = struct.unpack_from("<II", data)
        if control not in MODES or shaping != PASSTHROUGH:
            drive.flags |= DriveFlag.BAD_FRAME  # the simulated drive has no ramps and no filters
            return
        drive.set_mode(MODES[control])

    def _input_pos(self, data: bytes, drive: Drive, now_s: float) -> None:
        position, velocity, torque = struct.unpack_from("<fhh", data)
        drive.command(Setpoint(position * TURN, velocity * 1e-3 * TURN, torque * 1e-3), now_s)

    def _input_vel(self, data: bytes, drive: Drive, now_s: float) -> None:
        velocity, torque = struct.unpack_from("<ff", data)
        drive.command(Setpoint(drive.setpoint.position_rad, velocity * TURN, torque), now_s)

    def _input_torque(self, data: bytes, drive: Drive, now_s: float) -> None:
        (torque,) = struct.unpack_from("<f", data)
        drive.command(Setpoint(drive.setpoint.position_rad, 0.0, torque), now_s)

    def _limits(self, data: bytes, drive: Drive, now_s: float) -> None:
        velocity, current = struct.unpack_from("<ff", data)
        drive.set_limits(velocity * TURN, current * self.torque_constant)

    def _reboot(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.request(Request.RESET, now_s)
        self.reset()

    def _clear(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.request(Request.CLEAR_FAULTS, now_s)
        self._disarm_reason, self._result = 0, SUCCESS

    def _absolute(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.set_position(struct.unpack_from("<f", data)[0] * TURN)

    def _pos_gain(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.set_gains(position=struct.unpack_from("<f", data)[0])

    def _vel_gains(self, data: bytes, drive: Drive, now_s: float) -> None:
        gain, integrator = struct.unpack_from("<ff", data)
        drive.set_gains(velocity=gain / TURN, integrator=integrator / TURN)

    # ---- to the host -----------------------------------------------------------------------------

    def answer(self, answer: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """The message asked for; a change of state is answered by a heartbeat."""
        command = 0x01 if answer is Answer.STATUS else frame.identifier & 0x1F
        return self._message(command, drive.report())

    def cyclic(self, drive: Drive, now_s: float) -> list[Frame]:
        """Messages that are due at this sample; the heartbeat also at once when state or errors change."""
        report = drive.report()
        state = (report.state, error_bits(report))
        count, rates = self._samples, self.rates
        self._samples += 1
        due = []
        if state != self._told or (rates.heartbeat and count % rates.heartbeat == 0):
            self._told = state
            due.append(0x01)
        for command, every in (
            (0x09, rates.encoder),
            (0x14, rates.iq),
            (0x15, rates.temperature),
            (0x17, rates.bus),
            (0x1C, rates.torques),
        ):
            if every and count % every == 0:
                due.append(command)
        return [self._message(command, report) for command in due]

    def _message(self, command: int, report: DriveReport) -> Frame:
        return Frame(self.node << 5 | command, TELL[command](self, report))

    def _tell_version(self, report: DriveReport) -> bytes:
        return bytes((2, 4, 4, 58, 0, 6, 10, 0))

    def _tell_heartbeat(self, report: DriveReport) -> bytes:
        state = {DriveState.ENABLED: CLOSED_LOOP, DriveState.CALIBRATING: INDEX_SEARCH}.get(
            report.state, IDLE
        )
        errors = error_bits(report)
        if errors:
            self._disarm_reason = errors
        result = DISARMED if errors else BUSY if state == INDEX_SEARCH else self._result
        return struct.pack("<IBBBB", errors, state, result, 0, 0)

    def _tell_error(self, report: DriveReport) -> bytes:
        return struct.pack("<II", error_bits(report), self._disarm_reason)

    def _tell_encoder(self, report: DriveReport) -> bytes:
        return struct.pack("<ff", report.position_rad / TURN, report.velocity_rad_s / TURN)

    def _tell_iq(self, report: DriveReport) -> bytes:
        return struct.pack("<ff", report.torque_command_Nm / self.torque_constant, report.current_A)

    def _tell_temperature(self, report: DriveReport) -> bytes:
        return struct.pack("<ff", report.temperature_degC, report.temperature_degC)

    def _tell_bus(self, report: DriveReport) -> bytes:
        power = report.torque_Nm * report.velocity_rad_s
        return struct.pack("<ff", 24.0, power / 24.0)

    def _tell_torques(self, report: DriveReport) -> bytes:
        return struct.pack("<ff", report.torque_command_Nm, report.torque_Nm)


Hear = Callable[[OdriveWire, bytes, Drive, float], None]
HEAR: dict[int, tuple[int, Hear]] = {
    0x02: (0, OdriveWire._stop),
    0x07: (4, OdriveWire._axis_state),
    0x0B: (8, OdriveWire._controller_mode),
    0x0C: (8, OdriveWire._input_pos),
    0x0D: (8, OdriveWire._input_vel),
    0x0E: (4, OdriveWire._input_torque),
    0x0F: (8, OdriveWire._limits),
    0x16: (0, OdriveWire._reboot),
    0x18: (0, OdriveWire._clear),
    0x19: (4, OdriveWire._absolute),
    0x1A: (4, OdriveWire._pos_gain),
    0x1B: (8, OdriveWire._vel_gains),
}
TELL: dict[int, Callable[[OdriveWire, DriveReport], bytes]] = {
    0x00: OdriveWire._tell_version,
    0x01: OdriveWire._tell_heartbeat,
    0x03: OdriveWire._tell_error,
    0x09: OdriveWire._tell_encoder,
    0x14: OdriveWire._tell_iq,
    0x15: OdriveWire._tell_temperature,
    0x17: OdriveWire._tell_bus,
    0x1C: OdriveWire._tell_torques,
}
