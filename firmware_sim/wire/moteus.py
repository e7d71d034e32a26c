"""A moteus, device side: registers over CAN FD (`moteus_frames`); turns of the output shaft.

Identifier = source << 8 | drive, bit 15 asks for a reply on drive << 8 | source. Writing the mode begins a command:
what it leaves out is at its default. The position mode's torque = kp kp_scale (p - q) + kd kd_scale (v - dq) +
feed-forward, held to the maximum torque; the position moves on with the velocity, and without one of its own (NaN)
goes on from where it was. In fault and time-out every mode but stopped is refused. Registers of the encoders: 0 the
motor's, 1 the joint's, where they are in a turn.

Sources: mjbots, moteus "CAN Protocol", "Register Reference", control law of the "Reference"; its firmware
(`moteus_controller.cc`, `bldc_servo_control.h`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

from firmware_sim.errors import SimError
from firmware_sim.firmware import Drive, DriveFlag, DriveReport, DriveState, Mode, Request, Setpoint
from firmware_sim.wire.base import Answer, Heard
from firmware_sim.wire.frame import FD, LAST_BYTE, Frame
from firmware_sim.wire.moteus_frames import (
    CURRENT,
    POSITION,
    SHARE,
    TEMPERATURE,
    TIME,
    TORQUE,
    VELOCITY,
    VOLTAGE,
    WHOLE,
    BadFrame,
    Read,
    Scale,
    Write,
    answer,
    decode,
    filled,
    parse,
)

TURN = 2.0 * math.pi
STOPPED, FAULTED, PREPARING, POSITION_MODE, TIMEOUT = 0, 1, 3, 10, 11
BUS_V = 24.0
MODE, SET_NEAREST, SET_EXACT = 0x000, 0x130, 0x131
FIRMWARE, MAP_VERSION, MODEL = 0x000400, 5, 0x0301

FAULT_CODES = (
    (DriveFlag.OVER_TEMPERATURE, 38),
    (DriveFlag.MOTOR_ENCODER, 35),
    (DriveFlag.POSITION_LIMIT, 39),
    (DriveFlag.NOT_CALIBRATED, 36),
    (DriveFlag.INDEX_NOT_FOUND, 43),
)
DRIVER_FAULT = 33
NO_TORQUE = 1e-12


@dataclass
class Command:
    """What a write of the mode begins: registers 0x20 to 0x2B, at their defaults."""

    mode: int = STOPPED
    values: dict[int, float] = field(
        default_factory=lambda: {
            0x20: 0.0,
            0x21: 0.0,
            0x22: 0.0,
            0x23: 1.0,
            0x24: 1.0,
            0x25: math.nan,
            0x26: math.nan,
            0x27: 0.0,
            0x28: math.nan,
            0x29: math.nan,
            0x2B: 1.0,
        }
    )


COMMANDS: dict[int, Scale] = {
    0x20: POSITION,
    0x21: VELOCITY,
    0x22: TORQUE,
    0x23: SHARE,
    0x24: SHARE,
    0x25: TORQUE,
    0x26: POSITION,
    0x27: TIME,
    0x28: VELOCITY,
    0x29: VELOCITY,
    0x2B: SHARE,
}


class MoteusWire:
    """A moteus of number `node`; `kp` (N m/turn) and `kd` (N m s/turn) as they were configured."""

    def __init__(self, node: int, kp: float = 4.0, kd: float = 0.05) -> None:
        if not 1 <= node <= 127:
            raise SimError(f"moteus: number {node}; 1 to 127 is accepted")
        self.node, self.kp, self.kd = node, kp, kd
        self.reset()

    def reset(self) -> None:
        """Power cycle."""
        self._command = Command()
        self._control_rad: float | None = None
        self._moved_s = 0.0
        self._reads: list[Read] = []

    def identifiers(self) -> Iterable[int]:
        """From any source, with or without a reply."""
        return (LAST_BYTE | FD | self.node, *(FD | source << 8 | self.node for source in range(8)))

    def broadcasts(self) -> Iterable[int]:
        """None."""
        return ()

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """Apply the writes in order, then take what mode they ask for; the reads are answered together."""
        if frame.identifier >> 16:
            return Heard()
        begun: Command | None = None
        self._reads = []
        try:
            for part in parse(frame.data):
                if isinstance(part, Read):
                    self._reads.append(part)
                elif part.register == MODE:
                    begun = Command(int(part.raw))
                else:
                    self._write(part, begun or self._command, drive)
        except BadFrame:
            drive.flags |= DriveFlag.BAD_FRAME
        if begun is not None:
            self._command = begun
            self._begin(begun, drive, now_s)
        steps = begun is not None and begun.mode == POSITION_MODE
        return Heard((Answer.ASKED,) if frame.identifier & 0x8000 else (), steps)

    def _write(self, part: Write, command: Command, drive: Drive) -> None:
        if part.register in COMMANDS:
            command.values[part.register] = decode(part, COMMANDS[part.register])
        elif part.register in (SET_NEAREST, SET_EXACT):
            drive.set_position(TURN * decode(part, POSITION))
            self._control_rad = None

    def _begin(self, command: Command, drive: Drive, now_s: float) -> None:
        if command.mode == STOPPED:
            self._control_rad = None
            cleared = drive.state is DriveState.FAULT and drive.request(Request.CLEAR_FAULTS, now_s)
            if not cleared:
                drive.request(Request.DISABLE, now_s)
            return
        if command.mode != POSITION_MODE:
            drive.refuse_mode()
            return
        if drive.state is DriveState.FAULT:
            return
        if drive.state is DriveState.DISABLED:
            drive.request(Request.ENABLE, now_s)
            drive.set_mode(Mode.IMPEDANCE)
        self._move_on(drive, now_s)
        v = command.values
        top = drive.base.torque_limit_Nm if math.isnan(v[0x25]) else max(v[0x25], NO_TORQUE)
        drive.config = replace(drive.config, torque_limit_Nm=min(top, drive.base.torque_limit_Nm))
        timeout = drive.base.command_timeout_s if v[0x27] == 0.0 else v[0x27]
        drive.config = replace(drive.config, command_timeout_s=0.0 if math.isnan(timeout) else timeout)
        if not math.isnan(v[0x20]):
            self._control_rad = TURN * v[0x20]
        elif self._control_rad is None:
            self._control_rad = drive.position_rad
        velocity = 0.0 if math.isnan(v[0x21]) else TURN * v[0x21]
        kp, kd = self.kp * v[0x23] / TURN, self.kd * v[0x24] / TURN
        drive.command(Setpoint(self._control_rad, velocity, v[0x22], kp, kd), now_s)

    def cyclic(self, drive: Drive, now_s: float) -> list[Frame]:
        """Nothing by itself; the control position moves on."""
        self._move_on(drive, now_s)
        return []

    def _move_on(self, drive: Drive, now_s: float) -> None:
        """The control position, moved on at the velocity of the last command until now."""
        passed, self._moved_s = now_s - self._moved_s, now_s
        moving = drive.setpoint.velocity_rad_s
        if self._control_rad is not None and drive.state is DriveState.ENABLED and moving:
            self._control_rad += moving * passed
            drive.setpoint = drive.setpoint._replace(position_rad=self._control_rad)

    def answer(self, answer_: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """One frame with all that was asked for."""
        report = drive.report()
        data = b""
        for read in self._reads:
            data += answer(read, [self._read(read.first + k, report) for k in range(read.registers)])
        number = self.node << 8 | frame.identifier >> 8 & 0x7F
        try:
            return Frame(number, filled(data), extended=number > 0x7FF, fd=True, switch=True)
        except BadFrame:
            drive.flags |= DriveFlag.BAD_FRAME
            return None

    def _read(self, register: int, report: DriveReport) -> tuple[float, Scale] | None:
        if register in COMMANDS:
            return self._command.values[register], COMMANDS[register]
        found = REGISTERS.get(register)
        return None if found is None else (found[0](self, report), found[1])


def mode_of(report: DriveReport) -> int:
    """Register 0x000."""
    if report.state is DriveState.FAULT:
        return TIMEOUT if report.flags & DriveFlag.COMMAND_TIMEOUT else FAULTED
    modes = {
        DriveState.DISABLED: STOPPED,
        DriveState.CALIBRATING: PREPARING,
        DriveState.ENABLED: POSITION_MODE,
    }
    return modes[report.state]


def fault_of(report: DriveReport) -> int:
    """Register 0x00F."""
    if mode_of(report) != FAULTED:
        return 0
    return next((code for flag, code in FAULT_CODES if report.flags & flag), DRIVER_FAULT)


def _in_turn(angle_rad: float) -> float:
    return math.nan if math.isnan(angle_rad) else angle_rad / TURN % 1.0


def _validity(report: DriveReport) -> int:
    return 3 | (0 if math.isnan(report.second_position_rad) else 12)


Tell = Callable[[MoteusWire, DriveReport], float]
REGISTERS: dict[int, tuple[Tell, Scale]] = {
    MODE: (lambda w, r: mode_of(r), WHOLE),
    0x001: (lambda w, r: r.position_rad / TURN, POSITION),
    0x002: (lambda w, r: r.velocity_rad_s / TURN, VELOCITY),
    0x003: (lambda w, r: r.torque_Nm, TORQUE),
    0x004: (lambda w, r: r.current_A, CURRENT),
    0x005: (lambda w, r: 0.0, CURRENT),
    0x006: (lambda w, r: _in_turn(r.second_position_rad), POSITION),
    0x007: (lambda w, r: 0.0, WHOLE),
    0x00A: (lambda w, r: 0.0, TEMPERATURE),
    0x00B: (lambda w, r: 1, WHOLE),
    0x00C: (lambda w, r: 1, WHOLE),
    0x00D: (lambda w, r: BUS_V, VOLTAGE),
    0x00E: (lambda w, r: r.temperature_degC, TEMPERATURE),
    0x00F: (lambda w, r: fault_of(r), WHOLE),
    0x03A: (lambda w, r: r.torque_command_Nm, TORQUE),
    0x050: (lambda w, r: _in_turn(r.position_rad), POSITION),
    0x051: (lambda w, r: r.velocity_rad_s / TURN, VELOCITY),
    0x052: (lambda w, r: _in_turn(r.second_position_rad), POSITION),
    0x053: (lambda w, r: r.second_velocity_rad_s / TURN, VELOCITY),
    0x058: (lambda w, r: _validity(r), WHOLE),
    0x100: (lambda w, r: MODEL, WHOLE),
    0x101: (lambda w, r: FIRMWARE, WHOLE),
    0x102: (lambda w, r: MAP_VERSION, WHOLE),
    0x110: (lambda w, r: w.node, WHOLE),
    0x120: (lambda w, r: w.node, WHOLE),
    0x121: (lambda w, r: 0, WHOLE),
    0x122: (lambda w, r: 0, WHOLE),
}
