"""Laws of one channel's values, conditions, lateness and shaking, worked out by hand; the period is a power of two, so
that times are exact."""

from __future__ import annotations

from math import exp, inf, nan

import pytest

from cablecomp.runtime.channel import Channel, Latency, Seldom, Shaking, Sustained

T = 1.0 / 1024.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("moved", "taken"), [(0.5 + 0.125, True), (0.5 + 0.126, False)])
def test_a_value_may_move_by_rate_times_time_and_the_floor(moved: float, taken: bool, sign: float) -> None:
    channel = Channel(64.0, 0.125, 4.0 * T, 100.0)
    assert channel.take(1.0, 0.0)
    assert channel.take(1.0 + sign * moved, 8.0 * T) is taken
    assert channel.suspect is not taken
    assert channel.refused == (not taken)
    assert channel.value == (1.0 + sign * moved if taken else 1.0)
    assert (channel.arrived_s, channel.changed_s) == ((8.0 * T, 8.0 * T) if taken else (0.0, 0.0))


@pytest.mark.parametrize("bad", [50.0, inf, nan])
@pytest.mark.parametrize(("back", "taken"), [(0.25 + 0.125, True), (0.25 + 0.126, False)])
def test_after_a_jump_a_value_has_to_come_back_near_the_last_good_one(
    back: float, taken: bool, bad: float
) -> None:
    """Within the rate times the time that a value is held, and the floor; no less after what is no number."""
    for at in (1.0 + back, 1.0 - back):
        judged = Channel(64.0, 0.125, 4.0 * T, 100.0)
        judged.take(1.0, 0.0)
        assert not judged.take(bad, T)
        assert judged.take(at, 9.0 * T) is taken
        assert judged.suspect is not taken
        assert judged.refused == 1 + (not taken)


@pytest.mark.parametrize(
    ("value", "suspect"),
    [(2.0, False), (-2.0, False), (3.0, False), (-3.0, False), (inf, True), (nan, True)],
)
def test_what_is_out_of_range_is_turned_down_and_what_is_no_number_is_suspect(
    value: float, suspect: bool
) -> None:
    channel = Channel(1e9, 0.0, T, 2.0)
    assert channel.take(1.9, 0.0)
    assert not channel.take(value, T)
    assert (channel.value, channel.suspect, channel.refused) == (1.9, suspect, 1)


def test_a_value_that_stays_has_arrived_and_not_changed() -> None:
    channel = Channel(1.0, 1.0, T)
    for k in range(3):
        assert channel.take(0.5, k * T)
        assert (channel.arrived_s, channel.changed_s) == (k * T, 0.0)
    assert channel.take(0.6, 3.0 * T)
    assert channel.changed_s == 3.0 * T


def test_the_first_value_is_taken_wherever_it_is() -> None:
    channel = Channel(1.0, 0.0, T)
    assert (channel.arrived_s, channel.changed_s, channel.suspect) == (-inf, -inf, False)
    assert channel.seen == 0
    assert channel.take(12345.0, 7.0)


@pytest.mark.parametrize(("moved", "taken"), [(0.125 + 6.0, True), (0.125 + 6.01, False)])
def test_what_is_seldom_may_have_moved_since_its_last_good_value_by_rate_times_time(
    moved: float, taken: bool
) -> None:
    channel = Seldom(2.0, 0.125, T, 1.0, 100.0)
    assert channel.take(1.0, 0.0)
    for k in (1.0, 2.0):
        assert not channel.take(nan, k)
    assert channel.take(1.0 + moved, 3.0) is taken


def test_a_level_takes_three_readings_in_a_row_that_agree() -> None:
    """However far apart they come; what is no number, and what is out of range, breaks the row."""
    channel = Seldom(1e-6, 0.125, T, 0.5, 100.0)
    assert channel.take(1.0, 0.0)
    for k, value in enumerate((9.0, 9.1, 9.3, 9.3, nan, 9.3, 9.3, 500.0, 9.3, 9.4, 1e308, -1e308, inf)):
        assert not channel.take(value, k + 1.0)
    assert [channel.take(value, 20.0 + k) for k, value in enumerate((9.3, 9.2, 9.1))] == [False, False, True]
    assert channel.value == 9.1


def test_readings_that_agree_have_to_last() -> None:
    channel = Seldom(1e-6, 0.125, T, 8.0 * T, 100.0)
    assert channel.take(1.0, 0.0)
    assert [channel.take(9.0, k * T) for k in range(1, 10)] == 8 * [False] + [True]


def test_no_step_is_too_great_to_be_judged() -> None:
    channel = Seldom(1.0, 0.05, T, 0.1, turn=6.283185307179586)
    assert channel.take(1.7e308, 0.0)
    assert [channel.take(-1.7e308, float(k)) for k in range(1, 4)] == [False, False, True]


def test_a_condition_lasts_from_its_first_step() -> None:
    held = Sustained(4.0 * T)
    assert held.age_s == 0.0
    ages = [(held.step(k >= 2, k * T), held.age_s / T) for k in range(9)]
    assert ages == 6 * [(False, 0)] + [(True, 0), (True, 1), (True, 2)]
    assert held.begun
    assert not held.step(False, 9.0 * T)
    assert not held.begun
    assert not held.step(True, 20.0 * T)


def test_the_least_lateness_rises_by_200_ppm() -> None:
    latency = Latency()
    assert latency.take(9.0, nan) == 0.0
    assert latency.take(10.5, 10.0) == 0.0
    assert latency.take(20.75, 20.0) == pytest.approx(0.25 - 2e-4 * 10.0)
    assert latency.take(99.0, float("20")) == latency.take(99.0, nan) == pytest.approx(0.248)  # nothing new
    assert latency.take(30.4, 30.0) == 0.0
    assert latency.take(31.4, 31.0) == 0.0


@pytest.mark.parametrize("period", [T, 64.0 * T])
def test_shaking_is_what_two_filters_in_a_row_leave(period: float) -> None:
    shaking = Shaking(period)
    follow, forget = 1.0 - exp(-2.0 * 3.141592653589793 * 10.0 * period), 1.0 - exp(-period / 0.03)
    slow, square = 2.0, 0.0
    for value in (2.0, 3.0, nan, 1.0, 5.0):
        found = shaking.step(value)
        if value == value:
            slow += follow * (value - slow)
            square += forget * ((value - slow) ** 2 - square)
        assert found == pytest.approx(square)
