"""What a loop's time was spent on: histograms of bounded size, and the report that a run ends with."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import exp2, inf, log2, nan
from typing import Any, Final

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

    def spread(self) -> Spread:
        """The distribution so far."""
        mean = self.total / self.count if self.count else nan
        greatest = self.greatest if self.count else nan
        return Spread(
            self.count, mean, self.quantile(0.5), self.quantile(0.99), self.quantile(0.999), greatest
        )


@dataclass(frozen=True)
class TimingReport:
    """How a run kept its time and its data.

    `period`: time between the beginnings of two ticks; `jitter`: how late a tick began; `cycle`: decode,
    observe, compensate, encode, record of all joints; `step`: observer and compensator of one joint;
    `data_age`: age of the oldest channel used. `misses`: cycles that ended after the next tick was due;
    `skipped`: ticks left out for that. `policy` says what of scheduling, memory and garbage collection could
    be had, and what not.
    """

    rate_Hz: float
    asked_Hz: float
    ticks: int
    skipped: int
    misses: int
    period: Spread
    jitter: Spread
    poll: Spread
    step: Spread
    cycle: Spread
    data_age: Spread
    frames: int
    lost_frames: int
    invalid_frames: int
    repeated_frames: int
    reordered_frames: int
    dropped_frames: int
    send_failures: int
    policy: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON (NaN and infinity as None)."""
        plain: dict[str, Any] = _plain(asdict(self))
        return plain

    def rows(self) -> list[tuple[str, str]]:
        """Name and words of each line, as the terminal and the report page show them."""
        us = 1e6
        spread = "p50 {0:.1f}  p99 {1:.1f}  p99.9 {2:.1f}  max {3:.1f} µs"

        def line(s: Spread) -> str:
            return spread.format(s.p50_s * us, s.p99_s * us, s.p999_s * us, s.max_s * us)

        return [
            ("rate", f"{self.rate_Hz:.2f} Hz of {self.asked_Hz:g} Hz asked"),
            ("ticks", f"{self.ticks}, {self.misses} missed their end, {self.skipped} skipped"),
            ("period", line(self.period)),
            ("late begin", line(self.jitter)),
            ("poll", line(self.poll)),
            ("step of one joint", line(self.step)),
            ("whole cycle", line(self.cycle)),
            ("data age", line(self.data_age)),
            (
                "frames",
                f"{self.frames} taken, {self.lost_frames} lost, {self.repeated_frames} repeated, "
                f"{self.reordered_frames} reordered, {self.invalid_frames} damaged, "
                f"{self.dropped_frames} dropped by the system, {self.send_failures} not sent",
            ),
            *(("policy", line_) for line_ in self.policy),
        ]


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, float) and not -inf < value < inf:
        return None
    return value


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
