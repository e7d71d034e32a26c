"""ODrive CANSimple, device side: what it hears, and when it tells what. Identifier = node << 5 | command,
little-endian, angles in turns.

Two firmwares, which share most messages but not all: 0.5 (ODrive v3.x, both axes nodes of their own) and 0.6
(Pro, S1, Micro). What differs (here, in `odrive_errors.py`, in `odrive_messages.py`): error bits, the heartbeat's
last three bytes, what 0x03 to 0x06, 0x0A, 0x15, 0x19, 0x1C and 0x1D mean, and which messages feed the watchdog.
Every cyclic message also answers a remote request, or an empty frame in its place.

Sources: ODrive's message tables (`odrive-cansimple.dbc`) of 0.5.6 and 0.6.10; ODrive's documentation, "CAN
Protocol" of both; 0.5's published firmware (`can_simple.cpp`); ODrive's own CAN examples for addressing and
parameter access.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

from firmware_sim.errors import SimError
from firmware_sim.firmware import (
    Drive,
    DriveFlag,
    InputMode,
    Mode,
    Request,
    Setpoint,
)
from firmware_sim.wire.base import Answer, Heard
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.odrive_endpoints import serve
from firmware_sim.wire.odrive_errors import V05, V06
from firmware_sim.wire.odrive_messages import (
    CLOSED_LOOP,
    COUNTS_PER_TURN,
    IDLE,
    INVALID_STATE,
    NOT_CALIBRATED,
    SUCCESS,
    TELL_05,
    TELL_06,
    TURN,
    Axis,
)

CALIBRATIONS = (3, 4, 6, 7)
MODES = {1: Mode.TORQUE, 2: Mode.VELOCITY, 3: Mode.POSITION}
BROADCAST = 0x3F
ADDRESS, REBOOT, CLEAR = 0x06, 0x16, 0x18

FirmwareName = Literal["0.5", "0.6"]


@dataclass(frozen=True)
class OdriveRates:
    """Cyclic messages: every how many samples each goes out; 0 = only when asked. `temperature`, `torques` and
    `powers` are there in firmware 0.6 only."""

    heartbeat: int = 100
    encoder: int = 1
    error: int = 100
    iq: int = 10
    temperature: int = 100
    bus: int = 100
    torques: int = 1
    powers: int = 0


class OdriveWire:
    """A drive that speaks CANSimple; `node` 0…62, or 63 for one that was given no address yet;
    `torque_constant` in Nm/A turns current limits into torque limits."""

    def __init__(
        self,
        node: int,
        rates: OdriveRates | None = None,
        torque_constant: float = 0.1,
        firmware: FirmwareName = "0.6",
        serial: int | None = None,
    ) -> None:
        if not 0 <= node <= BROADCAST:
            raise SimError(f"odrive: node {node}; 0 to 63 is accepted")
        codes = {"0.5": V05, "0.6": V06}[firmware]
        self.axis = Axis(node, 0x3000_0000_0000 + node if serial is None else serial, torque_constant, codes)
        self._saved_node = node
        self.rates = OdriveRates() if rates is None else rates
        self._old = firmware == "0.5"
        self._hear = HEAR_05 if self._old else HEAR_06
        self._tell = TELL_05 if self._old else TELL_06
        self.reset()

    def reset(self) -> None:
        """Power cycle: counts start again."""
        self._samples = 0
        self._told: tuple[int, int] | None = None
        self.axis.result = SUCCESS
        self.axis.node = self._saved_node

    def identifiers(self) -> Iterable[int]:
        """Every command of the node."""
        return (self.axis.node << 5 | command for command in range(32))

    def broadcasts(self) -> Iterable[int]:
        """Addressing, reboot and identification of all nodes (firmware 0.6)."""
        return () if self._old else (BROADCAST << 5 | c for c in (ADDRESS, REBOOT, CLEAR))

    # ---- from the host ---------------------------------------------------------------------------

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """Apply one frame; a request is answered, a frame too short for its command is counted as bad."""
        command = frame.identifier & 0x1F
        fed = command in self.axis.codes.feeding or self._old
        if fed and not (frame.remote and not self._old):
            drive.feed_watchdog(now_s)
        asks = frame.remote or not frame.data
        if asks and command in self._tell:
            return Heard((Answer.ASKED,))
        action = self._hear.get(command)
        if frame.remote or action is None or len(frame.data) < action[0]:
            if command not in self._tell:
                drive.flags |= DriveFlag.BAD_FRAME
            return Heard()
        before = self.axis.node
        answers = action[1](self, frame.data, drive, now_s)
        return Heard(answers or (), command in (0x0C, 0x0D, 0x0E), self.axis.node != before)

    def _stop(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.request(Request.STOP, now_s)

    def _sdo(self, data: bytes, drive: Drive, now_s: float) -> tuple[Answer, ...]:
        self._sdo_answer = serve(data, drive)
        return () if self._sdo_answer is None else (Answer.ASKED,)

    def _address(self, data: bytes, drive: Drive, now_s: float) -> None:
        wanted, serial = data[0], int.from_bytes(data[1:7], "little")
        if serial == self.axis.serial:
            self.axis.node = wanted & 0x3F
        elif wanted == self.axis.node:
            self.axis.node = BROADCAST  # another drive is given this number: make room

    def _node_id(self, data: bytes, drive: Drive, now_s: float) -> None:
        self.axis.node = self._saved_node = struct.unpack_from("<I", data)[0] & 0x3F

    def _axis_state(self, data: bytes, drive: Drive, now_s: float) -> tuple[Answer, ...]:
        (wanted,) = struct.unpack_from("<I", data)
        if wanted == IDLE:
            accepted = drive.request(Request.DISABLE, now_s)
        elif wanted in CALIBRATIONS:
            accepted = drive.request(Request.CALIBRATE, now_s)
        elif wanted == CLOSED_LOOP:
            accepted = drive.request(Request.ENABLE, now_s)
        else:
            accepted = False
        self.axis.result = SUCCESS if accepted else INVALID_STATE
        if drive.flags & DriveFlag.NOT_CALIBRATED:
            self.axis.result = NOT_CALIBRATED
        return (Answer.STATUS,)

    def _controller_mode(self, data: bytes, drive: Drive, now_s: float) -> tuple[Answer, ...]:
        control, inputs = struct.unpack_from("<II", data)
        if control not in MODES or inputs not in InputMode.__members__.values():
            drive.refuse_mode()
            return (Answer.STATUS,)
        drive.set_mode(MODES[control], InputMode(inputs))
        return ()

    def _input_pos(self, data: bytes, drive: Drive, now_s: float) -> None:
        position, velocity, torque = struct.unpack_from("<fhh", data)
        drive.command(Setpoint(position * TURN, velocity * 1e-3 * TURN, torque * 1e-3), now_s)

    def _input_vel(self, data: bytes, drive: Drive, now_s: float) -> None:
        velocity, torque = struct.unpack_from("<ff", data)
        drive.command(drive.setpoint._replace(velocity_rad_s=velocity * TURN, torque_Nm=torque), now_s)

    def _input_torque(self, data: bytes, drive: Drive, now_s: float) -> None:
        (torque,) = struct.unpack_from("<f", data)
        drive.command(drive.setpoint._replace(torque_Nm=torque), now_s)

    def _limits(self, data: bytes, drive: Drive, now_s: float) -> None:
        velocity, current = struct.unpack_from("<ff", data)
        drive.set_limits(velocity * TURN, current * self.axis.torque_constant)

    def _trajectory_velocity(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.shaper.config.trajectory_velocity_rad_s = struct.unpack_from("<f", data)[0] * TURN

    def _trajectory_acceleration(self, data: bytes, drive: Drive, now_s: float) -> None:
        up, down = struct.unpack_from("<ff", data)
        drive.shaper.config.trajectory_acceleration_rad_s2 = up * TURN
        drive.shaper.config.trajectory_deceleration_rad_s2 = down * TURN

    def _inertia(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.shaper.config.inertia_Nms2_per_rad = struct.unpack_from("<f", data)[0] / TURN

    def _reboot(self, data: bytes, drive: Drive, now_s: float) -> None:
        action = data[0] if data else 0
        if action == 1:
            self._saved_node = self.axis.node
        elif action == 2:
            self._saved_node = BROADCAST
        drive.request(Request.RESET, now_s)
        self.reset()

    def _clear(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.request(Request.CLEAR_FAULTS, now_s)
        self.axis.disarm_reason, self.axis.result = 0, SUCCESS

    def _absolute(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.set_position(struct.unpack_from("<f", data)[0] * TURN)

    def _linear_count(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.set_position(struct.unpack_from("<i", data)[0] * TURN / COUNTS_PER_TURN)

    def _pos_gain(self, data: bytes, drive: Drive, now_s: float) -> None:
        drive.set_gains(position=struct.unpack_from("<f", data)[0])

    def _vel_gains(self, data: bytes, drive: Drive, now_s: float) -> None:
        gain, integrator = struct.unpack_from("<ff", data)
        drive.set_gains(velocity=gain / TURN, integrator=integrator / TURN)

    # ---- to the host -----------------------------------------------------------------------------

    def answer(self, answer: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """The message asked for; a change of state is answered by a heartbeat."""
        command = 0x01 if answer is Answer.STATUS else frame.identifier & 0x1F
        if command == 0x04 and not self._old:
            return None if self._sdo_answer is None else Frame(self.axis.node << 5 | 0x05, self._sdo_answer)
        return self._message(command, drive)

    _sdo_answer: bytes | None = None

    def cyclic(self, drive: Drive, now_s: float) -> list[Frame]:
        """Messages that are due at this sample; the heartbeat also at once when state or errors change."""
        report = drive.report()
        state = (report.state, self.axis.codes.axis(report))
        count, rates = self._samples, self.rates
        self._samples += 1
        due = []
        if state != self._told or (rates.heartbeat and count % rates.heartbeat == 0):
            self._told = state
            due.append(0x01)
        periods = [(0x09, rates.encoder), (0x03, rates.error), (0x14, rates.iq), (0x17, rates.bus)]
        if not self._old:
            periods += [(0x15, rates.temperature), (0x1C, rates.torques), (0x1D, rates.powers)]
        due += [command for command, every in periods if every and count % every == 0]
        return [self._message(command, drive) for command in due]

    def _message(self, command: int, drive: Drive) -> Frame:
        return Frame(self.axis.node << 5 | command, self._tell[command](self.axis, drive, drive.report()))


Hear = Callable[[OdriveWire, bytes, Drive, float], tuple[Answer, ...] | None]
_HEAR: dict[int, tuple[int, Hear]] = {
    0x02: (0, OdriveWire._stop),
    0x07: (4, OdriveWire._axis_state),
    0x0B: (8, OdriveWire._controller_mode),
    0x0C: (8, OdriveWire._input_pos),
    0x0D: (8, OdriveWire._input_vel),
    0x0E: (4, OdriveWire._input_torque),
    0x0F: (8, OdriveWire._limits),
    0x11: (4, OdriveWire._trajectory_velocity),
    0x12: (8, OdriveWire._trajectory_acceleration),
    0x13: (4, OdriveWire._inertia),
    0x16: (0, OdriveWire._reboot),
    0x18: (0, OdriveWire._clear),
    0x1A: (4, OdriveWire._pos_gain),
    0x1B: (8, OdriveWire._vel_gains),
}
HEAR_05 = {**_HEAR, 0x06: (4, OdriveWire._node_id), 0x19: (4, OdriveWire._linear_count)}
HEAR_06: dict[int, tuple[int, Hear]] = {
    **_HEAR,
    0x04: (4, OdriveWire._sdo),
    0x06: (7, OdriveWire._address),
    0x19: (4, OdriveWire._absolute),
}
