"""`cablecomp inspect`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.shared import JsonOption, console, errors
from cablecomp.cli.sources import RatioOption, Reading, Sources, reads_recordings, unit_error
from cablecomp.config import load_joint
from cablecomp.errors import InputError, path_text
from cablecomp.recording.inspection import Inspection, inspect
from cablecomp.recording.mapping import (
    FOLDER_MAP,
    ColumnMap,
    find_mapping,
    foreign_column,
    load_mapping,
    save_mapping,
)
from cablecomp.recording.raw_columns import raw_columns
from cablecomp.recording.reader import read_all
from cablecomp.recording.suggest import as_mapping, suggest, unknown_units
from cablecomp.recording.table import RemarkLog
from cablecomp.report.inspection import Looked, inspection_json, show


@reads_recordings
def inspect_recording(
    *,
    recording: Annotated[Path, typer.Argument(help="recording of any accepted kind")],
    config: RatioOption = None,
    reading: Reading,
    save: Annotated[
        bool,
        typer.Option("--save", help=f"keep the mapping for this folder ({FOLDER_MAP}), for every command"),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """What a recording holds: columns and what they may mean, rate, gaps, stuck or clipped sensors, noise."""
    given = reading()
    given.check(recording)
    raw = raw_columns(recording, given.decode)
    known = given.mapping
    place, saved = recording.parent / FOLDER_MAP, find_mapping(recording)
    names = (*raw.columns, *raw.left_out)
    if save and place.is_file():
        _refuse_another_s(place, recording, names)
    if known is None and saved is not None:
        found_there = load_mapping(saved)
        known = found_there if foreign_column(found_there, names) is None else None
    joint = None if config is None else load_joint(config)
    found = suggest(raw.columns, None if joint is None else joint.drive.ratio, raw.units)
    needed, left_out = unknown_units(found, known)
    mapping = as_mapping(found, known)
    seen, notes, why = (None, (), "; ".join(needed)) if needed else _looked_at(recording, mapping, given)
    looked = Looked(recording, raw, found, mapping, seen, (*notes, *left_out), why, joint)
    save = save and not needed
    if save:  # before it is shown: a pager may be left early
        save_mapping(
            place,
            mapping,
            (f"what the columns of {path_text(recording.name)} mean; check it before you trust it",),
        )
    if as_json:
        typer.echo(json.dumps(inspection_json(looked), indent=2))
    else:
        show(looked, console)
    if save:
        (errors() if as_json else console).print(f"saved: {place}", soft_wrap=True)
    if needed:
        raise unit_error(recording, needed)


def _refuse_another_s(place: Path, recording: Path, names: Sequence[str]) -> None:
    """Raise InputError if the mapping at `place` is that of a file of other columns: that one still needs it."""
    other = foreign_column(load_mapping(place), names)
    if other is not None:
        raise InputError(
            f"{place}: is of another recording (it names column {other!r}, which {path_text(recording)} has not); "
            "rename it to that recording's name with .map.toml at its end, or remove it, and save anew"
        )


def _looked_at(
    recording: Path, mapping: ColumnMap, reading: Sources
) -> tuple[Inspection | None, tuple[str, ...], str]:
    """Quality of the channels, what the reader remarks, and why there is none of it."""
    try:
        table = read_all(recording, mapping, reading.decode)
        log = RemarkLog()
        log.add(table.remarks)
        return inspect(table.columns), (*table.notes, *log.notes()), ""
    except InputError as error:
        return None, (), str(error)
