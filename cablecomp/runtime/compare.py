"""The comparison: motor-side control alone, a linear-stiffness compensator and the observer's, side by
side in one run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig
from cablecomp.control.options import CompensatorOptions, ControlConfig, FeedForward
from cablecomp.control.protocol import Protocol
from cablecomp.control.standard import calibration_protocol, force_protocol, reaching_protocol
from cablecomp.errors import InputError
from cablecomp.links.schema import LinkConfig
from cablecomp.recording.reader import read_all
from cablecomp.runtime.loop import TIME_IS_OVER
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import RunOptions, Watch, run_joints
from cablecomp.runtime.setup import Contestant, same_joint
from cablecomp.runtime.simulated import Simulation, SimulationFactory, SimulationWish
from cablecomp.runtime.ways_out import ASKED_BY_USER
from cablecomp.signal.noise import reading_sigma

Columns = Mapping[str, NDArray[np.float64]]
MOTOR_ALONE, LINEAR, OBSERVER = "motor-side-alone", "linear-stiffness", "observer"
NAMES = (MOTOR_ALONE, LINEAR, OBSERVER)
QUICK = 3.0
"""How much faster the motions are where feedback on the joint encoder, which mends slow errors by
itself, is on.
"""


class Calibrated(NamedTuple):
    """A configuration fitted to a recording, and lines that say what was found."""

    config: JointConfig
    rows: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]


Calibrate = Callable[[JointConfig, Columns], Calibrated]


@dataclass(frozen=True)
class Comparison:
    """Everything that the report of a comparison is made from.

    `open_loop`: the three side by side without feedback on the joint encoder; `closed_loop`: the same
    with it; `force`: force mode without torque sensor, against a wall; `force_range_Nm`: span of the
    torques asked for.
    """

    name: str
    nominal: JointConfig
    calibrated: Calibrated
    linear_Nm_per_rad: float
    calibration: RunReport
    open_loop: RunReport
    closed_loop: RunReport
    force: RunReport
    force_range_Nm: float
    protocol: Protocol
    seconds: float

    def factor(self, over: str, report: RunReport | None = None) -> float:
        """How many times the joint-side error of `over` is the observer's."""
        errors = {
            j.name: _error(j.true_position_rad, j.position_rad) for j in (report or self.open_loop).joints
        }
        return errors[over] / errors[OBSERVER]

    @property
    def encoder_noise_rad(self) -> float:
        """RMS of the joint encoder's noise and of its rounding."""
        s = self.nominal.sensors
        return reading_sigma(s.joint_position_noise_rad, s.joint_position_resolution_rad)

    @property
    def force_share(self) -> float:
        """RMS torque error in force mode over the range asked for."""
        joint = self.force.joints[0]
        return _error(joint.true_torque_Nm, joint.torque_Nm) / self.force_range_Nm

    def as_dict(self) -> dict[str, object]:
        """True joint-side RMS errors (rad) and how many times the observer's they are, by controller."""
        loops = {"without_joint_feedback": self.open_loop, "with_joint_feedback": self.closed_loop}
        return {
            "name": self.name,
            "calibrated": dict(self.calibrated.rows),
            **{
                loop: {
                    j.name: {
                        "error_rad": _error(j.true_position_rad, j.position_rad),
                        "over_observer": self.factor(j.name, report),
                    }
                    for j in report.joints
                }
                for loop, report in loops.items()
            },
            "encoder_noise_rad": self.encoder_noise_rad,
            "force_error_share": self.force_share,
            "seconds": self.seconds,
        }


class CompareOptions(NamedTuple):
    """Seed of plant and motions, length of the judged runs (s), folder for all files."""

    out: Path
    seed: int = 1
    duration_s: float = 30.0
    force_s: float = 15.0


Say = Callable[[str], None]
Now = Callable[[], float]


def compare(
    config: JointConfig,
    link: LinkConfig,
    control: ControlConfig,
    factory: SimulationFactory,
    calibrate: Calibrate,
    options: CompareOptions,
    now: Now,
    say: Say = lambda line: None,
    watch: Watch | None = None,
) -> Comparison:
    """Calibrate from one recording of 60 s, then run the contestants on motions not seen before, in
    stepped time.

    All on the independent plant, whose parameters lie off the nominal ones by draws of their tolerance. A signal
    that stops one of the runs ends it all by KeyboardInterrupt.
    """
    started = now()
    base = _Base(config, link, control, factory, options, watch)
    say("calibration: 60 s of load loops and turns, motor-side control alone")
    calibration = base.calibration()
    columns = read_all(options.out / "calibration" / "recording.csv").columns
    say("fitting the cable's parameters to that recording")
    calibrated = calibrate(config, columns)
    linear = best_line(columns, config.drive.ratio)
    protocol = reaching_protocol(config, 100 + options.seed, options.duration_s)
    say(f"side by side: {', '.join(NAMES)}; {protocol.duration_s:.0f} s of unseen motions")
    open_loop = base.side_by_side("open-loop", calibrated.config, linear, protocol, 0.0)
    say(f"the same with feedback on the joint encoder, {QUICK:g} times as fast")
    quick = reaching_protocol(config, 300 + options.seed, options.duration_s, pace=QUICK)
    closed = base.side_by_side("closed-loop", calibrated.config, linear, quick, None)
    torques = force_protocol(config, 200 + options.seed, options.force_s)
    say(f"force mode without torque sensor, against a wall; {torques.duration_s:.0f} s")
    force = base.force(calibrated.config, torques)
    extremes = torques.extremes()
    return Comparison(
        config.name,
        config,
        calibrated,
        linear,
        calibration,
        open_loop,
        closed,
        force,
        extremes.load_high_Nm - extremes.load_low_Nm,
        protocol,
        now() - started,
    )


def best_line(columns: Columns, ratio: float) -> float:
    """Stiffness (Nm/rad) of the best straight line through load against deflection of a recording: what
    a linear compensator would be given.
    """
    deflection = columns["joint_position_rad"] - ratio * columns["motor_position_rad"]
    load = columns["joint_torque_Nm"]
    spread = load - load.mean()
    slope = float(np.sum(spread * (deflection - deflection.mean())) / np.sum(spread**2))
    if not slope > 0.0:
        raise InputError(
            "the calibration recording shows no deflection under load; check the torque sensor's sign"
        )
    return 1.0 / slope


class _Base(NamedTuple):
    """What all runs of a comparison have in common."""

    config: JointConfig
    link: LinkConfig
    control: ControlConfig
    factory: SimulationFactory
    options: CompareOptions
    watch: Watch | None

    def calibration(self) -> RunReport:
        """One joint, motor-side control alone, nominal parameters."""
        alone = self.control.compensator.model_copy(update={"feed_forward": FeedForward.NONE})
        contestants = (Contestant(0, "calibration", self.config, alone),)
        protocol = calibration_protocol(self.config)
        return self._run("calibration", contestants, same_joint(self.link, ["calibration"]), protocol)

    def side_by_side(
        self, name: str, config: JointConfig, linear: float, protocol: Protocol, feedback: float | None
    ) -> RunReport:
        """Three joints of one kind on one bus: the only difference is the feed-forward."""
        common = self.control.compensator.model_copy(update={"joint_feedback_per_s": feedback})
        contestants = tuple(
            Contestant(k, other, config, _kind(common, kind, linear))
            for k, (other, kind) in enumerate(zip(NAMES, _KINDS, strict=True))
        )
        return self._run(name, contestants, same_joint(self.link, NAMES), protocol)

    def force(self, config: JointConfig, protocol: Protocol) -> RunReport:
        """One joint against a wall, torque known from both encoders alone."""
        options = self.control.compensator.model_copy(update={"torque_from": "encoders"})
        contestants = (Contestant(0, "force", config, options),)
        return self._run("force", contestants, same_joint(self.link, ["force"]), protocol, wall=True)

    def _run(
        self,
        name: str,
        contestants: tuple[Contestant, ...],
        link: LinkConfig,
        protocol: Protocol,
        wall: bool = False,
    ) -> RunReport:
        wish = SimulationWish(link, self.control, len(contestants), True, self.options.seed)
        simulation: Simulation = self.factory(wish)
        if wall:
            simulation.set_wall(1, 0.0)
        options = RunOptions(stepped=True, out=self.options.out / name)
        try:
            report = run_joints(contestants, link, self.control, protocol, options, simulation, self.watch)
        finally:
            simulation.close()
        if report.stop_reason.startswith(ASKED_BY_USER):
            raise KeyboardInterrupt
        if report.stop_reason != TIME_IS_OVER:
            raise InputError(
                f"{name}: the run stopped early: {report.stop_reason}; see {options.out}/events.jsonl"
            )
        return report


_KINDS = (FeedForward.NONE, FeedForward.LINEAR, FeedForward.OBSERVER)


def _kind(options: CompensatorOptions, kind: FeedForward, linear: float) -> CompensatorOptions:
    return options.model_copy(update={"feed_forward": kind, "linear_stiffness_Nm_per_rad": linear})


def _error(true: float, measured: float) -> float:
    return true if true == true else measured
