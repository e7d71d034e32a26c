"""Reading recordings of any accepted kind as checked blocks of canonical channels, in bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from cablecomp.errors import ConfigError, InputError
from cablecomp.recording.can_log import DecodeFrame
from cablecomp.recording.channels import Column, may_be_empty, order, parse_header
from cablecomp.recording.join import JoinRule, join
from cablecomp.recording.mapping import ColumnMap, columns_by, find_mapping, load_mapping, meaning
from cablecomp.recording.raw import RawRows, RawTable
from cablecomp.recording.source_file import Messages, open_file
from cablecomp.recording.table import Block, FloatArray, Remark, Table

_GAP_FACTOR: Final = 10.0
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
        upon and let through in `temperature_degC` and `other_*`), time running backwards, malformed rows.
        """
        checked = _Checks(self)
        return _regrouped((checked.block(piece) for piece in _some(self.raw(), self.path)), rows)


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
        return parse_header(table.names)
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
    motor = by_channel.get("motor_position_rad")
    if rule.leader is None and motor is not None:
        rule = replace(rule, leader=source.fields[motor.column][0])
    joined = join(source.log, source.topics, wanted, needed, rule)
    columns = [by_channel[name] for name in order(by_channel)]
    if "time_s" not in by_channel:
        columns.insert(0, Column("time_s", "time_s", 1.0, 0.0))
    ages = [name for name in joined.names if name.startswith("other_age_") and name not in by_channel]
    columns += [Column(name, name, 1.0, 0.0) for name in ages]
    return RawTable(joined.names, lambda names: joined.read()), tuple(columns), joined.notes


class _Checks:
    """Converts units and refuses what must not be bridged; remembers the last time stamp between pieces."""

    def __init__(self, recording: Recording) -> None:
        self._gaps = recording.gaps
        self._recording = recording
        self._last_time: float | None = None
        self._usual_step = 0.0

    def block(self, raw: RawRows) -> Block:
        columns, remarks = {}, []
        for column in self._recording.columns:
            values = _converted(raw.arrays[column.column], column)
            remarks += self._finite(values, raw, column)
            columns[column.name] = values
        remarks += self._time(columns["time_s"], raw.first_line)
        if raw.left_out:
            remarks.append(Remark("stale", raw.first_line, raw.left_out))
        if not raw.ends_with_break:
            remarks.append(Remark("end", raw.first_line + len(columns["time_s"]) - 1, 1))
        return Block(raw.first_line, columns, raw.fraction, tuple(remarks))

    def _finite(self, values: FloatArray, raw: RawRows, column: Column) -> list[Remark]:
        if np.isfinite(values).all():
            return []
        bad = ~np.isfinite(values)
        empty = np.isnan(values)
        if may_be_empty(column.name):
            if not (bad & ~empty).any():
                count, first = int(empty.sum()), int(np.argmax(empty))
                return [Remark("empty", raw.first_line + first, count, column.name)] if count else []
            bad &= ~empty
        if not bad.any():
            return []
        if self._gaps and column.name != "time_s":
            values[bad] = np.nan
            return [Remark("empty", raw.first_line + int(np.argmax(bad)), int(bad.sum()), column.name)]
        row = int(np.argmax(bad))
        cell = raw.cell(row, column.column)
        found = f"holds {cell!r}" if cell else "is empty"
        raise InputError(
            f"{self._where(raw.first_line + row)}: column {column.column!r} {found}; a finite number is "
            "expected, gaps are not bridged: remove the row or record that channel again"
        )

    def _time(self, time: FloatArray, first_line: int) -> list[Remark]:
        before = time[0] if self._last_time is None else self._last_time
        with np.errstate(over="ignore"):
            steps = np.diff(time, prepend=before)
        if steps.min() < 0.0:
            row = int(np.argmax(steps < 0.0))
            earlier = time[row] - steps[row]
            raise InputError(
                f"{self._where(first_line + row)}: time runs backwards, from {earlier:.9g} s to "
                f"{time[row]:.9g} s; sort the rows or split the file there"
            )
        start = 1 if self._last_time is None else 0
        self._last_time = float(time[-1])
        return self._odd_steps(steps[start:], first_line + start)

    def _odd_steps(self, steps: FloatArray, first_line: int) -> list[Remark]:
        forward = steps[steps > 0.0]
        if len(forward) >= 3:
            self._usual_step = float(np.median(forward))
        remarks = []
        if self._usual_step > 0.0:
            for row in np.flatnonzero(steps > _GAP_FACTOR * self._usual_step):
                remarks.append(Remark("gap", first_line + int(row), float(steps[row])))
        repeats = steps == 0.0
        if repeats.any():
            remarks.append(Remark("repeat", first_line + int(np.argmax(repeats)), int(repeats.sum())))
        return remarks

    def _where(self, line: int) -> str:
        return f"{self._recording.path}: {self._recording.line_word} {line}"


def _converted(values: FloatArray, column: Column) -> FloatArray:
    if column.factor != 1.0:
        with np.errstate(over="ignore"):
            values = values * column.factor
    return values + column.offset if column.offset else values


def _some(pieces: Iterator[RawRows], path: Path) -> Iterator[RawRows]:
    found = False
    for piece in pieces:
        if len(next(iter(piece.arrays.values()))):
            found = True
            yield piece
    if not found:
        raise InputError(f"{path}: has column names but no rows; expected at least one row of numbers")


def _regrouped(blocks: Iterator[Block], rows: int) -> Iterator[Block]:
    """Cut and join blocks into equal ones; a remark goes with the block of its line or an earlier one."""
    held: list[Block] = []
    for block in blocks:
        held.append(block)
        if sum(part.rows for part in held) < rows:
            continue
        whole = _joined(held)
        full = whole.rows - whole.rows % rows
        for start in range(0, full, rows):
            part = whole.part(start, start + rows)
            remarks = whole.remarks if start == 0 else ()
            yield Block(part.first_line, part.columns, part.fraction, remarks)
        held = [whole.part(full, whole.rows)] if full < whole.rows else []
    if held:
        yield _joined(held)


def _joined(blocks: Sequence[Block]) -> Block:
    if len(blocks) == 1:
        return blocks[0]
    columns = {name: np.concatenate([block.columns[name] for block in blocks]) for name in blocks[0].columns}
    remarks = tuple(remark for block in blocks for remark in block.remarks)
    return Block(blocks[0].first_line, columns, blocks[-1].fraction, remarks)
