"""Absolute ticks keep the rate whatever the work takes; histograms know their percentiles; the policy
is put back.
"""

from __future__ import annotations

import gc
import sys

import numpy as np
import pytest

from cablecomp.errors import InputError
from cablecomp.runtime.clock import MonotonicClock, SteppedClock, Ticker
from cablecomp.runtime.priority import Policy, armed
from cablecomp.runtime.timing import CycleTimes, Histogram


class WorkingClock:
    """Simulated time in which the caller can spend some."""

    def __init__(self) -> None:
        self.time = 10.0

    def now(self) -> float:
        return self.time

    def wait_until(self, due_s: float) -> None:
        self.time = max(self.time, due_s)


def test_the_grid_does_not_move_whatever_the_work_takes() -> None:
    clock = WorkingClock()
    ticker = Ticker(clock, 1e-3)
    rng = np.random.default_rng(3)
    for k in range(2000):
        tick = ticker.wait()
        assert tick.number == k
        assert tick.due_s == pytest.approx(k * 1e-3, abs=1e-12)
        clock.time += float(rng.uniform(0.0, 0.9e-3))
    assert ticker.skipped == 0
    assert clock.time - 10.0 < 2.0


def test_ticks_that_cannot_be_kept_are_skipped_and_counted() -> None:
    clock = WorkingClock()
    ticker = Ticker(clock, 1e-3)
    numbers = []
    for k in range(100):
        tick = ticker.wait()
        numbers.append(tick.number)
        assert tick.late_s < 1e-3
        clock.time += 3.4e-3 if k % 10 == 0 else 0.1e-3
    assert ticker.skipped == 2 * 10 + 10 * (0 if (3.4 % 1.0) < 1.0 else 1)
    assert numbers[-1] == 99 + ticker.skipped
    steps = np.diff(numbers)
    assert set(steps) == {1, 3}


def test_stepped_time_goes_where_it_is_told() -> None:
    clock = SteppedClock()
    ticker = Ticker(clock, 0.01)
    for _ in range(5):
        ticker.wait()
    assert clock.now() == pytest.approx(0.04)
    clock.wait_until(0.0)
    assert clock.now() == pytest.approx(0.04)


def test_real_time_passes() -> None:
    clock = MonotonicClock()
    before = clock.now()
    clock.wait_until(before)
    assert clock.now() >= before
    with pytest.raises(InputError, match="period"):
        Ticker(clock, 0.0)


def test_percentiles_are_known_to_two_percent() -> None:
    rng = np.random.default_rng(1)
    values = rng.lognormal(-10.0, 1.0, 50_000)
    histogram = Histogram()
    for value in values:
        histogram.add(float(value))
    spread = histogram.spread()
    assert spread.count == 50_000
    assert spread.mean_s == pytest.approx(values.mean())
    assert spread.max_s == values.max()
    for share, found in ((0.5, spread.p50_s), (0.99, spread.p99_s), (0.999, spread.p999_s)):
        assert found == pytest.approx(np.quantile(values, share), rel=0.025)


def test_a_histogram_does_not_grow() -> None:
    times = CycleTimes()
    size = sys.getsizeof(times.step._bins)
    for k in range(100_000):
        times.step.add(1e-7 * (k % 1000 + 1))
    assert sys.getsizeof(times.step._bins) == size
    assert np.isnan(times.cycle.spread().p50_s)


def test_the_policy_is_put_back_and_says_what_was_had() -> None:
    was_on, interval = gc.isenabled(), sys.getswitchinterval()
    with armed(Policy(fifo_priority=None, lock_memory=False)) as granted:
        assert not gc.isenabled()
        assert len(granted.lines) == 3
    assert gc.isenabled() == was_on
    assert sys.getswitchinterval() == interval


def test_what_is_not_permitted_is_said_and_survived(monkeypatch: pytest.MonkeyPatch) -> None:
    import os
    import resource

    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (65536, 65536))
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    with armed(Policy()) as granted:
        pass
    assert any("not permitted" in line for line in granted.lines)
    assert any("RLIMIT_MEMLOCK is 64 KiB" in line for line in granted.lines)
