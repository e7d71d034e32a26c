"""Faults on demand against the running loop: how soon each is seen, what the joint does, that nothing
recorded is lost. With `-s` every fault tells its line.
"""

from __future__ import annotations

import json
from pathlib import Path

import can
import numpy as np
import polars as pl
import pytest
from fault_runs import JOINT, REACH, Outcome, nothing_is_lost, run_with, simulated

from cablecomp.config import load_joint
from cablecomp.errors import DeviceError
from cablecomp.links.load import load_link
from cablecomp.links.port_can import GenericPort
from cablecomp.links.ports import Port
from cablecomp.links.schema import Timeouts
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.setup import times_of

CONFIGS = Path(__file__).parents[2] / "configs"


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
        # nothing holds the joint against its load then: it is pushed away, whatever is commanded
        ("saturate:which=motor,limit=0.02,start=0.4", "far from the motor", 0.05, 0.13, 1.5),
        # the drive's own speed limit trips at the first jump
        ("jump:which=motor,jump=0.5,p=0.01,start=0.4", "drive reports fault", 0.25, 0.25, 0.25),
        ("late:start=0.4,delay=0.006,direction=tx", "come late", 0.02, 0.25, 0.25),
        ("corrupt:start=0.4", "jumped", 0.02, 0.4, 0.4),
    ],
)
def test_faults_that_must_stop_the_joint(
    fault: str, words: str, seen_s: float, stop_s: float, moved_rad: float, tmp_path: Path
) -> None:
    outcome = run_with(tmp_path, fault)
    outcome.tell(fault, outcome.seen_after_s(words))
    assert outcome.seen_after_s(words) <= seen_s
    assert not outcome.finished
    assert outcome.stopped_after_s <= stop_s
    assert outcome.moved_rad(outcome.stopped_after_s) <= moved_rad
    nothing_is_lost(outcome)


@pytest.mark.parametrize(
    ("fault", "counter", "seen_s", "least"),
    [
        ("drop:p=0.2,start=0.4", "lost", 0.03, 50),
        ("repeat:start=0.4", "repeated", 0.002, 500),
        ("reorder:start=0.4,p=0.1,spread=0.002,direction=tx", "reordered", 0.2, 5),
    ],
)
def test_a_rough_bus_is_counted_and_survived(
    fault: str, counter: str, seen_s: float, least: int, tmp_path: Path
) -> None:
    outcome = run_with(tmp_path, fault)
    outcome.tell(fault, outcome.counted_after_s(counter))
    assert outcome.counted_after_s(counter) <= seen_s
    assert getattr(outcome.ended.timing, f"{counter}_frames") >= least
    assert outcome.finished, outcome.ended.stop_reason
    assert outcome.true_error_rad < 2e-3
    nothing_is_lost(outcome)


@pytest.mark.parametrize(
    ("fault", "words", "seen_s", "error_rad"),
    [
        ("stuck:which=joint,start=0.4", "joint encoder disagrees", 0.2, 2e-4),
        ("jump:which=joint,jump=0.5,start=0.4", "joint encoder jumped", 0.002, 2e-4),
        ("jump:which=joint,p=0.05,start=0.4", "joint encoder jumped", 0.1, 2e-4),
        ("corrupt:p=0.01,start=0.4,direction=tx", "jumped", 0.5, 2e-3),
    ],
)
def test_lies_that_are_seen_through_are_survived(
    fault: str, words: str, seen_s: float, error_rad: float, tmp_path: Path
) -> None:
    outcome = run_with(tmp_path, fault)
    outcome.tell(fault, outcome.seen_after_s(words))
    assert outcome.seen_after_s(words) <= seen_s
    assert outcome.finished, outcome.ended.stop_reason
    assert outcome.true_error_rad < error_rad
    nothing_is_lost(outcome)


def test_a_short_silence_is_held_and_faded_and_mended_without_a_step(tmp_path: Path) -> None:
    outcome = run_with(tmp_path, "silent:node=sensor,start=0.4,stop=0.45")
    outcome.tell("silent for 50 ms", outcome.seen_after_s("stale"))
    assert outcome.finished
    phases = outcome.ended.joints[0].phases
    assert phases["held"] > 0
    assert phases["fading"] > 0
    assert phases["recovering"] > 0
    assert "stopped" not in phases
    cycles = pl.read_csv(tmp_path / "cycles.csv", infer_schema_length=None)
    sent = cycles.filter(pl.col("controlled") > 0)["command_position_rad"].to_numpy()
    assert np.max(np.abs(np.diff(sent))) < 0.01
    assert outcome.true_error_rad < 5e-4
    nothing_is_lost(outcome)


def test_a_sensor_node_that_restarts_is_taken_back(tmp_path: Path) -> None:
    outcome = run_with(tmp_path, "reset:node=sensor,start=0.4")
    outcome.tell("reset:node=sensor", outcome.seen_after_s("stale"))
    assert outcome.finished
    assert outcome.seen_after_s("stale") <= 0.004
    assert outcome.true_error_rad < 2e-3
    nothing_is_lost(outcome)


def test_an_end_of_the_world_still_leaves_everything_closed(tmp_path: Path) -> None:
    """An exception out of nowhere, in mid-run: stop command sent, logs and snapshot whole, the
    exception still seen.
    """
    simulation, link, control = simulated("wrist-virtual")
    seen: list[int] = []

    def watch(loop, tick) -> None:
        seen[:] = [loop.report().ticks]
        if tick.now_s > 0.5:
            raise RuntimeError("out of nowhere")

    options = RunOptions(1.2, True, tmp_path)
    try:
        with pytest.raises(RuntimeError, match="out of nowhere"):
            run_joint(load_joint(JOINT), link, control, REACH, options, simulation, watch)
        simulation.advance()
        assert simulation.bench.joints[0].drive.state.name in ("DISABLED", "FAULT")
    finally:
        simulation.close()
    nothing_is_lost(Outcome(tmp_path, ticks=seen[0]))


def test_noise_on_a_serial_line_is_counted_and_survived(tmp_path: Path) -> None:
    """Every record has its checksum; an slcan line has none, so there only plausibility helps."""
    outcome = run_with(tmp_path, "noise:p=0.002,start=0.4", link="mit-serial")
    outcome.tell("mit-serial, noise:p=0.002", outcome.counted_after_s("invalid"))
    assert outcome.counted_after_s("invalid") <= 0.2
    assert outcome.finished, outcome.ended.stop_reason
    assert outcome.true_error_rad < 2e-3
    nothing_is_lost(outcome)


@pytest.mark.parametrize(
    ("link", "fault", "words"),
    [
        ("mit-serial", "cable_pull:start=0.4", "bus is lost"),
        ("mit-slcan", "cable_pull:start=0.4", "bus is lost"),
        ("mit-slcan", "bus_off:start=0.4", "bus is off"),
    ],
)
def test_a_line_that_is_gone_stops_the_joint(link: str, fault: str, words: str, tmp_path: Path) -> None:
    outcome = run_with(tmp_path, fault, link=link)
    outcome.tell(f"{link}, {fault}", outcome.seen_after_s(words))
    assert outcome.seen_after_s(words) <= 0.06
    assert not outcome.finished
    assert outcome.moved_rad(outcome.stopped_after_s) <= 0.06
    nothing_is_lost(outcome)


def test_an_adapter_that_is_gone_leaves_the_report_and_everything_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pulled out in mid-run; python-can cannot even close it, and lets an error out."""
    simulation, link, control = simulated("wrist-virtual")
    gone: list[bool] = []

    class Adapter:
        def __init__(self, channel: str | int | None) -> None:
            self._bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)

        def recv(self, timeout: float) -> can.Message | None:
            self._there()
            return self._bus.recv(timeout)

        def send(self, message: can.Message, timeout: float) -> None:
            self._there()
            self._bus.send(message, timeout)

        def shutdown(self) -> None:
            self._bus.shutdown()
            self._there()

        def _there(self) -> None:
            if gone:
                raise can.CanOperationError("unplugged")

    def opened(interface: str, channel: str | int | None, *options: object) -> Port:
        return GenericPort(lambda: Adapter(channel))

    def watch(loop, tick) -> None:
        if loop.since_s > 0.4:
            gone[:] = [True]

    monkeypatch.setattr("cablecomp.links.link.can_port", opened)
    options = RunOptions(1.2, True, tmp_path)
    try:
        report = run_joint(load_joint(JOINT), link, control, REACH, options, simulation, watch)
    finally:
        simulation.close()
    assert "bus is lost" in report.stop_reason
    assert json.loads((tmp_path / "run.json").read_text())["stop_reason"] == report.stop_reason
    nothing_is_lost(Outcome(tmp_path, report, ticks=report.timing.ticks))


def test_no_answer_at_all_is_a_device_error_in_one_line(tmp_path: Path) -> None:
    simulation, link, control = simulated("wrist-virtual", "silent:node=both")
    options = RunOptions(1.2, True, tmp_path)
    try:
        with pytest.raises(DeviceError, match="nothing from wrist") as caught:
            run_joint(load_joint(JOINT), link, control, REACH, options, simulation)
    finally:
        simulation.close()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("period_s", "fresh_s", "motor_stop_s"), [(1e-3, 2.5e-3, 0.04), (3e-3, 7.5e-3, 0.04), (0.02, 0.01, 0.04)]
)
def test_times_follow_from_the_link(period_s: float, fresh_s: float, motor_stop_s: float) -> None:
    """Fresh for two periods and a half, or as long as is held; a motor's reading is too old at half of the fade."""
    timeouts = Timeouts(hold_s=0.01, fade_s=0.08, stop_s=0.2)
    link = load_link(CONFIGS / "links/wrist-virtual.toml").model_copy(update={"timeouts": timeouts})
    assert times_of(link, period_s) == pytest.approx((fresh_s, 0.01, 0.08, 0.2, 0.08, motor_stop_s))
