"""Sequence counters and device clocks: what is counted is what happened."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablecomp.links.readings import DeviceClock, MessageStats


@given(st.integers(0, 2**32 - 1), st.sampled_from([16, 256, 65536]), st.integers(10, 300))
def test_lost_frames_are_counted_exactly(seed: int, modulus: int, n: int) -> None:
    rng = random.Random(seed)
    start = rng.randrange(modulus)
    stats = MessageStats("m")
    received = [0]
    k = 0
    for _ in range(n):
        k += rng.randint(1, modulus // 2 - 1) if rng.random() < 0.2 else 1
        received.append(k)
    assert all(stats.accept((start + i) % modulus, modulus) for i in received)
    assert stats.lost == k - (len(received) - 1)
    assert (stats.repeated, stats.reordered, stats.restarts) == (0, 0, 0)


def test_repeated_and_reordered_frames_are_not_used() -> None:
    stats = MessageStats("m")
    taken = [s for s in (10, 11, 11, 13, 12, 14) if stats.accept(s, 256)]
    assert taken == [10, 11, 13, 14]
    assert (stats.lost, stats.repeated, stats.reordered, stats.restarts) == (1, 1, 1, 0)


def test_half_of_the_counter_ahead_is_as_well_behind_and_is_not_used() -> None:
    """127 of 256 on has lost 126; 128 on may as well come from before."""
    ahead, either = MessageStats("m"), MessageStats("m")
    assert [ahead.accept(s, 256) for s in (200, 71)] == [True, True]
    assert [either.accept(s, 256) for s in (200, 72)] == [True, False]
    assert (ahead.lost, ahead.reordered) == (126, 0)
    assert (either.lost, either.reordered) == (0, 1)


def test_a_restart_is_taken_at_its_third_frame() -> None:
    stats = MessageStats("m")
    assert all(stats.accept(s, 256) for s in range(90, 101))
    assert [stats.accept(s, 256) for s in (0, 1, 2, 3)] == [False, False, True, True]
    assert (stats.restarts, stats.reordered, stats.lost) == (1, 0, 0)


def test_old_frames_that_do_not_follow_each_other_are_no_restart() -> None:
    stats = MessageStats("m")
    for s in (100, 50, 101, 60, 102, 70, 80, 90):
        stats.accept(s, 256)
    assert stats.restarts == 0
    assert stats.reordered == 5
    assert stats.sequence == 102


def test_a_stuck_counter_never_refreshes() -> None:
    stats = MessageStats("m")
    assert stats.accept(5, 256)
    assert not any(stats.accept(5, 256) for _ in range(1000))
    assert stats.repeated == 1000


@given(st.lists(st.integers(0, 2**15 - 2), min_size=1, max_size=200))
def test_the_device_clock_does_not_run_backwards(steps: list[int]) -> None:
    clock, t = DeviceClock(1e-6, 16), 0
    for step in steps:
        t += step
        assert clock.seconds(t % 2**16) == pytest.approx(t * 1e-6, abs=1e-12)


def test_the_device_clock_wraps_by_over_half_of_its_range_alone() -> None:
    """A stamp from a little before is that, and no turn of the counter."""
    clock = DeviceClock(1e-3, 8)
    assert [clock.seconds(c) for c in (200, 100, 228, 99)] == pytest.approx([0.2, 0.1, 0.228, 0.256 + 0.099])
