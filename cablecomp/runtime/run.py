"""`cablecomp run`: one configuration, one link, real or simulated; a folder with everything that happened."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import nan, sqrt
from pathlib import Path
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.config_text import write_joint
from cablecomp.control.command import Reference
from cablecomp.control.compensator import Compensator, Gains, given_gains, ratio_of
from cablecomp.control.degrade import DegradeTimes
from cablecomp.control.design import design_loop
from cablecomp.control.gate import GateLimits
from cablecomp.control.options import CompensatorOptions, ControlConfig, ControlMode
from cablecomp.control.protocol import Protocol
from cablecomp.errors import InputError
from cablecomp.links.link import BusLink, Link
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import Mode
from cablecomp.links.schema import JointEnds, LinkConfig
from cablecomp.observer import Observer
from cablecomp.runtime.clock import Clock, MonotonicClock, SteppedClock, Tick
from cablecomp.runtime.health import Health
from cablecomp.runtime.joint_loop import JointLoop, JointSetup, References
from cablecomp.runtime.loop import Loop, LoopOptions, Stage
from cablecomp.runtime.priority import QUIET, Policy
from cablecomp.runtime.simulated import Simulation
from cablecomp.runtime.timing import TimingReport


@dataclass(frozen=True)
class Contestant:
    """One joint of a run: its place on the link (from 0), a name for its folder, its configuration and
    controller.
    """

    place: int
    name: str
    config: JointConfig
    options: CompensatorOptions


@dataclass(frozen=True)
class RunOptions:
    """How a run is done. `duration_s` None = the protocol's; `stepped`: simulated time, as fast as it
    goes; `out`: folder for recording, predictions, cycles, events, snapshot and `run.json` (None =
    nothing is written).
    """

    duration_s: float | None = None
    stepped: bool = False
    out: Path | None = None
    bounds: bool = False
    policy: Policy | None = None
    resume: Path | None = None


@dataclass(frozen=True)
class JointResult:
    """How one joint did under control, root mean squares over the run.

    Position: joint encoder less reference; `true_position_rad` the same with the simulation's truth
    (NaN on hardware). Torque: the observer's less the reference's; `true_torque_Nm` with the truth.
    `residual_rad`: joint encoder less prediction.
    """

    name: str
    cycles: int
    position_rad: float
    true_position_rad: float
    torque_Nm: float
    true_torque_Nm: float
    residual_rad: float
    deflection_rad: float
    phases: dict[str, int]


@dataclass(frozen=True)
class RunReport:
    """What `run_joints` gives back; `folder` holds the files."""

    joints: tuple[JointResult, ...]
    timing: TimingReport
    stop_reason: str
    events: tuple[tuple[float, str, str], ...]
    gains: Gains
    folder: Path | None

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for `run.json`."""
        joints = [{k: _plain(v) for k, v in vars(j).items()} for j in self.joints]
        return {
            "schema": 1,
            "stop_reason": self.stop_reason,
            "gains": self.gains._asdict(),
            "joints": joints,
            "timing": self.timing.as_dict(),
            "events": [{"time_s": t, "joint": j, "what": w} for t, j, w in self.events],
        }


Watch = Callable[[Loop, Tick], None]
"""Called once a tick after the commands went out, with the loop to look at."""


class TruthTally:
    """Squares of true errors, joint by joint."""

    def __init__(self, names: Sequence[str]) -> None:
        self._sums = {name: [0.0, 0.0, 0] for name in names}

    def add(self, name: str, position_error: float, torque_error: float) -> None:
        """One cycle's errors (rad, Nm; NaN counts as 0)."""
        sums = self._sums[name]
        sums[0] += position_error * position_error
        sums[1] += torque_error * torque_error if torque_error == torque_error else 0.0
        sums[2] += 1

    def rms(self, name: str) -> tuple[float, float]:
        """Root mean squares of both."""
        position, torque, count = self._sums[name]
        return (sqrt(position / count), sqrt(torque / count)) if count else (nan, nan)


def run_joint(
    config: JointConfig,
    link: LinkConfig,
    control: ControlConfig,
    protocol: Protocol,
    options: RunOptions,
    simulation: Simulation | None = None,
    watch: Watch | None = None,
) -> RunReport:
    """Run one joint, the link's first; see `run_joints`."""
    name = link.joint[0].name
    return run_joints(
        (Contestant(0, name, config, control.compensator),),
        link,
        control,
        protocol,
        options,
        simulation,
        watch,
    )


def run_joints(
    contestants: Sequence[Contestant],
    link: LinkConfig,
    control: ControlConfig,
    protocol: Protocol,
    options: RunOptions,
    simulation: Simulation | None = None,
    watch: Watch | None = None,
) -> RunReport:
    """Run joints side by side on one link under one protocol; returns how they did, leaves the files in
    `options.out`.

    On hardware the protocol's load is what the surroundings do; on a simulation it is applied there. In
    force mode the load is the reference. Raises InputError for what does not fit together, DeviceError
    if the other side does not answer.
    """
    if options.stepped and simulation is None:
        raise InputError("stepped time needs a simulated joint; leave out --fast, or add --sim")
    for c in contestants:
        protocol.check_within(c.config.limits, protocol.name)
    first = contestants[0]
    mode = ControlMode.FORCE if protocol.mode == "force" else first.options.mode
    chosen = control.model_copy(update={"compensator": first.options.model_copy(update={"mode": mode})})
    given = given_gains(chosen.compensator)
    gains = design_loop(first.config, link.rate_Hz, chosen).gains if given is None else given
    period = 1.0 / link.rate_Hz
    bus: Link = BusLink(link)
    references = _references(protocol, mode is not ControlMode.POSITION)
    setups = tuple(_setup(c, mode, bus, control, references, gains, period, options) for c in contestants)
    if options.out is not None:
        _prepare(options.out, setups)
    duration = protocol.duration_s if options.duration_s is None else options.duration_s
    policy = options.policy if options.policy is not None else (QUIET if options.stepped else Policy())
    clock: Clock = SteppedClock() if options.stepped else MonotonicClock()
    timing = LoopOptions(duration, mode=_drive_mode(link, first.place), policy=policy)
    truths = TruthTally([c.name for c in contestants])

    def after(tick: Tick, stage: Stage) -> None:
        if simulation is not None:
            _simulate(loop, tick, simulation, protocol, mode, stage, truths)
        if watch is not None:
            watch(loop, tick)

    loop = Loop(bus, setups, clock, period, timing, options.out, after)
    report = loop.run()
    found = RunReport(
        tuple(_result(joint, truths) for joint in loop.joints),
        report,
        loop.stop_reason,
        tuple(loop.events.last),
        gains,
        options.out,
    )
    if options.out is not None:
        (options.out / "run.json").write_text(json.dumps(found.as_dict(), indent=1) + "\n", encoding="utf-8")
    return found


def matched(link: LinkConfig, control: ControlConfig, *, own_link: bool) -> tuple[LinkConfig, ControlConfig]:
    """Link and control file that say the same of the drive's stiffness and damping.

    `own_link`: the link is the user's, and what it states holds; else it takes over what the control
    file states.
    """
    motor = link.joint[0].motor
    if motor is None or motor.mode != "impedance":
        return link, control
    if own_link and motor.stiffness_Nm_per_rad > 0.0:
        own = {
            "stiffness_Nm_per_rad": motor.stiffness_Nm_per_rad,
            "damping_Nms_per_rad": motor.damping_Nms_per_rad or control.motor.damping_Nms_per_rad,
        }
        return link, control.model_copy(update={"motor": control.motor.model_copy(update=own)})
    gains = {
        "stiffness_Nm_per_rad": control.motor.stiffness_Nm_per_rad,
        "damping_Nms_per_rad": control.motor.damping_Nms_per_rad,
    }
    ends = link.joint[0].model_copy(update={"motor": motor.model_copy(update=gains)})
    return link.model_copy(update={"joint": (ends, *link.joint[1:])}), control


def same_joint(link: LinkConfig, names: Sequence[str]) -> LinkConfig:
    """The link with its first joint once for each name, on nodes counted up from its own."""
    base = link.joint[0]

    def copy(k: int, name: str) -> JointEnds:
        motor = None if base.motor is None else base.motor.model_copy(update={"node": base.motor.node + k})
        sensor = (
            None if base.sensor is None else base.sensor.model_copy(update={"node": base.sensor.node + k})
        )
        return JointEnds(name=name, motor=motor, sensor=sensor)

    return link.model_copy(update={"joint": tuple(copy(k, name) for k, name in enumerate(names))})


def times_of(link: LinkConfig, period_s: float) -> DegradeTimes:
    """The link's timeouts as times of the descent; two periods and a half count as fresh."""
    t = link.timeouts
    fresh = min(2.5 * period_s, t.hold_s)
    return DegradeTimes(fresh, t.hold_s, t.fade_s, t.stop_s, t.fade_s, max(0.5 * t.fade_s, fresh))


def _setup(
    c: Contestant,
    mode: ControlMode,
    bus: Link,
    control: ControlConfig,
    references: References,
    gains: Gains,
    period: float,
    options: RunOptions,
) -> JointSetup:
    link = bus.config
    if not 0 <= c.place < len(link.joint):
        raise InputError(
            f"link `{link.name}` has {len(link.joint)} joints; joint {c.place + 1} is not among them"
        )
    chosen = c.options.model_copy(update={"mode": mode})
    force = mode is not ControlMode.POSITION
    both = force and chosen.torque_from == "encoders"
    config = observed(c.config, chosen)
    observer = Observer(config, bounds=options.bounds)
    if options.resume is not None:
        observer.load(options.resume)
    compensator = Compensator(config, chosen, period, observer, gains=gains, motor=control.motor)
    times = times_of(link, period)
    sensor = config.observer.load == "joint_torque"
    health = Health(
        control.health,
        ratio_of(config),
        times.fresh_s,
        period,
        needs_torque=sensor,
        needs_joint=both,
        others=_places(bus.joints[c.place], observer.channels),
    )
    limits = GateLimits.of(c.config.limits, age_s=times.motor_stop_s)
    return JointSetup(c.place, c.name, config, compensator, health, limits, times, references)


def _places(readings: JointReadings, channels: Sequence[str]) -> tuple[int, ...]:
    missing = [name for name in channels if name not in readings.others]
    if missing:
        raise InputError(
            f"joint `{readings.name}`: an effect reads `{missing[0]}`, which is not on this link; "
            "add the channel to a device's messages"
        )
    return tuple(readings.index(name) for name in channels)


def observed(config: JointConfig, options: CompensatorOptions) -> JointConfig:
    """The configuration as the run's observer has it: where its load comes from follows from the
    control mode.
    """
    load: str = config.observer.load
    if options.mode is not ControlMode.POSITION:
        load = {"encoders": "both_encoders", "motor_torque": "motor_torque", "sensor": "joint_torque"}[
            options.torque_from
        ]
    return config.model_copy(update={"observer": config.observer.model_copy(update={"load": load})})


def _references(protocol: Protocol, force: bool) -> References:
    """The protocol as joints see it; joints that ask for the same instant share the answer."""
    asked, answer = nan, Reference()

    def reference(time_s: float) -> Reference:
        nonlocal asked, answer
        if time_s != asked:
            found = protocol.reference(time_s)
            # In position mode the load is the surroundings' own: the controller is not told.
            answer = found if force else found._replace(joint_torque_Nm=nan)
            asked = time_s
        return answer

    return reference


def _drive_mode(link: LinkConfig, place: int) -> Mode:
    motor = link.joint[place].motor
    if motor is None:
        raise InputError(f"joint `{link.joint[place].name}` has no motor on this link; add [joint.motor]")
    return Mode(motor.mode)


def _simulate(
    loop: Loop,
    tick: Tick,
    simulation: Simulation,
    protocol: Protocol,
    mode: ControlMode,
    stage: Stage,
    truths: TruthTally,
) -> None:
    """One period of the simulation after each cycle's commands, in step with the loop whether that is
    paced or not.
    """
    since = loop.since_s
    load = protocol.reference(since).joint_torque_Nm if stage is Stage.RUNNING else protocol.start_load_Nm
    for joint in loop.joints:
        if mode is ControlMode.POSITION:
            simulation.set_load(joint.setup.place + 1, load)
    simulation.advance(1 + tick.skipped)
    if stage is not Stage.RUNNING:
        return
    # the truth is one period on, where the reference of the next instant applies
    wanted = protocol.reference(since + loop.period_s)
    for joint in loop.joints:
        truth = simulation.truth(joint.setup.place + 1)
        torque = truth.joint_torque_Nm - wanted.joint_torque_Nm
        truths.add(joint.setup.name, truth.joint_position_rad - wanted.joint_position_rad, torque)


def _prepare(out: Path, setups: Sequence[JointSetup]) -> None:
    for setup in setups:
        folder = out if len(setups) == 1 else out / setup.name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{folder}: cannot be made ({error.strerror}); choose another --out") from None
        write_joint(folder / "joint.toml", setup.config, ("the configuration that this run used",))


def _result(joint: JointLoop, truths: TruthTally) -> JointResult:
    t = joint.tally

    def rms(square: float, count: int) -> float:
        return sqrt(square / count) if count else nan

    true_position, true_torque = truths.rms(joint.setup.name)
    return JointResult(
        joint.setup.name,
        t.cycles,
        rms(t.position_square, t.position_count),
        true_position,
        rms(t.torque_square, t.torque_count),
        true_torque,
        rms(t.residual_square, t.position_count),
        rms(t.deflection_square, t.cycles),
        t.phases_by_name(),
    )


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and value != value else value
