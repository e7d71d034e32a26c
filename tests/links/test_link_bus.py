"""Whole links on a bus inside of the process; the devices' bytes are worked out from the manuals by hand."""

from __future__ import annotations

import math

import pytest
from link_rig import joint_state, joint_status

from cablecomp.errors import InputError
from cablecomp.links import BusLink, BusState, DriveState, Mode, MotorCommand, Request
from cablecomp.links.records import (
    CLIP_TORQUE,
    CLIP_VELOCITY,
    JOINT_POSITION,
    JOINT_TORQUE,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    NOT_TAKEN,
    TEMPERATURE,
)


def test_a_cycle_with_a_mit_drive_and_a_sensor_node(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    link, joint = rig.link, rig.link.joints[0]
    assert link.request(0, Request.ENABLE)
    assert rig.heard() == [(1, bytes.fromhex("FFFFFFFFFFFFFFFC"))]
    assert link.send(0, MotorCommand(position_rad=12.5, torque_Nm=18.0)) == 0
    # 200 of 500 Nm/rad and 2 of 5 Nms/rad are 4095 * 0.4 = 1638 = 666; velocity 0 is 7FF
    assert rig.heard() == [(1, bytes.fromhex("FF FF 7F F6 66 66 6F FF"))]
    rig.tell(0, "01 80 00 7F F7 FF 24 00")
    rig.tell(0x680, joint_state(-1_234_567, 250_000, 7))
    assert link.poll(3.0) == 6
    assert joint.values[MOTOR_POSITION] == pytest.approx(-12.5 + 25 * 0x8000 / 65535, abs=1e-12)
    assert joint.values[MOTOR_VELOCITY] == pytest.approx(-50 + 100 * 0x7FF / 4095, abs=1e-12)
    assert joint.values[MOTOR_TORQUE] == pytest.approx(-18 + 36 * 0x7FF / 4095, abs=1e-12)
    assert joint.values[JOINT_POSITION] == pytest.approx(-1.234567, abs=1e-15)
    assert joint.values[JOINT_TORQUE] == pytest.approx(2.5, abs=1e-15)
    assert joint.values[joint.index("other_motor_temperature_degC")] == 36.0
    assert (joint.state, joint.error, joint.replies, joint.unanswered) == (DriveState.ENABLED, 0, 1, 0)
    sample = joint.sample(3.001)
    assert sample.time_s == 3.001
    assert sample.joint_torque_Nm == joint.values[JOINT_TORQUE]
    assert sample.motor_torque_Nm == joint.values[MOTOR_TORQUE]
    assert math.isnan(sample.temperature_degC)
    assert sample.other == (36.0,)
    assert joint.ages(3.004) == pytest.approx((0.004, 0.004, 0.004))
    status = link.status()
    assert (status.bus, status.frames, status.sent, status.ignored, status.invalid) == (
        BusState.ACTIVE,
        2,
        2,
        0,
        0,
    )


def test_device_time_stamps_the_sample_that_it_belongs_to(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    joint = rig.link.joints[0]
    rig.tell(0x680, joint_state(1, 1, 41))
    rig.tell(0x681, joint_status(5_000_123, 3125, 0x10, 41))
    rig.link.poll(1.0)
    assert joint.device_s[JOINT_POSITION] == pytest.approx(5.000123)
    assert joint.device_s[JOINT_TORQUE] == pytest.approx(5.000123)
    assert joint.values[TEMPERATURE] == pytest.approx(31.25)
    assert joint.sensor_flags == 0x10
    rig.tell(0x680, joint_state(2, 2, 42))
    rig.tell(0x681, joint_status(5_009_999, 3125, 0, 41))
    rig.link.poll(1.001)
    assert joint.device_s[JOINT_POSITION] == pytest.approx(5.000123), "that time is of the sample before"


def test_no_value_leaves_the_channel_to_age(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    joint = rig.link.joints[0]
    rig.tell(0x680, joint_state(1_000_000, -(1 << 23), 1))
    assert rig.link.poll(1.0) == 1
    assert joint.age_s(JOINT_TORQUE, 1.0) == math.inf
    rig.tell(0x680, joint_state(-(1 << 31), 100_000, 2))
    assert rig.link.poll(2.0) == 1
    assert joint.values[JOINT_POSITION] == 1.0
    assert joint.age_s(JOINT_POSITION, 2.0) == 1.0
    assert joint.age_s(JOINT_TORQUE, 2.0) == 0.0


def test_faults_of_the_wire_are_counted_and_nothing_old_is_used(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    link, joint = rig.link, rig.link.joints[0]
    for position, sequence in ((1, 1), (2, 2), (2, 2), (5, 5), (3, 3), (6, 6)):
        rig.tell(0x680, joint_state(position, 0, sequence))
    rig.tell(0x680, "00 01")
    rig.tell(0, "01 80 00")
    rig.tell(0x123, "00")
    assert link.poll(1.0) == 8
    status = link.status()
    assert (status.frames, status.ignored, status.invalid) == (9, 1, 2)
    assert (status.lost, status.repeated, status.reordered, status.restarts) == (2, 1, 1, 0)
    assert joint.lost == 2
    assert joint.values[JOINT_POSITION] == pytest.approx(6e-6)
    assert joint.updates[JOINT_POSITION] == 4


def test_silence_is_seen_by_name(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    rig.tell(0x680, joint_state(1, 0, 1))
    rig.link.poll(1.0)
    assert rig.link.silent(1.005, 0.01) == ("joint-1: drive reply", "joint-1: Joint1_Status")
    assert "joint-1: Joint1_State" in rig.link.silent(1.02, 0.01)
    for _ in range(5):
        rig.link.send(0, MotorCommand())
    assert rig.link.joints[0].unanswered == 5


def test_sign_gear_ratio_and_offset_both_ways(rigs) -> None:
    rig = rigs(
        "mit-virtual.toml",
        {
            "reply_id = 0": "sign = -1\ngear_ratio = 4.0\nposition_offset_rad = 0.25\nreply_id = 0",
            "stiffness_Nm_per_rad = 200.0": "stiffness_Nm_per_rad = 3200.0",
            "damping_Nms_per_rad = 2.0": "damping_Nms_per_rad = 32.0",
        },
    )
    joint = rig.link.joints[0]
    # shaft at 12.5 rad, 50 rad/s, 18 Nm: pulley at -12.5/4 - 0.25, -12.5 rad/s, -72 Nm
    rig.tell(0, "01 FF FF FF FF FF 00 00")
    rig.link.poll(0.0)
    assert joint.values[MOTOR_POSITION] == pytest.approx(-3.375, abs=1e-12)
    assert joint.values[MOTOR_VELOCITY] == pytest.approx(-12.5, abs=1e-12)
    assert joint.values[MOTOR_TORQUE] == pytest.approx(-72.0, abs=1e-12)
    assert joint.saturated == 0b111
    clipped = rig.link.send(0, MotorCommand(-3.375, -12.5, -72.0))
    assert clipped == rig.link.status().clipped == 0
    assert rig.heard() == [(1, bytes.fromhex("FF FF FF F6 66 66 6F FF"))]
    assert rig.link.send(0, MotorCommand(-3.375, -12.6, -72.1)) == CLIP_VELOCITY | CLIP_TORQUE
    assert rig.link.status().clipped == 1


def test_modes_of_a_mit_drive(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    gains = []
    for mode in (Mode.TORQUE, Mode.VELOCITY, Mode.IMPEDANCE):
        rig.link.request(0, Request.ENABLE, mode)
        rig.heard()
        rig.link.send(0, MotorCommand(0.0, 0.0, 0.0, 500.0, 5.0))
        gains.append(rig.heard()[0][1].hex()[7:13])
    assert gains == ["000000", "000fff", "ffffff"]
    with pytest.raises(InputError, match="nothing was sent"):
        rig.link.send(0, MotorCommand(torque_Nm=math.nan))
    assert rig.heard() == []


def test_stop_reaches_every_drive(rigs) -> None:
    rig = rigs("mit-virtual-8.toml")
    assert rig.link.stop()
    heard = rig.heard()
    assert {i for i, _ in heard} == set(range(1, 9))
    assert {d for _, d in heard} == {bytes.fromhex("FFFFFFFFFFFFFFFD")}


def test_eight_joints_share_one_reply_identifier(rigs) -> None:
    rig = rigs("mit-virtual-8.toml")
    for n in range(1, 9):
        rig.tell(0, bytes([n, n, 0, 0x7F, 0xF7, 0xFF, 20 + n, 0]))
        rig.tell(0x680 + 2 * (n - 1), joint_state(n * 1000, 0, 0))
    assert rig.link.poll(1.0) == 8 * 6
    for n, joint in enumerate(rig.link.joints, 1):
        assert joint.values[MOTOR_POSITION] == pytest.approx(-12.5 + 25 * 256 * n / 65535, abs=1e-12)
        assert joint.values[JOINT_POSITION] == pytest.approx(n * 1e-3, abs=1e-15)


def test_steps_of_a_simulated_bus(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    assert rig.link.sync(0x1_0000_0005)
    assert rig.heard() == [(0x700, bytes.fromhex("05 00 00 00"))]


def test_a_closed_link_neither_reads_nor_raises(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    rig.link.close()
    assert rig.link.poll(1.0) == 0
    assert rig.link.send(0, MotorCommand()) == NOT_TAKEN
    assert not rig.link.stop()
    status = rig.link.status()
    assert (status.bus, status.sent) == (BusState.CLOSED, 0)
    assert status.send_failures == 3


def test_a_joint_without_a_motor_cannot_be_commanded(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    data = rig.link.config.model_copy(
        update={"joint": (rig.link.config.joint[0].model_copy(update={"motor": None}),)}
    )
    link = BusLink(data)
    with pytest.raises(InputError, match=r"has no motor on this link; add \[joint\.motor\]"):
        link.send(0, MotorCommand())
    assert not link.request(0, Request.ENABLE)


def test_a_poll_makes_no_lasting_objects(rigs) -> None:
    import gc
    import tracemalloc

    rig = rigs("mit-virtual.toml")

    def cycles(n: int) -> None:
        for k in range(n):
            rig.tell(0, "01 80 00 7F F7 FF 24 00")
            rig.tell(0x680, joint_state(k, k, k & 0xFF))
            rig.link.poll(k * 1e-3)

    cycles(300)
    gc.collect()
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    cycles(2000)
    gc.collect()
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 4000
