"""One channel against its own past: plausible or not, still or moving, late or on time, quiet or shaking."""

from __future__ import annotations

from math import expm1, inf, isfinite, isnan, nan, pi, remainder
from typing import Final

_AGREEING: Final = 3
_INTERVALS: Final = 5.0
_PATIENCE_S: Final = 1.0
_SLOWEST_S: Final = 12.0
"""The longest interval that counts as usual, and what is taken for it before readings have told."""
_SHARE: Final = 0.25
"""Of the newest interval in the usual one."""


class Channel:
    """The last plausible value of a channel, when it came, and whether newer ones had to be turned down.

    A value is plausible if it is finite, within `least` (given none: `-most`) and `most`, and moved no faster than
    `rate` since the value before. After one that is not, values are turned down until they agree with the last
    plausible one again. `changed_s`: when it last changed.
    """

    __slots__ = (
        "_floor",
        "_hold_s",
        "_least",
        "_most",
        "_rate",
        "_raw",
        "_raw_s",
        "arrived_s",
        "changed_s",
        "refused",
        "seen",
        "suspect",
        "value",
    )

    def __init__(
        self, rate: float, floor: float, hold_s: float, most: float = inf, least: float | None = None
    ) -> None:
        self._rate = rate
        self._floor = floor
        self._hold_s = hold_s
        self._most = most
        self._least = -most if least is None else least
        self._raw = self._raw_s = nan
        self.value = nan
        self.arrived_s = -inf
        self.changed_s = -inf
        self.seen = 0
        self.refused = 0
        self.suspect = False

    def take(self, value: float, arrived_s: float) -> bool:
        """Judge one new value that came at `arrived_s`; False = turned down."""
        raw, dt = self._raw, arrived_s - self._raw_s
        self._raw, self._raw_s = value, arrived_s
        if not self._least < value < self._most:
            self.refused += 1
            self.suspect = self.suspect or not isfinite(value)
            return False
        if self.suspect:
            raw, dt = self.value, self._hold_s
        # before a first value there is none: its distance is no number and not too large
        if abs(value - raw) > self._rate * dt + self._floor:
            self.suspect = True
            self.refused += 1
            return False
        self.suspect = False
        if value != self.value:
            self.changed_s = arrived_s
        self.value, self.arrived_s = value, arrived_s
        return True


class Seldom(Channel):
    """A channel that may come seldom: `held` while what came last was turned down (`hold`).

    How far a value may lie grows with the time since the last accepted one; an angle (`turn`: its period) is as far as
    the shorter way round. A level further away is believed once three readings in a row, over no less than
    `confirm_s`, lie within `floor` of the one before: what was wrong is then the value that was held.

    `old_from_s`: when it begins to count as old. Turned down, from `confirm_s` on, or from when the next two readings
    should have come, at the pace of the last two; silent, after five of its usual intervals, which are taken for long
    until some have come, and no less than 1 s.
    """

    __slots__ = ("_agreeing", "_confirm_s", "_level", "_pace_s", "_since_s", "_turn", "held", "old_from_s")

    def __init__(
        self,
        rate: float,
        floor: float,
        hold_s: float,
        confirm_s: float,
        most: float = inf,
        least: float | None = None,
        turn: float = inf,
    ) -> None:
        super().__init__(rate, floor, hold_s, most, least)
        self._confirm_s = confirm_s
        self._turn = turn
        self._agreeing = 0
        self._level = self._since_s = nan
        self._pace_s = _SLOWEST_S
        self.old_from_s = inf
        self.held = False

    def take(self, value: float, arrived_s: float) -> bool:
        """Judge one new value that came at `arrived_s`; False = turned down."""
        if not self._least < value < self._most:
            self._agreeing = 0
            self.suspect = True
            self.refused += 1
            return False
        waited = arrived_s - self.arrived_s
        step, reach = value - self.value, self._rate * waited + self._floor
        if abs(step) > reach and self._apart(step) > reach and not self._agrees(value, arrived_s):
            self.suspect = True
            self.refused += 1
            return False
        if step:
            self.changed_s = arrived_s
        self.suspect = self.held = False
        self.value, self.arrived_s, self._agreeing = value, arrived_s, 0
        self._pace_s += _SHARE * ((waited if waited < _SLOWEST_S else _SLOWEST_S) - self._pace_s)
        patience = _INTERVALS * self._pace_s
        self.old_from_s = arrived_s + (patience if patience > _PATIENCE_S else _PATIENCE_S)
        return True

    def _apart(self, step: float) -> float:
        """How far a step goes, an angle's the shorter way round."""
        return abs(remainder(step, self._turn)) if isfinite(step) else inf

    def _agrees(self, value: float, arrived_s: float) -> bool:
        """Whether a value far from the last accepted one is the last of enough that agree."""
        if self._agreeing and self._apart(value - self._level) <= self._floor:
            self._agreeing += 1
        else:
            self._agreeing, self._since_s = 1, arrived_s
        self._level = value
        return self._agreeing >= _AGREEING and arrived_s - self._since_s >= self._confirm_s

    def hold(self, arrived_s: float) -> None:
        """Note that the value that came at `arrived_s` was turned down."""
        if not self.held:
            waited = 0.0 if isnan(self.value) else arrived_s - self.arrived_s
            self.old_from_s = min(self.old_from_s, arrived_s + max(self._confirm_s, 2.5 * waited))
            self.held = True

    def age_s(self, now_s: float) -> float:
        """For how long it has counted as old that readings were turned down, or stayed out (0 = it does not)."""
        return max(now_s - self.old_from_s, 0.0)


class Sustained:
    """A condition that counts once it has lasted `for_s`; `age_s` = for how long it has counted (0 = it
    does not). `begun`: it held at the last step; while it has not, a step with it false changes nothing.
    """

    __slots__ = ("_for_s", "_since", "age_s", "begun")

    def __init__(self, for_s: float) -> None:
        self._for_s = for_s
        self._since = inf
        self.age_s = 0.0
        self.begun = False

    def step(self, condition: bool, now_s: float) -> bool:
        """Whether the condition has held since `for_s` ago."""
        if not condition:
            self._since, self.age_s, self.begun = inf, 0.0, False
            return False
        if not self.begun:
            self._since, self.begun = now_s, True
        lasted = now_s - self._since
        self.age_s = max(lasted - self._for_s, 0.0)
        return lasted >= self._for_s


class Latency:
    """How much later than usual a device's samples come, from its own time stamps: `excess_s` over the
    least seen.

    The least is let up by 200 ppm, more than clocks drift; a device that starts afresh starts a new least.
    """

    __slots__ = ("_device_s", "_least_s", "excess_s")

    def __init__(self) -> None:
        self._device_s = nan
        self._least_s = nan
        self.excess_s = 0.0

    def take(self, arrived_s: float, device_s: float) -> float:
        """Take a sample's arrival and its stamp (both s, each by its own clock); stamps seen before
        change nothing.
        """
        if isnan(device_s) or device_s == self._device_s:
            return self.excess_s
        late = arrived_s - device_s
        if not device_s > self._device_s:
            self._least_s = late
        else:
            self._least_s = min(self._least_s + 2e-4 * (device_s - self._device_s), late)
        self._device_s = device_s
        self.excess_s = late - self._least_s
        return self.excess_s


class Shaking:
    """Mean square of what is quick in a signal: the signal less its slow part (10 Hz), averaged
    over 30 ms.
    """

    __slots__ = ("_follow", "_forget", "_slow", "square")

    def __init__(self, period_s: float) -> None:
        self._follow = -expm1(-2.0 * pi * 10.0 * period_s)
        self._forget = -expm1(-period_s / 0.03)
        self._slow = nan
        self.square = 0.0

    def step(self, value: float) -> float:
        """Take a value once a period; returns the mean square. NaN is left out."""
        if not isnan(value):
            slow = value if isnan(self._slow) else self._slow
            slow += self._follow * (value - slow)
            self._slow = slow
            quick = value - slow
            self.square += self._forget * (quick * quick - self.square)
        return self.square
