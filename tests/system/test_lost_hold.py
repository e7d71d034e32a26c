"""A bus that takes nothing, and a drive that is not what it was told to be: nothing is driven on blindly."""

from __future__ import annotations

import struct
import uuid
from collections.abc import Callable, Iterator

import can
import pytest
from fault_runs import CONFIGS, GAINS, JOINT
from mit_joint import MitJoint, reply
from odrive_joint import CLOSED_LOOP, IDLE, OdriveJoint

from cablecomp.config import JointConfig, load_joint
from cablecomp.control.options import load_control
from cablecomp.control.protocol import Protocol, parse_protocol
from cablecomp.links.load import load_link
from cablecomp.links.port_can import VirtualPort
from cablecomp.runtime.clock import Tick
from cablecomp.runtime.loop import Loop
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.setup import matched

CONTROL = load_control(CONFIGS / "control/wrist-capstan.toml")
HOLD = parse_protocol({"schema": 1, "name": "hold", "segment": [{"kind": "hold", "duration_s": 5.0}]}, "test")
AXIS_STATE = 1 << 5 | 0x07
Refuse = Callable[[int, bytes], bool]
Watch = Callable[[Loop, Tick], None]


class Rig:
    """A run of one joint in stepped time on a bus of its own."""

    def __init__(self, kind: str) -> None:
        channel = uuid.uuid4().hex
        bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)
        self.joint = {"mit": MitJoint, "odrive": OdriveJoint}[kind](bus)
        base = load_link(CONFIGS / f"links/{kind}-virtual.toml").redirect("virtual", channel)
        control = CONTROL.model_copy(update={"compensator": CONTROL.compensator.model_copy(update=GAINS)})
        self.link, self.control = matched(base, control, own_link=True)

    def in_mode(self, mode: str) -> None:
        ends = self.link.joint[0]
        assert ends.motor is not None
        motor = ends.motor.model_copy(update={"mode": mode})
        self.link = self.link.model_copy(update={"joint": (ends.model_copy(update={"motor": motor}),)})

    def run(
        self,
        duration_s: float,
        protocol: Protocol = HOLD,
        watch: Watch | None = None,
        config: JointConfig | None = None,
    ) -> RunReport:
        joint, options = config or load_joint(JOINT), RunOptions(duration_s, True)
        return run_joint(joint, self.link, self.control, protocol, options, self.joint, watch)


@pytest.fixture
def mit() -> Iterator[Rig]:
    rig = Rig("mit")
    yield rig
    rig.joint.bus.shutdown()


@pytest.fixture
def odrive() -> Iterator[Rig]:
    rig = Rig("odrive")
    yield rig
    rig.joint.bus.shutdown()


def refusing(monkeypatch: pytest.MonkeyPatch, refuse: Refuse) -> None:
    """The bus does not take what `refuse` says."""
    taken = VirtualPort.send

    def send(self: VirtualPort, identifier: int, data: bytes) -> bool:
        if refuse(identifier, data):
            self.counters.send_failures += 1
            return False
        return taken(self, identifier, data)

    monkeypatch.setattr(VirtualPort, "send", send)


def first_ones(count: int, which: Refuse) -> Refuse:
    """The first so many of those."""
    left = [count]

    def refuse(identifier: int, data: bytes) -> bool:
        if left[0] == 0 or not which(identifier, data):
            return False
        left[0] -= 1
        return True

    return refuse


def is_command(identifier: int, data: bytes) -> bool:
    return identifier == 1 and data[:7] != b"\xff" * 7


def test_a_first_command_that_the_bus_does_not_take_goes_out_before_anything_else(
    mit: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    refusing(monkeypatch, first_ones(5, is_command))
    assert mit.run(0.02).stop_reason == "time is over"
    words = [h.word for h in mit.joint.heard]
    assert words.index("") < words.index("enter")


def test_a_bus_that_takes_no_commands_ends_the_run(mit: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    """Though the drive goes on telling where it is: after as long as its reading may be old, half of the fade."""
    full, last = [False], [0.0]
    refusing(monkeypatch, lambda i, d: full[0] and is_command(i, d))

    def watch(loop: Loop, tick: Tick) -> None:
        full[0] = loop.since_s > 0.05
        last[0] = max(last[0], loop.since_s)
        mit.joint.say(0, reply(1, mit.joint.angle, mit.joint.speed))

    report = mit.run(1.0, watch=watch)
    assert "the bus takes no commands" in report.stop_reason
    assert last[0] == pytest.approx(0.05 + 0.5 * mit.link.timeouts.fade_s, abs=4e-3)
    assert mit.joint.heard[-1].word == "leave"


def test_a_stop_that_the_bus_does_not_take_is_said_again_where_a_run_ends_by_an_error(
    mit: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = [False]
    refusing(monkeypatch, first_ones(6, lambda i, d: ended[0]))

    def watch(loop: Loop, tick: Tick) -> None:
        if loop.since_s > 0.05:
            ended[0] = True
            raise RuntimeError("of the caller's own")

    with pytest.raises(RuntimeError, match="of the caller's own"):
        mit.run(1.0, watch=watch)
    mit.joint.hear()
    assert not mit.joint.enabled


def test_a_stop_that_the_bus_does_not_take_for_as_long_as_is_watched_is_said_on(
    mit: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two requests a tick for 0.1 s, none of them taken, and some more."""
    over = [False]
    refusing(monkeypatch, first_ones(230, lambda i, d: over[0] and i == 1))

    def watch(loop: Loop, tick: Tick) -> None:
        over[0] = over[0] or loop.since_s > 0.0485

    assert mit.run(0.05, watch=watch).stop_reason == "time is over"
    mit.joint.hear()
    assert not mit.joint.enabled


def test_a_drive_left_enabled_is_asked_to_let_go_until_the_bus_takes_it(
    odrive: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On its way to 1.2 rad, and the first request to let go is lost in a full queue."""
    joint = odrive.joint
    joint.closed, joint.wanted = True, 1.2
    refusing(monkeypatch, first_ones(3, lambda i, d: i == AXIS_STATE))
    assert odrive.run(0.05).stop_reason == "time is over"
    assert joint.states[0] == IDLE
    assert joint.angle < 0.3


def test_a_drive_whose_gains_are_its_own_closes_its_loop_where_its_motor_is(odrive: Rig) -> None:
    """It takes its time, and the motor is turned by hand meanwhile."""
    joint = odrive.joint
    joint.delay_s = 0.5

    def turned(j: OdriveJoint) -> None:
        if j.asked is not None and not j.closed:
            j.angle = 0.4 * min((j.tick - j.asked) / 400, 1.0)

    joint.disturb = turned
    assert odrive.run(0.05).stop_reason == "time is over"
    assert joint.closed_at == pytest.approx((0.4, 0.4), abs=1e-3)


def _silent(joint: OdriveJoint) -> None:
    joint.beats = False


def _homing(joint: OdriveJoint) -> None:
    joint.tells = 11


def _undefined(joint: OdriveJoint) -> None:
    joint.tells = 0


@pytest.mark.parametrize(
    ("change", "words", "within_s"),
    [
        (_silent, "5 of its heartbeats stayed out", 0.52),
        (_homing, "drive reports calibrating", 0.01),
        (_undefined, "drive reports unknown", 0.01),
    ],
)
def test_a_drive_that_is_not_known_to_be_enabled_any_more_ends_the_run(
    odrive: Rig, change: Callable[[OdriveJoint], None], words: str, within_s: float
) -> None:
    last = [0.0]

    def watch(loop: Loop, tick: Tick) -> None:
        last[0] = max(last[0], loop.since_s)
        if loop.since_s > 0.1 and odrive.joint.closed:
            change(odrive.joint)
            odrive.joint.closed = False

    report = odrive.run(3.0, watch=watch)
    assert words in report.stop_reason
    assert last[0] < 0.1 + within_s
    assert odrive.joint.states[-1] != CLOSED_LOOP


@pytest.mark.parametrize("mode", ["impedance", "velocity"])
def test_the_motor_stays_within_its_limit_whatever_the_drive_is_told(mit: Rig, mode: str) -> None:
    """A reach at 11 rad/s of the motor to beyond 0.5 rad."""
    mit.in_mode(mode)
    config = load_joint(JOINT)
    limits = config.limits.model_copy(update={"motor_position_max_rad": 0.5})
    farthest = [0.0]

    def watch(loop: Loop, tick: Tick) -> None:
        farthest[0] = max(farthest[0], mit.joint.angle)

    reach = parse_protocol(
        {"schema": 1, "name": "far", "segment": [{"kind": "ramp", "position_rad": 0.9, "duration_s": 0.25}]},
        "test",
    )
    mit.run(0.4, reach, watch, config.model_copy(update={"limits": limits}))
    assert 0.45 < farthest[0] < 0.52


def test_a_joint_encoder_that_reads_too_much_as_stated_is_believed_and_its_zero_is_no_error(
    mit: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """0.1 rad too much, where 0.02 rad beside the prediction are too many."""
    config, say = load_joint(JOINT), mit.joint.say

    def say_more(identifier: int, data: bytes, **kind: bool) -> None:
        if identifier == 0x680:
            data = struct.pack("<i", struct.unpack("<i", data[:4])[0] + 100_000) + data[4:]
        say(identifier, data, **kind)

    monkeypatch.setattr(mit.joint, "say", say_more)
    sensors = config.sensors.model_copy(update={"joint_position_offset_rad": 0.1})
    reach = parse_protocol(
        {"schema": 1, "name": "near", "segment": [{"kind": "ramp", "position_rad": 0.3, "duration_s": 0.4}]},
        "test",
    )
    report = mit.run(0.5, reach, config=config.model_copy(update={"sensors": sensors}))
    assert report.stop_reason == "time is over"
    assert report.joints[0].position_rad < 0.02
    assert not [what for _, _, what in report.events if "joint" in what]
