"""What `replay` and `diagnose` do when they are given `--workers` or `--scheduler`: a fleet, each joint and
night by itself."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Final

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn, TimeRemainingColumn

from cablecomp.cli.shared import announce_compilation, console, echo_json, plain_counts, warn
from cablecomp.cli.sources import Sources
from cablecomp.cluster import Workers
from cablecomp.counting import counted
from cablecomp.errors import InputError
from cablecomp.fleet.fleet import Work, run_fleet
from cablecomp.fleet.places import nights, strays
from cablecomp.recording.atomic import atomic_file
from cablecomp.report.fleet_page import failures, fleet_page, fleet_table

WorkersOption = Annotated[
    int | None,
    typer.Option(
        "--workers",
        min=1,
        help="a fleet: folders hold JOINT/NIGHT, each a row of its own; this many processes",
    ),
]
SchedulerOption = Annotated[
    str | None, typer.Option("--scheduler", help="a fleet, worked on by the Dask cluster at this address")
]
_MOST: Final = 6
"""Failed nights that the terminal names."""


def asked_for(workers: int | None, scheduler: str | None) -> Workers | None:
    """Where a fleet is worked on; None where no fleet is meant. Raises InputError if both are given."""
    if workers is not None and scheduler is not None:
        raise InputError("--workers and --scheduler say two places to work: give one of them")
    return None if workers is None and scheduler is None else Workers(workers or 0, scheduler)


def refuse_options(reading: Sources, given: Mapping[str, bool]) -> None:
    """Raise InputError if an option was given that a fleet has no use for; `given`: those of the command, by name."""
    mapped = reading.mapping is not None or reading.auto
    options = {**given, "--map": mapped, "--link, --dbc": reading.decode is not None}
    found = [name for name, is_given in options.items() if is_given]
    if found:
        raise InputError(
            f"{', '.join(found)}: of a fleet every night is taken by itself, as its joint's configuration and the "
            "mapping beside it (`cablecomp inspect LOG --save`) say; leave out what is named here"
        )


def work_fleet(
    work: Work, folders: Sequence[Path], config: Path | None, out: Path, workers: Workers, as_json: bool
) -> None:
    """Work through a fleet, show and write what became of it."""
    places = nights(folders, config, out)
    warn(strays(folders))
    announce_compilation()
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    errors = Console(stderr=True, markup=False, highlight=False)
    plain = plain_counts(errors)
    with Progress(*columns, console=errors, transient=True, disable=not errors.is_terminal) as bar:
        task = bar.add_task(work, total=len(places))

        def progress(done: int, of: int) -> None:
            bar.update(task, completed=done, total=of)
            if not errors.is_terminal:
                plain(f"{work}: nights", done, of)

        found = run_fleet(work, places, out, workers, progress)
    with atomic_file(out / "fleet.html") as path:
        path.write_text(fleet_page(found, " ".join(["cablecomp", *sys.argv[1:]])), encoding="utf-8")
    if as_json:
        echo_json({**asdict(found), "report": out / "fleet.html"})
    else:
        console.print(fleet_table(found))
        failed = failures(found)
        for line in failed[:_MOST]:
            console.print(f"failed: {line}", soft_wrap=True)
        if len(failed) > _MOST:
            console.print(f"failed: {len(failed) - _MOST} more, which the report names")
        if found.reused:
            console.print(f"there already: {counted(found.reused, 'night')}")
        console.print(f"report: {out / 'fleet.html'}", soft_wrap=True)
    if all(row["failed"] for row in found.rows):
        raise InputError(f"every night failed; the first: {found.rows[0]['failed']}")
