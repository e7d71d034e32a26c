"""Time as an argument: clocks that can be waited on, and a grid of absolute ticks with counted skips."""

from __future__ import annotations

import time
from typing import NamedTuple, Protocol

from cablecomp.errors import InputError


class Clock(Protocol):
    """Seconds that only grow, and a way to wait for one of them."""

    def now(self) -> float:
        """Present time, s."""

    def wait_until(self, due_s: float) -> None:
        """Return at `due_s` or later; at once if that has passed."""


class MonotonicClock:
    """The system's monotonic clock, from zero at its making; sleeps, and spins for the last `spin_s`."""

    def __init__(self, spin_s: float = 0.0) -> None:
        self._start = time.perf_counter()
        self._spin_s = spin_s

    def now(self) -> float:
        """See `Clock.now`."""
        return time.perf_counter() - self._start

    def wait_until(self, due_s: float) -> None:
        """See `Clock.wait_until`."""
        left = due_s - self.now()
        if left > self._spin_s:
            time.sleep(left - self._spin_s)
        while self.now() < due_s:
            pass


class SteppedClock:
    """Simulated time: waiting for an instant makes it the present one."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """See `Clock.now`."""
        return self._now

    def wait_until(self, due_s: float) -> None:
        """See `Clock.wait_until`."""
        self._now = max(self._now, due_s)


class Tick(NamedTuple):
    """One tick of the grid: its number, when it was due, when it began (s), and how many before it were
    skipped."""

    number: int
    due_s: float
    now_s: float
    skipped: int

    @property
    def late_s(self) -> float:
        """How late it began, s."""
        return self.now_s - self.due_s


class Ticker:
    """Ticks at `start + k period`, whatever the work between takes: lateness never shifts the grid.

    A tick whose successor is already due when it could begin is skipped and counted; rate is kept, phase is
    kept. `from_s`: what the grid's own time starts from.
    """

    def __init__(self, clock: Clock, period_s: float, from_s: float = 0.0) -> None:
        if not period_s > 0.0:
            raise InputError(f"period is {period_s} s; a time above 0 is accepted")
        self.period_s = period_s
        self.skipped = 0
        self._clock = clock
        self._start = clock.now()
        self._from = from_s
        self._next = 0

    def wait(self) -> Tick:
        """Wait for the next tick that can still begin within its own period."""
        due = self._start + self._next * self.period_s
        self._clock.wait_until(due)
        now = self._clock.now()
        late = int((now - due) / self.period_s + 1e-9)
        if late > 0:
            self._next += late
            self.skipped += late
            due = self._start + self._next * self.period_s
        tick = Tick(self._next, due - self._start + self._from, now - self._start + self._from, late)
        self._next += 1
        return tick
