"""A CANopen drive of profile CiA 402, device side: power state machine, cyclic synchronous modes (CSP, CSV, CST),
PDOs at SYNC or by event, SDO, heartbeats, emergencies.

After power-up: 0x6040 and 0x6060 by the first PDO to the drive, 0x6041 and 0x6061 by its own first one, by event
(CiA 402-3). Nobody's heartbeat is waited for until 0x1016 names one and it has been heard once; when it stays out:
emergency 0x8130 and fault. Sources: CiA 402-2 (state machine, statusword, modes), CiA 402-3 (mapping), CiA 301.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

from firmware_sim.firmware import Drive, DriveFlag, DriveState, Mode, Request, Setpoint
from firmware_sim.wire.base import Answer, Heard
from firmware_sim.wire.canopen_node import BOOTING, OPERATIONAL, STOPPED, Node, Pdo
from firmware_sim.wire.canopen_objects import RANGE, Abort, Entry
from firmware_sim.wire.frame import Frame

TURN = 2.0 * math.pi
MODES = {8: Mode.POSITION, 9: Mode.VELOCITY, 10: Mode.TORQUE}
DISABLED, READY, SWITCHED_ON, OPERATION = range(4)
STATUSWORDS = (0x0250, 0x0231, 0x0233, 0x0237)
FAULT_WORD, FOLLOWS = 0x0218, 1 << 12
ERRORS = (
    (DriveFlag.COMMAND_TIMEOUT, 0x8130),
    (DriveFlag.OVER_TEMPERATURE, 0x4310),
    (DriveFlag.MOTOR_ENCODER, 0x7305),
    (DriveFlag.OVER_VELOCITY, 0x8400),
    (DriveFlag.POSITION_LIMIT, 0x8612),
    (DriveFlag.BAD_MODE, 0x6320),
)
ANSWERS = (Answer.STATE, Answer.STATUS, Answer.ASKED)


class Units(NamedTuple):
    """Counts per turn of position, per turn/s of velocity, per turn of the joint's encoder; rated torque in Nm."""

    position: float = 65536.0
    velocity: float = 65536.0
    second: float = 1048576.0
    rated_torque: float = 10.0


class Cia402Wire:
    """A drive of node number `number`."""

    def __init__(self, number: int, units: Units | None = None) -> None:
        self.number, self.units = number, Units() if units is None else units
        self.reset()

    def reset(self) -> None:
        """Power cycle: the mapping is forgotten, and the boot-up message comes again."""
        self._drive: Drive | None = None
        self._ladder = DISABLED
        self._control = self._error = 0
        self._now_s = 0.0
        self._buffer: dict[tuple[int, int], bytes] = {}
        self._reply = b""
        self._emergencies: list[int] = []
        self._told: bytes | None = None
        self.node = Node(self.number)
        o, u = self.node.objects, self.units
        o.entries |= {
            (0x1000, 0): Entry(4, 0x0002_0192, writable=False),
            (0x1001, 0): Entry(1, writable=False, tell=lambda: 1 if self._error else 0),
            (0x1018, 0): Entry(1, 1, writable=False),
            (0x1018, 1): Entry(4, 0, writable=False),
            (0x603F, 0): Entry(2, writable=False, tell=lambda: self._error),
            (0x6040, 0): Entry(2, accept=self._controlword),
            (0x6041, 0): Entry(2, writable=False, tell=self._statusword),
            (0x6060, 0): Entry(1, 8, signed=True, accept=self._set_mode),
            (0x6061, 0): Entry(1, signed=True, writable=False, tell=lambda: self._mode),
            (0x6064, 0): self._reading(4, lambda d: d.position_rad / TURN * u.position),
            (0x606C, 0): self._reading(4, lambda d: d.velocity_rad_s / TURN * u.velocity),
            (0x6071, 0): Entry(2, signed=True),
            (0x6076, 0): Entry(4, round(1e3 * u.rated_torque), writable=False),
            (0x6077, 0): self._reading(2, lambda d: d.report().torque_Nm / u.rated_torque * 1e3),
            (0x607A, 0): Entry(4, signed=True),
            (0x60B2, 0): Entry(2, signed=True),
            (0x60C2, 0): Entry(1, 2, writable=False),
            (0x60C2, 1): Entry(1, 1),
            (0x60C2, 2): Entry(1, -3, signed=True),
            (0x60E4, 0): Entry(1, 1, writable=False),
            (0x60E4, 1): self._reading(4, lambda d: d.report().second_position_rad / TURN * u.second),
            (0x60FF, 0): Entry(4, signed=True),
            (0x6502, 0): Entry(4, 1 << 7 | 1 << 8 | 1 << 9, writable=False),
        }
        self.heard = Pdo(o, 0x1400, 0, 0x200 + self.number, (0x6040_0010, 0x6060_0008))
        mapped = ((0x6041_0010, 0x6061_0008), (0x6041_0010, 0x6064_0020), (0x6041_0010, 0x606C_0020))
        self.sent = [
            Pdo(o, 0x1800, k, (0x8000_0000 if k else 0) | 0x180 + 0x100 * k + self.number, m)
            for k, m in enumerate(mapped)
        ]

    def _reading(self, size: int, read: Callable[[Drive], float]) -> Entry:
        def tell() -> int:
            value = math.nan if self._drive is None else read(self._drive)
            return round(value) if math.isfinite(value) else 0

        return Entry(size, signed=True, writable=False, tell=tell)

    # ---- what is heard ---------------------------------------------------------------------------

    def identifiers(self) -> Iterable[int]:
        """Its SDO requests and its PDO."""
        return (0x600 + self.number, 0x200 + self.number)

    def broadcasts(self) -> Iterable[int]:
        """NMT, SYNC, and the heartbeat that is waited for."""
        watched = self.node.watched
        return (0x000, 0x080) if watched is None else (0x000, 0x080, watched)

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """Apply one frame."""
        self._drive, self._now_s = drive, now_s
        if frame.identifier == 0x000:
            return self._hear_nmt(frame.data, drive, now_s)
        if frame.identifier == self.node.watched:
            return self._hear_host(drive, now_s)
        if frame.identifier == 0x600 + self.number:
            return self._hear_sdo(frame.data)
        if self.node.state != OPERATIONAL:
            return Heard()
        if frame.identifier == 0x080:
            self._take_over(drive, now_s)
            due = (a for a, pdo in zip(ANSWERS, self.sent, strict=True) if pdo.on and pdo.synchronous)
            return Heard(tuple(due), steps=True)
        if frame.identifier == 0x200 + self.number and self.heard.on:
            self._hear_pdo(frame.data, drive, now_s)
        return Heard()

    def _hear_sdo(self, data: bytes) -> Heard:
        if len(data) != 8 or self.node.state in (STOPPED, BOOTING):
            return Heard()
        before = self.node.watched
        self._reply = self.node.objects.serve(data)
        return Heard((Answer.ASKED,), moved=self.node.watched != before)

    def _hear_pdo(self, data: bytes, drive: Drive, now_s: float) -> None:
        brought = self.heard.unpack(data)
        if brought is None:
            self._emergencies.append(0x8210)
            return
        self._buffer = brought
        if not self.heard.synchronous:
            self._take_over(drive, now_s)

    def _hear_nmt(self, data: bytes, drive: Drive, now_s: float) -> Heard:
        if len(data) != 2 or data[1] not in (0, self.number):
            return Heard()
        if data[0] in (0x81, 0x82):
            drive.request(Request.RESET if data[0] == 0x81 else Request.DISABLE, now_s)
            self.reset()
            return Heard(moved=True)
        if self.node.state != BOOTING:
            before = self.node.state
            self.node.command(data[0])
            if before == OPERATIONAL != self.node.state:  # connection aborted: voltage off
                self._climb_down(drive, now_s)
        return Heard()

    def _hear_host(self, drive: Drive, now_s: float) -> Heard:
        drive.config = replace(drive.config, command_timeout_s=self.node.patience_s)
        drive.feed_watchdog(now_s)
        return Heard()

    def _take_over(self, drive: Drive, now_s: float) -> None:
        for key, data in self._buffer.items():
            try:
                self.node.objects.put(key, data)
            except Abort:
                self._emergencies.append(0x6320)
        self._buffer = {}
        if self._ladder == OPERATION and drive.state is DriveState.ENABLED:
            o, u = self.node.objects.entries, self.units
            offset = 0 if self._mode == 10 else o[0x60B2, 0].value
            drive.setpoint = Setpoint(  # the watchdog is fed by heartbeats alone
                o[0x607A, 0].value / u.position * TURN,
                o[0x60FF, 0].value / u.velocity * TURN if self._mode == 9 else 0.0,
                1e-3 * u.rated_torque * (o[0x6071, 0].value if self._mode == 10 else offset),
            )

    # ---- power state machine ---------------------------------------------------------------------

    @property
    def _mode(self) -> int:
        return self.node.objects.entries[0x6060, 0].value

    def _set_mode(self, value: int) -> None:
        if value not in MODES:
            raise Abort(RANGE)
        if self._drive is not None and self._drive.mode is not MODES[value]:
            self._drive.set_mode(MODES[value])

    def _statusword(self) -> int:
        drive = self._drive
        if drive is None:
            return 0
        if drive.state is DriveState.FAULT:
            return FAULT_WORD
        if self._ladder == OPERATION:
            on = drive.state is DriveState.ENABLED
            return STATUSWORDS[OPERATION] | FOLLOWS if on else STATUSWORDS[SWITCHED_ON]
        return STATUSWORDS[self._ladder]

    def _controlword(self, word: int) -> None:
        drive, now_s = self._drive, self._now_s
        risen, self._control = word & ~self._control, word
        if drive is None:
            return
        if drive.state is DriveState.FAULT:
            self._ladder = DISABLED
            if risen & 0x80:
                drive.request(Request.CLEAR_FAULTS, now_s)
                drive.config = replace(drive.config, command_timeout_s=0.0)
            return
        if word & 0x06 != 0x06:  # disable voltage, or quick stop and then voltage off
            self._climb_down(drive, now_s)
        elif not word & 0x01:
            self._leave_operation(drive, now_s)
            self._ladder = READY
        elif self._ladder == READY:
            self._ladder = SWITCHED_ON
        elif not word & 0x08 and self._ladder == OPERATION:
            self._leave_operation(drive, now_s)
            self._ladder = SWITCHED_ON
        elif word & 0x08 and self._ladder == SWITCHED_ON:
            drive.set_mode(MODES[self._mode])
            if drive.request(Request.ENABLE, now_s):
                self._ladder = OPERATION

    def _leave_operation(self, drive: Drive, now_s: float) -> None:
        if drive.state in (DriveState.ENABLED, DriveState.CALIBRATING):
            drive.request(Request.DISABLE, now_s)

    def _climb_down(self, drive: Drive, now_s: float) -> None:
        self._leave_operation(drive, now_s)
        self._ladder = DISABLED

    # ---- what is told ----------------------------------------------------------------------------

    def answer(self, answer: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """A synchronous PDO, or the answer to an SDO request."""
        self._drive = drive
        if frame.identifier == 0x080:
            return self.sent[ANSWERS.index(answer)].pack()
        return Frame(0x580 + self.number, self._reply)

    def cyclic(self, drive: Drive, now_s: float) -> list[Frame]:
        """Boot-up and heartbeats, emergencies, PDOs by event: when state or mode change."""
        self._drive, self._now_s = drive, now_s
        out = self.node.heartbeat(now_s)
        code = 0
        if drive.state is DriveState.FAULT:
            code = next((code for flag, code in ERRORS if drive.flags & flag), 0x9000)
        if code != self._error:
            self._error = code
            self._emergencies.append(code)
        for told in self._emergencies:
            data = told.to_bytes(2, "little") + bytes([1 if told else 0]) + bytes(5)
            out.append(Frame(0x080 + self.number, data))
        self._emergencies = []
        if self.node.state == OPERATIONAL:
            o = self.node.objects.entries
            state = o[0x6041, 0].data + o[0x6061, 0].data
            if state != self._told:
                self._told = state
                out += [pdo.pack() for pdo in self.sent if pdo.on and not pdo.synchronous]
        return out
