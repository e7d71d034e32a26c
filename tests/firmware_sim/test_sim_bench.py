"""Joints on a port: sensor node, pacing, stepping, several joints, devices described by a foreign table."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from far_end import encode_command, read_state, read_status
from sim_two_mass import ListPort, TwoMass

from firmware_sim.bench import Bench
from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.errors import SimError
from firmware_sim.firmware import DriveState, Mode, SensorFlag, SensorNode, SensorNodeConfig, Setpoint
from firmware_sim.plantlike import Readings
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.mit import MODELS

ENTER = b"\xff" * 7 + b"\xfc"
STILL = Readings(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 25.0)


def bench_of(port: ListPort, **options: object) -> Bench:
    return make_bench(BenchConfig(**options), lambda number: TwoMass(), port)


def torque(value: float) -> bytes:
    return encode_command(MODELS["AK80-9"], Setpoint(torque_Nm=value))


# ---- sensor node -----------------------------------------------------------------------------------


def test_sequence_counts_every_sample_and_status_names_it() -> None:
    node = SensorNode(SensorNodeConfig(status_every=10))
    heard = [node.sample(STILL, k * 1e-3) for k in range(600)]
    assert [sample.sequence for sample, _ in heard] == [k % 256 for k in range(600)]
    statuses = [(k, status) for k, (_, status) in enumerate(heard) if status is not None]
    for k, status in statuses:
        assert status.sequence == k % 256
        assert status.device_time_us == k * 1000
    # every tenth, and the second sample, where "started afresh" goes
    assert [k for k, _ in statuses] == [0, 1, *range(10, 600, 10)]


def test_flags_come_at_once_with_the_sample_that_raised_them() -> None:
    node = SensorNode(SensorNodeConfig(status_every=1000, torque_range_Nm=1.0))
    for k in range(5):
        node.sample(STILL, k * 1e-3)
    cases = [
        (STILL._replace(joint_position_rad=0.5), SensorFlag.ENCODER_JUMPED),
        (STILL._replace(joint_position_rad=math.nan), SensorFlag.ENCODER_LOST),
        (STILL._replace(joint_torque_Nm=1.5), SensorFlag.TORQUE_SATURATED),
        (STILL._replace(temperature_degC=95.0), SensorFlag.OVER_TEMPERATURE),
    ]
    for readings, flag in cases:
        node.sample(STILL, 0.0)
        node.sample(STILL, 0.0)
        sample, status = node.sample(readings, 0.0)
        assert status is not None
        assert status.error_flags == flag
        assert abs(sample.joint_torque_Nm) <= 1.0


def test_clock_drift_and_wrap() -> None:
    node = SensorNode(SensorNodeConfig(clock_drift_ppm=100.0))
    assert node.device_time_us(10.0) == 10_001_000
    assert node.device_time_us(2**32 * 1e-6 / 1.0001 + 1.0) == pytest.approx(1_000_100, abs=1)


# ---- pacing ----------------------------------------------------------------------------------------


def test_tick_follows_the_callers_time_on_an_absolute_grid() -> None:
    port = ListPort()
    bench = bench_of(port)
    for now in (0.0001, 0.00099, 0.00151, 0.0049, 0.005, 0.0151):
        bench.tick(now)
    states = [read_state(f) for f in port.take() if f.identifier == 0x680]
    assert len(states) == 15  # one for each whole millisecond, however the ticks fell
    assert bench.time_s == pytest.approx(0.015, abs=2.6e-4)


def test_time_far_behind_is_skipped_and_counted() -> None:
    bench = bench_of(ListPort())
    bench.tick(1.0)
    (joint,) = bench.joints
    assert joint.lost_s == pytest.approx(0.95)
    assert bench.time_s == pytest.approx(1.0, abs=1e-9)


def test_stepped_time_moves_by_commands_alone() -> None:
    port = ListPort()
    bench = bench_of(port, joints=2)
    assert bench.pump() == 0
    port.arriving = [Frame(1, ENTER)]
    assert bench.pump() == 0
    assert bench.time_s == 0.0
    assert [f.identifier for f in port.take()] == [0]
    port.arriving = [Frame(1, torque(0.1))] * 3
    assert bench.pump() == 3
    first, second = bench.joints
    assert first.time_s == pytest.approx(3e-3)
    assert second.time_s == 0.0
    told = [f.identifier for f in port.take()]
    assert told == [0x680, 0x681, 0, 0x680, 0x681, 0, 0x680, 0]  # samples first, the reply last


def test_stepped_by_sync_moves_all_joints() -> None:
    port = ListPort()
    bench = bench_of(port, joints=3, stepping="sync")
    port.arriving = [Frame(1, torque(0.1)), Frame(0x700, b"\0\0\0\0"), Frame(0x700)]
    assert bench.pump() == 2
    assert {joint.time_s for joint in bench.joints} == {2e-3}
    states = [f.identifier for f in port.take() if f.identifier in (0x680, 0x682, 0x684)]
    assert states == [0x680, 0x682, 0x684] * 2


def test_the_same_commands_in_stepped_and_in_given_time_give_the_same_samples() -> None:
    ports = ListPort(), ListPort()
    stepped, ticked = bench_of(ports[0]), bench_of(ports[1])
    for port in ports:
        port.arriving = [Frame(1, ENTER)]
    stepped.pump()
    ticked.tick(0.0)
    for k in range(200):
        frame = Frame(1, torque(0.2 * math.sin(0.05 * k)))
        ports[0].arriving = [frame]
        stepped.pump()
        ports[1].arriving = [frame]
        ticked.tick((k + 1) * 1e-3)
    samples = [[f for f in port.take() if f.identifier == 0x680] for port in ports]
    # in given time the command is heard after the step that it was sent in would have begun: compare on the
    # way there
    assert len(samples[0]) == len(samples[1]) == 200
    assert samples[0] == samples[1]


def test_identifiers_must_not_be_shared() -> None:
    port = ListPort()
    bench = bench_of(port, joints=2)
    with pytest.raises(SimError, match="share"):
        Bench(port, [bench.joints[0], bench.joints[0]])
    with pytest.raises(SimError, match="protocol"):
        BenchConfig(protocol="canopen")


def test_eight_mit_joints_each_answer_with_their_own_id() -> None:
    port = ListPort()
    bench = bench_of(port, joints=8)
    port.arriving = [Frame(n, torque(0.0)) for n in range(1, 9)]
    bench.tick(0.0)
    replies = [f for f in port.take() if f.identifier == 0]
    assert [f.data[0] for f in replies] == list(range(1, 9))


# ---- protocols -------------------------------------------------------------------------------------


def test_odrive_joint_moves_and_reports_by_itself() -> None:
    port = ListPort()
    bench = bench_of(port, protocol="odrive")
    port.arriving = [
        Frame(0x27, bytes.fromhex("08000000")),
        Frame(0x2B, bytes.fromhex("0300000001000000")),
        Frame(0x2C, bytes.fromhex("CDCCCC3D00000000")),  # 0.1 turns
    ]
    for k in range(1500):
        bench.tick(k * 1e-3)
        if k % 50 == 0:
            port.arriving = [Frame(0x2C, bytes.fromhex("CDCCCC3D00000000"))]
    (joint,) = bench.joints
    assert joint.drive.state is DriveState.ENABLED
    assert joint.drive.position_rad == pytest.approx(0.2 * math.pi, abs=5e-3)
    told = [f.identifier for f in port.take()]
    assert told.count(0x29) == pytest.approx(1500, abs=2)
    assert 15 <= told.count(0x21) <= 18


def test_dbc_joint_by_the_shipped_table() -> None:
    port = ListPort()
    bench = bench_of(port, protocol="dbc")
    # control: enable, impedance, kp 2.00 / 0.05 = 40, kd 0.100 = 100, no torque limit; target 0.5 rad = 500
    # 000
    port.arriving = [Frame(0x6C1, bytes.fromhex("0203280064000000"))]
    for k in range(1000):
        bench.tick(k * 1e-3)
        port.arriving = [Frame(0x6C0, bytes.fromhex("20A1070000000000"))]
    (joint,) = bench.joints
    assert joint.drive.mode is Mode.IMPEDANCE
    assert joint.drive.setpoint == pytest.approx((0.5, 0.0, 0.0, 2.0, 0.1))
    assert joint.drive.position_rad == pytest.approx(0.5, abs=2e-3)
    told = port.take()
    states = [f for f in told if f.identifier == 0x6C2]
    assert [f.data[7] for f in states] == [(k + 1) % 256 for k in range(len(states))]
    status = next(f for f in told if f.identifier == 0x6C3)
    assert status.data[0] == 0x32  # enabled, impedance


FOREIGN = """VERSION ""

BU_: PC Axis

BO_ 2566844672 Axis1_Target: 8 PC
 SG_ Pos : 7|32@0- (1e-5,0) [0|0] "rad" Axis
 SG_ TorqueFF : 39|16@0- (0.01,0) [0|0] "Nm" Axis
 SG_ Stiff : 55|8@0+ (0.5,0) [0|0] "Nm/rad" Axis
 SG_ Cmd : 63|8@0+ (1,0) [0|0] "" Axis

BO_ 2566844673 Axis1_Info: 8 Axis
 SG_ Pos : 7|32@0- (1e-5,0) [0|0] "rad" PC
 SG_ State : 39|8@0+ (1,0) [0|0] "" PC
"""
MAP = """[device]
dbc = "maker.dbc"
[device.command]
message = "Axis{joint}_Target"
[device.command.signals]
Pos = "motor_position_target_rad"
TorqueFF = "motor_torque_target_Nm"
Stiff = "kp_Nm_per_rad"
Cmd = "request"
[device.state]
message = "Axis{joint}_Info"
signals = { Pos = "motor_position_rad", State = "drive_state" }
[device.requests]
disable = 16
enable = 17
"""


def test_a_foreign_device_by_its_own_table(tmp_path: Path) -> None:
    (tmp_path / "maker.dbc").write_text(FOREIGN)
    (tmp_path / "maker.toml").write_text(MAP)
    port = ListPort()
    bench = bench_of(port, protocol="dbc", map_path=tmp_path / "maker.toml")
    identifier = 2566844672 & 0x1FFFFFFF
    # big-endian: 0.1 rad = 10 000 = 0x2710, 0.05 Nm = 5, 1.5 Nm/rad = 3, enable = 0x11
    port.arriving = [Frame(identifier, bytes.fromhex("0000271000050311"), extended=True)]
    bench.tick(0.0)
    (joint,) = bench.joints
    assert joint.drive.state is DriveState.ENABLED
    assert joint.drive.setpoint == pytest.approx((0.1, 0.0, 0.05, 1.5, 0.0))
    answer = port.take()[0]
    assert answer == Frame(identifier + 1, bytes.fromhex("0000000002000000"), extended=True)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[device", "not valid TOML"),
        ("[device]\ndbc='x'\n", "are needed"),
        (MAP.replace('"kp_Nm_per_rad"', '"kp"'), "is accepted"),
        (MAP.replace("Axis{joint}_Info", "Nope"), "has no message Nope"),
        (MAP.replace("enable = 17", "fly = 17"), "FLY"),
    ],
)
def test_a_wrong_map_is_one_line(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "maker.dbc").write_text(FOREIGN)
    (tmp_path / "maker.toml").write_text(text)
    with pytest.raises(SimError, match=message) as caught:
        bench_of(ListPort(), protocol="dbc", map_path=tmp_path / "maker.toml")
    assert "\n" not in str(caught.value)


def test_status_is_read_back_from_the_wire() -> None:
    port = ListPort()
    bench_of(port).tick(1e-3)
    status = next(f for f in port.take() if f.identifier == 0x681)
    assert read_status(status).error_flags == SensorFlag.STARTED_AFRESH
