"""The command line's analysis half: replay, info, identify, diagnose; builds objects and calls them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from cablecomp.config import in_session, load_joint, session_of
from cablecomp.config_text import joint_text
from cablecomp.diagnosis.diagnose import Diagnosis, diagnose, report_json, write_diagnosis
from cablecomp.effects import load_effects
from cablecomp.mechanics.jit import is_compiled
from cablecomp.observer import Observer
from cablecomp.recording.atomic import atomic_directory
from cablecomp.recording.progress import progress_bar
from cablecomp.recording.reader import open_recording, read_all
from cablecomp.report.diagnosis_build import diagnosis_report
from cablecomp.report.info import bench_table, design_table
from cablecomp.report.replay_page import write_replay
from cablecomp.report.theory import write_theory_figures
from cablecomp.thesis.bench.evaluate import bench_recording, evaluate_bench
from cablecomp.thesis.design import design_sheet

console = Console()
Config = Annotated[Path, typer.Option("--config", help="joint configuration (TOML)")]


def register(app: typer.Typer) -> None:
    """Add this module's commands to the application."""
    for command in (replay, info, identify, diagnose_recordings):
        app.command("diagnose" if command is diagnose_recordings else command.__name__)(command)


def announce_compilation() -> None:
    """Say so before the first use of this very version compiles its kernels."""
    if not is_compiled():
        console.print("compiling the kernels, once for this version (under a minute) ...", style="dim")


def replay(
    recording: Annotated[Path, typer.Argument(help="recording (CSV, gzip CSV, Parquet, MCAP)")],
    config: Config,
    out: Annotated[Path, typer.Option(help="folder for prediction.csv, replay.json, report.html")] = Path(
        "replay"
    ),
    bounds: Annotated[
        bool, typer.Option("--bounds/--no-bounds", help="guaranteed bounds beside the prediction")
    ] = True,
    session: Annotated[
        str | None,
        typer.Option(help="whose own values hold; the [[session]] that names the recording if absent"),
    ] = None,
) -> None:
    """Stream a recording through the observer that the controller runs; compare with what was measured."""
    joint, source = load_joint(config), open_recording(recording)
    found = session_of(joint, recording, session)
    joint = in_session(joint, found)
    announce_compilation()
    with progress_bar(f"replay {recording.name}") as told:
        summary = write_replay(
            source, joint, Observer(joint, bounds=bounds), out, config.read_text(encoding="utf-8"), told
        )
    table = Table(show_header=False, box=None)
    if summary.rmse_rad is not None:
        table.add_row("prediction error, RMS", f"{1e3 * summary.rmse_rad:.5g} mrad")
        table.add_row(
            "best straight line, RMS", f"{1e3 * (summary.baseline_linear_rmse_rad or 0.0):.5g} mrad"
        )
    table.add_row("samples", f"{summary.samples:,}")
    if joint.sessions:
        table.add_row("session", "none matches: the joint's own values" if found is None else found.name)
    console.print(table)
    console.print(f"report: {out / 'report.html'}")


def info(
    config: Config,
    load: Annotated[
        float | None, typer.Option(help="worst load on the joint, N m (the configuration's limit if absent)")
    ] = None,
    figures: Annotated[Path | None, typer.Option(help="folder for the theory figures of this joint")] = None,
) -> None:
    """The design sheet of a joint: stiffness, hysteresis, pretension, wrap, efficiency."""
    joint = load_joint(config)
    console.print(design_table(design_sheet(joint, load)))
    if figures is not None:
        console.print(f"figures: {write_theory_figures(joint, figures, load)}")


def identify(
    recording: Annotated[Path, typer.Argument(help="bench recording: load ramps with holds")],
    config: Config,
    sensor_stiffness: Annotated[
        float, typer.Option(help="stiffness of torque sensor and coupling, N m/rad (App. A.3)")
    ] = inf,
    narrow: Annotated[
        bool, typer.Option("--narrow", help="tensions of nearly tangent pulleys (App. C)")
    ] = False,
) -> None:
    """True and acting coefficient of friction from a bench recording, the thesis's way."""
    joint = load_joint(config)
    bench = bench_recording(read_all(recording).columns, joint)
    console.print(
        bench_table(
            evaluate_bench(bench, joint, sensor_stiffness_Nm_per_rad=sensor_stiffness, narrow_tensions=narrow)
        )
    )


def diagnose_recordings(
    recordings: Annotated[list[Path], typer.Argument(help="one or more recordings of one joint")],
    config: Config,
    out: Annotated[
        Path, typer.Option(help="folder for diagnosis.json, report.html, joint.augmented.toml")
    ] = Path("diagnosis"),
    seed: Annotated[int, typer.Option(help="of surrogates and resampling")] = 0,
    effects: Annotated[
        list[Path] | None, typer.Option(help="Python file that registers an effect of your own")
    ] = None,
) -> None:
    """Find the physics that the configuration lacks: locate, name, model, show on held-out data."""
    for path in effects or ():
        load_effects(path)
    joint = load_joint(config)
    data = {str(path): read_all(path).columns for path in recordings}
    announce_compilation()
    with hypothesis_bar() as told:
        found = diagnose(joint, data, told, seed)
    with atomic_directory(out) as folder:
        write_diagnosis(found, folder)
        (folder / "report.html").write_text(
            diagnosis_report(found, joint_text(found.config)), encoding="utf-8"
        )
    _show(found)
    console.print(f"report: {out / 'report.html'}")


@contextmanager
def hypothesis_bar() -> Iterator[Callable[[str, float], None]]:
    """Give a function to be told (what is being tried, share done); the bar goes when it is over."""
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading", total=1.0)
        yield lambda what, share: bar.update(task, description=what, completed=share)


def _show(found: Diagnosis) -> None:
    result = report_json(found)
    table = Table(show_header=False, box=None)
    table.add_row("verdict", result["verdict"])
    for m in result["missing_physics"]:
        values = ", ".join(
            f"{name} = {v['value']:.4g} ± {v['sd']:.2g}"
            for name, v in m["parameters"].items()
            if isinstance(v, dict) and v["sd"]
        )
        table.add_row("missing", f"{m['effect']} (confidence {m['confidence']:.2f}): {values}")
        table.add_row("", m["statement"])
    for tied in result["not_excluded"]:
        table.add_row("cannot be told apart", f"{', '.join(tied['effects'])}: {tied['why']}")
    if result["mismatch"]:
        first = result["mismatch"][0]
        table.add_row(
            "located in", f"{first['covariate']} (share {first['share']:.2f}, p = {first['p_value']:.3g})"
        )
    table.add_row("noise floor", f"{1e3 * result['noise_floor_rad']:.4g} mrad")
    table.add_row("held-out RMSE, calibrated", f"{1e3 * result['baseline']['heldout_rmse_rad']:.4g} mrad")
    table.add_row("held-out RMSE, augmented", f"{1e3 * result['augmented']['heldout_rmse_rad']:.4g} mrad")
    if result["verdict"] == "unexplained":
        table.add_row("unexplained", str(result["remainder"]["description"]))
    if result["next_experiment"]:
        table.add_row("next experiment", result["next_experiment"]["why"])
    console.print(table)
