"""The link to Dynamixel drives: set up, cycle and stop by the maker's packets, and what a drive answers."""

from __future__ import annotations

import math
import os
import struct
import tomllib
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from dynamixel_status import status
from link_rig import CONFIGS

from cablecomp.errors import InputError
from cablecomp.links import BusLink, DriveState, Mode, MotorCommand, Request, parse_link
from cablecomp.links.records import (
    CLIP_POSITION,
    CLIP_TORQUE,
    CLIP_VELOCITY,
    MOTOR_CURRENT,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
)

TURN = 2 * math.pi
FILE = "dynamixel-serial.toml"


LIMITS = {38: struct.pack("<H", 1193), 44: struct.pack("<I", 350)}
"""What an XM430-W350 comes with (e-Manual, control table)."""


class Drives:
    """Dynamixels by hand on the other end of a pseudo-terminal."""

    def __init__(self, text: str) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self.master, False)
        path = os.ttyname(slave)
        self.link = BusLink(parse_link(tomllib.loads(text.replace("/dev/ttyUSB0", path)), FILE, CONFIGS))
        self.link.open()
        os.close(slave)
        self.table: dict[int, dict[int, bytes]] = {}
        self.sent: list[tuple[int, bytes]] = []
        self.now_s = 0.0

    def listen(self) -> list[tuple[int, bytes]]:
        data = b""
        while True:
            try:
                data += os.read(self.master, 4096)
            except BlockingIOError:
                break
        new = []
        while data:
            end = 7 + int.from_bytes(data[5:7], "little")
            new.append((data[4], data[7 : end - 2]))
            data = data[end:]
        self.sent += new
        return new

    def tell(self, node: int, error: int, data: bytes) -> None:
        os.write(self.master, status(node, error, data))
        for _ in range(500):
            self.now_s += 1e-3
            before = self.link.status()
            if self.link.poll(self.now_s) or self.link.status() != before:
                return
        raise AssertionError("nothing came")

    def set_up(self, node: int = 1, joint: int = 0) -> None:
        table = self.table.setdefault(node, dict(LIMITS))
        for _ in range(200):
            self.link.request(joint, Request.REPORT)
            for to, body in self.listen():
                address = int.from_bytes(body[1:3], "little")
                if to == 0xFE:
                    return
                if body[0] == 0x03:
                    table[address] = body[3:]
                elif body[0] == 0x02:
                    self.tell(to, 0, table[address])
        raise AssertionError("not set up")

    def close(self) -> None:
        self.link.close()
        os.close(self.master)


@pytest.fixture
def drives() -> Iterator[Any]:
    made: list[Drives] = []

    def make(change: dict[str, str] | None = None) -> Drives:
        text = Path(CONFIGS / FILE).read_text(encoding="utf-8")
        for old, new in (change or {}).items():
            assert old in text
            text = text.replace(old, new, 1)
        made.append(Drives(text))
        return made[-1]

    yield make
    for one in made:
        one.close()


def told(
    position: int = 0, velocity: int = 0, current: int = 0, *, torque: int = 0, hardware: int = 0, watchdog: int = 0,
) -> bytes:  # fmt: skip
    """Laid out by hand: status return level, torque enable, hardware error, watchdog; current, velocity, position;
    12.1 V, 36 degC."""
    head = bytes([1, torque, hardware, watchdog])
    return head + struct.pack("<hii", current, velocity, position) + struct.pack("<HB", 121, 36)


def test_set_up_step_by_step(drives: Any) -> None:
    line: Drives = drives()
    line.set_up()
    table = line.table[1]
    assert (table[68], table[64], table[98], table[11]) == (b"\x01", b"\x00", b"\x00", b"\x04")
    wanted = [68, 64, 70, 98, 126, 127, *range(128, 136), 144, 145, 146]
    assert all(64 <= a <= 661 for a in wanted)  # e-Manual, "Indirect Address": limited to the RAM area
    assert table[168] == b"".join(a.to_bytes(2, "little") for a in wanted)
    assert line.sent[-1] == (0xFE, bytes.fromhex("82 e000 1100 01"))


@pytest.mark.parametrize(("mode", "number"), [("velocity", 1), ("torque", 0)])
def test_each_mode_is_set(drives: Any, mode: str, number: int) -> None:
    line: Drives = drives({'mode = "position"': f'mode = "{mode}"'})
    line.set_up()
    assert line.table[1][11] == bytes([number])


@pytest.mark.parametrize(
    ("mode", "goal", "clips"),
    [
        ("torque", "83 6600 0200 01 6400", CLIP_TORQUE),
        ("velocity", "83 6800 0400 01 c8000000", CLIP_VELOCITY),
    ],
)
def test_no_goal_goes_beyond_the_drives_own_limit(drives: Any, mode: str, goal: str, clips: int) -> None:
    """e-Manual, "Goal Current(102)", "Goal Velocity(104)": within current limit (38) and velocity limit (44); a drive
    refuses a goal beyond and goes on with the last one, and no sync write is answered."""
    line: Drives = drives({'mode = "position"': f'mode = "{mode}"'})
    line.table[1] = {38: struct.pack("<H", 100), 44: struct.pack("<I", 200)}
    line.set_up()
    line.listen()
    assert line.link.send(0, MotorCommand(0.0, 1e3, 1e3)) == clips
    assert line.listen()[0] == (0xFE, bytes.fromhex(goal))
    assert line.link.send(0, MotorCommand(0.0, -1e3, -1e3)) == clips
    counts = {"torque": struct.pack("<h", -100), "velocity": struct.pack("<i", -200)}
    assert line.listen()[0][1].endswith(counts[mode])


def test_what_a_drive_tells_in_its_units(drives: Any) -> None:
    line: Drives = drives()
    line.set_up()
    line.tell(1, 0, told(-1024, 100, -200))
    joint = line.link.joints[0]
    assert joint.values[MOTOR_POSITION] == pytest.approx(-TURN / 4)
    assert joint.values[MOTOR_VELOCITY] == pytest.approx(22.9 * TURN / 60)
    assert joint.values[MOTOR_CURRENT] == pytest.approx(-0.538)
    assert joint.values[MOTOR_TORQUE] == pytest.approx(-0.538 * 1.78)
    assert joint.values[joint.index("other_bus_voltage_V")] == pytest.approx(12.1)
    assert joint.values[joint.index("temperature_degC")] == 36.0
    assert (joint.state, line.link.status().invalid) == (DriveState.DISABLED, 0)
    line.tell(1, 0, told(torque=1))
    assert joint.state is DriveState.ENABLED


@pytest.mark.parametrize(
    ("status_", "says"),
    [
        (told(hardware=0x20), "overload"),
        (told(hardware=0x04 | 0x01), "input voltage, overheating"),
        (told(watchdog=0xFF), "watchdog"),
        (bytes(17), "afresh"),  # indirect data after a restart
    ],
)
def test_what_ends_in_a_fault(drives: Any, status_: bytes, says: str) -> None:
    line: Drives = drives()
    line.set_up()
    line.tell(1, 0, told(512, torque=1))
    line.tell(1, 0x80, status_)
    assert line.link.joints[0].state is DriveState.FAULT
    assert says in line.link.error_text(0)
    if says == "afresh":
        assert line.link.joints[0].values[MOTOR_POSITION] == pytest.approx(TURN / 8)
        line.set_up()


def test_errors_and_other_lengths_are_counted_and_not_taken(drives: Any) -> None:
    line: Drives = drives()
    line.set_up()
    joint = line.link.joints[0]
    line.tell(1, 0x07, told(1))
    line.tell(1, 0, told(1)[:-1])
    assert (joint.updates[MOTOR_POSITION], line.link.status().invalid) == (0, 2)
    line.tell(9, 0, told(1))
    assert (joint.updates[MOTOR_POSITION], line.link.status().ignored) == (0, 1)


def test_a_cycle_enabling_and_stopping(drives: Any) -> None:
    line: Drives = drives()
    line.set_up()
    link = line.link
    link.request(0, Request.CLEAR_FAULTS)
    link.request(0, Request.ENABLE, Mode.POSITION)
    assert line.listen() == [
        (1, bytes.fromhex("03 6200 00")),
        (1, bytes.fromhex("03 6200 05")),  # 5 * 20 ms
        (1, bytes.fromhex("03 4000 01")),
    ]
    assert link.send(0, MotorCommand(-TURN / 2)) == 0
    assert line.listen() == [
        (0xFE, bytes.fromhex("83 7400 0400 01 00f8ffff")),
        (0xFE, bytes.fromhex("82 e000 1100 01")),
    ]
    assert link.send(0, MotorCommand(TURN * 1000)) == CLIP_POSITION
    assert line.listen()[0][1].endswith(struct.pack("<i", 1_048_575))
    link.stop()
    assert line.listen() == [(1, bytes.fromhex("03 4000 00"))] * 2
    for refused in (MotorCommand(0.0, 0.0, 0.0, 1.0), MotorCommand(math.nan)):
        with pytest.raises(InputError, match="nothing was sent"):
            link.send(0, refused)
    with pytest.raises(InputError, match="set up for mode"):
        link.request(0, Request.ENABLE, Mode.TORQUE)


SECOND = '''[[joint]]
name = "joint-2"
[joint.motor]
device = "drive"
node = 2
mode = "{}"

[[joint]]
name = "joint-1"'''


@pytest.mark.parametrize(
    ("mode", "goals"),
    [
        ("position", "83 7400 0400 02 00040000 01 00080000"),
        ("velocity", "93 02 6800 0400 00000000 01 7400 0400 00080000"),  # other items: bulk write
    ],
)
def test_two_drives_share_one_write_and_one_read(drives: Any, mode: str, goals: str) -> None:
    line: Drives = drives({'[[joint]]\nname = "joint-1"': SECOND.format(mode)})
    line.set_up(2, 0)
    line.set_up(1, 1)
    for _ in range(3):
        line.listen()
        line.link.send(0, MotorCommand(TURN / 4))
        line.link.send(1, MotorCommand(TURN / 2))
    assert line.listen() == [(0xFE, bytes.fromhex(goals)), (0xFE, bytes.fromhex("82 e000 1100 02 01"))]


def test_drives_are_set_up_one_after_the_other(drives: Any) -> None:
    line: Drives = drives({'[[joint]]\nname = "joint-1"': SECOND.format("position")})
    for _ in range(10):
        line.link.request(0, Request.REPORT)
        line.link.request(1, Request.REPORT)
    assert {node for node, _ in line.listen()} == {2}


def test_a_drive_that_does_not_keep_what_it_is_set_to(drives: Any) -> None:
    line: Drives = drives()
    for _ in range(400):
        line.link.request(0, Request.REPORT)
        if any(body[0] == 0x02 for _, body in line.listen()):
            line.tell(1, 0, b"\x02")
        if line.link.joints[0].state is DriveState.FAULT:
            break
    assert "does not keep" in line.link.error_text(0)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('mode = "position"', 'mode = "impedance"', "accepted: torque, velocity, position"),
        ("command_timeout_s = 0.1", "command_timeout_s = 5.0", "0.02 to 2.54"),
        ("node = 1", "node = 253", "0 to 252"),
        ('kind = "serial"\nport = "/dev/ttyUSB0"\nbaud '
         '= 4_000_000', 'kind = "can"\ninterface = "virtual"', "line of its own"),
    ],
)  # fmt: skip
def test_mistakes_end_in_one_line(drives: Any, old: str, new: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        drives({old: new})
