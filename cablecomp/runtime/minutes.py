"""A long run minute by minute: whether memory or step time grows."""

from __future__ import annotations

import os
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING

from cablecomp.runtime.histogram import CycleTimes, Histogram

if TYPE_CHECKING:
    from cablecomp.links.link import LinkStatus

_STATM = Path("/proc/self/statm")
_SHOWN = 10


@dataclass(frozen=True)
class Minute:
    """One whole minute under control: resident memory of the process at its end (MB, NaN where the system
    does not tell), `step` of one joint and the whole cycle in it, and what was missed, skipped or lost in it.
    """

    number: int
    memory_MB: float
    step_p50_s: float
    step_p99_s: float
    cycle_p99_s: float
    misses: int
    skipped: int
    lost_frames: int

    def words(self) -> str:
        """One line for terminal, page and event log."""
        return (
            f"memory {self.memory_MB:.1f} MB, step p50 {1e6 * self.step_p50_s:.1f} p99 "
            f"{1e6 * self.step_p99_s:.1f} µs, cycle p99 {1e6 * self.cycle_p99_s:.0f} µs, {self.misses} missed, "
            f"{self.skipped} skipped, {self.lost_frames} frames lost"
        )


class Minutes:
    """Tells the minutes of a run apart by differences of its running totals: nothing is counted twice."""

    def __init__(self) -> None:
        self.done: list[Minute] = []
        self.due_s = 60.0
        self._step, self._cycle = Histogram(), Histogram()
        self._counts = (0, 0, 0)

    def close(self, times: CycleTimes, skipped: int, status: LinkStatus) -> Minute:
        """End the present minute; call once `due_s` has passed."""
        counts = (times.misses, skipped, status.lost + status.dropped)
        step, cycle = times.step.since(self._step), times.cycle.since(self._cycle)
        misses, skips, lost = (now - then for now, then in zip(counts, self._counts, strict=True))
        self._step, self._cycle, self._counts = times.step.copy(), times.cycle.copy(), counts
        self.due_s += 60.0
        number = len(self.done) + 1
        minute = Minute(
            number, resident_MB(), step.quantile(0.5), step.quantile(0.99), cycle.quantile(0.99),
            misses, skips, lost,
        )  # fmt: skip
        self.done.append(minute)
        return minute


def shown(minutes: tuple[Minute, ...]) -> tuple[Minute, ...]:
    """All of a few minutes; of many the first two, the last and about ten evenly between."""
    every = -(-len(minutes) // _SHOWN)
    return tuple(
        m for m in minutes if every == 1 or m.number in (1, 2, len(minutes)) or m.number % every == 0
    )


def resident_MB() -> float:
    """Resident memory of this process in 1e6 bytes (Linux; NaN elsewhere)."""
    try:
        pages = int(_STATM.read_text(encoding="ascii").split()[1])
    except (OSError, IndexError, ValueError):
        return nan
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
