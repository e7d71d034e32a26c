"""Runs against the simulated joint with a fault that begins 0.4 s into a reach, and what came of them.

The joint moves to 0.6 rad within 1.2 s while its load grows to 1.2 Nm.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import polars as pl

from cablecomp.cli.simulation import start_simulation
from cablecomp.config import load_joint
from cablecomp.control.options import ControlConfig, load_control
from cablecomp.control.protocol import parse_protocol
from cablecomp.links.load import load_link
from cablecomp.links.schema import LinkConfig
from cablecomp.observer import Observer
from cablecomp.recording.reader import open_recording
from cablecomp.runtime.clock import Tick
from cablecomp.runtime.loop import Loop, RunStage
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.setup import matched
from cablecomp.runtime.simulated import Simulation, SimulationWish

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
    """A run with a fault, and what the joint did meanwhile; `counts`: the link's counters, tick by tick."""

    folder: Path
    report: RunReport | None = None
    time_s: list[float] = field(default_factory=list)
    joint_rad: list[float] = field(default_factory=list)
    counts: list[tuple[int, ...]] = field(default_factory=list)
    ticks: int = 0

    @property
    def ended(self) -> RunReport:
        """The report of a run that came to an end."""
        assert self.report is not None
        return self.report

    def seen_after_s(self, words: str) -> float:
        """Time from the fault's beginning to the first event that says these words."""
        times = [t for t, _, what in self.ended.events if words in what and t >= BEGIN_S]
        assert times, (words, self.ended.events)
        return times[0] - BEGIN_S

    def counted_after_s(self, counter: str) -> float:
        """Time from the fault's beginning to the first tick at which the link's counter has grown."""
        place = COUNTERS.index(counter)
        before = max(
            (c[place] for t, c in zip(self.time_s, self.counts, strict=True) if t < BEGIN_S), default=0
        )
        grown = [
            t for t, c in zip(self.time_s, self.counts, strict=True) if t >= BEGIN_S and c[place] > before
        ]
        assert grown, (counter, self.counts[-1])
        return grown[0] - BEGIN_S

    @property
    def stopped_after_s(self) -> float:
        """Time from the fault's beginning to the stop."""
        return self.seen_after_s("stop: ")

    @property
    def finished(self) -> bool:
        """Whether the run went on to its end."""
        return self.ended.stop_reason == "time is over"

    @property
    def true_error_rad(self) -> float:
        """RMS position error, from the simulation's truth."""
        return self.ended.joints[0].true_position_rad

    def moved_rad(self, within_s: float) -> float:
        """How far the joint went, at most, within a time of the fault's beginning."""
        at = np.array(self.time_s)
        angles = np.array(self.joint_rad)[(at >= BEGIN_S) & (at <= BEGIN_S + within_s)]
        return float(np.max(np.abs(angles - angles[0])))

    def tell(self, fault: str, seen_s: float) -> None:
        """One line for `pytest -s`: the fault, when it was seen, what became of the run and the joint."""
        end = f"error {1e3 * self.true_error_rad:.2f} mrad RMS to the end"
        if not self.finished:
            stop = self.stopped_after_s
            end = f"stopped after {1e3 * stop:.0f} ms, joint moved {1e3 * self.moved_rad(stop):.0f} mrad"
        print(f"\n{fault}: seen after {1e3 * seen_s:.0f} ms, {end}; {self.ticks} ticks, nothing lost", end="")


COUNTERS = ("lost", "repeated", "reordered", "invalid")


def matched_link(name: str) -> tuple[LinkConfig, ControlConfig]:
    """A shipped link and the wrist's control file with stated gains."""
    control = CONTROL.model_copy(update={"compensator": CONTROL.compensator.model_copy(update=GAINS)})
    return matched(load_link(CONFIGS / "links" / f"{name}.toml"), control, own_link=False)


def simulated(name: str, *faults: str) -> tuple[Simulation, LinkConfig, ControlConfig]:
    """The wrist behind a link, with faults."""
    link, control = matched_link(name)
    return start_simulation(JOINT, SimulationWish(link, control, 1, False, 3, faults)), link, control


def run_with(folder: Path, *faults: str, link: str = "wrist-virtual") -> Outcome:
    """One run in stepped time."""
    simulation, bus, control = simulated(link, *faults)
    outcome = Outcome(folder)

    def watch(loop: Loop, tick: Tick) -> None:
        if loop.stage >= RunStage.RUNNING:
            status = loop.link.status()
            outcome.time_s.append(tick.now_s)
            outcome.joint_rad.append(simulation.truth(1).joint_position_rad)
            outcome.counts.append(tuple(getattr(status, name) for name in COUNTERS))

    try:
        options = RunOptions(1.2, True, folder)
        outcome.report = run_joint(load_joint(JOINT), bus, control, REACH, options, simulation, watch)
        outcome.ticks = outcome.report.timing.ticks
    finally:
        simulation.close()
    return outcome


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
