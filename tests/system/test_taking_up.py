"""Before a drive is known nothing goes to it but requests to let go; then it is taken up without a pull. All of it
as a listener on the wire reads it.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import can
import cantools
import pytest
from fault_runs import CONFIGS, GAINS, JOINT, REACH, simulated
from mit_joint import POSITION_STEP, TORQUE_STEP, MitJoint, reply

from cablecomp.config import load_joint
from cablecomp.control.gate import GateLimits
from cablecomp.control.options import load_control
from cablecomp.control.protocol import Protocol, parse_protocol
from cablecomp.errors import DeviceError
from cablecomp.links.load import load_link
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import DriveState, Mode, Request
from cablecomp.recording.reader import open_recording
from cablecomp.runtime.clock import Tick
from cablecomp.runtime.health import Checked
from cablecomp.runtime.loop import Loop, RunStage
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.setup import matched
from cablecomp.runtime.taking_up import EASE_S, TakingUp
from cablecomp.signals import Sample

CONTROL = load_control(CONFIGS / "control/wrist-capstan.toml")


@pytest.fixture
def rig():
    """A link and a joint on a bus of their own; `run` runs it in stepped time."""
    channel = uuid.uuid4().hex
    joint = MitJoint(can.Bus(interface="virtual", channel=channel, ignore_config=True))
    yield Rig(channel, joint)
    joint.close()


class Rig:
    def __init__(self, channel: str, joint: MitJoint) -> None:
        self.joint = joint
        base = load_link(CONFIGS / "links/mit-virtual.toml").redirect("virtual", channel)
        control = CONTROL.model_copy(update={"compensator": CONTROL.compensator.model_copy(update=GAINS)})
        self.link, self.control = matched(base, control, own_link=True)
        self.stages: list[RunStage] = []

    def run(
        self,
        duration_s: float = 0.3,
        watch: Callable[[Loop, Tick], None] | None = None,
        protocol: Protocol = REACH,
    ) -> RunReport:
        def each(loop: Loop, tick: Tick) -> None:
            self.stages.append(loop.stage)
            if watch is not None:
                watch(loop, tick)

        options = RunOptions(duration_s, True)
        return run_joint(load_joint(JOINT), self.link, self.control, protocol, options, self.joint, each)


@pytest.mark.parametrize(("speaks_s", "recorded"), [(0.7, True), (2.5, False)])
def test_a_recording_waits_for_a_joint_encoder_that_speaks_late(
    rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speaks_s: float, recorded: bool
) -> None:
    """A node that is still booting, where control does not need it: what it tells is what `diagnose` lives on. Control
    begins without it once listening is over, and the run says so."""
    say = rig.joint.say

    def say_late(identifier: int, data: bytes, **kind: bool) -> None:
        if identifier == 0 or rig.joint.tick > 1e3 * speaks_s:
            say(identifier, data, **kind)

    monkeypatch.setattr(rig.joint, "say", say_late)
    joint = load_joint(JOINT)
    joint = joint.model_copy(
        update={"observer": joint.observer.model_copy(update={"load": "motor_torque"}), "effect": ()}
    )
    report = run_joint(
        joint,
        rig.link,
        rig.control,
        STAND,
        RunOptions(0.7, True, tmp_path),
        rig.joint,
        lambda loop, tick: None,
    )
    assert report.stop_reason == "time is over"
    columns = open_recording(tmp_path / "recording.csv").channels
    assert ("joint_position_rad" in columns) == recorded
    said = [what for _, _, what in report.events if "has not come" in what]
    assert said == ([] if recorded else [f"{c} has not come; the recording is without it" for c in TOLD])


TOLD = ("joint_position_rad", "joint_torque_Nm")
STAND = parse_protocol(
    {
        "schema": 1,
        "name": "stand",
        "segment": [{"kind": "ramp", "position_rad": 0.0, "load_Nm": 0.0, "duration_s": 1.0}],
    },
    "test",
)


def test_a_drive_left_enabled_far_away_is_taken_up_without_a_pull(rig: Rig) -> None:
    """At 3 rad, enabled and holding itself there: the first command is there, without stiffness or torque."""
    joint = rig.joint
    joint.angle, joint.enabled, joint.last = 3.0, True, joint.last._replace(position=3.0, kp=200.0, kd=2.0)
    report = rig.run(0.02)
    assert report.stop_reason == "time is over"
    assert set(joint.words_before_first_command()) == {"leave"}
    first = joint.commands[0]
    assert first.position == pytest.approx(3.0, abs=POSITION_STEP)
    assert first.kp == 0.0
    assert abs(first.torque) <= TORQUE_STEP
    assert abs(first.velocity) <= 100.0 / 4095
    taking_up = [
        h for h, s in zip(joint.heard, joint.ticks, strict=True) if rig.stages[s - 1] < RunStage.RUNNING
    ]
    assert all(abs(h.position - 3.0) < 1e-3 for h in taking_up if not h.word)
    # nothing but the first steps of the motion, which begins at zero, is left to pull
    assert joint.angle == pytest.approx(3.0, abs=0.7)


def test_stiffness_grows_little_by_little_and_the_target_stays(rig: Rig) -> None:
    rig.joint.angle = 0.5
    rig.run(0.02)
    enter = next(k for k, h in enumerate(rig.joint.heard) if h.word == "enter")
    commands = [h for h in rig.joint.heard[enter:] if not h.word]
    eased = [h for h in commands if h.kp < 199.0]
    assert commands[0].kp == 0.0
    steps = [b.kp - a.kp for a, b in pairwise(commands)]
    assert max(steps) <= 200.0 * 1e-3 / EASE_S + 500.0 / 4095
    assert min(steps) >= 0.0
    assert {round(h.position, 6) for h in eased} == {round(commands[0].position, 6)}
    assert all(h.kd == pytest.approx(2.0, abs=1e-2) for h in commands)


def test_an_open_circuits_pretension_is_held_before_the_drive_is_enabled_and_from_then_on() -> None:
    """-r T0 at the input pulley, here -1.2 Nm, in steps of a twentieth within 20 ms; the bus takes the second request
    to enable."""
    asked: list[str] = []

    def request(place: int, request: Request, mode: Mode) -> bool:
        asked.append(request.name)
        return asked.count("ENABLE") != 1

    link: Any = SimpleNamespace(
        config=load_link(CONFIGS / "links/mit-virtual.toml"),
        ease=lambda place, share: True,
        request=request,
    )
    taking_up = TakingUp(link, 0, GateLimits(), 2.5e-3, 1.2, 1e-3)
    sent = taking_up.first(0.4)
    torques = []
    for k in range(100):
        enabled = asked.count("ENABLE") > 1
        torques.append(taking_up.step(sent, 0.4, enabled, Mode.IMPEDANCE, 1e-3 * k).motor_torque_Nm)
        assert not asked or torques[-2] == pytest.approx(-1.2)
    assert torques == pytest.approx([max(-0.06 * (k + 1), -1.2) for k in range(100)])
    assert asked == ["CLEAR_FAULTS", "ENABLE"] * 2
    assert taking_up.held


@pytest.mark.parametrize(
    ("ages_s", "state", "known"),
    [
        ((0.0, 0.0), DriveState.DISABLED, True),
        ((2.6e-3, 0.0), DriveState.DISABLED, False),  # the motor's reading alone is old
        ((0.0, 2.6e-3), DriveState.DISABLED, False),
        ((0.0, 0.0), DriveState.ENABLED, False),
    ],
)
def test_a_drive_is_known_by_fresh_readings_once_it_has_let_go(
    ages_s: tuple[float, float], state: DriveState, known: bool
) -> None:
    link: Any = SimpleNamespace(
        config=load_link(CONFIGS / "links/mit-virtual.toml"), request=lambda place, request: True
    )
    taking_up = TakingUp(link, 0, GateLimits(), 2.5e-3, 0.0, 1e-3)
    readings = JointReadings("joint-1")
    readings.state = state
    seen = Sample(0.0, 0.1, 0.0, 0.0)
    taking_up.listen(readings, Checked(seen, 0.0, 0.0, 0, True, True, False), 0.0)
    taking_up.listen(readings, Checked(seen, *ages_s, 0, True, True, False), 1e-3)
    assert (taking_up.known_s(2e-3) >= 0.0) is known


def test_nothing_is_commanded_before_the_drive_has_spoken_for_a_while(rig: Rig) -> None:
    joint = rig.joint
    joint.mute = True

    def watch(loop: Loop, tick: Tick) -> None:
        joint.mute = tick.now_s < 0.3

    rig.run(0.01, watch)
    first = next(t for h, t in zip(joint.heard, joint.ticks, strict=True) if not h.word)
    assert first >= 300 + 50
    assert set(joint.words_before_first_command()) == {"leave"}


def lies(joint: MitJoint, tell: Callable[[float], float]) -> None:
    joint.tell = tell


@pytest.mark.parametrize(
    ("prepare", "words"),
    [
        (lambda j: setattr(j, "mute", True), "nothing from joint-1"),
        (lambda j: lies(j, lambda a: 0.3 * (j.tick // 2 % 2)), "motor encoder jumped"),
        (lambda j: lies(j, lambda a: 12.5), "end of what its reply can carry"),
        (lambda j: lies(j, lambda a: -3.4), r"stands at -3.4 rad, outside of -3.2 … 3.2"),
        (lambda j: setattr(j, "disturb", lambda j: setattr(j, "mute", j.tick > 20)), "stale"),
    ],
)
def test_a_drive_that_is_not_known_is_never_commanded(rig: Rig, prepare, words: str) -> None:
    joint = rig.joint
    prepare(joint)
    with pytest.raises(DeviceError, match=words):
        rig.run()
    assert joint.heard
    assert {h.word for h in joint.heard} == {"leave"}


def test_another_drive_s_replies_are_no_knowledge(rig: Rig) -> None:
    joint = rig.joint
    joint.mute = True

    def other(j: MitJoint) -> None:
        j.bus.send(can.Message(arbitration_id=0, is_extended_id=False, data=reply(2, 1.0)))

    joint.disturb = other
    with pytest.raises(DeviceError, match="frames came from other devices"):
        rig.run()
    assert {h.word for h in joint.heard} == {"leave"}


def test_a_motor_that_is_turned_while_it_is_taken_up_is_followed_and_never_pulled_back(rig: Rig) -> None:
    """By hand at 2 rad/s until it is enabled: there is no jump, and what holds it is where it was let go."""
    joint = rig.joint
    angles = {}

    def turned(j: MitJoint) -> None:
        if not j.enabled:
            j.speed = 2.0
        angles[j.tick] = j.angle

    joint.disturb = turned
    report = rig.run(0.02)
    assert report.stop_reason == "time is over"
    for h, tick in zip(joint.heard, joint.ticks, strict=True):
        if not h.word and h.kp == 0.0:
            assert h.position == pytest.approx(angles[tick - 1], abs=0.01)
    held = next(h for h in joint.commands if h.kp > 0.0)
    stopped = next(t for h, t in zip(joint.heard, joint.ticks, strict=True) if h.kp > 0.0)
    assert held.position == pytest.approx(angles[stopped], abs=0.02)


@pytest.mark.parametrize("link", ["wrist-virtual", "odrive-virtual", "mit-virtual"])
def test_every_protocol_is_told_where_it_is_before_it_is_enabled(link: str) -> None:
    """With a zero that lies 0.7 rad off, so that position 0 would be a jump; read by python-can and cantools."""
    simulation, bus, control = simulated(link)
    joint = simulation.bench.joints[0]
    ear = can.Bus(interface="virtual", channel=bus.bus.channel, ignore_config=True)
    joint.advance_sample()
    joint.drive.set_position(0.7)
    ends = bus.joint[0].model_copy(
        update={"motor": bus.joint[0].motor.model_copy(update={"position_offset_rad": 0.7})}
    )
    bus = bus.model_copy(update={"joint": (ends,)})
    try:
        report = run_joint(load_joint(JOINT), bus, control, REACH, RunOptions(0.05, True), simulation)
        targets, enabling, stiffness = spoken(link, ear)
    finally:
        simulation.close()
        ear.shutdown()
    assert report.stop_reason == "time is over"
    assert targets[0][1] == pytest.approx(0.7, abs=1e-3)
    assert targets[0][0] < enabling
    assert all(abs(b[1] - a[1]) < 0.031 for a, b in pairwise(targets))
    if link != "odrive-virtual":  # its gains are its own
        assert stiffness[0] == 0.0
        assert max(b - a for a, b in pairwise(stiffness)) < 40.0 * 1e-3 / EASE_S + 0.2


def spoken(link: str, ear: can.BusABC) -> tuple[list[tuple[int, float]], int, list[float]]:
    """(place, target in rad at the drive) of every command, place of the request to enable, stiffness in order."""
    targets, enabling, stiffness, place = [], -1, [], 0
    names = {"wrist-virtual": "cablecomp_joint", "odrive-virtual": "cablecomp_odrive"}
    table = (
        None
        if link == "mit-virtual"
        else cantools.database.load_file(Path(CONFIGS) / f"links/{names[link]}.dbc")
    )
    while (message := ear.recv(0)) is not None:
        place += 1
        identifier, data = message.arbitration_id, bytes(message.data)
        if link == "mit-virtual" and identifier == 1:
            if data == b"\xff" * 7 + b"\xfc":
                enabling = place
            elif data[:7] != b"\xff" * 7:
                targets.append((place, int.from_bytes(data[:2], "big") * 25.0 / 65535 - 12.5))
                stiffness.append(((data[3] & 15) << 8 | data[4]) * 500.0 / 4095)
        elif link == "odrive-virtual" and identifier == 1 << 5 | 0x0C:
            values = table.decode_message(identifier, data)
            targets.append((place, 2.0 * math.pi * next(v for k, v in values.items() if "Pos" in k)))
        elif link == "odrive-virtual" and identifier == 1 << 5 | 0x07 and data[0] == 8:
            enabling = place
        elif link == "wrist-virtual" and identifier == 0x6C0:
            targets.append((place, table.decode_message(identifier, data)["motor_position_target_rad"]))
        elif link == "wrist-virtual" and identifier == 0x6C1:
            values = table.decode_message(identifier, data)
            if values["request"] == "enable":
                enabling = place if enabling < 0 else enabling
                stiffness.append(values["kp_Nm_per_rad"])
    return targets, enabling, stiffness
