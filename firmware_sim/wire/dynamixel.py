"""A Dynamixel of the X series, device side: instructions and control table of an XM430-W350.

Items are written whole, those of the EEPROM (below 64) only without torque, goals within their limits and not after
a bus watchdog error; indirect data stand for what their addresses name, which lies in the RAM (64 to 661). The bus
watchdog (20 ms a count) stops the drive when no instruction comes, and then reads -1. A hardware error takes torque
away until a reboot. Status return level: 0 answers ping alone, 1 reads too, 2 everything. Sources: Robotis e-Manual,
"DYNAMIXEL Protocol 2.0", "XM430-W350".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from firmware_sim.firmware import Drive, DriveFlag, DriveState, Mode, Request, Setpoint
from firmware_sim.wire.base import Answer, Heard
from firmware_sim.wire.frame import Frame

TURN = 2.0 * math.pi
BROADCAST = 0xFE
PING, READ, WRITE, REG_WRITE, ACTION, REBOOT, CLEAR = 0x01, 0x02, 0x03, 0x04, 0x05, 0x08, 0x10
SYNC_READ, SYNC_WRITE, BULK_READ, BULK_WRITE = 0x82, 0x83, 0x92, 0x93
FAIL, UNKNOWN, RANGE, LENGTH, LIMIT, ACCESS = 1, 2, 4, 5, 6, 7
ALERT = 0x80
COUNTS, RPM, AMPERE = 4096, 0.229, 2.69e-3
MODES = {0: Mode.TORQUE, 1: Mode.VELOCITY, 3: Mode.POSITION, 4: Mode.POSITION}
EEPROM_END, TABLE_END = 64, 662
ADDRESSES, DATA, INDIRECT = 168, 224, 28
WATCHDOG_S = 0.02


class Refused(Exception):
    """An instruction fails with this error number."""

    def __init__(self, number: int) -> None:
        super().__init__(f"error {number}")
        self.number = number


@dataclass
class Item:
    """`size` bytes: `value` as written, or what `tell` says; written values lie in low…high."""

    size: int
    value: int = 0
    low: int = 0
    high: int = 0
    tell: Callable[[], float] | None = None

    @property
    def data(self) -> bytes:
        """Present value."""
        n = self.value if self.tell is None else round(self.tell())
        return (n & (1 << 8 * self.size) - 1).to_bytes(self.size, "little")


class DynamixelWire:
    """A drive of number `node`; `per_A`: torque constant at the output shaft."""

    def __init__(self, node: int, per_A: float = 1.78) -> None:
        self.node, self.per_A = node, per_A
        self._kept = {11: 3}  # the EEPROM outlives a restart
        self.reset()

    def reset(self) -> None:
        """Power cycle: what is not EEPROM is at its initial value."""
        self._drive: Drive | None = None
        self._heard_s = self._now_s = 0.0
        self._registered: bytes | None = None
        u8 = 0xFF
        self.items: dict[int, Item] = {
            0: Item(2, 1020), 2: Item(4), 6: Item(1, 46), 7: Item(1, self.node), 8: Item(1, 1, 0, 7),
            9: Item(1, 0, 0, 254), 10: Item(1, 0, 0, 5), 11: Item(1, self._kept[11], 0, 16), 12: Item(1, u8, 0, u8),
            13: Item(1, 2), 20: Item(4, 0, -1_044_479, 1_044_479), 31: Item(1, 80, 0, 100), 36: Item(2, 885, 0, 885),
            38: Item(2, 1193, 0, 1193), 44: Item(4, 350, 0, 1023), 48: Item(4, 4095, 0, 4095),
            52: Item(4, 0, 0, 4095), 63: Item(1, 52, 0, 61),
            64: Item(1, 0, 0, 1, tell=self._torque), 65: Item(1, 0, 0, 1), 68: Item(1, 2, 0, 2),
            69: Item(1, tell=lambda: self._registered is not None), 70: Item(1, tell=self._hardware),
            76: Item(2, 1920, 0, 16383), 78: Item(2, 100, 0, 16383), 80: Item(2, 0, 0, 16383),
            82: Item(2, 0, 0, 16383), 84: Item(2, 800, 0, 16383), 98: Item(1, 0, 0, 127),
            100: Item(2, 0, -885, 885), 102: Item(2, 0, -1193, 1193), 104: Item(4, 0, -350, 350),
            108: Item(4, 0, 0, 32767), 112: Item(4, 0, 0, 32767), 116: Item(4, 0, -1_048_575, 1_048_575),
            120: Item(2, tell=lambda: 1e3 * self._now_s % 32768),
            126: Item(2, tell=lambda: self._of(lambda d: d.report().torque_Nm / self.per_A / AMPERE)),
            128: Item(4, tell=lambda: self._of(lambda d: d.velocity_rad_s / TURN * 60.0 / RPM)),
            132: Item(4, tell=lambda: self._of(lambda d: d.position_rad / TURN * COUNTS)),
            144: Item(2, 120), 146: Item(1, tell=lambda: self._of(lambda d: d.report().temperature_degC)),
        }  # fmt: skip
        for k in range(INDIRECT):
            self.items[ADDRESSES + 2 * k] = Item(2, DATA + k, EEPROM_END, TABLE_END - 1)

    # ---- the control table -----------------------------------------------------------------------

    def _of(self, read: Callable[[Drive], float]) -> float:
        value = math.nan if self._drive is None else read(self._drive)
        return value if math.isfinite(value) else 0.0

    def _torque(self) -> bool:
        return self._drive is not None and self._drive.state in (DriveState.ENABLED, DriveState.CALIBRATING)

    def _hardware(self) -> int:
        drive = self._drive
        if drive is None or drive.state is not DriveState.FAULT:
            return 0
        flags = ((DriveFlag.OVER_TEMPERATURE, 1 << 2), (DriveFlag.MOTOR_ENCODER, 1 << 3))
        return next((bit for flag, bit in flags if drive.flags & flag), 1 << 5)

    def read(self, address: int, size: int) -> bytes:
        """`size` bytes from an address on; gaps between items read 0."""
        if not size or address + size > TABLE_END:
            raise Refused(ACCESS)
        return bytes(self._byte(address + k) for k in range(size))

    def _byte(self, address: int) -> int:
        if DATA <= address < DATA + INDIRECT:
            told = self.items[ADDRESSES + 2 * (address - DATA)].value
            return 0 if DATA <= told < DATA + INDIRECT else self._byte(told)
        for back in range(4):
            item = self.items.get(address - back)
            if item is not None:
                return item.data[back] if back < item.size else 0
        return 0

    def write(self, address: int, data: bytes, now_s: float) -> None:
        """Whole items from an address on."""
        if not data:
            raise Refused(LENGTH)
        while data:
            item = self.items.get(address)
            if item is None or item.low == item.high:
                raise Refused(ACCESS)
            if len(data) < item.size:
                raise Refused(LENGTH)
            value = int.from_bytes(data[: item.size], "little", signed=item.low < 0)
            self._put(address, item, value, now_s)
            address, data = address + item.size, data[item.size :]

    def _put(self, address: int, item: Item, value: int, now_s: float) -> None:
        drive = self._drive
        assert drive is not None
        if address < EEPROM_END and self._torque():
            raise Refused(ACCESS)
        if not item.low <= value <= item.high or (address == 11 and value not in MODES):
            raise Refused(RANGE)
        if address in (100, 102, 104, 116) and self.items[98].value < 0:
            raise Refused(RANGE)
        limit = {102: 38, 104: 44}.get(address)
        if limit is not None and abs(value) > self.items[limit].value:
            raise Refused(LIMIT)
        if address == 116 and self.items[11].value == 3 and not 0 <= value <= 4095:
            raise Refused(LIMIT)
        if address == 64:
            self._switch(bool(value), drive, now_s)
        item.value = value
        if address == 11:
            self._kept[11] = value
            drive.set_mode(MODES[value])
        if address in (102, 104, 116):
            self._aim(drive, now_s)

    def _switch(self, on: bool, drive: Drive, now_s: float) -> None:
        if drive.state is DriveState.FAULT:
            return
        if on and drive.state is DriveState.DISABLED:
            drive.set_mode(MODES[self.items[11].value])
            drive.request(Request.ENABLE, now_s)
            self._stand(drive)
        elif not on:
            drive.request(Request.DISABLE, now_s)

    def _stand(self, drive: Drive) -> None:
        """Goals that keep the drive where it is."""
        self.items[102].value = self.items[104].value = 0
        self.items[116].value = round(drive.position_rad / TURN * COUNTS)

    def _aim(self, drive: Drive, now_s: float) -> None:
        current, velocity, position = (self.items[a].value for a in (102, 104, 116))
        mode = MODES[self.items[11].value]
        drive.command(
            Setpoint(
                position / COUNTS * TURN,
                velocity * RPM / 60.0 * TURN if mode is Mode.VELOCITY else 0.0,
                current * AMPERE * self.per_A if mode is Mode.TORQUE else 0.0,
            ),
            now_s,
        )

    # ---- instructions ----------------------------------------------------------------------------

    def identifiers(self) -> Iterable[int]:
        """Its number."""
        return (self.node,)

    def broadcasts(self) -> Iterable[int]:
        """Everybody's number."""
        return (BROADCAST,)

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """Carry an instruction out; what it is answered is kept for `answer`."""
        self._drive, self._heard_s, self._now_s = drive, now_s, now_s
        instruction, body = frame.data[0], frame.data[1:]
        level, asks, steps = self.items[68].value, instruction == PING, False
        self._error, self._asked = 0, (0, 0)
        try:
            if instruction in (SYNC_READ, BULK_READ):
                self._asked = self._asked_of_many(instruction, body)
                asks = bool(self._asked[1]) and level >= 1
            elif instruction in (SYNC_WRITE, BULK_WRITE):
                steps = self._written_to_many(instruction, body, now_s)
            elif frame.identifier != BROADCAST or instruction in (WRITE, ACTION, REBOOT):
                asks = asks or self._one(instruction, body, drive, now_s, level)
        except Refused as refused:
            self._error = refused.number
            asks = level == 2 and frame.identifier != BROADCAST
        return Heard((Answer.ASKED,) if asks else (), steps=steps)

    def _one(self, instruction: int, body: bytes, drive: Drive, now_s: float, level: int) -> bool:
        if instruction == READ:
            if len(body) != 4:
                raise Refused(LENGTH)
            self._asked = (int.from_bytes(body[:2], "little"), int.from_bytes(body[2:], "little"))
            self.read(*self._asked)
            return level >= 1
        if instruction == WRITE:
            self.write(int.from_bytes(body[:2], "little"), body[2:], now_s)
        elif instruction == REG_WRITE:
            self._registered = body
        elif instruction == ACTION:
            if self._registered is None:
                raise Refused(UNKNOWN)
            body, self._registered = self._registered, None
            self.write(int.from_bytes(body[:2], "little"), body[2:], now_s)
        elif instruction == REBOOT:
            drive.request(Request.RESET, now_s)
            self.reset()
            self._error, self._asked, self._drive = 0, (0, 0), drive
        elif instruction == CLEAR:
            if body != b"\x01DXL\x22" or abs(drive.velocity_rad_s) > 0.1:
                raise Refused(FAIL)
            drive.set_position(drive.position_rad % TURN)
        elif instruction != PING:
            raise Refused(UNKNOWN)
        return self.items[68].value == 2

    def _asked_of_many(self, instruction: int, body: bytes) -> tuple[int, int]:
        if instruction == SYNC_READ:
            if self.node not in body[4:]:
                return (0, 0)
            return (int.from_bytes(body[:2], "little"), int.from_bytes(body[2:4], "little"))
        for k in range(0, len(body) - 4, 5):
            if body[k] == self.node:
                return (
                    int.from_bytes(body[k + 1 : k + 3], "little"),
                    int.from_bytes(body[k + 3 : k + 5], "little"),
                )
        return (0, 0)

    def _written_to_many(self, instruction: int, body: bytes, now_s: float) -> bool:
        at = 4 if instruction == SYNC_WRITE else 0
        address, size = int.from_bytes(body[:2], "little"), int.from_bytes(body[2:4], "little")
        while at < len(body):
            node = body[at]
            at += 1
            if instruction == BULK_WRITE:
                address = int.from_bytes(body[at : at + 2], "little")
                size = int.from_bytes(body[at + 2 : at + 4], "little")
                at += 4
            if node == self.node:
                self.write(address, body[at : at + size], now_s)
                return True
            at += size
        return False

    def answer(self, answer: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """The status: error and alert, model and firmware for a ping, or what was read."""
        self._drive = drive
        alert = ALERT if self._hardware() else 0
        data = b""
        if not self._error and frame.data[0] == PING:
            data = self.read(0, 2) + self.read(6, 1)
        elif not self._error and self._asked[1]:
            data = self.read(*self._asked)
        return Frame(self.node, bytes([self._error | alert]) + data)

    def cyclic(self, drive: Drive, now_s: float) -> list[Frame]:
        """Nothing by itself; the bus watchdog looks at the time."""
        self._drive, self._now_s = drive, now_s
        watchdog = self.items[98]
        if watchdog.value > 0 and now_s - self._heard_s > WATCHDOG_S * watchdog.value:
            watchdog.value = -1
            self._stand(drive)
            self._aim(drive, now_s)
        return []
