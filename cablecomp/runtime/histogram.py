"""Histograms of times, of bounded size, that a loop fills."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp2, log2, nan
from typing import Final

_PER_OCTAVE: Final = 32  # a bin is 2.2 % wide: percentiles are known to 1.1 %
_LOWEST: Final = 1e-8
_BINS: Final = 32 * 40


@dataclass(frozen=True)
class Spread:
    """Distribution of a time in s: count, mean, median, 99th and 99.9th percentile, greatest."""

    count: int
    mean_s: float
    p50_s: float
    p99_s: float
    p999_s: float
    max_s: float


class Histogram:
    """Counts of positive times in bins of equal ratio; memory does not grow with what is counted."""

    __slots__ = ("_bins", "count", "greatest", "total")

    def __init__(self) -> None:
        self._bins = [0] * _BINS
        self.count = 0
        self.total = 0.0
        self.greatest = 0.0

    def add(self, seconds: float) -> None:
        """Count one time; what lies below 10 ns counts as that."""
        self.count += 1
        self.total += seconds
        if seconds > self.greatest:
            self.greatest = seconds
        k = int(log2(seconds / _LOWEST) * _PER_OCTAVE) if seconds > _LOWEST else 0
        self._bins[k if k < _BINS else _BINS - 1] += 1

    def quantile(self, share: float) -> float:
        """Time below which that share of the counted ones lies (NaN if there is none), within 1.1 %."""
        if self.count == 0:
            return nan
        wanted = share * self.count
        seen = 0
        for k, n in enumerate(self._bins):
            seen += n
            if seen >= wanted:
                return min(_LOWEST * exp2((k + 0.5) / _PER_OCTAVE), self.greatest)
        return self.greatest

    def copy(self) -> Histogram:
        """As it is now, for `since`."""
        other = Histogram()
        other._bins = list(self._bins)
        other.count, other.total, other.greatest = self.count, self.total, self.greatest
        return other

    def since(self, earlier: Histogram) -> Histogram:
        """What was counted after `earlier`, a copy of this one; its greatest is known to a bin (2.2 %)."""
        other = Histogram()
        other._bins = [now - then for now, then in zip(self._bins, earlier._bins, strict=True)]
        other.count, other.total = self.count - earlier.count, self.total - earlier.total
        top = max((k for k, n in enumerate(other._bins) if n), default=-1)
        other.greatest = min(_LOWEST * exp2((top + 1) / _PER_OCTAVE), self.greatest) if top >= 0 else 0.0
        return other

    def spread(self) -> Spread:
        """The distribution so far."""
        mean = self.total / self.count if self.count else nan
        greatest = self.greatest if self.count else nan
        return Spread(
            self.count, mean, self.quantile(0.5), self.quantile(0.99), self.quantile(0.999), greatest
        )


class CycleTimes:
    """Histograms that a loop fills."""

    __slots__ = ("cycle", "data_age", "jitter", "misses", "period", "poll", "step")

    def __init__(self) -> None:
        self.period = Histogram()
        self.jitter = Histogram()
        self.poll = Histogram()
        self.step = Histogram()
        self.cycle = Histogram()
        self.data_age = Histogram()
        self.misses = 0
