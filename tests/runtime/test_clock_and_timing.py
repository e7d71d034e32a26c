"""Absolute ticks keep the rate whatever the work takes; histograms know their percentiles; the policy
is put back.
"""

from __future__ import annotations

import gc
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cablecomp.errors import InputError
from cablecomp.links.link import LinkStatus
from cablecomp.links.records import BusState
from cablecomp.runtime.accounts import Accounts
from cablecomp.runtime.clock import MonotonicClock, SteppedClock, Tick, Ticker
from cablecomp.runtime.histogram import CycleTimes, Histogram
from cablecomp.runtime.minutes import Minutes, shown
from cablecomp.runtime.priority import QUIET, Policy, armed


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


def test_the_garbage_collector_is_the_callers_afterwards_and_in_stepped_time() -> None:
    """What a caller froze is looked through no more, whatever ran meanwhile."""
    gc.freeze()
    with armed(Policy(fifo_priority=None, lock_memory=False)):
        pass
    assert gc.get_freeze_count() > 0
    was_on = gc.isenabled()
    with armed(QUIET):
        assert gc.isenabled() == was_on


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


def test_what_came_since_is_what_was_added_since() -> None:
    rng = np.random.default_rng(4)
    first, later, whole = Histogram(), Histogram(), Histogram()
    for k, x in enumerate(rng.uniform(1e-6, 1e-3, 3000)):
        whole.add(x)
        (first if k < 1000 else later).add(x)
        if k == 999:
            before = whole.copy()
    since = whole.since(before)
    for share in (0.1, 0.5, 0.99):
        assert since.quantile(share) == later.quantile(share)
    assert since.count == 2000
    assert since.total == pytest.approx(later.total)
    assert later.greatest <= since.greatest <= 1.03 * later.greatest
    assert whole.since(whole.copy()).count == 0


@pytest.mark.parametrize(
    ("late_ms", "took_ms", "missed"),
    [(0.0, 0.9, 0), (0.0, 1.1, 1), (0.6, 0.3, 0), (0.6, 0.5, 1), (0.9, 0.2, 1)],
)
def test_a_cycle_is_missed_that_ends_after_the_next_tick_is_due(
    late_ms: float, took_ms: float, missed: int
) -> None:
    """However short it was, if it began late."""
    accounts = Accounts(1e-3)
    begin = 7.0  # by another clock than the ticks'
    tick = Tick(5, 5e-3, 5e-3 + 1e-3 * late_ms, 0)
    accounts.cycle(tick, begin, begin + 5e-5, begin + 1e-3 * took_ms)
    assert accounts.times.misses == missed
    found = [getattr(accounts.times, name).spread().max_s for name in ("jitter", "poll", "cycle")]
    assert found == pytest.approx([1e-3 * late_ms, 5e-5, 1e-3 * took_ms])


def status_with(lost: int) -> LinkStatus:
    return LinkStatus(BusState.ACTIVE, "", *[0] * 15)._replace(lost=lost)


def test_minutes_count_their_own_only() -> None:
    minutes, times = Minutes(), CycleTimes()
    for number in range(1, 31):
        for _ in range(100):
            times.step.add(number * 1e-6)
            times.cycle.add(10.0 * number * 1e-6)
        times.misses += number
        minute = minutes.close(times, 2 * number, status_with(3 * number))
        assert minute.number == number
        assert minutes.due_s == 60.0 * (number + 1)
        assert minute.step_p50_s == pytest.approx(number * 1e-6, rel=0.012)
        assert minute.cycle_p99_s == pytest.approx(10.0 * number * 1e-6, rel=0.012)
        assert (minute.misses, minute.skipped, minute.lost_frames) == (number, 2, 3)
    assert [m.number for m in shown(tuple(minutes.done[:4]))] == [1, 2, 3, 4]
    some = [m.number for m in shown(tuple(minutes.done))]
    assert {1, 2, 30} <= set(some)
    assert len(some) <= 13


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="resident memory is read on Linux alone")
def test_resident_memory_grows_by_what_is_taken() -> None:
    """In a process of its own: in this one others' memory goes back meanwhile."""
    lines = (
        "import numpy as np",
        "from cablecomp.runtime.minutes import resident_MB",
        "before = resident_MB()",
        "taken = np.ones(25_000_000)",
        "print(resident_MB() - before)",
    )
    told = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=True
    )
    assert 150.0 < float(told.stdout) < 250.0
