"""Reading recordings of any accepted kind as checked blocks of canonical channels, in bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from cablecomp.errors import ConfigError, InputError
from cablecomp.recording.can_log import DecodeFrame
from cablecomp.recording.channels import CANONICAL, Column, may_be_empty, order, parse_header
from cablecomp.recording.checks import Checks, regrouped, some
from cablecomp.recording.join import JoinRule, join
from cablecomp.recording.mapping import (
    ColumnMap,
    check_units,
    columns_by,
    find_mapping,
    load_mapping,
    meaning,
)
from cablecomp.recording.raw import RawRows, RawTable
from cablecomp.recording.source_file import Messages, open_file
from cablecomp.recording.table import Block, FloatArray, Table

_MOST_VALUES: Final = 200_000_000


@dataclass(frozen=True)
class Recording:
    """A recording that has been opened: its head is known, its rows are streamed by `blocks`.

    `channels` are canonical names in the order of the file, `columns` say how each was named and is
    converted, `comments` are the `#` lines at the head, `line_word` is what messages count ("line", "row"),
    `notes` say what was assumed on opening.
    """

    path: Path
    columns: tuple[Column, ...]
    comments: tuple[str, ...]
    kind: str
    line_word: str
    raw: Callable[[], Iterator[RawRows]]
    notes: tuple[str, ...] = ()
    gaps: bool = False
    lacking: frozenset[str] = frozenset()
    """Channels whose cells may be without a finite number, where `gaps` does not let all of them be."""

    @property
    def channels(self) -> tuple[str, ...]:
        """Canonical names of the channels."""
        return tuple(column.name for column in self.columns)

    def require(self, names: Iterable[str], why: str = "") -> None:
        """Raise InputError if a channel is missing; `why` says what needs it."""
        missing = [name for name in names if name not in self.channels]
        if missing:
            reason = f", needed {why}" if why else ""
            raise InputError(
                f"{self.path}: has no column {missing[0]}{reason}; found: {', '.join(self.channels)}"
            )

    def blocks(self, rows: int = 65536) -> Iterator[Block]:
        """Stream blocks of `rows` rows (the last one may be shorter).

        Raises InputError with the line for: a cell that is empty, NaN or infinite (empty cells are remarked
        upon and let through in `temperature_degC` and `other_*`, and in channels that may be `lacking`), time running
        backwards, malformed rows.
        """
        checks = Checks(self.path, self.columns, self.line_word, self.gaps, self.lacking)
        return regrouped((checks.block(piece) for piece in some(self.raw(), self.path)), rows)

    def head(self, rows: int = 200_000) -> dict[str, FloatArray]:
        """Its first rows (that many or some more) by channel, read for themselves; empty if there are none."""
        parts, read = [], 0
        for block in self.blocks():
            parts.append(block.columns)
            read += block.rows
            if read >= rows:
                break
        return {n: np.concatenate([p[n] for p in parts]) for n in self.channels} if parts else {}


def open_recording(
    path: Path | str, mapping: ColumnMap | None = None, decode: Callable[[], DecodeFrame] | None = None
) -> Recording:
    """Open a recording by what the file holds; InputError in one line if it cannot be read.

    Accepted: CSV (comma, semicolon, tab; plain or gzip), Parquet, NumPy .npz, MATLAB .mat, MCAP and ROS bags,
    CAN logs (with `decode`). `mapping` says what foreign columns mean; without one, that saved beside the file
    is taken, where the file's own names are not all channels.
    """
    path = Path(path)
    kind, source = open_file(path, decode)
    saved = find_mapping(path) if mapping is None else None
    notes = list(source.notes if isinstance(source, RawTable) else source.log.notes)
    if saved is not None and not _speaks_for_itself(source):
        mapping = load_mapping(saved)
        notes.append(f"columns taken as {saved} says")
    table, columns, more = (
        _joined_rows(path, source, mapping)
        if isinstance(source, Messages)
        else (source, _columns(path, source, mapping), ())
    )
    used = tuple(column.column for column in columns)
    recording = Recording(
        path, columns, table.comments, kind, table.line_word, lambda: table.read(used), (*notes, *more)
    )
    recording.require(["time_s"], "as the clock of every recording (time_s, time_ms, time_us, ...)")
    return recording


def read_all(
    path: Path | str,
    mapping: ColumnMap | None = None,
    decode: Callable[[], DecodeFrame] | None = None,
    gaps: bool = False,
) -> Table:
    """Read a whole recording into memory; errors as `open_recording` and `Recording.blocks`.

    `gaps`: cells without a finite number stay as NaN, with a remark, in every channel but the clock.

    InputError as well for one of over 200 million values.
    """
    recording = replace(open_recording(path, mapping, decode), gaps=gaps)
    blocks, values = [], 0
    for block in recording.blocks():
        values += block.rows * len(block.columns)
        if values > _MOST_VALUES:
            raise InputError(
                f"{path}: holds over {_MOST_VALUES:,} values; cut it with `cablecomp convert` first"
            )
        blocks.append(block)
    columns = {name: np.concatenate([block.columns[name] for block in blocks]) for name in recording.channels}
    remarks = tuple(remark for block in blocks for remark in block.remarks)
    return Table(recording.path, blocks[0].first_line, columns, remarks, recording.notes)


def _speaks_for_itself(source: RawTable | Messages) -> bool:
    """Whether a file's own names are channels: then no mapping found by chance is put over them."""
    if isinstance(source, Messages):
        return "motor_position_rad" in {c.name for c in source.own_columns().values()}
    return all(meaning(name) is not None for name in source.names)


def _columns(path: Path, table: RawTable, mapping: ColumnMap | None) -> tuple[Column, ...]:
    try:
        if mapping is not None:
            return columns_by(mapping, table.names, table.units)
        columns = parse_header(table.names)
        check_units(columns, table.units)
        return columns
    except ConfigError as error:
        raise ConfigError(f"{path}: {line}" for line in error.lines) from None
    except InputError as error:
        raise InputError(f"{path}: {table.where}{error}; `cablecomp inspect` suggests a mapping") from None


def _joined_rows(
    path: Path, source: Messages, mapping: ColumnMap | None
) -> tuple[RawTable, tuple[Column, ...], tuple[str, ...]]:
    """Rows from messages, what their columns mean, and the rule by which they were joined."""
    own = source.own_columns()
    by_channel = {column.name: column for column in own.values()}
    if mapping is not None:
        try:
            by_channel |= {c.name: c for c in columns_by(mapping, tuple(source.fields), {})}
        except ConfigError as error:
            raise ConfigError(f"{path}: {line}" for line in error.lines) from None
    if not set(by_channel) - {"time_s"}:
        shown = ", ".join(list(source.fields)[:12])
        raise InputError(
            f"{path}: no message holds a known channel such as motor_position_rad; found {shown}; "
            "`cablecomp inspect` suggests a mapping"
        )
    ordered = sorted(by_channel.values(), key=lambda column: column.name != "motor_position_rad")
    wanted = {c.column: source.fields[c.column] for c in ordered}
    needed = [c.column for c in by_channel.values() if not may_be_empty(c.name)]
    rule = JoinRule() if mapping is None else mapping.rule
    ends = [by_channel[n].column for n in ("motor_position_rad", "joint_position_rad") if n in by_channel]
    if rule.leader is None and ends:  # the slower one: readings that were not made are none
        slower = max((source.fields[c][0] for c in ends), key=lambda topic: source.topics[topic].period_s)
        rule = replace(rule, leader=slower)
    steady = [c.column for c in by_channel.values() if c.name in CANONICAL]
    joined = join(source.log, source.topics, wanted, needed, rule, steady)
    columns = [by_channel[name] for name in order(by_channel)]
    if "time_s" not in by_channel:
        columns.insert(0, Column("time_s", "time_s", 1.0, 0.0))
    ages = [name for name in joined.names if name.startswith("other_age_") and name not in by_channel]
    columns += [Column(name, name, 1.0, 0.0) for name in ages]
    return RawTable(joined.names, lambda names: joined.read()), tuple(columns), joined.notes
