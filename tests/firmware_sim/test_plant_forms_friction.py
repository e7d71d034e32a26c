"""Other forms of friction between cable and what it lies on, against laws worked out apart from the plant."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from plant_joints import clock, course, joint
from scipy.integrate import cumulative_trapezoid, quad

from firmware_sim.plant import EffectSpec, PlantRun, StageConfig, simulate

STICKS = 50.0  # a coefficient with which nothing slips


def _turned(
    circuit: str, effect: EffectSpec, reach: float = 2.0, dt: float = 0.01, **changes: float
) -> PlantRun:
    """Motor forward, then back, without load; the free span is long."""
    motor = course(0.0, reach, -reach, points=400)
    config = joint(circuit, free_length_m=0.2, **changes)
    return simulate(config, clock(motor, dt), motor, 0 * motor, effects=(effect,))


def test_several_guides_hold_back_like_one_of_all_their_bend_and_stick_one_by_one() -> None:
    three = EffectSpec(
        "routing_friction:several_guides",
        {"mu_angle": 0.4, "arc_length_m": 0.03, "count": 3.0, "first": 0.25},
    )
    run = _turned("open", three)
    ratio = run.tension_h_in_N / run.tension_h_N
    assert ratio[390] == pytest.approx(math.exp(-0.4), rel=2e-3)
    assert ratio[790] == pytest.approx(math.exp(0.4), rel=2e-3)
    # where they stick fast, a load stretches the first span alone
    config = joint("open", free_length_m=0.4, mu_output=STICKS, mu_input=STICKS)
    s = config.stages[0]
    load = course(0.0, 0.3, points=40) * s.output_radius_m * s.pretension_N
    for first in (0.15, 0.45):
        fast = EffectSpec(
            three.id, {**three.parameters, "mu_angle": 8.0, "arc_length_m": 1e-3, "first": first}
        )
        held = simulate(config, clock(load), 0 * load, load, effects=(fast,))
        stretched = load * first * s.free_length_m / (s.EA_N * s.output_radius_m**2)
        assert held.joint_position_rad[-1] == pytest.approx(stretched[-1], rel=0.03)


def test_unlike_paths_hold_back_each_cable_by_its_own_bend() -> None:
    run = _turned(
        "closed",
        EffectSpec(
            "routing_friction:unlike_paths",
            {"mu_angle": 0.3, "arc_length_m": 0.01, "skew": 0.6, "first": 0.3},
        ),
    )
    for at, way in ((390, 1.0), (790, -1.0)):  # forward the input drum pays out cable h and winds on cable l
        high = math.log(run.tension_h_in_N[at] / run.tension_h_N[at])
        low = math.log(run.tension_l_in_N[at] / run.tension_l_N[at])
        assert high == pytest.approx(-way * 0.3 * 1.6, rel=5e-3)
        assert low == pytest.approx(way * 0.3 * 0.4, rel=5e-3)


def test_a_greased_sheath_drags_in_proportion_to_the_cables_speed() -> None:
    for dt in (0.01, 0.002):
        grease = EffectSpec(
            "routing_friction:greased", {"mu_angle": 1e-6, "arc_length_m": 0.02, "viscous_Ns_per_m": 50.0}
        )
        run = _turned("open", grease, dt=dt)
        speed = 0.02 * 2.0 / (400 * dt)  # input radius times the motor's speed
        assert run.tension_h_N[390] - run.tension_h_in_N[390] == pytest.approx(50.0 * speed, rel=1e-3)
        assert run.tension_h_N[790] - run.tension_h_in_N[790] == pytest.approx(-2 * 50.0 * speed, rel=1e-3)


@pytest.mark.parametrize("tension", [40.0, 80.0])
def test_a_wiper_holds_back_the_same_at_any_tension_beside_its_bend(tension: float) -> None:
    """Along the guide dT = −(mu T + w) ds: what T + W/(mu Θ) there is falls by the capstan ratio."""
    law = {"hold_N": 6.0, "mu_angle": 0.2, "arc_length_m": 0.01}
    run = _turned("open", EffectSpec("routing_friction:wiper", law), pretension_N=tension)
    for at, way in ((390, -1.0), (790, 1.0)):
        expected = (tension + 30.0) * math.exp(way * 0.2) - 30.0
        assert run.tension_h_in_N[at] == pytest.approx(expected, rel=2e-3)
    alone = EffectSpec("routing_friction:wiper", {"hold_N": 6.0})
    config = joint("open", mu_output=STICKS, mu_input=STICKS, pretension_N=tension)
    swing = course(0.0, 5.9, 9.0, -2.9, points=40)  # N: held, beyond by 3 N, held by 6 N the other way
    run = simulate(
        config, clock(swing), 0 * swing, swing * config.stages[0].output_radius_m, effects=(alone,)
    )
    for at, passed in ((40, 0.0), (80, 3.0), (120, 3.0)):
        assert run.tension_h_in_N[at] == pytest.approx(tension + passed, abs=0.03)


def test_a_sheath_that_bends_rubs_by_what_the_channel_says() -> None:
    motor = course(0.0, 2.0, -2.0, points=400)
    bend = np.linspace(0.0, 1.0, len(motor))
    effect = EffectSpec(
        "routing_friction:bending", {"mu_angle": 0.2, "arc_length_m": 0.02, "mu_angle_per_unit": 0.3}
    )
    config = joint("open", free_length_m=0.2)
    run = simulate(config, clock(motor), motor, 0 * motor, effects=(effect,), other_1=bend)
    for at, way in ((390, -1.0), (790, 1.0)):
        ratio = math.log(run.tension_h_in_N[at] / run.tension_h_N[at])
        assert ratio == pytest.approx(way * (0.2 + 0.3 * bend[at]), rel=5e-3)


def _loaded(name: str, parameters: dict[str, float], dt: float = 0.01, **changes: float) -> np.ndarray:
    """Joint angle over a swing of the load; the input drum holds fast."""
    config = joint("open", **{"mu_input": STICKS, **changes})
    s = config.stages[0]
    load = course(0.0, 0.8, -0.3, 0.4, points=80) * s.output_radius_m * s.pretension_N
    effects = (EffectSpec(name, parameters),) if name else ()
    return simulate(config, clock(load, dt), 0 * load, load, effects=effects).joint_position_rad


def test_a_thinning_film_is_the_linear_one_at_power_one_and_scales_with_speed_by_its_power() -> None:
    linear = _loaded("viscous_slip", {"coefficient_Ns_per_m_rad": 3e4})
    power = {"coefficient_Ns_per_m_rad": 3e4, "exponent": 1.0, "speed_m_s": 1e-4}
    np.testing.assert_array_equal(_loaded("viscous_slip:power_law", power), linear)
    p, quicker = 0.5, 8.0
    slow = {"coefficient_Ns_per_m_rad": 3e5 * quicker**p, "exponent": p, "speed_m_s": 1e-6}
    fast = {**slow, "coefficient_Ns_per_m_rad": 3e5}
    first = _loaded("viscous_slip:power_law", slow, dt=0.01)
    second = _loaded("viscous_slip:power_law", fast, dt=0.01 / quicker)
    plain = _loaded("", {})
    assert np.max(np.abs(first - plain)) > 0.05 * np.ptp(plain)
    assert np.max(np.abs(first - second)) < 0.01 * np.max(np.abs(first - plain))


def test_a_lubricant_shears_as_eyring_has_it() -> None:
    """Next to no Coulomb friction and a steady load: at s from its end the cable slips at s Ṫ/EA; what drags it there
    shortens all that lies before."""
    config = joint("open", mu_output=1e-7, mu_input=STICKS)
    s = config.stages[0]
    length, rate, speed = s.wrap_output_rad * s.output_radius_m, 20.0, 2e-5  # m, N/s, m/s
    time = np.linspace(0.0, 1.0, 200)
    moment = rate * s.output_radius_m * time
    law = {"coefficient_Ns_per_m_rad": 2e3, "speed_m_s": speed}
    plain, run = (
        simulate(config, time, 0 * time, moment, effects=e)
        for e in ((), (EffectSpec("viscous_slip:eyring", law),))
    )
    assert length * rate / s.EA_N > 2.0 * speed  # well into the logarithm
    drag = quad(lambda x: x * 2e3 * speed * math.asinh(x * rate / s.EA_N / speed), 0.0, length)[0]
    short = (plain.joint_position_rad - run.joint_position_rad)[-1] * s.output_radius_m
    assert short == pytest.approx(drag / s.output_radius_m / s.EA_N, rel=0.01)


def test_a_coefficient_that_grows_with_speed_is_the_plain_one_when_slow_and_depends_on_speed_over_its_own() -> (
    None
):
    def run(dt: float, speed: float) -> np.ndarray:
        return _loaded("viscous_slip:strengthening", {"gain": 0.3, "speed_m_s": speed}, dt)

    plain = _loaded("", {})
    np.testing.assert_allclose(run(1e3, 1e-5), plain, atol=1e-3 * np.ptp(plain))
    np.testing.assert_allclose(run(0.01, 1e-6), run(0.001, 1e-5), atol=1e-9)
    peaks = [run(dt, 1e-6)[80] for dt in (1.0, 0.1, 0.01)]  # the quicker, the stiffer
    assert plain[80] > peaks[0] > peaks[1] > peaks[2]


def test_grease_on_one_drum_acts_where_it_is() -> None:
    both = _loaded("viscous_slip", {"coefficient_Ns_per_m_rad": 3e4})
    out = _loaded("viscous_slip:one_drum", {"coefficient_Ns_per_m_rad": 3e4, "on_input": 0.0})
    inner = _loaded("viscous_slip:one_drum", {"coefficient_Ns_per_m_rad": 3e4, "on_input": 1.0})
    plain = _loaded("", {})
    scale = np.max(np.abs(both - plain))
    np.testing.assert_allclose(out, both, atol=0.02 * scale)  # next to nothing slips on the input drum
    np.testing.assert_allclose(inner, plain, atol=0.02 * scale)


@pytest.mark.parametrize(
    ("name", "parameters", "law"),
    [
        ("floor", {"exponent": 1.5, "floor": 0.4}, lambda t: 0.4 + 0.6 * t**-1.5),
        ("exponential", {"rate": 0.7}, lambda t: math.exp(-0.7 * (t - 1.0))),
        ("worn_through", {"place": 0.4, "floor": 0.5}, lambda t: 0.75 - 0.25 * math.tanh((t - 1.4) / 0.15)),
        ("pressed_flat", {"rate": 3.0}, lambda t: 4.0 / (1.0 + 3.0 * t)),
        ("ploughed", {"adhesion": 0.9, "place": 1.5}, lambda t: 0.9 / t + 0.4 * t - 0.3),
    ],
)
def test_a_coefficient_by_pressure_sets_the_affected_wrap(
    name: str, parameters: dict[str, float], law: Callable[[float], float]
) -> None:
    """Loading elongation with mu = mu0 f(T/T0): δ = R T0/(EA mu0) ∫ (τ − 1)/(τ f) dτ."""
    config = joint("open", mu_input=100.0, input_radius_m=0.04, free_length_m=0.05)
    s = config.stages[0]
    load = course(0.0, 1.2, points=100)
    run = simulate(
        config,
        clock(load),
        0 * load,
        load * s.output_radius_m * s.pretension_N,
        effects=(EffectSpec(f"pressure_dependent_friction:{name}", parameters),),
    )
    wrapped = np.array([quad(lambda t: (t - 1) / (t * law(t)), 1.0, 1.0 + m)[0] for m in load])
    expected = s.pretension_N / s.EA_N * (wrapped / s.mu_output + s.free_length_m / s.output_radius_m * load)
    assert np.max(np.abs(run.joint_position_rad - expected)) < 5e-3 * expected[-1]


def _left_over(
    s: StageConfig, mu: Callable[[np.ndarray], np.ndarray], peak: float, radius_share: float
) -> float:
    """Joint angle that a swing to `peak` and back leaves: the bump in ln T over ∫ mu ds, rad."""
    depth = np.linspace(0.0, 5.0, 40000)
    w = cumulative_trapezoid(mu(depth), depth, initial=0.0)
    bump = np.maximum(np.minimum(w, math.log1p(peak) - w), 0.0)
    area = float(np.trapezoid(np.expm1(bump), depth))
    return radius_share * s.pretension_N / s.EA_N * area


def _small_loop(effect: EffectSpec, place: float, **changes: float) -> tuple[float, StageConfig]:
    config = joint("open", wrap_output_rad=14.0, wrap_input_rad=14.0, **changes)
    s = config.stages[0]
    load = course(0.0, 0.25, 0.0, points=40) * s.output_radius_m * s.pretension_N
    motor = np.full(len(load), place)
    run = simulate(config, clock(load), motor, load, effects=(effect,))
    return float(run.joint_position_rad[-1] - run.joint_position_rad[0]), s


@pytest.mark.parametrize("place", [-1.0, 0.5, 1.4])
def test_a_patch_of_the_groove_is_met_where_the_joint_stands(place: float) -> None:
    parameters = {"height": 1.5, "place_rad": 0.4, "width_rad": 0.5}
    left, s = _small_loop(
        EffectSpec("position_dependent_friction:patch", parameters),
        place / 0.5,
        mu_output=0.3,
        mu_input=STICKS,
    )

    def mu(depth: np.ndarray) -> np.ndarray:
        return np.asarray(0.3 * (1.0 + 1.5 * np.exp(-(((place - depth - 0.4) / 0.5) ** 2) / 2)))

    assert left == pytest.approx(_left_over(s, mu, 0.25, 1.0), rel=0.02)


@pytest.mark.parametrize("place", [-0.4, 0.4, 1.2])
def test_a_rippled_groove_is_met_where_the_joint_stands(place: float) -> None:
    law = {"amplitude": 0.7, "order": 4.0, "phase_rad": 0.5}
    effect = EffectSpec("position_dependent_friction:threaded", law)
    left, s = _small_loop(effect, place / 0.5, mu_output=0.3, mu_input=STICKS)

    def mu(depth: np.ndarray) -> np.ndarray:
        return np.asarray(0.3 * (1.0 + 0.7 * np.cos(4.0 * (place - depth) - 0.5)))

    assert left == pytest.approx(_left_over(s, mu, 0.25, 1.0), rel=0.02)


@pytest.mark.parametrize("place", [-0.6, 0.3, 1.2])
def test_a_polished_part_is_met_where_the_joint_stands(place: float) -> None:
    law = {"height": 2.0, "place_rad": 0.2, "width_rad": 0.15}
    effect = EffectSpec("position_dependent_friction:polished", law)
    left, s = _small_loop(effect, place / 0.5, mu_output=0.3, mu_input=STICKS)

    def mu(depth: np.ndarray) -> np.ndarray:
        return np.asarray(0.3 * (1.0 + 2.0 / (1.0 + np.exp(-2.0 * (place - depth - 0.2) / 0.15))))

    assert left == pytest.approx(_left_over(s, mu, 0.25, 1.0), rel=0.02)


@pytest.mark.parametrize("place", [-0.5, 0.4, 1.0])
def test_a_cable_that_wanders_rubs_the_more_the_further_it_is_out_of_line(place: float) -> None:
    law = {"growth_per_rad": 0.8, "place_rad": 0.25}
    effect = EffectSpec("position_dependent_friction:fleet_angle", law)
    left, s = _small_loop(effect, place / 0.5, mu_output=0.3, mu_input=STICKS)

    def mu(depth: np.ndarray) -> np.ndarray:
        return np.asarray(0.3 * (1.0 + 0.8 * np.abs(place - depth - 0.25)))

    assert left == pytest.approx(_left_over(s, mu, 0.25, 1.0), rel=0.02)


@pytest.mark.parametrize("place", [-1.0, 0.5, 2.0])
def test_the_input_drums_groove_is_met_where_the_motor_stands(place: float) -> None:
    def left(amplitude: float) -> tuple[float, StageConfig]:
        law = {"amplitude": amplitude, "phase_rad": 0.5}
        effect = EffectSpec("position_dependent_friction:input_drum", law)
        return _small_loop(effect, place, mu_output=STICKS, mu_input=0.3)

    (rough, s), (smooth, _) = left(0.6), left(0.0)

    def mu(depth: np.ndarray) -> np.ndarray:  # what lies deeper departs when the motor has paid out more
        return np.asarray(0.3 * (1.0 + 0.6 * np.cos(place + depth - 0.5)))

    whole = _left_over(s, lambda depth: np.full_like(depth, 0.3), 0.25, 1.0)
    assert rough / smooth == pytest.approx(_left_over(s, mu, 0.25, 1.0) / whole, rel=0.02)


def test_a_burr_counts_by_the_direction_of_sliding() -> None:
    """Over a patch so wide that it is everywhere, loading feels mu (1 + h (1 + g)), letting go mu (1 + h (1 − g))."""
    everywhere = {"height": 1.0, "width_rad": 10.0, "place_rad": -1.0, "grain": 0.6}
    for sign, share in ((1.0, 1.6), (-1.0, 0.4)):
        config = joint("open", mu_input=STICKS, wrap_output_rad=14.0)
        s = config.stages[0]
        load = course(0.0, sign * 0.4, points=80)
        burr = EffectSpec("position_dependent_friction:burr", everywhere)
        moment = load * s.output_radius_m * s.pretension_N
        run = simulate(config, clock(load), 0 * load, moment, effects=(burr,))
        mu = sign * s.mu_output * (1.0 + share)
        wrapped = s.pretension_N / (s.EA_N * mu) * (load - np.log1p(load))
        expected = wrapped + moment * s.free_length_m / (s.EA_N * s.output_radius_m**2)
        assert np.max(np.abs(run.joint_position_rad - expected)) < 0.02 * np.max(np.abs(expected))
