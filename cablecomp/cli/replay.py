"""`cablecomp replay`."""

from __future__ import annotations

import dataclasses
from contextlib import suppress
from pathlib import Path
from threading import Event
from typing import Annotated

import typer
from rich.table import Table

from cablecomp.cli.beliefs import believe_streamed
from cablecomp.cli.fleet import SchedulerOption, WorkersOption, asked_for, refuse_options, work_fleet
from cablecomp.cli.folders import out_option
from cablecomp.cli.shared import (
    BoundsOption,
    EffectsOption,
    FleetConfig,
    JsonOption,
    announce_compilation,
    console,
    needed_config,
    read_joint,
    warn,
)
from cablecomp.cli.sources import Reading, reads_recordings
from cablecomp.config import JointConfig
from cablecomp.estimation.standing import as_it_stood
from cablecomp.monitor.played import played
from cablecomp.monitor.server import PageServer
from cablecomp.observer import Observer
from cablecomp.recording.progress import progress_bar
from cablecomp.recording.reader import Recording
from cablecomp.recording.replay import comparable, required_channels
from cablecomp.recording.replay_summary import ReplaySummary
from cablecomp.report.page import CSS
from cablecomp.report.replay_page import write_replay


@reads_recordings
def replay(
    *,
    recording: Annotated[
        Path, typer.Argument(help="recording (CSV, Parquet, npz, mat, MCAP, ROS bag, CAN log)")
    ],
    config: FleetConfig = None,
    out: Annotated[Path, out_option("folder for prediction.csv, replay.json, report.html")] = Path("replay"),
    bounds: BoundsOption = True,
    session: Annotated[
        str | None,
        typer.Option(help="whose own values hold; the [[session]] that names the recording if absent"),
    ] = None,
    effects: EffectsOption = None,
    as_json: JsonOption = False,
    reading: Reading,
    view: Annotated[
        bool, typer.Option("--view", help="afterwards a page on this machine that plays the recording")
    ] = False,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
) -> None:
    """Stream a recording through the observer that the controller runs; compare with what was measured.

    With --workers or --scheduler RECORDING is a folder of a fleet, JOINT/NIGHT: one row for each, and which
    joints change.
    """
    fleet = asked_for(workers, scheduler)
    if fleet is not None:
        refuse_options(
            reading(),
            {
                "--session": session is not None,
                "--effects": effects is not None,
                "--view": view,
                "--no-bounds": not bounds,
            },
        )
        work_fleet("replay", [recording], config, out, fleet, as_json)
        return
    config = needed_config(config)
    joint = read_joint(config, effects)
    source = comparable(reading(joint).open(recording), joint)
    joint, stood, said = as_it_stood(joint, recording, source.head, session)
    warn(said)
    announce_compilation(joint, bounds)
    source.require(required_channels(joint), f"with [observer] load = {joint.observer.load!r}")
    source = dataclasses.replace(source, notes=(*source.notes, *said, *believe_streamed(joint, source)))
    with progress_bar(f"replay {recording.name}") as progress:
        summary = write_replay(
            source, joint, Observer(joint, bounds=bounds), out, config.read_text(encoding="utf-8"), progress
        )
    if as_json:
        typer.echo(summary.to_json(), nl=False)
    else:
        _show(summary, joint, stood)
        for note in summary.notes:
            if note not in said:
                console.print(f"note: {note}")
        console.print(f"report: {out / 'report.html'}")
    if view:
        _play(source, joint, summary.duration_s, bounds)


def _show(summary: ReplaySummary, joint: JointConfig, stood: str | None) -> None:
    """What came of it, on the terminal."""
    table = Table(show_header=False, box=None)
    if summary.rmse_rad is not None:
        table.add_row("prediction error, RMS", f"{1e3 * summary.rmse_rad:.5g} mrad")
    if summary.baseline_linear_rmse_rad is not None:
        table.add_row("best straight line, RMS", f"{1e3 * summary.baseline_linear_rmse_rad:.5g} mrad")
    table.add_row("samples", f"{summary.samples:,}")
    if joint.sessions:
        table.add_row("session", stood or "none matches: the joint's own values")
    console.print(table)


def _play(source: Recording, joint: JointConfig, duration_s: float, bounds: bool) -> None:
    """Serve the page until the user has seen enough."""
    server = PageServer(f"{source.path.name}, {joint.name}", CSS)
    try:
        typer.echo(f"on view: {server.address} (Ctrl-C ends it)", err=True)
        for frame in played(source, joint, duration_s, bounds):
            server.take(frame)
        server.finish()
        with suppress(KeyboardInterrupt):
            Event().wait()
    finally:
        server.close()
