"""What reading a recording gives: blocks of channels, whole tables, and remarks on what is odd in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cablecomp.counting import counted

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Remark:
    """Something odd that does not stop the reading.

    `kind`: "gap" = the time step into this line is far longer than usual (`size` = step in s); "repeat" =
    `size` rows have the time stamp of the row before them; "empty" = `size` cells of an optional channel are
    empty; "stale" = `size` rows were left out because another topic had no fresh value; "end" = the file does
    not end with a line break. `line` is the first line concerned.
    """

    kind: Literal["gap", "repeat", "empty", "stale", "end"]
    line: int
    size: float
    channel: str = "time_s"


@dataclass(frozen=True)
class Block:
    """Consecutive rows of a recording in canonical channels.

    Row k stands in line (or row) `first_line + k` of the file; `fraction` is the share of the file that has
    been read once this block is used; `columns` holds float64 arrays of one length.
    """

    first_line: int
    columns: dict[str, FloatArray]
    fraction: float
    remarks: tuple[Remark, ...] = ()

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self.columns.values())))

    def part(self, start: int, stop: int) -> Block:
        """Return rows start..stop-1 as views, without the remarks."""
        cut = {name: values[start:stop] for name, values in self.columns.items()}
        return Block(self.first_line + start, cut, self.fraction)


@dataclass(frozen=True)
class Table:
    """A whole recording in memory."""

    path: Path
    first_line: int
    columns: dict[str, FloatArray]
    remarks: tuple[Remark, ...]
    notes: tuple[str, ...] = ()

    @property
    def channels(self) -> tuple[str, ...]:
        """Canonical names of the channels."""
        return tuple(self.columns)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.columns["time_s"])


class RemarkLog:
    """Collects the remarks of all blocks in bounded memory and words them; it keeps the first `keep` gaps."""

    def __init__(self, line_word: str = "line", keep: int = 200) -> None:
        self._word = line_word
        self._keep = keep
        self._gaps: list[Remark] = []
        self._gap_count = 0
        self._sums: dict[tuple[str, str], Remark] = {}

    def add(self, remarks: Iterable[Remark]) -> None:
        """Take in the remarks of one block."""
        for remark in remarks:
            if remark.kind == "gap":
                self._gap_count += 1
                if len(self._gaps) < self._keep:
                    self._gaps.append(remark)
                continue
            key = (remark.kind, remark.channel)
            earlier = self._sums.get(key)
            self._sums[key] = remark if earlier is None else _joined(earlier, remark)

    @property
    def gaps(self) -> tuple[Remark, ...]:
        """The gaps kept, in order."""
        return tuple(self._gaps)

    def notes(self) -> tuple[str, ...]:
        """Return one plain line for each kind of remark."""
        return tuple(self._lines())

    def _lines(self) -> Iterator[str]:
        if self._gaps:
            widest = max(self._gaps, key=lambda gap: gap.size)
            shown = ", ".join(f"{self._word} {gap.line} ({gap.size:.4g} s)" for gap in self._gaps[:5])
            more = f" and {self._gap_count - 5} more" if self._gap_count > 5 else ""
            yield (
                f"{counted(self._gap_count, 'gap')} in time, at {shown}{more}; longest {widest.size:.4g} s; "
                "nothing was filled in, the drive is taken as moving monotonically across a gap"
            )
        for remark in self._sums.values():
            count, where = int(remark.size), f"first at {self._word} {remark.line}"
            if remark.kind == "repeat":
                yield f"{counted(count, 'row')} with the time stamp of the row before, {where}"
            elif remark.kind == "empty":
                yield f"{remark.channel} is empty in {counted(count, 'row')}, {where}; left empty"
            elif remark.kind == "stale":
                yield f"{counted(count, 'row')} left out for want of a fresh value from another topic, {where}"
            else:
                yield (
                    f"{self._word} {remark.line} does not end with a line break; "
                    "if the file was cut there, its last value may be incomplete"
                )


def _joined(earlier: Remark, later: Remark) -> Remark:
    return Remark(earlier.kind, earlier.line, earlier.size + later.size, earlier.channel)
