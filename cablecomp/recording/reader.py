"""Reading recordings of any accepted kind as checked blocks of canonical channels, in bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

import numpy as np

from cablecomp.errors import InputError
from cablecomp.recording import csv_text, foreign, mcap_file
from cablecomp.recording.channels import Column, may_be_empty, parse_header
from cablecomp.recording.source import identify
from cablecomp.recording.table import Block, FloatArray, Remark, Table

_GAP_FACTOR: Final = 10.0


class RawRows(Protocol):
    """Rows as a reader gives them: arrays in the order of the file's columns, NaN where a cell is empty."""

    @property
    def first_line(self) -> int: ...
    @property
    def arrays(self) -> list[FloatArray]: ...
    @property
    def fraction(self) -> float: ...
    @property
    def ends_with_break(self) -> bool: ...
    def cell(self, row: int, column: int) -> str:
        """Return the text of a cell, for messages."""


@dataclass(frozen=True)
class Recording:
    """A recording that has been opened: its head is known, its rows are streamed by `blocks`.

    `channels` are canonical names in the order of the file, `columns` say how each was named and is
    converted, `comments` are the `#` lines at the head, `line_word` is what messages count ("line", "row").
    """

    path: Path
    columns: tuple[Column, ...]
    comments: tuple[str, ...]
    kind: str
    line_word: str
    raw: Callable[[], Iterator[RawRows]]

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


def open_recording(path: Path | str) -> Recording:
    """Open a recording by what the file holds; InputError in one line if it cannot be read.

    Accepted: CSV (comma, semicolon, tab; plain or gzip), Parquet, MCAP with JSON messages, NumPy .npz.
    """
    path = Path(path)
    kind, gzipped = identify(path)
    if kind == "text":
        head = csv_text.read_head(path, gzipped)
        names, comments, word = head.columns, head.comments, "line"

        def raw() -> Iterator[RawRows]:
            return csv_text.read_rows(path, gzipped, head)

    else:
        opener = {"parquet": foreign.open_parquet, "npz": foreign.open_npz, "mcap": mcap_file.open_mcap}[kind]
        names, raw = opener(path)
        comments, word = (), "row"
    try:
        columns = parse_header(names)
    except InputError as error:
        where = f"line {head.header_line}: " if kind == "text" else ""
        raise InputError(f"{path}: {where}{error}") from None
    recording = Recording(path, columns, comments, kind, word, raw)
    recording.require(["time_s"], "as the clock of every recording (time_s, time_ms, time_us, ...)")
    return recording


def read_all(path: Path | str) -> Table:
    """Read a whole recording into memory; errors as `open_recording` and `Recording.blocks`."""
    recording = open_recording(path)
    blocks = list(recording.blocks())
    columns = {name: np.concatenate([block.columns[name] for block in blocks]) for name in recording.channels}
    remarks = tuple(remark for block in blocks for remark in block.remarks)
    return Table(recording.path, blocks[0].first_line, columns, remarks)


class _Checks:
    """Converts units and refuses what must not be bridged; remembers the last time stamp between pieces."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._last_time: float | None = None
        self._usual_step = 0.0

    def block(self, raw: RawRows) -> Block:
        columns, remarks = {}, []
        for index, column in enumerate(self._recording.columns):
            values = _converted(raw.arrays[index], column)
            remarks += self._finite(values, raw, index, column)
            columns[column.name] = values
        remarks += self._time(columns["time_s"], raw.first_line)
        if not raw.ends_with_break:
            remarks.append(Remark("end", raw.first_line + len(columns["time_s"]) - 1, 1))
        return Block(raw.first_line, columns, raw.fraction, tuple(remarks))

    def _finite(self, values: FloatArray, raw: RawRows, index: int, column: Column) -> list[Remark]:
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
        row = int(np.argmax(bad))
        cell = raw.cell(row, index)
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
        if len(piece.arrays[0]):
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
