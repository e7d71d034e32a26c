"""`cablecomp run`: one configuration, one link, real or simulated; a folder with everything that happened."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

from cablecomp.config import JointConfig
from cablecomp.config_text import write_joint
from cablecomp.control.compensator import Gains, given_gains
from cablecomp.control.options import ControlConfig, ControlMode
from cablecomp.control.protocol import Protocol
from cablecomp.durable import write_durably
from cablecomp.errors import InputError
from cablecomp.links.link import BusLink, Link
from cablecomp.links.records import Mode
from cablecomp.links.schema import LinkConfig
from cablecomp.runtime.clock import Clock, MonotonicClock, SteppedClock, Tick
from cablecomp.runtime.folder import SNAPSHOT, START, RunFolder
from cablecomp.runtime.joint_loop import JointSetup
from cablecomp.runtime.loop import Loop, LoopOptions, RunStage
from cablecomp.runtime.pace import Pace, check_pace
from cablecomp.runtime.priority import QUIET, Policy
from cablecomp.runtime.results import RunReport, TruthTally, result_of
from cablecomp.runtime.setup import (
    Contestant,
    check_drive_timeouts,
    joint_setup,
    references_of,
    resumed_at_s,
)
from cablecomp.runtime.simulated import Simulation
from cablecomp.runtime.timing import TimingReport
from cablecomp.runtime.ways_out import WaysOut


@dataclass(frozen=True)
class RunOptions:
    """How a run is done. `duration_s` None = the protocol's; `stepped`: simulated time, as fast as it
    goes; `out`: folder for recording, predictions, cycles, events, snapshot and `run.json` (None =
    nothing is written); `resume`: a snapshot to go on from, in its time and history;
    `without_drive_timeout`: run though a drive would stay enabled if this process were killed.
    """

    duration_s: float | None = None
    stepped: bool = False
    out: Path | None = None
    bounds: bool = False
    policy: Policy | None = None
    resume: Path | None = None
    without_drive_timeout: bool = False


Watch = Callable[[Loop, Tick], None]
"""Called once a tick after the commands went out, with the loop to look at."""


def run_joint(
    config: JointConfig,
    link: LinkConfig,
    control: ControlConfig,
    protocol: Protocol,
    options: RunOptions,
    simulation: Simulation | None = None,
    watch: Watch | None = None,
    ways_out: WaysOut | None = None,
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
        ways_out,
    )


def run_joints(
    contestants: Sequence[Contestant],
    link: LinkConfig,
    control: ControlConfig,
    protocol: Protocol,
    options: RunOptions,
    simulation: Simulation | None = None,
    watch: Watch | None = None,
    ways_out: WaysOut | None = None,
) -> RunReport:
    """Run joints side by side on one link under one protocol; returns how they did, leaves the files in
    `options.out`.

    On hardware the protocol's load is what the surroundings do; on a simulation it is applied there. In
    force mode the load is the reference. Signals that ask to end stop the joints first (`ways_out`: entered
    already by the caller). Raises InputError for what does not fit together, DeviceError if the other side
    does not answer.
    """
    _check(contestants, link, protocol, options, simulation)
    if simulation is not None and simulation.terminal is not None:
        link = link.at_terminal(simulation.terminal)
    first, period = contestants[0], 1.0 / link.rate_Hz
    mode = ControlMode.FORCE if protocol.mode == "force" else first.options.mode
    gains = _gains(first, mode, link, control)
    bus: Link = BusLink(link)
    references = references_of(protocol, mode is ControlMode.FORCE)
    setups = tuple(
        joint_setup(
            c, mode, bus, control, references, gains, period, bounds=options.bounds, resume=options.resume
        )
        for c in contestants
    )
    if not options.stepped:
        check_pace([_pace(setup, options) for setup in setups], period)
    truths = TruthTally([c.name for c in contestants])

    def after(tick: Tick, stage: RunStage) -> None:
        if simulation is not None:
            _simulate(loop, tick, simulation, protocol, mode, stage, truths)
        if watch is not None:
            watch(loop, tick)

    with ExitStack() as last:

        def prepare() -> None:
            if options.out is not None:
                last.callback(_prepare(options.out, setups, options.resume).close)

        ways = last.enter_context(WaysOut()) if ways_out is None else ways_out
        clock: Clock = SteppedClock() if options.stepped else MonotonicClock()
        wanted = _wanted(options, protocol, link, first.place, setups)
        loop = Loop(bus, setups, clock, period, wanted, options.out, after, prepare)
        last.enter_context(ways.asking(loop.ask_to_stop))
        return _reported(loop, loop.run(), truths, gains, options.out)


def _check(
    contestants: Sequence[Contestant],
    link: LinkConfig,
    protocol: Protocol,
    options: RunOptions,
    simulation: Simulation | None,
) -> None:
    """Raise InputError for what does not fit together."""
    if options.stepped and simulation is None:
        raise InputError("stepped time needs a simulated joint; leave out --fast, or add --sim")
    if simulation is None and not options.without_drive_timeout:
        check_drive_timeouts(link, [c.place for c in contestants])
    for c in contestants:
        protocol.check_within(c.config.limits, protocol.name)


def _gains(first: Contestant, mode: ControlMode, link: LinkConfig, control: ControlConfig) -> Gains:
    """The gains that the first joint's options state, else those designed for it; all joints run with them."""
    options = first.options.model_copy(update={"mode": mode})
    given = given_gains(options)
    if given is not None:
        return given
    from cablecomp.control.design import design_gains  # a slow import, and only what is not stated needs it

    return design_gains(first.config, link.rate_Hz, control.model_copy(update={"compensator": options}))


def _wanted(
    options: RunOptions, protocol: Protocol, link: LinkConfig, place: int, setups: Sequence[JointSetup]
) -> LoopOptions:
    """How long the run takes, from when on its clock counts, and how the process gets its time."""
    duration = protocol.duration_s if options.duration_s is None else options.duration_s
    policy = options.policy if options.policy is not None else (QUIET if options.stepped else Policy())
    begin = 0.0
    if options.resume is not None:
        begin = max(resumed_at_s(s) for s in setups) + 1.0 / link.rate_Hz
        if not isfinite(begin):
            raise InputError(
                f"{options.resume}: its observer has taken no sample, there is nothing to go on from; "
                "leave out --resume"
            )
    return LoopOptions(duration, mode=_drive_mode(link, place), policy=policy, begin_s=begin)


def _pace(setup: JointSetup, options: RunOptions) -> Pace:
    compensator = setup.compensator
    return Pace(setup.name, setup.config, compensator.options, compensator.gains, options.bounds)


def _reported(
    loop: Loop, timing: TimingReport, truths: TruthTally, gains: Gains, out: Path | None
) -> RunReport:
    """What came of the run, in `run.json` too; what cannot be written is said, and loses nothing of what is there."""
    found = RunReport(
        tuple(result_of(joint, truths) for joint in loop.joints),
        timing,
        loop.stop_reason,
        tuple(loop.events.last),
        gains,
        out,
        tuple(loop.failures),
    )
    if out is None:
        return found
    path = out / "run.json"
    try:
        write_durably(path, (json.dumps(found.as_dict(), indent=1) + "\n").encode())
    except OSError as error:
        failure = f"{path}: cannot be written ({error.strerror}); free some space"
        return replace(found, failures=(*found.failures, failure))
    return found


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
    stage: RunStage,
    truths: TruthTally,
) -> None:
    """One period of the simulation after each cycle's commands, in step with the loop whether that is
    paced or not.
    """
    since = loop.since_s
    load = protocol.reference(since).joint_torque_Nm if stage is RunStage.RUNNING else protocol.start_load_Nm
    for joint in loop.joints:
        if mode is not ControlMode.FORCE:
            simulation.set_load(joint.setup.place + 1, load)
    simulation.advance(1 + tick.skipped)
    if stage is not RunStage.RUNNING:
        return
    # the truth is one period on, where the reference of the next instant applies
    wanted = protocol.reference(since + loop.period_s)
    for joint in loop.joints:
        truth = simulation.truth(joint.setup.place + 1)
        torque = truth.joint_torque_Nm - wanted.joint_torque_Nm
        truths.add(joint.setup.name, truth.joint_position_rad - wanted.joint_position_rad, torque)


def _prepare(out: Path, setups: Sequence[JointSetup], resume: Path | None) -> RunFolder:
    try:
        start = None if resume is None else resume.read_bytes()
    except OSError as error:
        raise InputError(f"{resume}: cannot be read ({error.strerror}); give a snapshot file") from None
    opened = RunFolder(out, [setup.name for setup in setups])
    for setup, folder in zip(setups, opened.folders, strict=True):
        if start is not None:  # kept: replayed from there, the recording gives the same predictions
            write_durably(folder / START, start)
            write_durably(folder / SNAPSHOT, start)
        write_joint(folder / "joint.toml", setup.config, ("the configuration that this run used",))
    return opened
