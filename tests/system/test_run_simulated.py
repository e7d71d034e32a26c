"""The whole loop against the simulated joint: what a run leaves behind, how well it does, and that
nothing shared makes it so.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from joints import WRIST_GAINS

from cablecomp.cli.simulation import start_simulation
from cablecomp.config import load_joint
from cablecomp.control.options import ControlMode, FeedForward, load_control
from cablecomp.control.protocol import parse_protocol
from cablecomp.control.standard import force_protocol
from cablecomp.errors import InputError
from cablecomp.links.load import load_link
from cablecomp.observer import Observer
from cablecomp.recording.reader import open_recording
from cablecomp.report.replay_page import write_replay
from cablecomp.report.run_page import write_run_page
from cablecomp.runtime.clock import Tick
from cablecomp.runtime.loop import Loop, RunStage
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.setup import matched
from cablecomp.runtime.simulated import SimulationWish

CONFIGS = Path(__file__).parents[2] / "configs"
JOINT = CONFIGS / "joints/wrist-capstan.toml"
CONTROL = CONFIGS / "control/wrist-capstan.toml"
LINK = CONFIGS / "links/wrist-virtual.toml"

REACH = parse_protocol(
    {
        "schema": 1,
        "name": "reach",
        "segment": [
            {"kind": "ramp", "position_rad": 0.4, "load_Nm": 1.2, "duration_s": 1.5},
            {"kind": "ramp", "position_rad": -0.2, "load_Nm": -0.8, "duration_s": 2.0},
        ],
    },
    "test",
)


def simulated_run(
    out: Path | None,
    duration_s: float,
    mode: ControlMode = ControlMode.POSITION,
    faults: tuple[str, ...] = (),
    watch: Callable[[Loop, Tick], None] | None = None,
    **changes: object,
) -> RunReport:
    """A run in stepped time on a joint exactly as configured."""
    joint, control = load_joint(JOINT), load_control(CONTROL)
    options = control.compensator.model_copy(update={**WRIST_GAINS, "mode": mode, **changes})
    link, control = matched(
        load_link(LINK), control.model_copy(update={"compensator": options}), own_link=False
    )
    protocol = force_protocol(joint, 5, 8.0) if mode is ControlMode.FORCE else REACH
    simulation = start_simulation(
        JOINT, SimulationWish(link, control, off_nominal=False, seed=3, faults=faults)
    )
    if mode is ControlMode.FORCE:
        simulation.set_wall(1, 0.0)
    try:
        return run_joint(joint, link, control, protocol, RunOptions(duration_s, True, out), simulation, watch)
    finally:
        simulation.close()


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> RunReport:
    return simulated_run(tmp_path_factory.mktemp("run"), 3.0)


def test_the_joint_follows_far_better_than_the_motor_alone(finished: RunReport) -> None:
    alone = simulated_run(None, 3.0, feed_forward=FeedForward.NONE)
    assert alone.joints[0].true_position_rad > 15.0 * finished.joints[0].true_position_rad


def test_replay_gives_the_predictions_back_bit_for_bit(finished: RunReport, tmp_path: Path) -> None:
    assert finished.folder is not None
    config = load_joint(finished.folder / "joint.toml")
    write_replay(
        open_recording(finished.folder / "recording.csv"), config, Observer(config), tmp_path / "replay"
    )
    live = pl.read_csv(finished.folder / "prediction.csv", infer_schema_length=None)
    again = pl.read_csv(tmp_path / "replay" / "prediction.csv", infer_schema_length=None)
    assert live.columns == again.columns
    for name in live.columns:
        a, b = (t[name].cast(pl.Float64).fill_null(np.nan).to_numpy() for t in (live, again))
        assert a.tobytes() == b.tobytes(), name


def test_every_cycle_is_recorded_once(finished: RunReport) -> None:
    assert finished.folder is not None
    recording = pl.read_csv(finished.folder / "recording.csv", comment_prefix="#")
    cycles = pl.read_csv(finished.folder / "cycles.csv", infer_schema_length=None)
    assert len(recording) == len(cycles)
    assert np.array_equal(recording["time_s"], cycles["time_s"])
    assert int(cycles["controlled"].sum()) == finished.joints[0].cycles
    steps = np.diff(recording["time_s"].to_numpy())
    assert np.allclose(steps, 1e-3)


def test_what_is_recorded_after_the_stop_is_as_good_as_what_was_before(finished: RunReport) -> None:
    """The drive lets go and the joint swings freely; where the motor is has to be known all the same."""
    assert finished.folder is not None
    cycles, seen = (
        pl.read_csv(finished.folder / name, infer_schema_length=None)
        for name in ("cycles.csv", "prediction.csv")
    )
    before = cycles["controlled"].to_numpy() > 0.0
    after = cycles["time_s"].to_numpy() > cycles["time_s"].to_numpy()[before][-1] + 0.002
    assert after.sum() > 90
    assert cycles["motor_age_s"].to_numpy()[after].max() < 1e-9
    residual = seen["residual_rad"].to_numpy()
    assert np.std(residual[after]) < 3.0 * np.std(residual[before])


def test_the_snapshot_goes_on_where_the_run_ended(finished: RunReport) -> None:
    assert finished.folder is not None
    config = load_joint(finished.folder / "joint.toml")
    taken_up, replayed = Observer(config), Observer(config)
    taken_up.load(finished.folder / "observer.snapshot")
    blocks = open_recording(finished.folder / "recording.csv").blocks()
    for block in blocks:
        replayed.run(block.columns)
    assert taken_up.snapshot() == replayed.snapshot()


def test_the_run_says_how_time_and_data_were_kept(finished: RunReport) -> None:
    assert finished.folder is not None
    said = json.loads((finished.folder / "run.json").read_text())
    assert said["stop_reason"] == "time is over"
    timing = said["timing"]
    assert timing["ticks"] > 3000
    assert timing["skipped"] == 0
    assert timing["lost_frames"] == 0
    assert len(timing["policy"]) == 3
    assert timing["step"]["p50_s"] < timing["step"]["p99_s"] <= timing["step"]["max_s"]


def test_a_tenth_of_a_second_at_most_waits_to_be_written(tmp_path: Path) -> None:
    """What waits is what a process that is killed does not leave behind; the link keeps 1 kHz."""
    waiting: list[int] = []

    def watch(loop: Loop, tick: Tick) -> None:
        waiting.extend(joint.log.waiting for joint in loop.joints if joint.log is not None)

    simulated_run(tmp_path, 0.5, watch=watch)
    assert len(waiting) > 500
    assert 90 <= max(waiting) <= 101


@pytest.mark.parametrize("node", ["drive", "sensor"])
@pytest.mark.parametrize("after_the_stop", [False, True])
def test_silence_is_an_event_under_control_and_none_of_a_drive_that_was_stopped(
    node: str, after_the_stop: bool, tmp_path: Path
) -> None:
    silent_s, duration_s = (0.36, 0.25) if after_the_stop else (0.2, 1.0)
    report = simulated_run(tmp_path, duration_s, faults=(f"silent:node={node},start={silent_s}",))
    stopped_s = next(t for t, _, what in report.events if what.startswith("stop: "))
    assert (stopped_s < silent_s) is after_the_stop
    assert any("stale" in what for _, _, what in report.events) is not after_the_stop
    assert ("stale" in report.stop_reason) is not after_the_stop
    cycles = pl.read_csv(tmp_path / "cycles.csv", infer_schema_length=None)
    last = cycles.row(-1, named=True)  # what came of it is recorded all the same
    assert last["time_s"] > stopped_s + 0.09
    assert last["motor_age_s" if node == "drive" else "load_age_s"] > 0.05


def test_force_is_made_without_a_torque_sensor(tmp_path: Path) -> None:
    report = simulated_run(tmp_path, 5.0, ControlMode.FORCE)
    cycles = pl.read_csv(tmp_path / "cycles.csv", infer_schema_length=None)
    asked = cycles["reference_torque_Nm"].to_numpy()
    assert report.joints[0].true_torque_Nm < 0.03 * (asked.max() - asked.min())


def test_impedance_yields_by_its_stiffness() -> None:
    """At rest under a steady load M the joint stands off its reference by M/K, the motor answering from
    both encoders.
    """
    joint, control = load_joint(JOINT), load_control(CONTROL)
    options = control.compensator.model_copy(
        update={
            **WRIST_GAINS,
            "mode": ControlMode.IMPEDANCE,
            "impedance_stiffness_Nm_per_rad": 8.0,
            "impedance_damping_Nms_per_rad": 0.3,
        }
    )
    link, control = matched(
        load_link(LINK), control.model_copy(update={"compensator": options}), own_link=False
    )
    simulation = start_simulation(JOINT, SimulationWish(link, control, off_nominal=False, seed=3))
    push = {"kind": "ramp", "load_Nm": 0.4, "duration_s": 0.5}
    quiet = parse_protocol(
        {"schema": 1, "name": "push", "segment": [push, {"kind": "hold", "duration_s": 2.5}]}, "test"
    )
    angles: list[float] = []

    def watch(loop: Loop, tick: Tick) -> None:
        if loop.stage is RunStage.RUNNING:
            angles.append(simulation.truth(1).joint_position_rad)

    try:
        run_joint(joint, link, control, quiet, RunOptions(None, True), simulation, watch)
    finally:
        simulation.close()
    moved = float(np.mean(angles[-500:]))
    assert moved == pytest.approx(0.4 / 8.0, rel=0.05)


def test_a_force_run_replays_bit_for_bit_as_well(tmp_path: Path) -> None:
    """The load comes from both encoders there; `joint.toml` beside the recording says so."""
    simulated_run(tmp_path / "run", 1.0, ControlMode.FORCE)
    config = load_joint(tmp_path / "run" / "joint.toml")
    assert config.observer.load == "both_encoders"
    write_replay(
        open_recording(tmp_path / "run" / "recording.csv"), config, Observer(config), tmp_path / "replay"
    )
    live, again = (
        pl.read_csv(tmp_path / name / "prediction.csv", infer_schema_length=None)
        for name in ("run", "replay")
    )
    for name in ("deflection_rad", "joint_position_rad", "tension_h_N", "tension_l_N"):
        assert live[name].equals(again[name]), name


def test_asked_to_stop_before_anything_has_come_leaves_a_page_and_no_riddle(tmp_path: Path) -> None:
    joint, control = load_joint(JOINT), load_control(CONTROL)
    control = control.model_copy(update={"compensator": control.compensator.model_copy(update=WRIST_GAINS)})
    link, control = matched(load_link(LINK), control, own_link=False)
    simulation = start_simulation(JOINT, SimulationWish(link, control, faults=("silent:node=both",)))

    def watch(loop: Loop, tick: Tick) -> None:
        if tick.number > 20:
            loop.ask_to_stop("asked by the user")

    try:
        report = run_joint(joint, link, control, REACH, RunOptions(1.0, True, tmp_path), simulation, watch)
    finally:
        simulation.close()
    assert report.ended_well
    assert "Timing and data" in write_run_page(report, "").read_text()


def test_a_run_goes_on_from_a_snapshot_and_can_be_replayed_from_there(
    finished: RunReport, tmp_path: Path
) -> None:
    assert finished.folder is not None
    snapshot = finished.folder / "observer.snapshot"
    joint, control = load_joint(JOINT), load_control(CONTROL)
    control = control.model_copy(update={"compensator": control.compensator.model_copy(update=WRIST_GAINS)})
    link, control = matched(load_link(LINK), control, own_link=False)
    simulation = start_simulation(JOINT, SimulationWish(link, control, off_nominal=False, seed=3))
    options = RunOptions(0.5, True, tmp_path, resume=snapshot)
    try:
        report = run_joint(joint, link, control, REACH, options, simulation)
    finally:
        simulation.close()
    assert report.stop_reason == "time is over"
    before = pl.read_csv(finished.folder / "recording.csv", comment_prefix="#")["time_s"][-1]
    went_on = pl.read_csv(tmp_path / "recording.csv", comment_prefix="#")["time_s"]
    assert before < went_on[0] < before + 0.1
    observer = Observer(load_joint(tmp_path / "joint.toml"))
    observer.load(tmp_path / "start.snapshot")
    blocks = list(open_recording(tmp_path / "recording.csv").blocks())
    again = np.concatenate([observer.run(block.columns)["deflection_rad"] for block in blocks])
    live = pl.read_csv(tmp_path / "prediction.csv", infer_schema_length=None)["deflection_rad"].to_numpy()
    assert live.tobytes() == again.tobytes()


def test_a_snapshot_of_an_observer_that_has_taken_nothing_is_nothing_to_go_on_from(tmp_path: Path) -> None:
    """Its time is minus infinity, from which no clock gets anywhere."""
    snapshot = tmp_path / "empty.snapshot"
    Observer(load_joint(JOINT)).save(snapshot)
    joint, control = load_joint(JOINT), load_control(CONTROL)
    control = control.model_copy(update={"compensator": control.compensator.model_copy(update=WRIST_GAINS)})
    link, control = matched(load_link(LINK), control, own_link=False)
    simulation = start_simulation(JOINT, SimulationWish(link, control, off_nominal=False, seed=3))

    def watch(loop: Loop, tick: Tick) -> None:
        assert tick.number < 1000, "it would never end"

    options = RunOptions(0.3, True, tmp_path / "run", resume=snapshot)
    try:
        with pytest.raises(InputError, match=r"empty\.snapshot: its observer has taken no sample") as caught:
            run_joint(joint, link, control, REACH, options, simulation, watch)
    finally:
        simulation.close()
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run").exists()
