"""Both ends of the wire, written apart from the same manuals, meet: every protocol over every kind of
wire."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from wire_meeting import PROTOCOLS, Meeting

from cablecomp.errors import DeviceError
from cablecomp.links import BusLink, BusState, DriveState, Mode, MotorCommand, Request
from cablecomp.links.records import JOINT_POSITION, JOINT_TORQUE, MOTOR_POSITION, MOTOR_TORQUE, MOTOR_VELOCITY
from firmware_sim.errors import SimError

WIRES = ("virtual", "udp_multicast", "slcan", "serial")
# Half a count of what each wire carries: motor position in rad, motor velocity in rad/s, motor torque in Nm
RESOLUTION = {
    "mit": (25 / 65535, 100 / 4095, 36 / 4095),
    "damiao": (25 / 65535, 60 / 4095, 20 / 4095),
    "odrive": (2e-6, 2e-5, 1e-5),
    "odrive-0.5": (2e-6, 2e-5, 1e-5),
    "robstride": (25.2 / 65535, 88 / 65535, 34 / 65535),
    "cubemars-v3": (0.06 * 0.0175, 10 / 1800, 36 / 4095),  # the status has steps of 0.1 deg, 10 ERPM, 0.01 A
    "cubemars-servo": (0.06 * 0.0175, 10 / 1800, 36 / 4095),
    "moteus": (2e-6, 2e-5, 1e-5),
    "cia402": (1e-4, 1e-4, 5e-3),  # 65536 counts per turn, thousandths of 10 Nm
    "dbc": (1e-6, 0.025, 1e-3),
}


@pytest.fixture
def meet() -> Iterator[Any]:
    made: list[Meeting] = []

    def make(*args: Any, **options: Any) -> Meeting:
        try:
            made.append(Meeting(*args, **options))
        except (SimError, DeviceError) as error:
            if "udp_multicast" in args:
                pytest.skip(f"no multicast here: {error}")
            raise
        return made[-1]

    yield make
    for meeting in made:
        meeting.close()


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("protocol", [p for p in PROTOCOLS if not p.endswith(("-dual", "dynamixel"))])
def test_both_ends_say_the_same(meet: Any, protocol: str, wire: str) -> None:
    meeting = meet(protocol, wire)
    link, joint, device = meeting.link, meeting.link.joints[0], meeting.bench.joints[0]

    own_loops = protocol.startswith("odrive") or protocol in ("cubemars-servo", "cia402")
    mode = Mode.POSITION if own_loops else Mode.IMPEDANCE
    if protocol == "cia402":
        meeting.climb()
    else:
        if protocol == "damiao":  # it has to tell its ranges before
            assert link.request(0, Request.REPORT)
            meeting.until(lambda: joint.updates[MOTOR_POSITION])
        assert link.request(0, Request.CLEAR_FAULTS)
        assert link.request(0, Request.ENABLE, mode)
    meeting.until(lambda: device.drive.state.name == "ENABLED")
    meeting.until(
        lambda: min(joint.updates[MOTOR_POSITION], joint.updates[JOINT_POSITION]) >= meeting.bench.steps
    )
    gains = (None, None) if own_loops or protocol == "dbc" else (60.0, 2.0)
    command = MotorCommand(0.4, 0.0, -device.plant.load_Nm, *gains)
    tolerance = RESOLUTION[protocol]
    for _ in range(120):
        meeting.cycle(command)
        truth = device.truth
        assert joint.values[MOTOR_POSITION] == pytest.approx(truth.motor_position_rad, abs=tolerance[0])
        assert joint.values[MOTOR_VELOCITY] == pytest.approx(truth.motor_velocity_rad_s, abs=tolerance[1])
        assert joint.values[JOINT_POSITION] == pytest.approx(truth.joint_position_rad, abs=0.51e-6)
        assert joint.values[JOINT_TORQUE] == pytest.approx(truth.joint_torque_Nm, abs=0.51e-5)
    assert joint.values[MOTOR_TORQUE] == pytest.approx(device.truth.motor_torque_Nm, abs=0.05)
    told = device.drive.setpoint
    assert told.position_rad == pytest.approx(0.4, abs=tolerance[0])
    feedforward = 0.0 if protocol == "cubemars-servo" else command.torque_Nm
    assert told.torque_Nm == pytest.approx(feedforward, abs=max(tolerance[2], 5e-4))
    if not own_loops:
        assert told.kp_Nm_per_rad == pytest.approx(200.0 if protocol == "dbc" else 60.0, abs=500 / 4095)
        assert told.kd_Nms_per_rad == pytest.approx(2.0, abs=5 / 4095)
    assert joint.device_s[JOINT_POSITION] == pytest.approx(device.time_s, abs=0.0111)
    assert joint.state == DriveState.ENABLED
    status = link.status()
    assert (status.bus, status.invalid, status.lost, status.repeated, status.reordered) == (
        BusState.ACTIVE,
        0,
        0,
        0,
        0,
    )
    assert link.request(0, Request.DISABLE)
    meeting.until(lambda: device.drive.state.name == "DISABLED")
    assert link.stop()
    meeting.until(lambda: device.drive.state.name in ("DISABLED", "FAULT"))


@pytest.mark.parametrize("protocol", ["moteus-dual", "cia402-dual", "odrive-dual"])
def test_the_joints_encoder_on_the_drives_second_input(meet: Any, protocol: str) -> None:
    meeting = meet(protocol, "virtual")
    link, joint, device = meeting.link, meeting.link.joints[0], meeting.bench.joints[0]
    gains: tuple[Any, Any] = (None, None)
    if protocol != "moteus-dual":
        meeting.climb()
    else:
        gains = (60.0, 2.0)
        link.request(0, Request.ENABLE, Mode.IMPEDANCE)
        meeting.until(lambda: device.drive.state.name == "ENABLED")
    first = device.plant.load_Nm / 50.0
    for _ in range(50):
        meeting.cycle(MotorCommand(-0.3, 0.0, -device.plant.load_Nm, *gains))
        assert joint.values[JOINT_POSITION] == pytest.approx(device.truth.joint_position_rad, abs=4e-6)
    assert joint.values[JOINT_POSITION] < first - 5e-3
    assert joint.updates[JOINT_TORQUE] == 0


def test_a_dynamixel_on_a_line_of_its_own(meet: Any) -> None:
    meeting = meet("dynamixel", "dynamixel")
    link, joint, device = meeting.link, meeting.link.joints[0], meeting.bench.joints[0]
    meeting.climb()
    for _ in range(40):
        steps = meeting.bench.steps
        updates = joint.updates[MOTOR_POSITION]
        link.send(0, MotorCommand(0.4))
        meeting.until(
            lambda steps=steps, updates=updates: (
                meeting.bench.steps > steps and joint.updates[MOTOR_POSITION] > updates
            )
        )
        truth = device.truth
        assert joint.values[MOTOR_POSITION] == pytest.approx(truth.motor_position_rad, abs=8e-4)
        assert joint.values[MOTOR_VELOCITY] == pytest.approx(truth.motor_velocity_rad_s, abs=0.0121)
        assert joint.values[MOTOR_TORQUE] == pytest.approx(truth.motor_torque_Nm, abs=2.5e-3)
    assert device.drive.setpoint.position_rad == pytest.approx(0.4, abs=8e-4)
    assert joint.updates[JOINT_POSITION] == 0
    assert link.status().invalid == 0
    assert link.stop()
    meeting.until(lambda: device.drive.state.name == "DISABLED")


def test_eight_joints_on_one_bus(meet: Any) -> None:
    meeting = meet("mit", "virtual", joints=8)
    for n in range(8):
        meeting.link.request(n, Request.ENABLE)
    meeting.until(lambda: all(j.drive.state.name == "ENABLED" for j in meeting.bench.joints))
    for _ in range(20):
        meeting.cycle(MotorCommand(0.1))
    for joint, device in zip(meeting.link.joints, meeting.bench.joints, strict=True):
        assert joint.values[JOINT_TORQUE] == pytest.approx(0.5 + 0.25 * device.number, abs=1e-5)
        assert joint.values[MOTOR_POSITION] == pytest.approx(device.truth.motor_position_rad, abs=4e-4)
    assert meeting.link.status().ignored == 0


def test_frames_that_the_wire_loses_are_counted_one_by_one(meet: Any) -> None:
    meeting = meet("mit", "virtual", faults=("drop:p=0.3,direction=tx,id=0x680,mask=0x7FF",))
    meeting.link.request(0, Request.ENABLE)
    joint = meeting.link.joints[0]
    for k in range(300):
        meeting.now_s = 1e-3 * k
        meeting.link.send(0, MotorCommand())
        meeting.bench.pump()
        meeting.link.poll(meeting.now_s)
    state = next(m for m in joint.messages if m.name.endswith("Joint1_State"))
    first_to_last = state.received + state.lost
    assert state.received < 260
    assert 290 <= first_to_last <= 300
    assert state.lost == meeting.link.status().lost
    assert (state.repeated, state.reordered, state.restarts) == (0, 0, 0)


@pytest.mark.parametrize(
    ("spec", "field"), [("repeat:p=0.2", "repeated"), ("reorder:spread=0.004", "reordered")]
)
def test_repeated_and_reordered_frames_never_turn_time_back(meet: Any, spec: str, field: str) -> None:
    meeting = meet("mit", "virtual", faults=(f"{spec},direction=tx,id=0x680,mask=0x7FF",))
    meeting.link.request(0, Request.ENABLE)
    node = next(m for m in meeting.link.joints[0].messages if m.name.endswith("Joint1_State"))
    newest = -1
    for k in range(300):
        meeting.link.send(0, MotorCommand())
        meeting.bench.pump()
        meeting.link.poll(1e-3 * k)
        if node.sequence >= 0:
            assert newest < 0 or (node.sequence - newest) % 256 < 128
            newest = node.sequence
    assert getattr(meeting.link.status(), field) > 10


def test_a_pulled_cable_is_a_lost_bus(meet: Any) -> None:
    for wire in ("serial", "slcan"):
        meeting = meet("mit", wire)
        meeting.link.request(0, Request.ENABLE)
        meeting.cycle(MotorCommand())
        meeting.bench.port.unplug()
        meeting.link.send(0, MotorCommand())
        meeting.link.poll(1.0)
        assert meeting.link.status().bus == BusState.LOST
        assert not meeting.link.stop()
        assert meeting.link.joints[0].ages(1.0).joint_position_s > 0.9
        meeting.bench.port.plug()
        meeting.link.close()
        where = meeting.bench.port.describe()
        meeting.link = BusLink(meeting.link.config.redirect(where["interface"], where["channel"]))
        meeting.link.open()
        meeting.cycle(MotorCommand())


def test_bus_off_behind_an_slcan_adapter(meet: Any) -> None:
    meeting = meet("mit", "slcan", faults=("bus_off:start=0.02,stop=0.04",))
    link, port = meeting.link, meeting.bench.port
    link.request(0, Request.ENABLE)
    for _ in range(15):
        meeting.cycle(MotorCommand())
    port.poll(0.03)
    link.send(0, MotorCommand())

    def told() -> bool:
        port.poll(0.03)
        link.poll(1.0)
        return link.status().bus == BusState.OFF

    for _ in range(2000):
        if told():
            break
        port.wait(0.001)
    assert link.status().bus == BusState.OFF
    assert "bus error" in link.status().fault
    assert link.status().overflows >= 1


def test_a_sensor_node_that_restarts_is_followed_again(meet: Any) -> None:
    meeting = meet("mit", "virtual", faults=("reset:start=0.15,node=sensor,boot=0.02",))
    meeting.link.request(0, Request.ENABLE)
    joint = meeting.link.joints[0]
    oldest = 0.0
    for k in range(300):
        now = 1e-3 * k
        meeting.link.send(0, MotorCommand())
        meeting.bench.pump()
        meeting.link.poll(now)
        if k > 5:
            oldest = max(oldest, joint.age_s(JOINT_POSITION, now))
    assert 0.015 < oldest < 0.03
    assert joint.age_s(JOINT_POSITION, 0.299) < 1.5e-3
    status = meeting.link.status()
    assert status.restarts == 1 or status.lost > 0
