"""Other forms of what happens to the cable, its ends and its pretension, against laws worked out apart."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from plant_effect_course import WARM, T
from plant_joints import clock, course, joint
from scipy.integrate import quad, solve_ivp

from firmware_sim.plant import EffectSpec, PlantRun, simulate
from firmware_sim.plant.forms.courses import worked

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


def _alone(effect: EffectSpec, circuit: str = "open", load: float = 0.5) -> PlantRun:
    """A steady load on a joint whose cables do not slip on their drums."""
    config = joint(circuit, mu_output=STICKS, mu_input=STICKS)
    s = config.stages[0]
    moment = np.full(len(T), load * s.output_radius_m * s.pretension_N)
    return simulate(config, T, 0 * T, moment, effects=(effect,))


def test_a_clamp_slides_in_steps_or_for_a_while() -> None:
    radius = joint().stages[0].output_radius_m
    gradual = _alone(
        EffectSpec("clamp_slip:gradual", {"slip_m": 2e-4, "time_s": 1.0, "duration_s": 1.5, "cable_l": 0.0})
    )
    moved = (gradual.joint_position_rad - gradual.joint_position_rad[0]) * radius
    np.testing.assert_allclose(moved, 2e-4 * np.clip((T - 1.0) / 1.5, 0, 1), atol=2e-8)
    steps = _alone(
        EffectSpec("clamp_slip:in_steps", {"slip_m": 3e-4, "time_s": 1.0, "duration_s": 1.0, "steps": 3.0})
    )
    moved = (steps.joint_position_rad - steps.joint_position_rad[0]) * radius
    for at, share in ((0.98, 0.0), (1.2, 1 / 3), (1.7, 2 / 3), (2.2, 1.0)):
        assert moved[round(at * 100)] == pytest.approx(3e-4 * share, abs=2e-8)
    bites = _alone(EffectSpec("clamp_slip:settling", {"slip_m": 2e-4, "time_s": 1.0, "lag_s": 0.5}))
    moved = (bites.joint_position_rad - bites.joint_position_rad[0]) * radius
    np.testing.assert_allclose(moved, 2e-4 * (1.0 - np.exp(-np.maximum(T - 1.0, 0.0) / 0.5)), atol=2e-8)
    values = {"slip_m": 7e-4, "time_s": 0.5, "duration_s": 1.5, "steps": 3.0, "growth": 2.0, "wait": 0.5}
    unequal = _alone(EffectSpec("clamp_slip:unequal_steps", values))
    moved = (unequal.joint_position_rad - unequal.joint_position_rad[0]) * radius
    for at, gone in ((0.48, 0.0), (0.52, 1e-4), (1.48, 1e-4), (1.52, 3e-4), (1.98, 3e-4), (2.02, 7e-4)):
        assert moved[round(at * 100)] == pytest.approx(gone, abs=2e-8)


def test_what_the_load_works_at_goes_on_while_that_moves_alone() -> None:
    """Half of it before the load rests, the other half after; by how far it goes, up or down."""
    time = np.linspace(0.0, 8.0, 801)
    load = np.interp(time, [0.0, 2.0, 3.0, 5.0, 5.5, 8.0], [0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    gone = worked(time, load, 1.0, 6.0)
    for at, share in ((1.99, 0.0), (2.5, 0.25), (3.0, 0.5), (4.9, 0.5), (5.25, 0.75), (5.5, 1.0), (8.0, 1.0)):
        assert gone[np.searchsorted(time, at)] == pytest.approx(share, abs=0.006)
    np.testing.assert_array_equal(worked(time, 0.0 * load, 1.0, 6.0), time >= 1.0)
    # what went on before and after is not its
    assert worked(time, load, 2.5, 0.25)[np.searchsorted(time, 2.625)] == pytest.approx(0.5, abs=0.03)
    config = joint("open")
    moment = np.interp(T, [0.0, 1.5, 2.0], [0.2, 0.2, 0.4]) * config.stages[0].output_radius_m
    moment *= config.stages[0].pretension_N
    law = EffectSpec("clamp_slip:worked_loose", {"slip_m": 2e-4, "time_s": 0.5, "duration_s": 2.0})
    plain, loose = (simulate(config, T, 0 * T, moment, effects=e) for e in ((), (law,)))
    moved = (loose.joint_position_rad - plain.joint_position_rad) * config.stages[0].output_radius_m
    np.testing.assert_allclose(moved, 2e-4 * np.clip((T - 1.5) / 0.5, 0.0, 1.0), atol=2e-7)


@pytest.mark.parametrize("effect", ["clamp_slip", "strand_break"])
def test_the_other_cable_is_the_mirror_image(effect: str) -> None:
    size = {"slip_m": 4e-6} if effect == "clamp_slip" else {"fraction": 0.4}
    here = _alone(EffectSpec(effect, {**size, "time_s": 1.0}), "closed", 0.4)
    there = _alone(EffectSpec(f"{effect}:other_cable", {**size, "time_s": 1.0}), "closed", -0.4)
    np.testing.assert_allclose(there.joint_position_rad, -here.joint_position_rad, atol=1e-9)
    np.testing.assert_allclose(there.tension_l_N, here.tension_h_N, rtol=1e-6)


def test_a_clamp_that_is_pulled_too_hard_creeps_by_the_excess() -> None:
    config = joint("open")
    tension = 1.5 * config.stages[0].pretension_N
    for holds, excess in ((tension + 1.0, 0.0), (tension - 4.0, 4.0)):
        run = _alone(EffectSpec("clamp_slip:overload", {"rate_m_per_Ns": 2e-6, "holds_N": holds}))
        speed = np.gradient(run.joint_position_rad, T) * config.stages[0].output_radius_m
        np.testing.assert_allclose(speed[5:-5], 2e-6 * excess, atol=1e-9)


def test_wires_that_fray_or_break_in_steps_end_where_they_break_at_once() -> None:
    once = _alone(EffectSpec("strand_break", {"fraction": 0.4, "time_s": 1.0}))
    lasts = {"duration_s": 2.0}
    for form, goes in (
        ("fraying", lasts),
        ("accelerating", lasts),
        ("settling", {"lag_s": 0.2}),
        ("in_steps", {**lasts, "steps": 4.0}),
        ("unequal_steps", {**lasts, "growth": 0.5}),
    ):
        run = _alone(EffectSpec(f"strand_break:{form}", {"fraction": 0.4, "time_s": 1.0, **goes}))
        assert run.joint_position_rad[-1] == pytest.approx(once.joint_position_rad[-1], rel=1e-4)
        np.testing.assert_array_equal(run.joint_position_rad[T < 1.0], once.joint_position_rad[T < 1.0])
        between = run.joint_position_rad[(T > 1.2) & (T < 2.8)]
        assert np.all(between < once.joint_position_rad[-1])
        assert np.all(np.diff(run.joint_position_rad) > -1e-12)
