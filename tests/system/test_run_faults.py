"""Faults on demand against the running loop: how soon each is seen, what the joint does, that nothing
recorded is lost.

The joint moves to 0.6 rad within 1.2 s while its load grows to 1.2 Nm; each fault begins 0.4 s into the run.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from cablecomp.cli_simulation import start_simulation
from cablecomp.config import load_joint
from cablecomp.control.options import load_control
from cablecomp.control.protocol import parse_protocol
from cablecomp.errors import DeviceError
from cablecomp.links.schema import SerialBus, load_link
from cablecomp.observer import Observer
from cablecomp.recording.reader import open_recording
from cablecomp.runtime.clock import Tick
from cablecomp.runtime.loop import Loop, Stage
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.setup import matched
from cablecomp.runtime.simulated import Simulation, SimulationWish
from firmware_sim.build import BenchConfig
from firmware_sim.faults import parse_fault
from firmware_sim.firmware import DriveConfig
from firmware_sim.hosted import HostedJoints, HostedSpec
from firmware_sim.plant import LinkSpec, MotorSpec

CONFIGS = Path(__file__).parents[2] / "configs"
JOINT = CONFIGS / "joints/wrist-capstan.toml"
CONTROL = load_control(CONFIGS / "control/wrist-capstan.toml")
GAINS = {
    "load_filter_Hz": 15.5,
    "load_lead_s": 0.0,
    "follow_filter_Hz": 30.0,
    "follow_lead_s": 0.01,
    "joint_feedback_per_s": 0.0,
    "force_feedback_per_s": 20.0,
    "motor_integral_per_s": 65.0,
}
BEGIN_S = 0.4
REACH = parse_protocol(
    {
        "schema": 1,
        "name": "reach",
        "segment": [{"kind": "ramp", "position_rad": 0.6, "load_Nm": 1.2, "duration_s": 1.2}],
    },
    "test",
)


@dataclass
class Outcome:
    """A run with a fault, and what the joint did meanwhile."""

    report: RunReport
    folder: Path
    time_s: list[float] = field(default_factory=list)
    joint_rad: list[float] = field(default_factory=list)
    ticks: int = 0

    def seen_after_s(self, words: str) -> float:
        """Time from the fault's beginning to the first event that says these words."""
        times = [t for t, _, what in self.report.events if words in what and t >= BEGIN_S]
        assert times, (words, self.report.events)
        return times[0] - BEGIN_S

    @property
    def stopped_after_s(self) -> float:
        """Time from the fault's beginning to the stop."""
        return self.seen_after_s("stop: ")

    @property
    def finished(self) -> bool:
        """Whether the run went on to its end."""
        return self.report.stop_reason == "time is over"

    def moved_rad(self, within_s: float) -> float:
        """How far the joint went, at most, within a time of the fault's beginning."""
        at = np.array(self.time_s)
        angles = np.array(self.joint_rad)[(at >= BEGIN_S) & (at <= BEGIN_S + within_s)]
        return float(np.max(np.abs(angles - angles[0])))


def run_with(folder: Path, *faults: str) -> Outcome:
    joint = load_joint(JOINT)
    control = CONTROL.model_copy(update={"compensator": CONTROL.compensator.model_copy(update=GAINS)})
    link, control = matched(load_link(CONFIGS / "links/wrist-virtual.toml"), control, own_link=False)
    simulation = start_simulation(JOINT, SimulationWish(link, control, 1, False, 3, faults))
    return _run(folder, simulation, link, control, joint)


def _run(folder: Path, simulation: Simulation, link, control, joint) -> Outcome:
    times: list[float] = []
    angles: list[float] = []

    def watch(loop: Loop, tick: Tick) -> None:
        if loop.stage >= Stage.RUNNING:
            times.append(tick.now_s)
            angles.append(simulation.truth(1).joint_position_rad)

    try:
        report = run_joint(joint, link, control, REACH, RunOptions(1.2, True, folder), simulation, watch)
    finally:
        simulation.close()
    return Outcome(report, folder, times, angles, report.timing.ticks)


def nothing_is_lost(outcome: Outcome) -> None:
    """Every sample that the observer took is in the recording, whole and in order; the snapshot is the
    state after the last.
    """
    cycles = pl.read_csv(outcome.folder / "cycles.csv", infer_schema_length=None)
    recording = open_recording(outcome.folder / "recording.csv")
    config = load_joint(outcome.folder / "joint.toml")
    replayed, taken_up = Observer(config), Observer(config)
    rows = 0
    for block in recording.blocks():
        rows += block.rows
        replayed.run(block.columns)
    assert rows == len(cycles)
    # all ticks but those of listening, before the first whole sample
    assert outcome.ticks - rows <= 60
    assert np.allclose(np.diff(cycles["time_s"].to_numpy()), 1e-3)
    taken_up.load(outcome.folder / "observer.snapshot")
    assert taken_up.snapshot() == replayed.snapshot()


@pytest.mark.parametrize(
    ("fault", "words", "seen_s", "stop_s", "moved_rad"),
    [
        ("drop:p=1,start=0.4", "stale", 0.004, 0.055, 0.06),
        ("bus_off:start=0.4", "stale", 0.004, 0.055, 0.06),
        ("silent:node=drive,start=0.4", "motor position is stale", 0.004, 0.055, 0.06),
        ("silent:node=sensor,start=0.4", "joint torque is stale", 0.004, 0.205, 0.2),
        ("silent:node=both,start=0.4", "stale", 0.004, 0.055, 0.06),
        ("stuck:which=motor,start=0.4", "motor encoder is stuck", 0.006, 0.006, 0.02),
        ("jump:which=motor,jump=0.5,start=0.4", "motor encoder jumped", 0.002, 0.06, 0.06),
        ("reset:node=drive,start=0.4", "stale", 0.004, 0.06, 0.15),
        (
            "offset:channel=joint_torque_Nm,offset=0.9,start=0.4",
            "disagrees with motor torque",
            0.25,
            0.5,
            0.4,
        ),
        ("saturate:which=sensor,limit=0.2,start=0.4", "disagrees with motor torque", 0.6, 0.8, 0.6),
        ("late:start=0.4,delay=0.006,direction=tx", "come late", 0.02, 0.25, 0.25),
        ("corrupt:start=0.4", "jumped", 0.02, 0.4, 0.4),
    ],
)
def test_faults_that_must_stop_the_joint(
    fault: str, words: str, seen_s: float, stop_s: float, moved_rad: float, tmp_path: Path
) -> None:
    outcome = run_with(tmp_path, fault)
    assert outcome.seen_after_s(words) <= seen_s
    assert not outcome.finished
    assert outcome.stopped_after_s <= stop_s
    assert outcome.moved_rad(outcome.stopped_after_s) <= moved_rad
    nothing_is_lost(outcome)


@pytest.mark.parametrize(
    ("fault", "counter", "least"),
    [
        ("drop:p=0.2,start=0.4", "lost_frames", 50),
        ("repeat:start=0.4", "repeated_frames", 500),
        ("reorder:start=0.4,p=0.1,spread=0.002,direction=tx", "reordered_frames", 5),
        ("corrupt:p=0.01,start=0.4,direction=tx", "frames", 1),
    ],
)
def test_a_rough_bus_is_counted_and_survived(fault: str, counter: str, least: int, tmp_path: Path) -> None:
    outcome = run_with(tmp_path, fault)
    assert getattr(outcome.report.timing, counter) >= least
    assert outcome.finished, outcome.report.stop_reason
    assert outcome.report.joints[0].true_position_rad < 2e-3
    nothing_is_lost(outcome)


@pytest.mark.parametrize(
    ("fault", "words", "seen_s"),
    [
        ("stuck:which=joint,start=0.4", "joint encoder disagrees", 0.2),
        ("jump:which=joint,jump=0.5,start=0.4", "joint encoder jumped", 0.002),
        ("jump:which=joint,p=0.05,start=0.4", "joint encoder jumped", 0.1),
    ],
)
def test_a_lying_joint_encoder_is_seen_and_not_needed(
    fault: str, words: str, seen_s: float, tmp_path: Path
) -> None:
    outcome = run_with(tmp_path, fault)
    assert outcome.seen_after_s(words) <= seen_s
    assert outcome.finished
    assert outcome.report.joints[0].true_position_rad < 2e-4
    nothing_is_lost(outcome)


def test_a_short_silence_is_held_and_faded_and_mended_without_a_step(tmp_path: Path) -> None:
    outcome = run_with(tmp_path, "silent:node=sensor,start=0.4,stop=0.45")
    assert outcome.finished
    phases = outcome.report.joints[0].phases
    assert phases["held"] > 0
    assert phases["fading"] > 0
    assert phases["recovering"] > 0
    assert "stopped" not in phases
    cycles = pl.read_csv(tmp_path / "cycles.csv", infer_schema_length=None)
    sent = cycles.filter(pl.col("controlled") > 0)["command_position_rad"].to_numpy()
    assert np.max(np.abs(np.diff(sent))) < 0.01
    assert outcome.report.joints[0].true_position_rad < 5e-4
    nothing_is_lost(outcome)


def test_a_sensor_node_that_restarts_is_taken_back(tmp_path: Path) -> None:
    outcome = run_with(tmp_path, "reset:node=sensor,start=0.4")
    assert outcome.finished
    assert outcome.seen_after_s("stale") <= 0.004
    nothing_is_lost(outcome)


def test_a_motor_without_torque_is_stopped(tmp_path: Path) -> None:
    outcome = run_with(tmp_path, "saturate:which=motor,limit=0.02,start=0.4")
    assert not outcome.finished
    assert outcome.stopped_after_s < 0.25
    nothing_is_lost(outcome)


def test_an_end_of_the_world_still_leaves_everything_closed(tmp_path: Path) -> None:
    """An exception out of nowhere, in mid-run: stop command sent, logs and snapshot whole, the
    exception still seen.
    """
    joint = load_joint(JOINT)
    control = CONTROL.model_copy(update={"compensator": CONTROL.compensator.model_copy(update=GAINS)})
    link, control = matched(load_link(CONFIGS / "links/wrist-virtual.toml"), control, own_link=False)
    simulation = start_simulation(JOINT, SimulationWish(link, control, 1, False, 3))
    seen: list[Loop] = []

    def watch(loop: Loop, tick: Tick) -> None:
        seen[:] = [loop]
        if tick.now_s > 0.5:
            raise RuntimeError("out of nowhere")

    try:
        with pytest.raises(RuntimeError, match="out of nowhere"):
            run_joint(joint, link, control, REACH, RunOptions(1.2, True, tmp_path), simulation, watch)
        simulation.advance()
        drive = simulation.bench.joints[0].drive
        assert drive.state.name in ("DISABLED", "FAULT")
    finally:
        simulation.close()
    outcome = Outcome(None, tmp_path, ticks=seen[0].report().ticks)
    nothing_is_lost(outcome)


@pytest.mark.parametrize("fault", ["noise:p=0.002,start=0.4", "cable_pull:start=0.4"])
def test_a_serial_line_with_noise_or_without_its_cable(fault: str, tmp_path: Path) -> None:
    joint, motor = load_joint(JOINT), CONTROL.motor
    from cablecomp.config import read_toml

    spec = HostedSpec(
        read_toml(JOINT),
        "serial",
        BenchConfig(protocol="mit", drive=DriveConfig(torque_limit_Nm=1.5)),
        MotorSpec(motor.inertia_kgm2, 1.5, motor.viscous_Nms_per_rad, motor.coulomb_Nm),
        LinkSpec(motor.output_inertia_kgm2, 0.0, 0.0, motor.output_viscous_Nms_per_rad),
        seed=3,
        faults=(parse_fault(fault, 1),),
    )
    hosted = HostedJoints(spec)
    link = load_link(CONFIGS / "links/mit-serial.toml")
    path = hosted.bench.port.describe()["terminal"]
    link = link.model_copy(update={"bus": SerialBus(kind="serial", port=str(path))})
    control = CONTROL.model_copy(update={"compensator": CONTROL.compensator.model_copy(update=GAINS)})
    link, control = matched(link, control, own_link=False)
    outcome = _run(tmp_path, hosted, link, control, joint)
    if fault.startswith("noise"):
        assert outcome.finished, outcome.report.stop_reason
        assert outcome.report.timing.invalid_frames > 0
    else:
        assert not outcome.finished
        assert outcome.stopped_after_s <= 0.06
    nothing_is_lost(outcome)


def test_no_answer_at_all_is_a_device_error_in_one_line(tmp_path: Path) -> None:
    joint = load_joint(JOINT)
    control = CONTROL.model_copy(update={"compensator": CONTROL.compensator.model_copy(update=GAINS)})
    link, control = matched(load_link(CONFIGS / "links/wrist-virtual.toml"), control, own_link=False)
    simulation = start_simulation(JOINT, SimulationWish(link, control, 1, False, 3, ("silent:node=both",)))
    try:
        with pytest.raises(DeviceError, match="nothing from wrist") as caught:
            run_joint(joint, link, control, REACH, RunOptions(1.2, True, tmp_path), simulation)
    finally:
        simulation.close()
    assert "\n" not in str(caught.value)


def test_times_follow_from_the_link() -> None:
    from cablecomp.runtime.setup import times_of

    link = load_link(CONFIGS / "links/wrist-virtual.toml")
    times = times_of(link, 1e-3)
    assert times.hold_s == link.timeouts.hold_s
    assert times.stop_s == link.timeouts.stop_s
