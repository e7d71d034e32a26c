"""What a row of a recording must be, whatever file it comes from: finite, in SI, with time that does not run back."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from cablecomp.errors import InputError
from cablecomp.recording.channels import Column, may_be_empty
from cablecomp.recording.raw import RawRows
from cablecomp.recording.table import Block, FloatArray, Remark

_GAP_FACTOR: Final = 10.0


class Checks:
    """Converts units and refuses what must not be bridged; remembers the last time stamp between pieces."""

    def __init__(
        self,
        path: Path,
        columns: Sequence[Column],
        line_word: str,
        gaps: bool = False,
        lacking: Collection[str] = (),
    ) -> None:
        self._gaps, self._lacking = gaps, lacking
        self._path, self._columns, self._word = path, columns, line_word
        self._last_time: float | None = None
        self._usual_step = 0.0

    def block(self, raw: RawRows) -> Block:
        """The rows in canonical channels, with remarks; InputError with the line of what must not be bridged."""
        columns, remarks = {}, []
        for column in self._columns:
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
        if column.name in self._lacking or (self._gaps and column.name != "time_s"):
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
        return f"{self._path}: {self._word} {line}"


def _converted(values: FloatArray, column: Column) -> FloatArray:
    if column.factor != 1.0:
        with np.errstate(over="ignore"):
            values = values * column.factor
    return values + column.offset if column.offset else values


def some(pieces: Iterator[RawRows], path: Path) -> Iterator[RawRows]:
    """Pieces that hold rows; InputError if none does."""
    found = False
    for piece in pieces:
        if len(next(iter(piece.arrays.values()))):
            found = True
            yield piece
    if not found:
        raise InputError(f"{path}: has column names but no rows; expected at least one row of numbers")


def regrouped(blocks: Iterator[Block], rows: int) -> Iterator[Block]:
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
