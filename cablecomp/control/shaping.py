"""Small signal shapers with explicit state: a lead filter, a filtered derivative, a bumpless transfer."""

from __future__ import annotations

from math import exp, inf, pi

from cablecomp.errors import InputError


class LeadFilter:
    """Expected value of a signal: `(1 + s lead) / (1 + s tau)^2` of the reading, tau = 1/(2 pi f),
    exact for a held input.

    `rate` is the filtered rate of change per second. A constant comes through as it is, a ramp of rate
    r late by `(2 stage_lag_s - lead) r`, stage_lag_s = tau for periods well below it: with lead = 2
    stage_lag_s + latency a ramp is foreseen over the loop's latency.
    """

    __slots__ = ("_a", "_lead", "first", "rate", "second", "stage_lag_s", "started")

    def __init__(self, filter_Hz: float, lead_s: float, period_s: float) -> None:
        kept = exp(-2.0 * pi * filter_Hz * period_s)
        self._a = 1.0 - kept
        self.stage_lag_s = period_s * kept / self._a
        self._lead = lead_s
        self.reset()

    def reset(self) -> None:
        """Forget everything; the next reading is taken as if it had always been there."""
        self.first = self.second = self.rate = 0.0
        self.started = False

    @property
    def state(self) -> tuple[float, float, float, bool]:
        """All that it remembers."""
        return self.first, self.second, self.rate, self.started

    @state.setter
    def state(self, state: tuple[float, float, float, bool]) -> None:
        self.first, self.second, self.rate, self.started = state

    def step(self, reading: float) -> float:
        """Take a reading, give the expected value."""
        if not self.started:
            self.first = self.second = reading
            self.started = True
        self.first += self._a * (reading - self.first)
        self.second += self._a * (self.first - self.second)
        self.rate = (self.first - self.second) / self.stage_lag_s
        return self.second + self._lead * self.rate


class Slope:
    """Filtered rate of change of a signal: first difference through a first-order low pass."""

    __slots__ = ("_a", "_period", "last", "rate", "started")

    def __init__(self, filter_Hz: float, period_s: float) -> None:
        self._a = 1.0 - exp(-2.0 * pi * filter_Hz * period_s)
        self._period = period_s
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.last = self.rate = 0.0
        self.started = False

    def jump(self, value: float) -> None:
        """Go on from another value at the rate of before: what leads there is no motion."""
        self.last = value

    def step(self, value: float) -> float:
        """Take a value, give its rate per second."""
        if not self.started:
            self.last = value
            self.started = True
        self.rate += self._a * ((value - self.last) / self._period - self.rate)
        self.last = value
        return self.rate


class BumplessTransfer:
    """What is added to a target so that a switch costs no step, and dies away: `size (1 - 3 x^2 + 2 x^3)`, x = time
    since over `blend_s`, or over a longer time where the mean rate were above `most_rad_s`."""

    __slots__ = ("_blend_s", "_most_rad_s", "_period", "_total", "left", "size", "slope")

    def __init__(self, blend_s: float, period_s: float, most_rad_s: float = inf) -> None:
        if not blend_s > 0.0:
            raise InputError(f"blend_s is {blend_s}; a time above 0 is accepted")
        self._blend_s = blend_s
        self._most_rad_s = most_rad_s
        self._total = 1
        self._period = period_s
        self.size = 0.0
        self.slope = 0.0
        self.left = 0

    def start(self, size: float) -> None:
        """Begin anew with `size`, rad."""
        self.size = size
        self._total = max(1, round(max(self._blend_s, abs(size) / self._most_rad_s) / self._period))
        self.left = self._total

    def step(self) -> float:
        """Present addition (rad); `slope` then holds its rate (rad/s)."""
        if self.left == 0:
            self.slope = 0.0
            return 0.0
        x = 1.0 - self.left / self._total
        self.left -= 1
        self.slope = self.size * 6.0 * x * (x - 1.0) / (self._total * self._period)
        return self.size * (1.0 + x * x * (2.0 * x - 3.0))
