"""Pieces that protocols are laid out in: straight lines and sine sweeps of load and position over time."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, log, pi, sin
from typing import NamedTuple, Protocol


class Knot(NamedTuple):
    """Where a piece begins or ends: joint position (rad), load (Nm)."""

    position: float
    load: float


class At(NamedTuple):
    """Values within a piece; rates of the position per second."""

    position: float
    position_rate: float
    load: float
    position_rate_rate: float = 0.0


class Piece(Protocol):
    """One stretch of time."""

    @property
    def duration_s(self) -> float:
        """How long it takes."""

    @property
    def end(self) -> Knot:
        """Where it ends."""

    def at(self, time_s: float) -> At:
        """Values at a time from its beginning."""

    def load_range(self) -> tuple[float, float]:
        """Least and greatest load."""

    def position_range(self) -> tuple[float, float]:
        """Least and greatest position."""


@dataclass(frozen=True)
class Line:
    """From one knot to another: load linearly, position with least jerk, `10 x^3 - 15 x^4 + 6 x^5` (peak
    speed 1.875 times the mean), since no inertia follows a corner."""

    begin: Knot
    end: Knot
    duration_s: float

    def at(self, time_s: float) -> At:
        """See `Piece.at`."""
        x, span = time_s / self.duration_s, self.end.position - self.begin.position
        v = 30.0 * x * x * (1.0 - x) * (1.0 - x) * span / self.duration_s
        a = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) * span / (self.duration_s * self.duration_s)
        position = self.begin.position + x * x * x * (10.0 + x * (6.0 * x - 15.0)) * span
        return At(position, v, self.begin.load + x * (self.end.load - self.begin.load), a)

    def load_range(self) -> tuple[float, float]:
        """See `Piece.load_range`."""
        return min(self.begin.load, self.end.load), max(self.begin.load, self.end.load)

    def position_range(self) -> tuple[float, float]:
        """See `Piece.position_range`."""
        return min(self.begin.position, self.end.position), max(self.begin.position, self.end.position)


@dataclass(frozen=True)
class Sweep:
    """A sine about the first value: phase `2 pi f1 (D/ln k) (k^(t/D) - 1)`, k = f2/f1, stretched to whole
    periods."""

    begin: Knot
    on_load: bool
    amplitude: float
    from_Hz: float
    growth: float
    turns: float
    duration_s: float

    @property
    def end(self) -> Knot:
        """It ends where it began."""
        return self.begin

    def at(self, time_s: float) -> At:
        """See `Piece.at`."""
        g, x = self.growth, time_s / self.duration_s
        whole = log(g) if g != 1.0 else 1.0
        share = (g**x - 1.0) / (g - 1.0) if g != 1.0 else x
        phase = 2.0 * pi * self.turns * share
        speed = 2.0 * pi * self.turns / self.duration_s
        if g != 1.0:
            speed *= whole * g**x / (g - 1.0)
        value, rate = self.amplitude * sin(phase), self.amplitude * speed * cos(phase)
        bend = -self.amplitude * speed * speed * sin(phase)
        if g != 1.0:
            bend += rate * whole / self.duration_s
        if self.on_load:
            return At(self.begin.position, 0.0, self.begin.load + value)
        return At(self.begin.position + value, rate, self.begin.load, bend)

    def load_range(self) -> tuple[float, float]:
        """See `Piece.load_range`."""
        a = self.amplitude if self.on_load else 0.0
        return self.begin.load - a, self.begin.load + a

    def position_range(self) -> tuple[float, float]:
        """See `Piece.position_range`."""
        a = 0.0 if self.on_load else self.amplitude
        return self.begin.position - a, self.begin.position + a


def line(begin: Knot, end: Knot, duration_s: float) -> Line:
    """A straight piece."""
    return Line(begin, end, duration_s)


def sweep(
    begin: Knot, on_load: bool, amplitude: float, from_Hz: float, to_Hz: float, duration_s: float
) -> Sweep:
    """A sine sweep; the number of turns is rounded up to a whole one."""
    growth = to_Hz / from_Hz
    mean = (to_Hz - from_Hz) / log(growth) if growth != 1.0 else from_Hz
    return Sweep(begin, on_load, amplitude, from_Hz, growth, float(ceil(mean * duration_s)), duration_s)
