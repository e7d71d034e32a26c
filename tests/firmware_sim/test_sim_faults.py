"""Faults on demand: each does what its name says, when it says, the same way for the same seed."""

from __future__ import annotations

from itertools import pairwise

import pytest
from far_end import encode_command, read_state, read_status
from hypothesis import given
from hypothesis import strategies as st
from sim_two_mass import ListPort, TwoMass

from firmware_sim.bench import Bench
from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.errors import SimError
from firmware_sim.faults import FAULTS, FaultyPort, SerialNoise, describe_faults, parse_fault
from firmware_sim.firmware import DriveFlag, DriveState, SensorFlag, Setpoint
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.mit import MODELS
from firmware_sim.wire.serial_records import RecordReader, encode_record

ENTER = Frame(1, b"\xff" * 7 + b"\xfc")


def through(spec: str, frames: list[Frame], seed: int = 0, until: float = 1.0) -> list[tuple[float, Frame]]:
    """What a faulty port sends of frames that are sent 1 ms apart."""
    inner = ListPort()
    port = FaultyPort(inner, [parse_fault(spec, seed)])
    sent = list(frames)
    for k in range(round(until / 1e-3)):
        port.send([sent.pop(0)] if sent else [], k * 1e-3)
    return inner.sent


MANY = [Frame(0x100 + k % 7, k.to_bytes(4, "big")) for k in range(300)]


def test_dropped_in_its_window_only() -> None:
    got = [frame for _, frame in through("drop:start=0.1,stop=0.2", MANY)]
    assert got == MANY[:100] + MANY[200:]
    some = through("drop:p=0.3", MANY, seed=5)
    assert 180 < len(some) < 240
    assert some == through("drop:p=0.3", MANY, seed=5)
    assert some != through("drop:p=0.3", MANY, seed=6)


def test_only_the_named_identifiers_and_direction() -> None:
    got = [frame for _, frame in through("drop:id=0x103", MANY)]
    assert got == [frame for frame in MANY if frame.identifier != 0x103]
    got = [frame for _, frame in through("drop:id=0x100,mask=0x7fc", MANY)]
    assert got == [frame for frame in MANY if frame.identifier > 0x103]
    assert len(through("drop:direction=rx", MANY)) == 300


def test_late_frames_keep_their_order_and_lose_nothing() -> None:
    got = through("late:delay=0.02", MANY)
    assert [frame for _, frame in got] == MANY
    for k, (at, _) in enumerate(got):
        assert k * 1e-3 + 0.02 - 1e-9 <= at <= k * 1e-3 + 0.0211


def test_repeated_and_reordered_and_corrupted() -> None:
    repeated = [frame for _, frame in through("repeat:times=2", MANY)]
    assert repeated == [frame for frame in MANY for _ in range(3)]
    shuffled = [frame for _, frame in through("reorder:spread=0.01", MANY)]
    assert sorted(shuffled, key=lambda f: f.data) == MANY
    assert shuffled != MANY
    hit = [frame for _, frame in through("corrupt:bits=1", MANY)]
    for before, after in zip(MANY, hit, strict=True):
        difference = int.from_bytes(before.data, "big") ^ int.from_bytes(after.data, "big")
        assert difference.bit_count() == 1
        assert after.identifier == before.identifier


def test_faults_compose_in_order() -> None:
    inner = ListPort()
    port = FaultyPort(inner, [parse_fault("repeat:times=1"), parse_fault("late:delay=0.005")])
    port.send([MANY[0]], 0.0)
    assert inner.sent == []
    port.send([], 0.0051)
    assert len(inner.sent) == 2


def test_bus_off_stops_both_ways_and_comes_back() -> None:
    inner = ListPort()
    port = FaultyPort(inner, [parse_fault("bus_off:start=1,stop=2")])
    for now, passes in ((0.5, True), (1.0, False), (1.99, False), (2.0, True)):
        inner.arriving = [MANY[0]]
        assert bool(port.poll(now)) is passes
        port.send([MANY[1]], now)
        assert bool(inner.take()) is passes


@given(st.integers(0, 1000))
def test_serial_noise_never_makes_a_wrong_record(seed: int) -> None:
    noise = SerialNoise(p=0.02, seed=seed)
    reader, heard = RecordReader(), []
    for frame in MANY[:60]:
        heard += reader.feed(noise.hit(encode_record(frame), 0.0))
    assert all(frame in MANY for frame in heard)
    assert len(heard) + reader.bad_records >= 50


# ---- in the device ---------------------------------------------------------------------------------


def run(spec: str, seconds: float = 0.6, torque: float = 0.0, load: float = 0.3) -> tuple[Bench, ListPort]:
    """An enabled joint under a steady load and a stiff position command, with one fault."""
    port = ListPort()
    bench = make_bench(BenchConfig(), lambda number: TwoMass(load), port, [parse_fault(spec)])
    port.arriving = [ENTER]
    command = Frame(1, encode_command(MODELS["AK80-9"], Setpoint(0.2, 0.0, torque, 5.0, 0.1)))
    for k in range(round(seconds / 1e-3)):
        bench.tick(k * 1e-3)
        port.arriving = [command]
    return bench, port


def states(port: ListPort) -> list:
    return [(t, read_state(f)) for t, f in port.sent if f.identifier == 0x680]


def test_stuck_joint_encoder_stands_still_while_the_joint_moves() -> None:
    bench, port = run("stuck:which=joint,start=0.05,stop=0.4")
    during = {s.joint_position_rad for t, s in states(port) if 0.052 < t < 0.398}
    assert len(during) == 1
    after = [s.joint_position_rad for t, s in states(port) if t > 0.402]
    truth = bench.joints[0].truth
    assert truth is not None
    assert after[-1] == pytest.approx(truth.joint_position_rad, abs=1e-5)
    assert abs(after[-1] - during.pop()) > 0.05


def test_stuck_motor_encoder_deceives_the_drive_itself() -> None:
    bench, _ = run("stuck:which=motor,start=0.02", seconds=0.3)
    (joint,) = bench.joints
    assert joint.truth is not None
    # its spring pulls on, for it never sees the target reached
    assert abs(joint.truth.motor_position_rad - joint.drive.position_rad) > 0.3


def test_jumping_encoders_are_seen() -> None:
    _, port = run("jump:which=joint,jump=0.4,start=0.3")
    flags = [read_status(f).error_flags for _, f in port.sent if f.identifier == 0x681]
    assert SensorFlag.ENCODER_JUMPED in flags
    bench, _ = run("jump:which=motor,jump=0.4,start=0.3")
    assert bench.joints[0].drive.state is DriveState.FAULT
    assert bench.joints[0].drive.flags & DriveFlag.MOTOR_ENCODER
    _, port = run("jump:which=joint,jump=0.1,p=0.05,start=0.1")
    late = [s.joint_position_rad for t, s in states(port) if t > 0.4]
    spikes = sum(abs(a - b) > 0.05 for a, b in pairwise(late))
    assert 4 < spikes < 40


def test_saturated_torque_at_motor_and_at_sensor() -> None:
    bench, _ = run("saturate:which=motor,limit=0.05", seconds=0.3)
    plant = bench.joints[0].plant
    assert abs(plant.last_command_Nm) <= 0.05
    _, port = run("saturate:which=sensor,limit=0.1")
    assert {round(s.joint_torque_Nm, 9) for _, s in states(port)} == {0.1}


def test_sensor_offset() -> None:
    _, port = run("offset:channel=joint_torque_Nm,offset=0.25,start=0.3")
    assert {round(s.joint_torque_Nm, 6) for t, s in states(port) if t < 0.299} == {0.3}
    assert {round(s.joint_torque_Nm, 6) for t, s in states(port) if t > 0.302} == {0.55}


def test_silent_sensor_node_counts_on() -> None:
    _, port = run("silent:node=sensor,start=0.2,stop=0.3")
    samples = states(port)
    assert not [t for t, _ in samples if 0.2011 < t < 0.2999]
    gap = [(a, b) for (_, a), (_, b) in pairwise(samples) if b.sequence != (a.sequence + 1) % 256]
    assert len(gap) == 1
    assert (gap[0][1].sequence - gap[0][0].sequence) % 256 == 101  # a hundred samples were not heard


def test_silent_drive_times_out_by_itself() -> None:
    bench, port = run("silent:node=drive,start=0.2,stop=0.5")
    assert bench.joints[0].drive.flags & DriveFlag.COMMAND_TIMEOUT
    replies = [t for t, f in port.sent if f.identifier == 0]
    assert not [t for t in replies if 0.2011 < t < 0.4999]
    assert [t for t in replies if t > 0.5]


def test_reset_in_mid_motion() -> None:
    bench, port = run("reset:node=both,start=0.25,boot=0.05")
    (joint,) = bench.joints
    assert joint.drive.state is DriveState.DISABLED
    assert joint.drive.flags & DriveFlag.STARTED_AFRESH
    again = [s.sequence for t, s in states(port) if t > 0.2505]
    assert again[0] == pytest.approx(50, abs=2)  # silent while it boots, counting from its own start
    flags = [read_status(f) for t, f in port.sent if f.identifier == 0x681 and t > 0.25]
    assert flags[0].device_time_us < 100_000


def test_a_fault_of_one_joint_leaves_the_other_alone() -> None:
    port = ListPort()
    bench = make_bench(BenchConfig(joints=2), lambda n: TwoMass(0.3), port, [parse_fault("silent:joint=2")])
    for k in range(50):
        bench.tick(k * 1e-3)
    told = {f.identifier for _, f in port.sent}
    assert told == {0x680, 0x681}


# ---- text ------------------------------------------------------------------------------------------


WRONG = (
    "fly drop:p drop:q=1 drop:p=often drop:p=2 drop:start=2,stop=1 drop:direction=up stuck:which=eye "
    "offset:channel=mood silent:node=all saturate:which=host"
)


@pytest.mark.parametrize("text", WRONG.split())
def test_wrong_specifications_are_one_line(text: str) -> None:
    with pytest.raises(SimError) as caught:
        parse_fault(text)
    assert "accepted" in str(caught.value) or "must lie before" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_every_fault_is_described_and_parsed_with_its_defaults() -> None:
    text = describe_faults()
    for name in FAULTS:
        assert f"{name}:" in text
        parse_fault(name)
