"""Rates and magnitudes hold for what a listener reads off the wire, whatever the bus brings; and what ends a run is
called by its name.
"""

from __future__ import annotations

import math
import random
import struct
import time
import uuid
from collections.abc import Callable
from itertools import pairwise

import can
import pytest
from mit_joint import POSITION_STEP, MitJoint, reply
from test_taking_up import Rig

from cablecomp.control.protocol import parse_protocol
from cablecomp.links.port_can import VirtualPort
from cablecomp.runtime.results import RunReport

RATE, LOW, HIGH, TORQUE, SPEED = 30.0, -3.2, 3.2, 1.5, 30.0  # the wrist's [limits]
CYCLE = RATE * 1e-3
BEGIN = 150  # ms: the run is under control by then
EPS = 1e-9


@pytest.fixture
def rig():
    channel = uuid.uuid4().hex
    joint = MitJoint(can.Bus(interface="virtual", channel=channel, ignore_config=True))
    yield Rig(channel, joint)
    joint.close()


def send(joint: MitJoint, identifier: int, data: bytes, count: int = 1, **kind) -> None:
    for _ in range(count):
        joint.bus.send(
            can.Message(arbitration_id=identifier, **{"is_extended_id": False, **kind}, data=data),
        )


def held_on_the_wire(joint: MitJoint) -> None:
    """Every command within the magnitudes, every pair of successive ones within one cycle's rate."""
    commands = joint.commands
    assert len(commands) > 60
    for h in commands:
        assert all(math.isfinite(x) for x in h[1:])
        assert LOW <= h.position <= HIGH
        assert abs(h.torque) <= TORQUE
        assert abs(h.velocity) <= SPEED
        assert 0.0 <= h.kp <= 200.1
    assert max(abs(b.position - a.position) for a, b in pairwise(commands)) <= CYCLE + EPS
    assert commands[0].kp == 0.0


def disturbed(rig: Rig, act: Callable[[MitJoint, random.Random], None], duration_s: float = 0.6) -> RunReport:
    """A run in which `act` is called once a period, from 150 ms on."""
    rng = random.Random(7)
    rig.joint.disturb = lambda joint: act(joint, rng) if joint.tick > BEGIN else None
    report = rig.run(duration_s)
    held_on_the_wire(rig.joint)
    if not report.ended_well:  # then the drive was told to let go, and nothing else since
        last = max(k for k, h in enumerate(rig.joint.heard) if not h.word)
        assert {h.word for h in rig.joint.heard[last + 1 :]} == {"leave"}
        assert not rig.joint.enabled
    return report


def at(tick: int, act: Callable[[MitJoint], None]) -> Callable[[MitJoint, random.Random], None]:
    return lambda joint, rng: act(joint) if joint.tick == tick else None


def lie(tell: Callable[[float], float]) -> Callable[[MitJoint, random.Random], None]:
    """From 300 ms on the drive's own replies are wrong."""

    def act(joint: MitJoint, rng: random.Random) -> None:
        if joint.tick == 300:
            joint.tell = tell

    return act


def own(joint: MitJoint, position: float, **more) -> None:
    """A reply that bears the drive's own number, from somebody else."""
    send(joint, 0, reply(1, position, **more))


OTHERS = {
    "another drive's replies": lambda j, rng: send(j, 0, reply(2, rng.uniform(-12.5, 12.5)), 3),
    "another drive in fault": lambda j, rng: send(j, 0, reply(2, -12.5, error=5)),
    "remote frames": lambda j, rng: send(j, rng.randrange(8), b"", is_remote_frame=True, dlc=8),
    "short frames": lambda j, rng: send(j, 0, reply(1, 1.0)[: rng.randrange(8)]),
    "FD frames": lambda j, rng: send(j, 0, bytes(rng.randbytes(64)), is_fd=True),
    "extended frames": lambda j, rng: send(j, rng.randrange(3), rng.randbytes(8), is_extended_id=True),
    "frames of no one": lambda j, rng: send(j, rng.randrange(0x700, 0x7FF), rng.randbytes(8), 20),
}


@pytest.mark.parametrize("name", OTHERS)
def test_foreign_frames_change_nothing(rig: Rig, name: str) -> None:
    report = disturbed(rig, OTHERS[name])
    assert report.ended_well, report.stop_reason
    assert report.joints[0].position_rad < 0.02


LIES = {
    "jumps once": (lie(lambda a: a + 0.5), "motor encoder jumped"),
    "jumps by turns": (
        lambda j, rng: setattr(j, "tell", lambda a: a + rng.choice((0.0, 2.0))),
        None,  # every other one is right, and the wrong ones are turned down
    ),
    "stuck": (lie(lambda a: 0.05), "motor encoder is stuck"),
    "drifts": (lambda j, rng: setattr(j, "tell", lambda a: a + 0.02 * (j.tick - BEGIN)), ""),
    "at the end of its range": (lie(lambda a: 12.5), "motor encoder jumped"),
    "one forged reply": (at(300, lambda j: own(j, -2.0)), None),
    "one forged reply, near": (at(300, lambda j: own(j, j.angle + 0.03)), None),
    "one forged fault": (at(300, lambda j: own(j, j.angle, error=3)), "drive reports fault"),
    "a forger in every period": (lambda j, rng: own(j, j.angle + rng.uniform(-0.08, 0.08)), ""),
    "joint angle is no number": (
        lambda j, rng: send(j, 0x680, struct.pack("<i", -(2**31)) + bytes(3) + j.count()),
        None,
    ),
    "load jumps": (
        lambda j, rng: send(
            j, 0x680, bytes(4) + struct.pack("<i", rng.choice((-1, 1)) << 22)[:3] + j.count()
        ),
        "",
    ),
}


@pytest.mark.parametrize("name", LIES)
def test_lies_move_the_wire_no_faster_than_the_limit(rig: Rig, name: str) -> None:
    """`words`: how the end is called ("" = in one way or another, None = the run goes on to its end)."""
    act, words = LIES[name]
    report = disturbed(rig, act)
    if words is None:
        assert report.ended_well, report.stop_reason
    elif words:
        assert words in report.stop_reason


def test_a_flood_is_called_a_flood(rig: Rig) -> None:
    bus = rig.link.bus.model_copy(update={"max_frames_per_poll": 500})
    rig.link = rig.link.model_copy(update={"bus": bus})
    report = disturbed(rig, at(300, lambda j: send(j, 0x7F0, bytes(8), 50_000)))
    assert not report.ended_well
    assert "motor position is stale" in report.stop_reason
    assert "the bus is flooded" in report.stop_reason


def test_frames_that_the_system_dropped_are_named_beside_what_is_stale(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(VirtualPort, "dropped", lambda port: 70 if rig.joint.tick >= 300 else 0)
    report = disturbed(rig, at(300, lambda j: setattr(j, "mute", True)))
    assert "motor position is stale" in report.stop_reason
    assert (
        "the bus is flooded: 0 polls could not read all that came, 70 frames were dropped"
        in report.stop_reason
    )


def test_a_motion_that_asks_for_too_much_is_cut_to_the_limit_on_the_wire(rig: Rig) -> None:
    """0.9 rad in 20 ms at the joint, the threefold at the motor: 135 rad/s at least, where 30 are allowed."""
    leap = {"kind": "ramp", "position_rad": 0.9, "duration_s": 0.02}
    back = {"kind": "ramp", "position_rad": -0.9, "duration_s": 0.02}
    rest = {"kind": "hold", "duration_s": 0.2}
    protocol = parse_protocol({"schema": 1, "name": "leap", "segment": [leap, rest, back, rest]}, "test")
    health = rig.control.health.model_copy(update={"lead_rad": None})
    rig.control = rig.control.model_copy(update={"health": health})
    rig.run(0.4, protocol=protocol)
    held_on_the_wire(rig.joint)
    most = max(abs(b.position - a.position) for a, b in pairwise(rig.joint.commands))
    assert most > CYCLE - POSITION_STEP


def test_bus_off_stops_and_says_so(rig: Rig) -> None:
    """An error message of the controller, as linux/can/error.h has it: bus off."""
    report = disturbed(rig, at(300, lambda j: send(j, 0x40, bytes(8), is_error_frame=True)))
    assert "bus-off" in report.stop_reason


def test_a_bus_that_refuses_some_commands_gets_no_leap_afterwards(rig: Rig) -> None:
    """Commands refused for 20 ms in mid-motion: the first one taken again is one cycle from the last one taken."""
    from cablecomp.links.port_can import VirtualPort

    taken = VirtualPort.send

    def refuse(port: VirtualPort, identifier: int, data: bytes) -> bool:
        if identifier == 1 and 400 < rig.joint.tick <= 420 and data[:7] != b"\xff" * 7:
            return False
        return taken(port, identifier, data)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(VirtualPort, "send", refuse)
        report = rig.run(0.6)
    held_on_the_wire(rig.joint)
    assert report.ended_well, report.stop_reason


def test_clocks_that_are_set_meanwhile_change_nothing(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wall time jumps by days with every look at it."""
    rng = random.Random(3)
    monkeypatch.setattr(time, "time", lambda: 1e9 + rng.uniform(-1e6, 1e6))
    report = disturbed(rig, lambda j, r: None)
    assert report.ended_well, report.stop_reason
