"""A recording as its file holds it: named columns of numbers, before names, units and time have been checked."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from cablecomp.recording.table import FloatArray


class RawRows(Protocol):
    """Consecutive rows: an array for each column asked for, NaN where a cell is empty."""

    @property
    def first_line(self) -> int: ...
    @property
    def arrays(self) -> Mapping[str, FloatArray]: ...
    @property
    def fraction(self) -> float: ...
    @property
    def ends_with_break(self) -> bool: ...
    @property
    def left_out(self) -> int: ...
    def cell(self, row: int, column: str) -> str:
        """Return the text of a cell, for messages."""


@dataclass(frozen=True)
class NumberRows:
    """Rows that were numbers in the file; `left_out` rows before or among them had no fresh value."""

    first_line: int
    arrays: Mapping[str, FloatArray]
    fraction: float
    ends_with_break: bool = True
    left_out: int = 0

    def cell(self, row: int, column: str) -> str:
        """Return a value as text, for messages; an empty one is an empty text."""
        value = self.arrays[column][row]
        return "" if np.isnan(value) else repr(float(value))


@dataclass(frozen=True)
class RawTable:
    """An opened file: `names` of its columns, `read` streams the rows of those asked for, in any order.

    `comments` stand at the head of a text; `line_word` is what messages count, `where` names the head;
    `units` are those that the file itself states; `notes` say what is odd about the file.
    """

    names: tuple[str, ...]
    read: Callable[[Sequence[str]], Iterator[RawRows]]
    line_word: str = "row"
    where: str = ""
    comments: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
