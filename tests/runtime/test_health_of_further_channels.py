"""Temperature and further channels, by hand: what cannot be true, what leaps, what falls silent."""

from __future__ import annotations

from math import inf, nan, tau

import pytest
from fed_health import ALL, FURTHER, Fed, T, options

from cablecomp.links.records import MOTOR_TORQUE, TEMPERATURE
from cablecomp.runtime import health as h


@pytest.mark.parametrize("absurd", [327.67, -60.5, 200.5, 1e300, nan])
@pytest.mark.parametrize("needed", [True, False])
def test_a_temperature_that_cannot_be_true_is_held_out_and_makes_old_what_lives_on_it(
    absurd: float, needed: bool
) -> None:
    fed = Fed(needs_temperature=needed)
    fed.cycle(**ALL, temperature=31.0)
    assert fed.cycle(**ALL, temperature=31.5).sample.temperature_degC == 31.5
    for k in range(20):  # every reading from now on: old once it has lasted
        checked = fed.cycle(**ALL, temperature=absurd)
        assert checked.flags == h.TEMPERATURE_UNTRUE
        assert checked.sample.temperature_degC == fed.readings.values[TEMPERATURE] == 31.5
        assert checked.load_age_s == (max(k - 8, 0) * T if needed else 0.0)
    fed.cycle(**ALL, temperature=32.0)
    over = fed.cycle(**ALL, temperature=32.0)
    assert (over.flags, over.load_age_s, over.sample.temperature_degC) == (0, 0.0, 32.0)


def test_one_reading_of_a_slow_thermometer_that_cannot_be_true_makes_nothing_old() -> None:
    """It comes every 100 periods, and none is missed before the next two."""
    fed = Fed(needs_temperature=True)
    for k in range(600):
        came = {"temperature": 327.67 if k == 300 else 20.0} if k % 100 == 0 else {}
        checked = fed.cycle(**ALL, **came)
        assert checked.load_age_s == 0.0
        assert checked.sample.temperature_degC == 20.0
        assert checked.flags == (h.TEMPERATURE_UNTRUE if 300 <= k < 400 else 0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_leap_is_held_out_until_readings_that_agree_have_lasted(sign: float) -> None:
    """A single one passes by; a new level is believed before it makes anything old."""
    fed = Fed(options(temperature_rate_K_s=1.0), needs_temperature=True)
    for k in range(40):
        level = 31.0 + sign * 9.0 * (k == 4 or k >= 10)
        checked = fed.cycle(**ALL, temperature=level)
        held = k == 4 or 10 <= k < 18  # `confirm_s` is 8 periods
        assert checked.flags == (h.TEMPERATURE_UNTRUE if held else 0)
        assert checked.sample.temperature_degC == (31.0 if held else level)
        assert checked.load_age_s == 0.0


@pytest.mark.parametrize("first", [85.0, 0.0])
def test_a_first_reading_that_was_wrong_is_let_go_of(first: float) -> None:
    """What a thermometer says at power-on, then the truth, ten times a second."""
    fed = Fed(needs_temperature=True, period_s=0.1)
    for k in range(20):
        checked = fed.cycle(**ALL, temperature=25.0 if k else first)
        assert checked.load_age_s == 0.0
        assert checked.sample.temperature_degC == (25.0 if k >= 3 else first)
    assert checked.flags == 0


def test_after_a_glitch_a_thermometer_may_have_drifted() -> None:
    fed = Fed(needs_temperature=True, period_s=0.1)
    for k in range(120):
        came = 20.0 if k < 10 else 300.0 if k < 100 else 28.0
        checked = fed.cycle(**ALL, temperature=came)
        assert checked.sample.temperature_degC == (20.0 if k < 100 else 28.0)
        assert checked.flags == (h.TEMPERATURE_UNTRUE if 10 <= k < 100 else 0)


def test_a_further_angle_may_go_round() -> None:
    """An encoder that wraps at a full turn moves no further there than elsewhere."""
    fed = Fed(others=(FURTHER,))
    fed.readings.others = ("other_elbow_rad",)
    fed.readings.values.append(nan), fed.readings.arrived_s.append(nan), fed.readings.updates.append(0)
    for k in range(4000):
        angle = (5.5 + 2.0 * min(k, 4000 - k) * T) % tau
        checked = fed.cycle(**ALL, other_0=angle)
        assert (checked.flags, checked.sample.other) == (0, (angle,))


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        *[("other_1", 7.0, absurd) for absurd in (nan, inf, -inf)],
        *[("other_motor_degC", 40.0, absurd) for absurd in (-61.0, 201.0, inf)],
        *[("other_wrist_rad", 1.0, absurd) for absurd in (-inf, nan)],
        *[("other_wrist_Nm", 1.0, absurd) for absurd in (nan, inf)],
    ],
)
def test_a_further_channel_is_judged_by_its_unit_and_held(name: str, good: float, bad: float) -> None:
    fed = Fed(others=(FURTHER,))
    fed.readings.others = (name,)
    fed.readings.values.append(nan), fed.readings.arrived_s.append(nan), fed.readings.updates.append(0)
    assert fed.cycle(**ALL).flags == 0  # it has never come, and is no number
    assert fed.cycle(**ALL, other_0=good).sample.other == (good,)
    for k in range(20):
        checked = fed.cycle(**ALL, other_0=bad)
        assert (checked.flags, checked.sample.other) == (h.OTHER_UNTRUE, (good,))
        assert checked.load_age_s == max(k - 8, 0) * T
    fed.cycle(**ALL, other_0=good)
    assert fed.cycle(**ALL, other_0=good).flags == 0


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [("other_motor_degC", 40.0, 45.2), ("other_wrist_rad", 1.0, 1.25), ("other_wrist_Nm", 1.0, -9.6)],
)
def test_a_leap_of_a_further_channel_is_judged_by_its_unit(name: str, good: float, bad: float) -> None:
    fed = Fed(others=(FURTHER,))
    fed.readings.others = (name,)
    fed.readings.values.append(nan), fed.readings.arrived_s.append(nan), fed.readings.updates.append(0)
    for value, flags in ((good, 0), (bad, h.OTHER_UNTRUE), (good, 0)):
        checked = fed.cycle(**ALL, other_0=value)
        assert (checked.flags, checked.sample.other) == (flags, (good,))


def test_a_joint_waits_for_the_temperature_that_an_effect_reads() -> None:
    for came in ({}, {"temperature": -273.0}, {"temperature": nan}):
        fed = Fed(needs_temperature=True)
        for k in range(20):
            checked = fed.cycle(**ALL, **came)
            assert not checked.ready
            assert checked.load_age_s == (max(k - 8, 0) * T if came else 0.0)
            assert checked.flags == (h.TEMPERATURE_UNTRUE if came else 0)
        over = fed.cycle(**ALL, temperature=20.0)
        assert (over.ready, over.load_age_s, over.flags) == (True, 0.0, 0)
        assert Fed().cycle(**ALL, **came).ready  # nothing reads it


def test_a_joint_waits_for_the_further_channels_that_effects_read() -> None:
    fed = Fed(count=1, others=(FURTHER,))
    assert not fed.cycle(**ALL).ready
    assert not fed.cycle(**ALL, other_0=nan).ready
    assert fed.cycle(**ALL, other_0=1.0).ready


@pytest.mark.parametrize("needed", [True, False])
def test_a_thermometer_that_falls_silent_makes_old_what_lives_on_it(needed: bool) -> None:
    """It came ten times a second; it is missed after a second, and no more once it comes again."""
    fed = Fed(needs_temperature=needed, period_s=0.1)
    for _ in range(40):
        assert fed.cycle(**ALL, temperature=20.0).flags == 0
    for k in range(1, 100):
        checked = fed.cycle(**ALL)
        assert checked.load_age_s == pytest.approx(max(0.1 * k - 1.0, 0.0) if needed else 0.0, abs=1e-9)
        if k != 10:
            assert checked.flags == (h.TEMPERATURE_STALE if needed and k > 10 else 0)
        assert checked.ready
    untrue = fed.cycle(**ALL, temperature=nan)
    assert untrue.flags == h.TEMPERATURE_UNTRUE
    assert untrue.load_age_s == pytest.approx(9.0 if needed else 0.0)
    over = fed.cycle(**ALL, temperature=21.0)
    assert (over.flags, over.load_age_s, over.sample.temperature_degC) == (0, 0.0, 21.0)


@pytest.mark.parametrize("every", [1, 10, 100])
def test_a_slow_thermometer_is_no_alarm_and_is_missed_later(every: int) -> None:
    """Every 0.1, 1 or 10 s, some readings lost, the first two at once."""
    fed = Fed(needs_temperature=True, period_s=0.1)
    for k in range(30 * every):
        came = {"temperature": 20.0} if k < 2 or (k % every == 0 and k % (7 * every)) else {}
        checked = fed.cycle(**ALL, **came)
        assert (checked.flags, checked.load_age_s) == (0, 0.0)
    silent = [fed.cycle(**ALL).load_age_s for _ in range(601)]
    assert silent[-1] > 0.0


def test_a_further_channel_that_falls_silent_is_said() -> None:
    fed = Fed(count=1, others=(FURTHER,), period_s=0.1)
    for _ in range(40):
        assert fed.cycle(**ALL, other_0=1.0).flags == 0
    assert [fed.cycle(**ALL).flags for _ in range(12)][-1] == h.OTHER_STALE


def test_a_further_channel_without_a_unit_may_be_anything_finite() -> None:
    fed = Fed(count=1, others=(FURTHER,))
    for value in (0.0, 1e300, -1e300, 5.0):
        checked = fed.cycle(**ALL, other_0=value)
        assert (checked.flags, checked.sample.other) == (0, (value,))


@pytest.mark.parametrize("every", [1, 10])
def test_a_motor_torque_that_stays_out_is_old_where_the_load_is_found_from_it(every: int) -> None:
    """It may come in a message of its own, while the motor's position goes on."""
    fed = Fed(needs_torque=False, needs_motor_torque=True)
    readings = fed.readings
    for k in range(3000):
        if k % every == 0 and k < 1500:
            readings.arrived_s[MOTOR_TORQUE] = (fed.k + 1) * T
            readings.updates[MOTOR_TORQUE] += 1
            checked = fed.cycle(motor=0.0, motor_torque=0.1)
        else:
            checked = fed.cycle(motor=0.0)
        if k < 1500:
            assert (checked.flags, checked.load_age_s, checked.ready) == (0, 0.0, True)
    assert checked.flags == h.MOTOR_TORQUE_STALE
    assert checked.load_age_s > 0.4
