"""Tension profiles at telling instants of a recording, found while it streams past."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from cablecomp.recording.table import FloatArray

START: Final = "start"
GREATEST_LOAD: Final = "greatest load"
BACK: Final = "back through zero"
LEAST_LOAD: Final = "least load"
END: Final = "end"
INSTANTS: Final = (START, GREATEST_LOAD, BACK, LEAST_LOAD, END)


class WrapProfile(Protocol):
    """Tension along one wrap: `angle_rad` from the termination, `tension_N` there."""

    @property
    def name(self) -> str: ...
    @property
    def angle_rad(self) -> FloatArray: ...
    @property
    def tension_N(self) -> FloatArray: ...


@dataclass(frozen=True)
class Snapshot:
    """Profiles of all wraps after a row (index in the recording); `load_Nm` is None if unknown."""

    label: str
    row: int
    time_s: float
    load_Nm: float | None
    profiles: tuple[WrapProfile, ...]


class Instants:
    """Says after which rows of a block a snapshot is due; a later one replaces one of the same label.

    Instants: the first row, the greatest load so far, the first sign change of load after it, the least load
    so far; the caller adds the last row.
    """

    def __init__(self) -> None:
        self._started = False
        self._greatest = -np.inf
        self._least = np.inf
        self._falling = False

    def due(self, load: FloatArray | None) -> list[tuple[int, str]]:
        """Return (row in the block, label) in the order of rows; without load only the start is due."""
        found = list(self._due(load))
        self._started = True
        return sorted(found)

    def _due(self, load: FloatArray | None) -> Iterator[tuple[int, str]]:
        if not self._started:
            yield 0, START
        if load is None:
            return
        after = 0
        top, bottom = int(load.argmax()), int(load.argmin())
        if load[top] > self._greatest:
            self._greatest = float(load[top])
            self._falling, after = self._greatest > 0.0, top
            yield top, GREATEST_LOAD
        below = load[after:] <= 0.0
        if self._falling and below.any():
            self._falling = False
            yield after + int(below.argmax()), BACK
        if load[bottom] < self._least:
            self._least = float(load[bottom])
            yield bottom, LEAST_LOAD


def in_order(snapshots: Sequence[Snapshot]) -> tuple[Snapshot, ...]:
    """Return the snapshots by time, one for each row: labels of the same row are joined."""
    by_row: dict[int, Snapshot] = {}
    for snapshot in sorted(snapshots, key=lambda s: (s.row, INSTANTS.index(s.label))):
        first = by_row.get(snapshot.row)
        label = snapshot.label if first is None else f"{first.label}, {snapshot.label}"
        by_row[snapshot.row] = Snapshot(
            label, snapshot.row, snapshot.time_s, snapshot.load_Nm, snapshot.profiles
        )
    return tuple(by_row.values())
