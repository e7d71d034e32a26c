"""The simulated ODrive: addressing, parameters, input modes, and both firmwares; frames are those of ODrive's
own examples and message tables."""

from __future__ import annotations

import itertools
import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sim_two_mass import TwoMass

from firmware_sim.bench import Bench
from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.firmware import DriveFlag, DriveState, InputMode, Setpoint, Shaper, ShapingConfig
from firmware_sim.firmware.shaping import plan
from firmware_sim.wire.frame import Frame

TURN = 2.0 * math.pi
BROADCAST = 0x3F


class Wire:
    """A port in a list."""

    def __init__(self) -> None:
        self.arriving: list[Frame] = []
        self.sent: list[Frame] = []

    def poll(self, now_s: float) -> list[Frame]:
        arrived, self.arriving = self.arriving, []
        return arrived

    def send(self, frames: list[Frame], now_s: float) -> None:
        self.sent += frames

    def wait(self, timeout_s: float) -> None:
        pass

    def describe(self) -> dict[str, Any]:
        return {}

    def close(self) -> None:
        pass


def bench_of(joints: int = 1, **options: Any) -> tuple[Bench, Wire]:
    port = Wire()
    config = BenchConfig(protocol="odrive", joints=joints, **options)
    return make_bench(config, lambda number: TwoMass(), port), port


def ask(bench: Bench, port: Wire, *frames: Frame) -> list[Frame]:
    """What is answered at once, without the cyclic messages."""
    port.sent.clear()
    port.arriving = list(frames)
    bench.pump()
    return port.sent[:]


def identifier(node: int, command: int) -> int:
    return node << 5 | command


# ---- addressing: ODrive's can_enumerate.py -------------------------------------------------------------


def test_a_scan_finds_every_drive() -> None:
    bench, port = bench_of(joints=3)
    found = ask(bench, port, Frame(identifier(BROADCAST, 0x06), remote=True))
    assert [f.identifier & 0x1F for f in found] == [0x06] * 3
    assert [f.data[0] for f in found] == [1, 2, 3]
    serials = {int.from_bytes(f.data[1:7], "little") for f in found}
    assert len(serials) == 3


def test_a_new_address_by_serial_number() -> None:
    bench, port = bench_of(joints=2)
    (found, _) = ask(bench, port, Frame(identifier(BROADCAST, 0x06), remote=True))
    assign = Frame(identifier(BROADCAST, 0x06), bytes([9]) + found.data[1:7])
    ask(bench, port, assign)
    assert ask(bench, port, Frame(identifier(1, 0x00), remote=True)) == []
    (version,) = ask(bench, port, Frame(identifier(9, 0x00)))  # an empty frame asks as well
    _, _, _, _, major, minor, _, _ = version.data
    assert (version.identifier, major, minor) == (identifier(9, 0x00), 0, 6)


def test_a_taken_address_is_vacated() -> None:
    bench, port = bench_of(joints=2)
    (first, _) = ask(bench, port, Frame(identifier(BROADCAST, 0x06), remote=True))
    ask(bench, port, Frame(identifier(BROADCAST, 0x06), bytes([2]) + first.data[1:7]))
    nodes = [f.data[0] for f in ask(bench, port, Frame(identifier(BROADCAST, 0x06), remote=True))]
    assert nodes == [2, BROADCAST]


def test_an_address_is_kept_over_a_reboot_once_saved() -> None:
    bench, port = bench_of()
    (found,) = ask(bench, port, Frame(identifier(BROADCAST, 0x06), remote=True))

    def node() -> int:
        return ask(bench, port, Frame(identifier(BROADCAST, 0x06), remote=True))[0].data[0]

    ask(bench, port, Frame(identifier(BROADCAST, 0x06), bytes([5]) + found.data[1:7]))
    ask(bench, port, Frame(identifier(5, 0x16), b"\x00"))
    assert node() == 1
    ask(bench, port, Frame(identifier(BROADCAST, 0x06), bytes([5]) + found.data[1:7]))
    ask(bench, port, Frame(identifier(5, 0x16), b"\x01"))
    assert node() == 5
    ask(bench, port, Frame(identifier(BROADCAST, 0x16), b"\x02"))
    assert node() == BROADCAST


# ---- parameters: ODrive's can_param_access.py ------------------------------------------------------------


def test_a_parameter_is_written_and_read_back() -> None:
    bench, port = bench_of()
    ramp = 390  # axis0.controller.config.vel_ramp_rate of firmware 0.6.10
    write = Frame(identifier(1, 0x04), struct.pack("<BHBf", 1, ramp, 0, 1.5))
    assert ask(bench, port, write) == []  # confirmed from 0.6.11 on only
    (told,) = ask(bench, port, Frame(identifier(1, 0x04), struct.pack("<BHB", 0, ramp, 0)))
    assert told.identifier == identifier(1, 0x05)
    assert struct.unpack("<BHBf", told.data) == (0, ramp, 0, 1.5)
    assert bench.joints[0].drive.shaper.config.velocity_ramp_rad_s2 == pytest.approx(1.5 * TURN)


def test_a_parameter_that_is_not_there_is_not_answered() -> None:
    bench, port = bench_of()
    assert ask(bench, port, Frame(identifier(1, 0x04), struct.pack("<BHB", 0, 9999, 0))) == []


def test_powers_are_told() -> None:
    bench, port = bench_of()
    (told,) = ask(bench, port, Frame(identifier(1, 0x1D), remote=True))
    assert told.identifier == identifier(1, 0x1D)
    assert len(told.data) == 8


# ---- what it sends by itself -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("firmware", "expected"),
    [
        ("0.6", {0x01, 0x03, 0x09, 0x14, 0x15, 0x17, 0x1C}),
        ("0.5", {0x01, 0x03, 0x09, 0x14, 0x17}),
    ],
)
def test_errors_current_and_bus_come_by_themselves(firmware: Any, expected: set[int]) -> None:
    bench, port = bench_of(firmware=firmware)
    for k in range(120):
        bench.tick(1e-3 * k)
    told = {f.identifier & 0x1F for f in port.sent if f.identifier >> 5 == 1}
    assert told == expected


# ---- modes -------------------------------------------------------------------------------------------


def run(bench: Bench, port: Wire, seconds: float, *frames: Frame) -> list[float]:
    """Motor velocities while the frames' targets are followed."""
    joint = bench.joints[0]
    port.arriving = list(frames)
    start, velocities = joint.time_s, []
    while joint.time_s < start + seconds:
        bench.tick(joint.time_s + 1e-3)
        velocities.append(joint.drive.velocity_rad_s)
        port.arriving = [frames[-1]]
    return velocities


def test_it_starts_in_position_control() -> None:
    bench, port = bench_of()
    closed = Frame(identifier(1, 0x07), struct.pack("<Q", 8))
    run(bench, port, 1.0, closed, Frame(identifier(1, 0x0C), struct.pack("<fhh", 0.1, 0, 0)))
    assert bench.joints[0].drive.position_rad == pytest.approx(0.1 * TURN, abs=0.02)


@pytest.mark.parametrize("modes", [(0, 1), (3, 4), (3, 7), (3, 8), (9, 1), (3, 99)])
@pytest.mark.parametrize("firmware", ["0.5", "0.6"])
def test_a_mode_that_it_does_not_have_is_refused_aloud(firmware: Any, modes: tuple[int, int]) -> None:
    bench, port = bench_of(firmware=firmware)
    ask(bench, port, Frame(identifier(1, 0x07), struct.pack("<Q", 8)))
    (told,) = ask(bench, port, Frame(identifier(1, 0x0B), struct.pack("<II", *modes)))
    error, state = struct.unpack_from("<IB", told.data)
    assert told.identifier == identifier(1, 0x01)
    assert (error, state) == ({"0.5": 0x200, "0.6": 0x10}[firmware], 1)
    assert bench.joints[0].drive.state is DriveState.FAULT
    assert bench.joints[0].drive.flags & DriveFlag.BAD_MODE


def test_a_velocity_ramp_is_honoured() -> None:
    bench, port = bench_of()
    frames = [
        Frame(identifier(1, 0x04), struct.pack("<BHBf", 1, 390, 0, 2.0)),
        Frame(identifier(1, 0x1B), struct.pack("<ff", 1.0, 10.0)),
        Frame(identifier(1, 0x0B), struct.pack("<II", 2, 2)),
        Frame(identifier(1, 0x07), struct.pack("<Q", 8)),
        Frame(identifier(1, 0x0D), struct.pack("<ff", 1.0, 0.0)),
    ]
    velocities = run(bench, port, 1.2, *frames)
    assert velocities[250] == pytest.approx(0.5 * TURN, abs=0.15 * TURN)  # 2 turns/s^2 for a quarter second
    assert velocities[-1] == pytest.approx(1.0 * TURN, rel=0.05)


def test_a_trajectory_tells_when_it_is_done() -> None:
    bench, port = bench_of()
    frames = [
        Frame(identifier(1, 0x11), struct.pack("<ff", 2.0, 0.0)),
        Frame(identifier(1, 0x12), struct.pack("<ff", 20.0, 20.0)),
        Frame(identifier(1, 0x0B), struct.pack("<II", 3, 5)),
        Frame(identifier(1, 0x07), struct.pack("<Q", 8)),
        Frame(identifier(1, 0x0C), struct.pack("<fhh", 0.5, 0, 0)),
    ]
    done = []
    for seconds in (0.05, 1.0):
        velocities = run(bench, port, seconds, *frames)
        frames = frames[-1:]
        (told,) = ask(bench, port, Frame(identifier(1, 0x01), remote=True))
        done.append(told.data[6] & 1)
        assert max(velocities) < 2.0 * TURN * 1.3
    assert done == [0, 1]
    assert bench.joints[0].drive.position_rad == pytest.approx(0.5 * TURN, abs=0.05)


# ---- laws of the input modes -------------------------------------------------------------------------

DT = 1e-3


@given(
    st.floats(-20, 20),
    st.floats(-15, 15),
    st.floats(-20, 20),
    st.floats(0.5, 20),
    st.floats(1, 100),
    st.floats(1, 100),
)
def test_a_trapezoid_arrives_at_rest_within_its_limits(
    start: float, rate: float, end: float, top: float, up: float, down: float
) -> None:
    config = ShapingConfig(
        trajectory_velocity_rad_s=top,
        trajectory_acceleration_rad_s2=up,
        trajectory_deceleration_rad_s2=down,
    )
    move = plan(start, rate, end, config)
    assert min(move.speed_up_s, move.cruise_s, move.slow_down_s) >= -1e-9
    assert move.at(0.0)[:2] == pytest.approx((start, rate), abs=1e-6)
    assert move.at(move.duration_s)[:2] == pytest.approx((end, 0.0), abs=1e-6)
    n = 200
    points = [move.at(move.duration_s * k / n) for k in range(n + 1)]
    for (x0, v0, _), (x1, v1, _) in itertools.pairwise(points):
        step = move.duration_s / n
        assert abs(v1) <= max(top, abs(rate)) + 1e-6
        assert abs(v1 - v0) <= max(up, down) * step + 1e-6
        assert x1 - x0 == pytest.approx(0.5 * (v0 + v1) * step, abs=max(up, down) * step**2 + 1e-6)


@given(st.floats(-10, 10), st.floats(0.5, 100))
def test_the_position_filter_settles_without_overshoot(target: float, bandwidth: float) -> None:
    shaper = Shaper(ShapingConfig(filter_bandwidth_per_s=bandwidth))
    shaper.mode = InputMode.POS_FILTER
    wanted, seen = Setpoint(position_rad=target), []
    for _ in range(int(12.0 / (bandwidth * DT))):
        seen.append(shaper.step(wanted, DT).position_rad)
    assert seen[-1] == pytest.approx(target, abs=1e-3 * abs(target) + 1e-9)
    assert (
        max(x * math.copysign(1.0, target) for x in seen) <= abs(target) * (1.0 + 0.1 * bandwidth * DT) + 1e-9
    )


@given(st.floats(-10, 10), st.floats(0.1, 100))
def test_ramps_never_step_by_more_than_their_rate(target: float, rate: float) -> None:
    for mode, field in ((InputMode.VEL_RAMP, 1), (InputMode.TORQUE_RAMP, 2)):
        shaper = Shaper(ShapingConfig(velocity_ramp_rad_s2=rate, torque_ramp_Nm_s=rate))
        shaper.mode, before = mode, 0.0
        wanted = Setpoint(0.0, target, target)
        for _ in range(200):
            now = shaper.step(wanted, DT)[field]
            assert abs(now - before) <= rate * DT * (1.0 + 1e-9)
            assert abs(now) <= abs(target)
            before = now
        reached = min(rate * 200 * DT, abs(target))
        assert before == pytest.approx(math.copysign(reached, target), abs=1e-9)


def test_inactive_inputs_change_nothing() -> None:
    shaper = Shaper()
    shaper.hold(1.5)
    shaper.mode = InputMode.INACTIVE
    assert shaper.step(Setpoint(9.0, 9.0, 9.0), DT) == Setpoint(1.5)
