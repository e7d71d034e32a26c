"""`cablecomp run`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from cablecomp.cli.folders import out_option
from cablecomp.cli.live import LiveRun
from cablecomp.cli.shared import (
    DEMO_LINK,
    BoundsOption,
    Config,
    Control,
    EffectsOption,
    JsonOption,
    announce_compilation,
    console,
    control_of,
    echo_json,
    errors,
    read_joint,
)
from cablecomp.config import JointConfig, in_session, session_of
from cablecomp.config_text import joint_text
from cablecomp.control.options import ControlConfig, ControlMode
from cablecomp.control.protocol import Protocol, load_protocol
from cablecomp.control.standard import calibration_protocol, force_protocol, reaching_protocol
from cablecomp.errors import DeviceError, InputError
from cablecomp.links.load import load_link
from cablecomp.links.schema import LinkConfig, SerialBus
from cablecomp.report.page import CSS
from cablecomp.report.run_page import write_run_page
from cablecomp.runtime.clock import Tick
from cablecomp.runtime.loop import Loop
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import RunOptions, Watch, run_joint
from cablecomp.runtime.setup import matched, observed, same_joint, stated_gains
from cablecomp.runtime.simulated import Simulation, SimulationWish
from cablecomp.runtime.view import LiveView
from cablecomp.runtime.ways_out import WaysOut

CALIBRATE = Path("calibrate")
"""The protocol of this name comes with the project."""
SIMULATED = ("virtual", "udp_multicast", "slcan")
"""Interfaces whose other end a simulated joint can take without hardware."""


LinkFile = Annotated[
    Path | None,
    typer.Option(
        "--link",
        help="link file (TOML) or the name of an example; with --sim a bus inside of this process stands "
        "for a CAN adapter",
    ),
]
ProtocolFile = Annotated[
    Path | None,
    typer.Option(
        "--protocol",
        help="what is asked for over time (TOML), or `calibrate`: about 60 s that `cablecomp calibrate` needs",
    ),
]
Fast = Annotated[bool, typer.Option("--fast", help="simulated time, as fast as it goes")]
Sim = Annotated[bool, typer.Option("--sim", help="start the simulated joint as well; nothing else is needed")]
Compare = Annotated[
    bool, typer.Option("--compare", help="motor-side control, linear stiffness and observer side by side")
]
Faults = Annotated[
    list[str] | None, typer.Option("--fault", help="fault of the simulated joint, such as drop:p=0.1")
]
Live = Annotated[
    bool, typer.Option("--live", help="watch the residual: raise mismatches, keep the data around them")
]
View = Annotated[
    bool,
    typer.Option("--view", help="a page to look on, on this machine; Foxglove too where it is installed"),
]
PlotJuggler = Annotated[
    bool, typer.Option("--plotjuggler", help="frames to PlotJuggler's UDP server, as JSON")
]
InSession = Annotated[
    str | None, typer.Option("--session", help="[[session]] whose own values and laws hold")
]
WithoutTimeout = Annotated[
    bool,
    typer.Option(
        "--without-drive-timeout",
        help="run though a drive would stay enabled if this process were killed",
    ),
]


def run(
    config: Config,
    link: LinkFile = None,
    sim: Sim = False,
    control: Control = None,
    protocol: ProtocolFile = None,
    mode: Annotated[ControlMode | None, typer.Option(help="what is controlled")] = None,
    duration: Annotated[float | None, typer.Option(help="end after this many seconds", min=0.0)] = None,
    out: Annotated[Path, out_option("folder for recording, predictions, report")] = Path("run"),
    fast: Fast = False,
    bounds: BoundsOption = True,
    comparison: Compare = False,
    resume: Annotated[Path | None, typer.Option(help="observer snapshot to go on from")] = None,
    fault: Faults = None,
    seed: Annotated[int, typer.Option(min=0, help="of simulated noise, true parameters and motions")] = 1,
    nominal: Annotated[bool, typer.Option("--nominal", help="simulated joint exactly as configured")] = False,
    live: Live = False,
    view: View = False,
    plotjuggler: PlotJuggler = False,
    session: InSession = None,
    effects: EffectsOption = None,
    as_json: JsonOption = False,
    without_drive_timeout: WithoutTimeout = False,
) -> None:
    """Control a joint over a link, real or simulated; ends with a timing report and a recording that
    `replay` accepts.
    """
    if comparison:
        others = {
            "--protocol": protocol, "--mode": mode, "--resume": resume, "--fault": fault, "--nominal": nominal,
            "--live": live, "--view": view, "--plotjuggler": plotjuggler, "--no-bounds": not bounds,
            "--without-drive-timeout": without_drive_timeout,
        }  # fmt: skip
        _goes_with_compare([name for name, given in others.items() if given], duration)
    joint = read_joint(config, effects)
    joint = in_session(joint, session_of(joint, None, session))
    bus, wanted = _bus_and_control(link, control, joint, mode, sim=sim)
    if comparison:
        from cablecomp.cli.demo import compare_controllers  # brings the plant

        length = 30.0 if duration is None else duration
        compare_controllers(config, joint, bus, wanted, out, seed, length, as_json)
        return
    asked = _asked(protocol, joint, wanted.compensator.mode, seed, duration)
    if live:
        _check_watched(joint, wanted, asked)
    wish = SimulationWish(bus, wanted, 1, not nominal, seed, tuple(fault or ()))
    options = RunOptions(
        duration, fast, out, bounds, resume=resume, without_drive_timeout=without_drive_timeout
    )
    said = errors() if as_json else console
    announce_compilation(joint, bounds)
    with WaysOut() as ways_out:
        with ExitStack() as last:
            simulation = _simulation(config, wish) if sim else None
            if simulation is not None:
                last.callback(simulation.close)
                if asked.mode == "force":
                    simulation.set_wall(1, 0.0)
            shown = last.enter_context(LiveView(said))
            failures: list[str] = []
            watch = last.enter_context(_onlookers(joint, out, shown.watch, view, plotjuggler, said, failures))
            beside = LiveRun(joint, bus.rate_Hz, out, watch, stepped=fast) if live else None
            watch = watch if beside is None else beside.watch
            with _named(resume):
                report = run_joint(joint, bus, wanted, asked, options, simulation, watch, ways_out)
        report = replace(report, failures=(*report.failures, *failures))
        _finish(report, joint, config, beside, as_json)


def _goes_with_compare(others: Sequence[str], duration: float | None) -> None:
    """Raise InputError for options that a comparison would ignore, and a duration too short for a motion."""
    if others:
        raise InputError(
            f"run: {', '.join(others)} cannot go with --compare, which asks for its own motions of simulated joints; "
            "leave it out, or run without --compare"
        )
    if duration is not None and duration <= 3.0:
        raise InputError(
            f"run: --duration {duration:g} leaves --compare no motion, as its last 3 s lead back; give more than 3"
        )


@contextmanager
def _named(snapshot: Path | None) -> Iterator[None]:
    """What is wrong with a snapshot is said of its file."""
    try:
        yield
    except InputError as error:
        if snapshot is None or not str(error).startswith("snapshot: "):
            raise
        raise InputError(f"{snapshot}: {error}") from None


def _bus_and_control(
    link: Path | None, control: Path | None, joint: JointConfig, mode: ControlMode | None, *, sim: bool
) -> tuple[LinkConfig, ControlConfig]:
    """The bus, as it is or rehearsed, and the controller for it; raises InputError where one does not fit the other."""
    bus = load_link(DEMO_LINK if link is None else link)
    bus = _rehearsed(bus, errors()) if sim else bus
    wanted = control_of(control, joint, None if sim else stated_gains(bus))
    if mode is not None:
        chosen = wanted.compensator.model_copy(update={"mode": mode})
        wanted = wanted.model_copy(update={"compensator": chosen})
    bus, wanted = matched(bus, wanted, own_link=not sim)
    if link is None and not sim:
        raise InputError("--link is missing; give a link file, or --sim for a simulated joint")
    return (same_joint(bus, [joint.name]) if link is None else bus), wanted


def _rehearsed(link: LinkConfig, said: Console) -> LinkConfig:
    """The link as a simulated joint can sit on it: a bus inside of this process stands for a CAN adapter."""
    bus = link.bus
    if isinstance(bus, SerialBus) or bus.interface in SIMULATED:
        return link
    said.print(f"--sim: a bus inside of this process stands for {bus.interface} {bus.channel}")
    return link.redirect("virtual", f"{link.name}, rehearsed")


def _asked(
    protocol: Path | None, joint: JointConfig, mode: ControlMode, seed: int, duration: float | None
) -> Protocol:
    """What is asked for over time: the file's, the one for calibrations, else motions at random for the mode."""
    if protocol == CALIBRATE and not CALIBRATE.is_file():
        return calibration_protocol(joint)
    if protocol is not None:
        return load_protocol(protocol)
    span = 30.0 if duration is None else max(duration, 30.0)
    random = force_protocol if mode is ControlMode.FORCE else reaching_protocol
    return random(joint, seed, span)


@contextmanager
def _onlookers(
    joint: JointConfig,
    out: Path,
    shown: Watch,
    view: bool,
    plotjuggler: bool,
    said: Console,
    failures: list[str],
) -> Iterator[Watch]:
    """What is called once a tick: the terminal's view, and the instrument where someone looks on; `failures` gets why
    what was written for them is incomplete."""
    if not (view or plotjuggler):
        yield shown
        return
    from cablecomp.monitor.viewer import Onlookers, watched  # its process costs seconds

    out.mkdir(parents=True, exist_ok=True)
    free = (p for k in count(1) if not (p := out / f"live-{k}.mcap").exists())
    who = Onlookers(
        view, view and _installed("foxglove"), plotjuggler, next(free) if _installed("mcap") else None
    )
    with watched(joint, who, CSS) as viewer:
        instrument = viewer.instrument
        for line in viewer.words:
            said.print(line, soft_wrap=True)

        def both(loop: Loop, tick: Tick) -> None:
            shown(loop, tick)
            instrument.watch(loop, tick)

        yield both
    said.print(f"onlookers: {instrument.sent} frames sent, {instrument.dropped} dropped")
    failures += viewer.failures


def _installed(package: str) -> bool:
    return find_spec(package) is not None


def _finish(
    report: RunReport, joint: JointConfig, config: Path, beside: LiveRun | None, as_json: bool
) -> None:
    """Leave the page, say what came of it; a terminal that is gone by now changes nothing."""
    if beside is not None:
        report = beside.finish(report)
    failures = list(report.failures)
    try:
        page = f"report: {write_run_page(report, joint_text(joint))}"
    except OSError as error:
        page = "no report.html was written"
        failures.append(f"{report.folder}/report.html: cannot be written ({error.strerror}); free some space")
    except InputError as error:  # of a recording that holds no row
        page = "no report.html was written"
        failures.append(str(error))
    with suppress(OSError):
        if as_json:
            echo_json(report.as_dict())
        else:
            _show(report)
        for path in () if beside is None or as_json else beside.kept:
            console.print(
                f"mismatch: see {path.with_suffix('.json')}; cablecomp diagnose {path} --config {config}"
            )
        if not as_json:
            console.print(page)
    if failures:
        raise DeviceError("; ".join(failures))
    if not report.ended_well:
        raise typer.Exit(3)


def _simulation(path: Path, wish: SimulationWish) -> Simulation:
    from cablecomp.cli.simulation import start_simulation  # compiled code: only where a plant is wanted

    return start_simulation(path, wish)


def _check_watched(joint: JointConfig, wanted: ControlConfig, asked: Protocol) -> None:
    """Raise InputError where --live would watch nothing: the joint encoder tells the load, and leaves no residual."""
    mode = ControlMode.FORCE if asked.mode == "force" else wanted.compensator.mode
    options = wanted.compensator.model_copy(update={"mode": mode})
    if observed(joint, options).observer.load == "both_encoders":
        raise InputError(
            "--live: the load is found from both encoders, which leaves no residual to watch; leave it out, or let the "
            "load come from elsewhere (torque_from, observer.load)"
        )


def _show(report: RunReport) -> None:
    table = Table(title=f"Run ended: {report.stop_reason}", show_header=False, box=None)
    for joint in report.joints:
        if joint.cycles == 0:
            table.add_row(joint.name, "never under control")
            continue
        true = ""
        if joint.true_position_rad == joint.true_position_rad:
            true = f", true {1e3 * joint.true_position_rad:.4f}"
        forced = joint.torque_Nm == joint.torque_Nm
        if not forced:
            table.add_row(f"{joint.name}: position error, RMS", f"{_mrad(joint.position_rad)}{true}")
        table.add_row(f"{joint.name}: deflection, RMS", _mrad(joint.deflection_rad))
        if joint.residual_rad == joint.residual_rad:
            table.add_row(f"{joint.name}: prediction residual, RMS", _mrad(joint.residual_rad))
        if forced:
            table.add_row(
                f"{joint.name}: torque error, RMS",
                f"{joint.torque_Nm:.4f} Nm (true {joint.true_torque_Nm:.4f})",
            )
    for name, words in report.timing.rows():
        table.add_row(name, words)
    console.print(table)


def _mrad(angle_rad: float) -> str:
    return "not measured" if angle_rad != angle_rad else f"{1e3 * angle_rad:.4f} mrad"
