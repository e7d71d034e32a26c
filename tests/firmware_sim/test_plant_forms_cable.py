"""Other forms of what the cable is and of its pretension, against laws worked out apart."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from plant_effect_course import WARM, T
from plant_joints import clock, course, joint
from scipy.integrate import quad, solve_ivp

from firmware_sim.plant import EffectSpec, simulate

STICKS = 50.0


def _still(effect: EffectSpec, warm: np.ndarray, start_s: float = 0.0) -> np.ndarray:
    """T_h over T0 of a joint that is left alone; both cables pull alike."""
    config = joint()
    still = 0.0 * T
    run = simulate(config, T + start_s, still, still, effects=(effect,), temperature_degC=warm)
    np.testing.assert_allclose(run.tension_l_N, run.tension_h_N, rtol=1e-9)
    return np.asarray(run.tension_h_N / config.stages[0].pretension_N)


def test_creep_by_a_power_goes_on_from_recording_to_recording() -> None:
    law = EffectSpec(
        "pretension_relaxation:power_law", {"fraction": 0.04, "exponent": 0.4, "scale_s": 5.0, "age_s": 3.0}
    )
    for start in (0.0, 60.0):
        expected = 1 - 0.04 * (((T + start + 3.0) / 5.0) ** 0.4 - (3.0 / 5.0) ** 0.4)
        np.testing.assert_allclose(_still(law, 0 * T + 20.0, start), expected, rtol=1e-6)


def test_a_termination_beds_in_and_comes_to_rest() -> None:
    law = EffectSpec("pretension_relaxation:exponential", {"fraction": 0.05, "time_constant_s": 1.5})
    np.testing.assert_allclose(_still(law, 0 * T + 20.0), 1 - 0.05 * (1 - np.exp(-T / 1.5)), rtol=1e-6)
    np.testing.assert_allclose(_still(law, 0 * T + 20.0, 100.0), 0.95, rtol=1e-6)


def test_a_termination_beds_in_while_the_cable_creeps_on() -> None:
    law = EffectSpec(
        "pretension_relaxation:in_two",
        {"fraction": 0.06, "share": 0.4, "time_constant_s": 0.8, "lasts_s": 20.0},
    )
    for start in (0.0, 60.0):
        since = T + start
        expected = 1 - 0.024 * (1 - np.exp(-since / 0.8)) - 0.036 * since / 20.0
        np.testing.assert_allclose(_still(law, 0 * T + 20.0, start), expected, rtol=1e-6)


def test_a_polymer_relaxes_by_a_stretched_exponential() -> None:
    law = EffectSpec(
        "pretension_relaxation:stretched", {"fraction": 0.07, "time_constant_s": 1.7, "exponent": 0.4}
    )
    for start in (0.0, 60.0):
        expected = 0.93 + 0.07 / np.exp(((T + start) / 1.7) ** 0.4)
        np.testing.assert_allclose(_still(law, 0 * T + 20.0, start), expected, rtol=1e-6)


def _run(effect: EffectSpec, motor: np.ndarray, load: np.ndarray, start_s: float = 0.0) -> np.ndarray:
    """Mean tension over T0 of a joint that is run; what one cable gains the other loses."""
    config = joint()
    run = simulate(config, T + start_s, motor, load, effects=(effect,))
    return np.asarray(0.5 * (run.tension_h_N + run.tension_l_N) / config.stages[0].pretension_N)


def test_a_new_cable_beds_in_by_the_way_that_it_is_run() -> None:
    law = EffectSpec("pretension_relaxation:by_travel", {"fraction": 0.08, "travel_rad": 3.0})
    there_and_back = 0.8 * np.abs((T - 1.0) % 2.0 - 1.0)  # 0.8 rad in every second
    for start in (0.0, 5.0):
        expected = 1 - 0.08 * (1 - np.exp(-0.8 * (T + start) / 3.0))
        np.testing.assert_allclose(_run(law, there_and_back, 0.0 * T, start), expected, atol=3e-4)


def test_a_cable_creeps_as_it_is_loaded() -> None:
    law = EffectSpec(
        "pretension_relaxation:under_load", {"fraction": 0.05, "usual_Nm": 0.2, "time_constant_s": 4.0}
    )
    load = np.where(T < 1.0, 0.2, 0.0)  # then nothing more
    without = _run(EffectSpec("pretension_relaxation:under_load", {"fraction": 0.0}), 0.0 * T, load)
    lost = without - _run(law, 0.0 * T, load)
    np.testing.assert_allclose(lost, 0.05 * np.cbrt(np.minimum(T, 1.0) / 4.0), atol=6e-4)


def test_a_frame_that_closes_a_gap_pulls_from_then_on() -> None:
    law = EffectSpec("thermal_pretension:from_contact", {"coefficient_per_K": -0.02, "contact_degC": 21.0})
    expected = np.where(WARM > 21.0, 1 - 0.02 * (WARM - 21.0), 1.0)
    assert 0.1 < np.mean(WARM > 21.0) < 0.9
    np.testing.assert_allclose(_still(law, WARM), expected, rtol=1e-6)


def test_a_frame_that_sticks_and_slides_follows_behind_a_play() -> None:
    """It warms up to 4 K more and cools down again: held for 1.5 K at first, and for 3 K at the turn."""
    law = EffectSpec(
        "thermal_pretension:sticking", {"coefficient_per_K": 0.02, "reference_degC": 19.0, "stick_K": 1.5}
    )
    over = 4.0 * np.sin(0.8 * T)
    cools = np.cos(0.8 * T) < 0.0
    followed = np.where(cools, np.minimum(over + 1.5, 2.5), np.maximum(over - 1.5, 0.0))
    assert followed[-1] < 1.5
    np.testing.assert_allclose(_still(law, 20.0 + over), 1 + 0.02 * (1.0 + followed), atol=2e-6)


def test_warmth_quickens_creep() -> None:
    law = EffectSpec(
        "pretension_relaxation:warm_creep", {"fraction": 0.03, "time_constant_s": 0.8, "doubling_K": 4.0}
    )
    logarithm = 0.03 * np.log1p(T / 0.8)
    np.testing.assert_allclose(1 - _still(law, 0 * T + 20.0), logarithm, rtol=2e-3, atol=1e-6)
    np.testing.assert_allclose(1 - _still(law, 0 * T + 24.0), 2 * logarithm, rtol=2e-3, atol=1e-6)


def _follower(lag: float) -> np.ndarray:
    """What follows the temperature with a lag, by an integrator of its own."""
    found = solve_ivp(
        lambda t, y: (np.interp(t, T, WARM) - y) / lag,
        (0, T[-1]),
        [WARM[0]],
        t_eval=T,
        rtol=1e-9,
        max_step=0.01,
    )
    return np.asarray(found.y[0])


def test_thermal_pretension_lags_bends_or_passes() -> None:
    lagged = EffectSpec(
        "thermal_pretension:lagged", {"coefficient_per_K": 0.02, "reference_degC": 21.0, "lag_s": 0.7}
    )
    np.testing.assert_allclose(_still(lagged, WARM), 1 + 0.02 * (_follower(0.7) - 21.0), rtol=1e-5)
    bent = EffectSpec("thermal_pretension:quadratic", {"coefficient_per_K": 0.02, "bend_per_K": -0.1})
    over = WARM - 20.0
    np.testing.assert_allclose(_still(bent, WARM), 1 + 0.02 * over * (1 - 0.1 * over), rtol=1e-6)
    passing = EffectSpec(
        "thermal_pretension:transient", {"coefficient_per_K": 0.02, "quick_s": 0.1, "slow_s": 0.9}
    )
    np.testing.assert_allclose(_still(passing, WARM), 1 + 0.02 * (_follower(0.1) - _follower(0.9)), rtol=1e-5)
    np.testing.assert_allclose(_still(passing, 0 * T + 30.0), 1.0, rtol=1e-9)  # all equally warm


@pytest.mark.parametrize(
    ("name", "parameters", "stiffness"),
    [
        ("saturating", {"softness": 0.7, "reach": 0.5}, lambda t: 1 - 0.7 * math.exp(-t / 0.5)),
        ("power_law", {"exponent": 0.4}, lambda t: (t + 0.02) ** 0.4),
        (
            "knee",
            {"rise": 0.8, "place": 1.3, "width": 0.2},
            lambda t: 1 + 0.4 * (1 + math.tanh((t - 1.3) / 0.2)),
        ),
        (
            "s_shaped",
            {"dip": 0.6, "place": 1.2, "width": 0.3},
            lambda t: 1 - 0.6 * math.exp(-((t - 1.2) ** 2) / 0.09),
        ),
    ],
)
def test_a_cable_is_as_stiff_as_its_tension_makes_it(
    name: str, parameters: dict[str, float], stiffness: Callable[[float], float]
) -> None:
    """Open circuit without slip: the free span stretches by T0 L/EA ∫ g(1)/g dτ; no loop."""
    config = joint("open", mu_output=STICKS, mu_input=STICKS, free_length_m=1.0)
    s = config.stages[0]
    load = course(0.0, 1.5, -0.7, 0.0, points=50)
    moment = load * s.output_radius_m * s.pretension_N
    effect = EffectSpec(f"nonlinear_cable:{name}", parameters)
    run = simulate(config, clock(load), 0 * load, moment, effects=(effect,))
    whole = stiffness(1.0)
    strain = np.array([quad(lambda t: whole / stiffness(t), 1.0, 1.0 + m)[0] for m in load])
    expected = s.pretension_N * s.free_length_m / (s.EA_N * s.output_radius_m) * strain
    assert np.max(np.abs(run.joint_position_rad - expected)) < 0.01 * np.ptp(expected)


def _stretch(effect: EffectSpec, load: np.ndarray, dt: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    """Tension less T0, and what the effect adds to the free span in units of its elastic stretch per newton."""
    config = joint("open")
    s = config.stages[0]
    moment = load * s.output_radius_m * s.pretension_N
    plain = simulate(config, clock(load, dt), 0 * load, moment)
    run = simulate(config, clock(load, dt), 0 * load, moment, effects=(effect,))
    added = (run.joint_position_rad - plain.joint_position_rad) * s.output_radius_m * s.EA_N / s.free_length_m
    return plain.tension_h_N - s.pretension_N, added


def test_many_strands_obey_masings_rule() -> None:
    """The branch after a reversal is the first one twice as large, from the reversal on."""
    effect = EffectSpec("strand_friction:masing", {"fraction": 0.5, "yield_N": 10.0})
    pull, added = _stretch(effect, course(0.0, 0.8, -0.4, points=200))
    first = slice(0, 200)
    assert np.all(np.diff(added[first]) >= -1e-9)
    slopes = np.diff(added[first]) / np.diff(pull[first])
    assert slopes[0] == pytest.approx(0.0, abs=0.05)  # all stick
    assert slopes[-1] == pytest.approx(0.5, rel=0.02)  # all follow
    back = np.arange(200, 401)
    expected = added[200] - 2 * np.interp((pull[200] - pull[back]) / 2, pull[first], added[first])
    assert np.max(np.abs(added[back] - expected)) < 0.01 * np.ptp(added)


def test_layers_that_grip_ever_less_are_plays_each_with_a_third_of_the_next() -> None:
    effect = EffectSpec("strand_friction:graded", {"fraction": 0.6, "yield_N": 9.0})
    pull, added = _stretch(effect, course(0.0, 0.8, -0.4, 0.3, points=200))
    expected = np.zeros(len(pull))
    for radius in (9.0, 3.0, 1.0, 1 / 3, 1 / 9, 1 / 27):
        rest = 0.0
        for k, x in enumerate(pull):
            rest = min(max(rest, x - radius), x + radius)
            expected[k] += 0.1 * rest
    assert np.max(np.abs(added - expected)) < 5e-3 * np.ptp(expected)


def test_greased_strands_yield_in_their_own_time() -> None:
    ramp = course(0.0, 0.8, points=20)
    load = np.concatenate([ramp, np.full(300, 0.8)])
    effect = EffectSpec("strand_friction:rate_dependent", {"fraction": 0.5, "yield_N": 8.0, "time_s": 0.4})
    pull, added = _stretch(effect, load, dt=0.004)
    end = 0.5 * (pull[-1] - 8.0)
    left = end - added[21:]
    elapsed = 0.004 * np.arange(len(left))
    np.testing.assert_allclose(left[:250], left[0] * np.exp(-elapsed / 0.4)[:250], rtol=0.02, atol=1e-3 * end)
    quick = EffectSpec("strand_friction", {"fraction": 0.5, "yield_N": 8.0})
    slow = course(0.0, 0.8, -0.4, points=60)
    np.testing.assert_allclose(_stretch(effect, slow, 1e3)[1], _stretch(quick, slow, 1e3)[1], atol=0.01)


def test_pressed_strands_hold_back_by_a_share_of_the_tension() -> None:
    effect = EffectSpec("strand_friction:proportional", {"fraction": 0.5, "share": 0.1})
    pull, added = _stretch(effect, course(0.0, 0.8, -0.4, 0.5, points=150))
    T0, at, expected = 50.0, 50.0, []
    for tension in pull + T0:
        at = min(max(at, 0.9 * tension), 1.1 * tension)
        expected.append(0.5 * (at - T0))
    assert np.max(np.abs(added - expected)) < 5e-3 * np.max(np.abs(expected))


def test_a_pressed_core_and_a_greased_cover_stretch_by_halves() -> None:
    """Slowly, the cover is a play as one that yields at once; the core three, of radii up to a share of the tension."""
    law = {"fraction": 0.6, "share": 0.12, "yield_N": 6.0, "time_s": 0.3}
    pull, added = _stretch(
        EffectSpec("strand_friction:mixed_lay", law), course(0.0, 0.8, -0.4, 0.5, points=150), 1e3
    )
    T0, expected = 50.0, np.zeros(len(pull))
    for share, radius in ((0.04, 0.0), (0.08, 0.0), (0.12, 0.0), (0.0, 6.0), (0.0, 6.0), (0.0, 6.0)):
        at = T0
        for k, tension in enumerate(pull + T0):
            hold = share * tension + radius
            at = min(max(at, tension - hold), tension + hold)
            expected[k] += 0.1 * (at - T0)
    assert np.max(np.abs(added - expected)) < 5e-3 * np.max(np.abs(expected))


def test_wires_that_come_to_lie_yield_no_further() -> None:
    law = {"fraction": 0.6, "yield_N": 4.0, "seats_N": 8.0}
    pull, added = _stretch(
        EffectSpec("strand_friction:seating", law), course(0.0, 0.8, -0.4, 0.5, points=150)
    )
    rest, expected = 0.0, []
    for x in pull:
        rest = min(max(rest, x - 4.0), x + 4.0)
        expected.append(0.6 * 8.0 * np.tanh(rest / 8.0))
    assert np.max(np.abs(added - expected)) < 5e-3 * np.max(np.abs(expected))
    assert np.max(np.abs(added)) < 0.6 * 8.0


def test_strands_that_yield_little_by_little_follow_bouc_and_wen() -> None:
    """Z by the smallest of steps along the tension."""
    law = {"fraction": 0.6, "yield_N": 8.0}
    turns = course(0.0, 0.8, -0.4, 0.1, -0.2, 0.5, points=60)
    pull, added = _stretch(EffectSpec("strand_friction:bouc_wen", law), turns)
    held, expected = 0.0, [0.0]
    for before, after in pairwise(pull):
        for _ in range(50):
            step = (after - before) / 50
            held += step * (1.0 - abs(held) / 8.0 if held * step > 0.0 else 1.0)
        expected.append(0.6 * (after - held))
    assert np.max(np.abs(added - expected)) < 5e-3 * np.max(np.abs(expected))
