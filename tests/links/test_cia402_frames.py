"""The link to CiA 402 drives, frame by frame: set up, commands, heartbeats; a drive that is not well."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from link_rig import Rig

from cablecomp.errors import InputError
from cablecomp.links import DriveState, Mode, MotorCommand, Request
from cablecomp.links.cia402 import Control
from cablecomp.links.records import JOINT_POSITION, MOTOR_POSITION, MOTOR_TORQUE, MOTOR_VELOCITY

LINK = "cia402-socketcan.toml"
TURN = 2 * math.pi
ENABLED = 0x1237


class Device:
    """Answers SDO by hand, keeps what was written, tells what it is asked to."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.written: list[tuple[int, int, int, int]] = []
        self.heard: list[tuple[int, bytes]] = []
        self.refuse: dict[tuple[int, int], int] = {}
        self.rated_mNm = 10_000

    def set_up(self, cycles: int = 200) -> None:
        for _ in range(cycles):
            self.rig.link.request(0, Request.REPORT)
            for identifier, data in self.listen():
                if identifier == 0x601:
                    self.answer(data)
                if (identifier, data) == (0x000, b"\x01\x01"):
                    return
            self.rig.link.poll(0.0)

    def answer(self, data: bytes) -> None:
        command, index, sub, value = struct.unpack("<BHBI", data)
        if (index, sub) in self.refuse:
            self.rig.tell(0x581, b"\x80" + data[1:4] + struct.pack("<I", self.refuse[index, sub]))
        elif command == 0x40:
            self.rig.tell(0x581, b"\x43" + data[1:4] + struct.pack("<I", self.rated_mNm))
        else:
            self.written.append((command, index, sub, value))
            self.rig.tell(0x581, b"\x60" + data[1:4] + bytes(4))

    def listen(self) -> list[tuple[int, bytes]]:
        new = self.rig.heard()
        self.heard += new
        return new

    def tell(self, statusword: int, position: int = 0, torque: int = 0, now_s: float = 0.0) -> None:
        self.rig.tell(0x181, struct.pack("<Hih", statusword, position, torque))
        self.rig.link.poll(now_s)

    def state(self) -> tuple[DriveState, str]:
        joint = self.rig.link.joints[0]
        return joint.state, self.rig.link.error_text(0)


@pytest.fixture
def device(rigs: Any) -> Device:
    found = Device(rigs(LINK))
    found.set_up()
    found.listen()
    return found


def control(device: Device, command: MotorCommand | None = None) -> int:
    device.listen()
    device.rig.link.send(0, command or MotorCommand())
    (word,) = (struct.unpack_from("<H", data)[0] for i, data in device.listen() if i == 0x201)
    return int(word)


def test_the_set_up_takes_power_away_first_and_maps_by_the_book(device: Device) -> None:
    written = device.written
    assert written[0] == (0x2B, 0x6040, 0, 0)
    assert (0x2B, 0x1017, 0, 100) in written
    assert (0x23, 0x1016, 1, 127 << 16 | 100) in written
    at = [w[1:3] for w in written].index((0x1400, 1))
    assert [w[1:] for w in written[at : at + 8]] == [
        (0x1400, 1, 0x8000_0201),
        (0x1400, 2, 1),
        (0x1600, 0, 0),
        (0x1600, 1, 0x6040_0010),
        (0x1600, 2, 0x607A_0020),
        (0x1600, 3, 0x60B2_0010),
        (0x1600, 0, 3),
        (0x1400, 1, 0x201),
    ]
    assert (0x2F, 0x6060, 0, 8) in written
    assert [w[1:] for w in written if w[1] == 0x60C2] == [(0x60C2, 1, 10), (0x60C2, 2, 0xFC)]  # 10 * 10^-4 s
    assert device.rig.link.joints[0].state is DriveState.UNKNOWN


@pytest.mark.parametrize(("mode", "target", "number"), [("velocity", 0x60FF, 9), ("torque", 0x6071, 10)])
def test_each_mode_maps_its_target(rigs: Any, mode: str, target: int, number: int) -> None:
    device = Device(rigs(LINK, {'mode = "position"': f'mode = "{mode}"'}))
    device.set_up()
    assert (0x2F, 0x6060, 0, number) in device.written
    assert [w[3] >> 16 for w in device.written if w[1:3] == (0x1600, 2)] == [target]


def test_commands_climb_step_by_step_and_sync_follows(device: Device) -> None:
    device.tell(0x0250)
    assert control(device) == Control.DISABLE_VOLTAGE
    device.rig.link.request(0, Request.ENABLE, Mode.POSITION)
    for word, expected in ((0x0250, 0x06), (0x0231, 0x07), (0x0233, 0x0F), (ENABLED, 0x0F)):
        device.tell(word)
        assert control(device) == expected
    assert [i for i, _ in device.heard[-2:]] == [0x201, 0x080]
    assert device.state() == (DriveState.ENABLED, "")


def test_a_command_and_what_the_drive_tells(device: Device) -> None:
    control(device, MotorCommand(-TURN / 4, 0.0, 2.5))
    assert device.heard[-3:] == [
        (0x201, struct.pack("<Hih", 0, -16384, 250)),
        (0x77F, b"\x05"),
        (0x080, b""),
    ]
    device.tell(ENABLED, 32768, -125)
    device.rig.tell(0x281, struct.pack("<iHb", -65536, 0, 8))
    device.rig.link.poll(0.0)
    values = device.rig.link.joints[0].values
    assert values[MOTOR_POSITION] == pytest.approx(TURN / 2)
    assert values[MOTOR_VELOCITY] == pytest.approx(-TURN)
    assert values[MOTOR_TORQUE] == pytest.approx(-1.25)


def test_heartbeats_of_this_side_keep_to_a_quarter_of_the_drives_patience(device: Device) -> None:
    beats = 0
    for k in range(1000):
        device.tell(ENABLED, now_s=1e-3 * k)
        device.rig.link.send(0, MotorCommand())
        beats += sum(i == 0x77F for i, _ in device.listen())
    assert 38 <= beats <= 41


def enable(device: Device) -> None:
    device.rig.tell(0x701, b"\x05")
    device.rig.link.request(0, Request.ENABLE, Mode.POSITION)
    device.tell(ENABLED)
    assert device.state() == (DriveState.ENABLED, "")


@pytest.mark.parametrize(
    ("identifier", "data", "says"),
    [
        (0x701, "00", "started afresh"),
        (0x701, "7f", "left the NMT state"),
        (0x701, "04", "left the NMT state"),
        (0x081, "3081110000000000", "nothing heard from this side, or bus error (0x8130)"),
        (0x081, "1043010000000000", "drive temperature (0x4310)"),
        (0x181, "37020000000000" + "00", "does not follow"),
        (0x281, "00000000000001", "another mode"),
    ],
)
def test_what_ends_in_a_fault(device: Device, identifier: int, data: str, says: str) -> None:
    enable(device)
    device.rig.tell(identifier, data)
    device.rig.link.poll(0.01)
    state, text = device.state()
    assert state is DriveState.FAULT
    assert says in text


def test_a_fault_tells_its_code_and_is_reset_by_one_edge(device: Device) -> None:
    enable(device)
    device.rig.tell(0x281, struct.pack("<iHb", 0, 0x7305, 8))
    device.tell(0x0218)
    assert device.state() == (DriveState.FAULT, "sensor (0x7305)")
    assert control(device) == Control.DISABLE_VOLTAGE  # it does not climb by itself again
    device.rig.link.request(0, Request.CLEAR_FAULTS, Mode.POSITION)
    device.rig.link.request(0, Request.ENABLE, Mode.POSITION)
    assert [control(device), control(device)] == [Control.FAULT_RESET, Control.DISABLE_VOLTAGE]
    device.rig.tell(0x081, bytes(8))
    device.rig.tell(0x281, struct.pack("<iHb", 0, 0, 8))
    device.tell(0x0250)
    assert (device.state()[0], control(device)) == (DriveState.DISABLED, Control.SHUTDOWN)


def test_a_drive_that_drops_out_is_not_enabled_again(device: Device) -> None:
    enable(device)
    device.tell(0x0250)
    assert (device.state()[0], control(device)) == (DriveState.DISABLED, Control.DISABLE_VOLTAGE)


def test_heartbeats_that_stay_out(device: Device) -> None:
    enable(device)
    for k in range(1, 600):
        device.tell(ENABLED, now_s=1e-3 * k)
        if device.state()[0] is DriveState.FAULT:
            break
    assert 0.3 <= 1e-3 * k <= 0.302
    assert "heartbeats" in device.state()[1]


def test_a_drive_that_started_afresh_tells_nothing_until_it_is_set_up_again(device: Device) -> None:
    enable(device)
    device.rig.tell(0x701, b"\x00")
    device.tell(ENABLED, 1000)
    assert device.rig.link.joints[0].values[MOTOR_POSITION] == 0.0
    device.written.clear()
    device.set_up()
    assert device.written[0][1:] == (0x6040, 0, 0)
    device.tell(0x0250, 65536)
    assert device.state() == (DriveState.DISABLED, "")
    assert device.rig.link.joints[0].values[MOTOR_POSITION] == pytest.approx(TURN)


@pytest.mark.parametrize(
    ("refuse", "rated", "says"),
    [
        ({(0x1600, 3): 0x0604_0041}, 10_000, "0x1600:03 (cannot be mapped, 0x06040041)"),
        ({(0x6060, 0): 0x0609_0030}, 10_000, "0x6060:00 (value out of range"),
        ({(0x1016, 1): 0x0602_0000}, 10_000, "0x1016:01 (no such object"),  # a watchdog was asked for
        ({}, 12_000, "0x6076:00 is 12000, not 10000"),
    ],
)
def test_a_set_up_that_is_refused_is_said(
    rigs: Any, refuse: dict[tuple[int, int], int], rated: int, says: str
) -> None:
    device = Device(rigs(LINK))
    device.refuse, device.rated_mNm = refuse, rated
    device.set_up()
    device.rig.link.poll(0.0)
    assert device.state()[0] is DriveState.FAULT
    assert says in device.state()[1]
    assert (0x000, b"\x01\x01") not in device.heard


def test_objects_that_a_drive_may_lack(rigs: Any) -> None:
    device = Device(rigs(LINK))
    lacking = ((0x6076, 0), (0x60C2, 1), (0x60C2, 2), (0x1802, 1), (0x1803, 1))
    device.refuse = dict.fromkeys(lacking, 0x0602_0000)
    device.set_up()
    assert (0x000, b"\x01\x01") in device.heard


def test_an_answer_that_stays_out_is_asked_for_again(rigs: Any) -> None:
    device = Device(rigs(LINK))
    for _ in range(250):
        device.rig.link.request(0, Request.REPORT)
    assert [i for i, _ in device.listen()] == [0x000, 0x601] * 3


def test_stopping(device: Device) -> None:
    enable(device)
    device.listen()
    assert device.rig.link.stop()
    assert [(i, data[:5]) for i, data in device.listen()] == [
        (0x201, bytes(5)),
        (0x080, b""),
        (0x601, bytes.fromhex("2b40600000")),
    ]
    device.tell(ENABLED)
    assert control(device) == Control.DISABLE_VOLTAGE


def test_what_the_wire_cannot_carry_is_refused_or_said(device: Device) -> None:
    link = device.rig.link
    with pytest.raises(InputError, match="stiffness"):
        link.send(0, MotorCommand(0.0, 0.0, 0.0, 1.0))
    with pytest.raises(InputError, match="finite"):
        link.send(0, MotorCommand(math.nan))
    with pytest.raises(InputError, match="set up for mode"):
        link.request(0, Request.ENABLE, Mode.TORQUE)
    assert link.send(0, MotorCommand(0.0, 0.0, 1e6)) != 0
    assert device.listen()[0] == (0x201, struct.pack("<Hih", 0, 0, 32767))


@given(st.sampled_from([0x181, 0x281, 0x081, 0x581, 0x701]), st.binary(max_size=8))
def test_no_frame_raises(identifier: int, data: bytes) -> None:
    rig = Rig(LINK)
    try:
        rig.tell(identifier, data)
        rig.link.poll(0.0)
    finally:
        rig.close()


def test_the_second_encoder_is_the_joints(rigs: Any) -> None:
    device = Device(rigs("cia402-dual-encoder.toml"))
    device.set_up()
    assert (0x23, 0x1A02, 1, 0x60E4_0120) in device.written
    device.rig.tell(0x381, struct.pack("<i", -262144))
    device.rig.link.poll(0.0)
    assert device.rig.link.joints[0].values[JOINT_POSITION] == pytest.approx(-TURN / 4)


def test_two_drives_share_one_sync(rigs: Any) -> None:
    joint = '[[joint]]\nname = "joint-2"\n[joint.motor]\ndevice = "drive"\nnode = 2\n\n[[joint]]\nname = "joint-1"'
    rig: Rig = rigs(LINK, {'[[joint]]\nname = "joint-1"': joint})
    for _ in range(3):
        rig.heard()
        for k in range(2):
            rig.link.send(k, MotorCommand())
    assert [i for i, _ in rig.heard()] == [0x202, 0x201, 0x080]
    for _ in range(2):  # the other one's run is over
        rig.heard()
        rig.link.send(1, MotorCommand())
    assert [i for i, _ in rig.heard()] == [0x201, 0x080]
