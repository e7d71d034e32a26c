"""All columns of a file under their own names, for a look at what they may mean."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np

from cablecomp.errors import InputError
from cablecomp.recording.can_log import DecodeFrame
from cablecomp.recording.join import JoinRule, join
from cablecomp.recording.raw import RawTable
from cablecomp.recording.source_file import Messages, open_file
from cablecomp.recording.table import FloatArray
from cablecomp.recording.topics import TopicFacts

_MOST_ROWS = 400_000
_MOST_FIELDS = 256


@dataclass(frozen=True)
class RawColumns:
    """Columns by their own names, of one length (NaN = empty), at most 400 000 rows.

    `kind` is the file's; `left_out` are columns that hold no numbers; `topics` those of a log of messages;
    `units` what the file states.
    """

    kind: str
    columns: dict[str, FloatArray]
    left_out: tuple[str, ...]
    topics: dict[str, TopicFacts]
    units: dict[str, str]
    notes: tuple[str, ...]


def raw_columns(path: Path, decode: Callable[[], DecodeFrame] | None = None) -> RawColumns:
    """Read the columns of a file as they are; InputError if it cannot be read.

    Messages are joined at the topic with most of them. Columns of a CSV that hold text are left out.
    """
    kind, source = open_file(path, decode)
    if isinstance(source, Messages):
        wanted = dict(islice(source.fields.items(), _MOST_FIELDS))
        leader = max({t for t, _ in wanted.values()}, key=lambda t: source.topics[t].count)
        ordered = dict(sorted(wanted.items(), key=lambda item: item[1][0] != leader))
        joined = join(source.log, source.topics, ordered, (), JoinRule(leader, hold_s=1e9))
        table = RawTable(joined.names, lambda names: joined.read(), notes=joined.notes)
        columns = _stacked(path, table, ("time_s", *wanted))
        return RawColumns(kind, columns, (), source.topics, {}, table.notes)
    names, text = _numeric(path, source)
    table = replace(source, names=names)
    return RawColumns(kind, _stacked(path, table, names), text, {}, dict(source.units), source.notes)


def _stacked(path: Path, table: RawTable, names: tuple[str, ...]) -> dict[str, FloatArray]:
    parts: dict[str, list[FloatArray]] = {name: [] for name in names}
    rows = 0
    for piece in table.read(names):
        for name in names:
            parts[name].append(piece.arrays[name])
        rows += len(piece.arrays[names[0]])
        if rows >= _MOST_ROWS:
            break
    if not rows:
        raise InputError(f"{path}: has column names but no rows; expected at least one row of numbers")
    return {name: np.concatenate(part)[:_MOST_ROWS] for name, part in parts.items()}


def _numeric(path: Path, table: RawTable) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The columns that hold numbers, and those that do not, tried one by one on the first rows."""
    good, bad, causes = [], [], []
    for name in table.names:
        try:
            next(iter(table.read((name,))), None)
            good.append(name)
        except InputError as error:
            bad.append(name)
            causes.append(str(error).removeprefix(f"{path}: "))
    if not good:
        raise InputError(f"{path}: no column holds numbers: {causes[0]}")
    return tuple(good), tuple(bad)
