"""The link against a drive of others' making: a `canopen.LocalNode` whose object dictionary, SDO server, NMT slave,
PDOs and emergencies are that package's own."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from link_rig import Rig

from cablecomp.links import DriveState, Mode, MotorCommand, Request
from cablecomp.links.records import MOTOR_POSITION, MOTOR_TORQUE

canopen = pytest.importorskip("canopen", reason="peer not installed: pip install 'cablecomp[peers]'")

SINGLE = {
    0x1017: (6, 0), 0x603F: (6, 0), 0x6040: (6, 0), 0x6041: (6, 0x0250), 0x6060: (2, 0), 0x6061: (2, 0),
    0x6064: (4, 0), 0x606C: (4, 0), 0x6076: (7, 10_000), 0x6077: (3, 0), 0x607A: (4, 0), 0x60B2: (3, 0),
}  # fmt: skip
WORDS = {0x06: 0x0231, 0x07: 0x0233, 0x0F: 0x1237, 0x00: 0x0250}


def dictionary() -> Any:
    od = canopen.ObjectDictionary()

    def variable(index: int, sub: int, kind: int, value: int) -> Any:
        made = canopen.objectdictionary.ODVariable(f"x{index:04X}_{sub}", index, sub)
        made.data_type, made.default, made.access_type = kind, value, "rw"
        return made

    for index, (kind, value) in SINGLE.items():
        od.add_object(variable(index, 0, kind, value))
    subs: dict[int, tuple[int, ...]] = {0x1016: (5, 7), 0x60C2: (5, 5, 2)}
    subs |= dict.fromkeys((0x1400, 0x1800, 0x1801, 0x1802, 0x1803), (5, 7, 5))
    subs |= dict.fromkeys((0x1600, 0x1A00, 0x1A01, 0x1A02, 0x1A03), (5, 7, 7, 7, 7))
    for index, kinds in subs.items():
        record = canopen.objectdictionary.ODRecord(f"r{index:04X}", index)
        for sub, kind in enumerate(kinds):
            record.add_member(variable(index, sub, kind, 0))
        od.add_object(record)
    return od


class Drive:
    """A power state machine on top of the package's node: obeys at SYNC what the mapped PDO brought."""

    def __init__(self, channel: str) -> None:
        self.network = canopen.Network()
        self.network.connect(interface="virtual", channel=channel)
        self.node = self.network.create_node(1, dictionary())
        self.node.nmt.state = "PRE-OPERATIONAL"
        self.targets: dict[int, int] = {}
        self.heard = b""
        self.network.subscribe(0x201, lambda i, data, t: setattr(self, "heard", bytes(data)))
        self.network.subscribe(0x080, lambda i, data, t: self.sync())

    def value(self, index: int, sub: int = 0) -> int:
        return int(self.node.sdo[index].raw if not sub else self.node.sdo[index][sub].raw)

    def mapped(self, index: int) -> list[tuple[int, int]]:
        entries = [self.value(index, k) for k in range(1, 1 + int(self.node.sdo[index][0].raw))]
        return [(e >> 16, e & 0xFF) for e in entries]

    def sync(self) -> None:
        if self.node.nmt.state != "OPERATIONAL":
            return
        data, bits = int.from_bytes(self.heard, "little"), 0
        for index, width in self.mapped(0x1600) if self.heard else []:
            self.targets[index] = data >> bits & (1 << width) - 1
            bits += width
        word = self.targets.get(0x6040, 0)
        self.node.sdo[0x6041].raw = WORDS.get(word, 0x0250)
        self.node.sdo[0x6061].raw = self.value(0x6060)
        if word == 0x0F:
            self.node.sdo[0x6064].raw = self.targets[0x607A]
        for k in range(4):
            identifier = self.value(0x1800 + k, 1)
            if identifier and not identifier & 0x8000_0000:
                data = b"".join(
                    self.value(i).to_bytes(w // 8, "little", signed=i in (0x6064, 0x606C, 0x6077, 0x6061))
                    for i, w in self.mapped(0x1A00 + k)
                )
                self.network.send_message(identifier & 0x7FF, data)

    def close(self) -> None:
        self.node.nmt.stop_heartbeat()
        self.network.disconnect()


@pytest.fixture
def met(rigs: Any) -> Iterator[tuple[Rig, Drive]]:
    rig: Rig = rigs("cia402-socketcan.toml")
    drive = Drive(str(rig.link.config.bus.channel))  # type: ignore[union-attr]  # a CAN link has a bus
    yield rig, drive
    drive.close()


def cycle(rig: Rig, each: Callable[[], object], reached: Callable[[], bool], seconds: float = 20.0) -> None:
    begin = time.monotonic()
    while not reached():
        assert time.monotonic() < begin + seconds, rig.link.error_text(0)
        each()
        time.sleep(1e-3)
        rig.link.poll(time.monotonic() - begin)


def test_set_up_enabled_commanded_and_let_go(met: tuple[Rig, Drive]) -> None:
    rig, drive = met
    link, joint = rig.link, rig.link.joints[0]
    cycle(rig, lambda: link.request(0, Request.REPORT), lambda: joint.updates[MOTOR_POSITION] > 0)
    assert joint.state is DriveState.DISABLED
    assert drive.mapped(0x1600) == [(0x6040, 16), (0x607A, 32), (0x60B2, 16)]
    assert (drive.value(0x6060), drive.value(0x1017)) == (8, 100)
    link.request(0, Request.CLEAR_FAULTS, Mode.POSITION)
    link.request(0, Request.ENABLE, Mode.POSITION)
    command = MotorCommand(0.5, 0.0, -1.25)
    cycle(rig, lambda: link.send(0, command), lambda: joint.state is DriveState.ENABLED)
    cycle(rig, lambda: link.send(0, command), lambda: abs(joint.values[MOTOR_POSITION] - 0.5) < 1e-4)
    assert struct.unpack("<h", struct.pack("<H", drive.targets[0x60B2])) == (-125,)
    assert joint.values[MOTOR_TORQUE] == 0.0
    assert link.error_text(0) == ""
    assert link.request(0, Request.STOP)
    cycle(rig, lambda: None, lambda: joint.state is DriveState.DISABLED)
    assert drive.targets[0x6040] == 0


def test_an_emergency_of_the_packages_own_is_a_fault(met: tuple[Rig, Drive]) -> None:
    rig, drive = met
    link, joint = rig.link, rig.link.joints[0]
    cycle(rig, lambda: link.request(0, Request.REPORT), lambda: joint.updates[MOTOR_POSITION] > 0)
    drive.node.emcy.send(0x3210, 4, b"")
    cycle(rig, lambda: None, lambda: joint.state is DriveState.FAULT)
    assert "DC link" in link.error_text(0)
    drive.node.emcy.reset()
    cycle(rig, lambda: None, lambda: joint.state is DriveState.DISABLED)


def test_a_restart_is_seen(met: tuple[Rig, Drive]) -> None:
    rig, drive = met
    link, joint = rig.link, rig.link.joints[0]
    cycle(rig, lambda: link.request(0, Request.REPORT), lambda: joint.updates[MOTOR_POSITION] > 0)
    drive.network.send_message(0x701, [0])
    cycle(rig, lambda: None, lambda: joint.state is DriveState.FAULT)
    assert "afresh" in link.error_text(0)
