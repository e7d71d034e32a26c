"""Command line: builds objects and calls them. Exit codes: 0 done, 2 bad input, 3 device (also: a run that had
to stop the joint), 4 our own fault.
"""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from cablecomp import cli_prove, cli_study
from cablecomp.cli_analysis import register
from cablecomp.cli_live import LiveRun
from cablecomp.config import JointConfig, load_joint
from cablecomp.config_text import joint_text
from cablecomp.control.design import design_loop
from cablecomp.control.motors import control_for
from cablecomp.control.options import ControlConfig, ControlMode, load_control
from cablecomp.control.protocol import load_protocol
from cablecomp.control.standard import calibration_protocol, force_protocol, reaching_protocol
from cablecomp.errors import CablecompError, DeviceError, InputError, InternalError
from cablecomp.identification.calibrate import calibrate
from cablecomp.links.schema import LinkConfig, load_link
from cablecomp.report.compare_page import HEAD, summary_rows, write_comparison
from cablecomp.report.design_page import design_page, design_tables
from cablecomp.report.run_page import write_run_page
from cablecomp.runtime.compare import Calibrated, Columns, CompareOptions, Comparison, compare
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.setup import matched, same_joint
from cablecomp.runtime.simulated import Simulation, SimulationWish
from cablecomp.runtime.view import LiveView

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
DEMO_JOINT, DEMO_LINK = CONFIGS / "joints/wrist-capstan.toml", CONFIGS / "links/wrist-virtual.toml"
DEMO_CONTROL = CONFIGS / "control/wrist-capstan.toml"

app = typer.Typer(
    help="Real-time hysteresis compensator for cable-driven joints.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
console = Console()
register(app)
cli_prove.register(app)
cli_study.register(app)

Config = Annotated[Path, typer.Option("--config", help="joint configuration (TOML)")]
Control = Annotated[
    Path | None, typer.Option("--control", help="control file (TOML); made up from the joint if absent")
]


@app.command()
def run(
    config: Config,
    link: Annotated[
        Path | None, typer.Option(help="link file (TOML); with --sim a bus inside of the process")
    ] = None,
    sim: Annotated[
        bool, typer.Option("--sim", help="start the simulated joint as well; nothing else is needed")
    ] = False,
    control: Control = None,
    protocol: Annotated[Path | None, typer.Option(help="what is asked for over time (TOML)")] = None,
    mode: Annotated[ControlMode | None, typer.Option(help="what is controlled")] = None,
    duration: Annotated[float | None, typer.Option(help="end after this many seconds", min=0.0)] = None,
    out: Annotated[Path, typer.Option(help="folder for recording, predictions, report")] = Path("run"),
    fast: Annotated[bool, typer.Option("--fast", help="simulated time, as fast as it goes")] = False,
    bounds: Annotated[
        bool, typer.Option("--bounds/--no-bounds", help="guaranteed bounds beside the prediction")
    ] = True,
    calibration: Annotated[
        bool, typer.Option("--calibration", help="the protocol to calibrate from")
    ] = False,
    comparison: Annotated[
        bool, typer.Option("--compare", help="motor-side control, linear stiffness and observer side by side")
    ] = False,
    resume: Annotated[Path | None, typer.Option(help="observer snapshot to go on from")] = None,
    fault: Annotated[
        list[str] | None, typer.Option(help="fault of the simulated joint, such as drop:p=0.1")
    ] = None,
    seed: Annotated[int, typer.Option(help="of simulated noise, true parameters and motions")] = 1,
    nominal: Annotated[bool, typer.Option("--nominal", help="simulated joint exactly as configured")] = False,
    live: Annotated[
        bool, typer.Option("--live", help="watch the residual: raise mismatches, keep the data around them")
    ] = False,
) -> None:
    """Control a joint over a link, real or simulated; ends with a timing report and a recording that
    `replay` accepts.
    """
    joint = load_joint(config)
    wanted = _control(control, joint)
    bus, wanted = matched(load_link(DEMO_LINK if link is None else link), wanted, own_link=not sim)
    if link is None and not sim:
        raise InputError("--link is missing; give a link file, or --sim for a simulated joint")
    if link is None:
        bus = same_joint(bus, [joint.name])
    if comparison:
        _compare(config, joint, bus, wanted, out, seed, 30.0 if duration is None else duration)
        return
    if mode is not None:
        wanted = wanted.model_copy(
            update={"compensator": wanted.compensator.model_copy(update={"mode": mode})}
        )
    force = wanted.compensator.mode is ControlMode.FORCE
    if protocol is not None:
        asked = load_protocol(protocol)
    elif calibration:
        asked = calibration_protocol(joint)
    else:
        span = 30.0 if duration is None else max(duration, 30.0)
        asked = force_protocol(joint, seed, span) if force else reaching_protocol(joint, seed, span)
    wish = SimulationWish(bus, wanted, 1, not nominal, seed, tuple(fault or ()))
    simulation = _simulation(config, wish) if sim else None
    if simulation is not None and asked.mode == "force":
        simulation.set_wall(1, 0.0)
    options = RunOptions(duration, fast, out, bounds, resume=resume)
    try:
        with LiveView(console) as view:
            signal.signal(signal.SIGINT, lambda number, frame: view.press())
            beside = LiveRun(joint, bus.rate_Hz, out, view.watch, stepped=fast) if live else None
            watch = view.watch if beside is None else beside.watch
            report = run_joint(joint, bus, wanted, asked, options, simulation, watch)
    finally:
        if simulation is not None:
            simulation.close()
    if beside is not None:
        report = beside.finish(report)
    _show(report)
    for path in () if beside is None else beside.kept:
        console.print(
            f"mismatch: see {path.with_suffix('.json')}; cablecomp diagnose {path} --config {config}"
        )
    page = write_run_page(report, joint_text(joint))
    console.print(f"report: {page}")
    if not report.ended_well:
        raise typer.Exit(3)


@app.command()
def design(
    config: Config,
    rate: Annotated[float, typer.Option(help="loop rate, Hz")] = 1000.0,
    control: Control = None,
    out: Annotated[Path | None, typer.Option(help="folder for design.html")] = None,
) -> None:
    """Design gains from the drive's stiffness range: margins, hysteresis as a describing function, plots."""
    joint = load_joint(config)
    wanted = _control(control, joint)
    free = {"load_filter_Hz": None, "load_lead_s": None, "joint_feedback_per_s": None}
    wanted = wanted.model_copy(update={"compensator": wanted.compensator.model_copy(update=free)})
    found = design_loop(joint, rate, wanted)
    console.print(design_tables(found))
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        (out / "design.html").write_text(design_page(found), encoding="utf-8")
        console.print(f"plots: {out / 'design.html'}")


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="folder for everything that the demonstration leaves")] = Path(
        "demo"
    ),
    seed: Annotated[int, typer.Option(help="of true parameters, noise and motions")] = 1,
) -> None:
    """A compensated joint against uncompensated ones, on a simulated bus; ends with where the report lies."""
    if not DEMO_JOINT.exists():
        raise InputError(f"{DEMO_JOINT}: is missing; run the demonstration from a clone of the project")
    joint, wanted = load_joint(DEMO_JOINT), load_control(DEMO_CONTROL)
    bus, wanted = matched(load_link(DEMO_LINK), wanted, own_link=False)
    _compare(DEMO_JOINT, joint, bus, wanted, out, seed, 14.0)


def _compare(
    path: Path,
    joint: JointConfig,
    bus: LinkConfig,
    wanted: ControlConfig,
    out: Path,
    seed: int,
    duration_s: float,
) -> None:
    with LiveView(console) as view:
        signal.signal(signal.SIGINT, lambda number, frame: view.press())
        found = compare(
            joint,
            bus,
            wanted,
            lambda wish: _simulation(path, wish),
            _calibrated,
            CompareOptions(out, seed, duration_s, min(10.0, duration_s)),
            time.perf_counter,
            view.say,
            view.watch,
        )
    page = write_comparison(found, out, joint_text(found.calibrated.config))
    _summary(found)
    console.print(f"report: {page}")


def _calibrated(config: JointConfig, columns: Columns) -> Calibrated:
    found = calibrate(config, [columns])
    rows = tuple((v.name, f"{v.value:.5g} ± {v.sd:.2g} (nominal {v.nominal:.5g})") for v in found.values)
    return Calibrated(found.config, rows, found.warnings)


def _control(path: Path | None, joint: JointConfig) -> ControlConfig:
    return control_for(joint) if path is None else load_control(path)


def _simulation(path: Path, wish: SimulationWish) -> Simulation:
    from cablecomp.cli_simulation import start_simulation  # compiled code: only where a plant is wanted

    return start_simulation(path, wish)


def _show(report: RunReport) -> None:
    table = Table(title=f"Run ended: {report.stop_reason}", show_header=False, box=None)
    for joint in report.joints:
        if joint.cycles == 0:
            table.add_row(joint.name, "never under control")
            continue
        true = (
            ""
            if joint.true_position_rad != joint.true_position_rad
            else f", true {1e3 * joint.true_position_rad:.4f}"
        )
        table.add_row(f"{joint.name}: position error, RMS", f"{1e3 * joint.position_rad:.4f} mrad{true}")
        table.add_row(f"{joint.name}: deflection, RMS", f"{1e3 * joint.deflection_rad:.4f} mrad")
        table.add_row(f"{joint.name}: prediction residual, RMS", f"{1e3 * joint.residual_rad:.4f} mrad")
        if joint.torque_Nm == joint.torque_Nm:
            table.add_row(
                f"{joint.name}: torque error, RMS",
                f"{joint.torque_Nm:.4f} Nm (true {joint.true_torque_Nm:.4f})",
            )
    for name, words in report.timing.rows():
        table.add_row(name, words)
    console.print(table)


def _summary(found: Comparison) -> None:
    table = Table(title="Joint-side error under unseen motions with load changes")
    for name in HEAD:
        table.add_column(name, justify="left" if name == "controller" else "right")
    for row in summary_rows(found):
        table.add_row(*row)
    console.print(table)
    joint = found.force.joints[0]
    console.print(
        f"force without torque sensor: RMS error {joint.true_torque_Nm:.4f} Nm, "
        f"{100 * found.force_share:.2f} % of range"
    )
    for name, words in found.open_loop.timing.rows():
        console.print(f"{name}: {words}", style="dim")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point: runs a command, turns errors into one line on stderr and an exit code."""
    try:
        code = app(args=list(sys.argv[1:] if arguments is None else arguments), standalone_mode=False)
        return code if isinstance(code, int) else 0
    except InputError as error:
        return _fail(str(error), 2)
    except DeviceError as error:
        return _fail(str(error), 3)
    except InternalError as error:
        return _fail(f"{error} (a fault of this program: please report it)", 4)
    except CablecompError as error:
        return _fail(str(error), 4)
    except KeyboardInterrupt:
        return _fail("stopped by the user", 130)
    except Exception as error:
        shown = getattr(error, "format_message", None)
        if shown is None:  # neither ours nor the command line's: a bug, whose traceback is worth having
            raise
        return _fail(f"{shown()}; see cablecomp --help", 2)


def _fail(text: str, code: int) -> int:
    print(f"cablecomp: {' '.join(text.split())}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
