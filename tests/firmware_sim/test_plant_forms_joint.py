"""Other forms of what loads the pulley and of what lies between pulley and file, against laws worked out apart."""

from __future__ import annotations

import math

import numpy as np
import pytest
from plant_effect_course import LOAD, MOTOR, OTHER, WARM, T, carried, play
from plant_joints import clock, course, joint
from scipy.interpolate import CubicSpline

from firmware_sim.plant import EffectSpec, PlantRun, simulate


def _swept(effect: EffectSpec, motor: np.ndarray, dt: float = 0.01) -> PlantRun:
    return simulate(joint(), clock(motor, dt), motor, 0 * motor, effects=(effect,))


def test_dahls_friction_comes_to_its_limit_exponentially() -> None:
    motor = course(0.0, 0.02, points=400)
    run = _swept(EffectSpec("bearing_friction:dahl", {"torque_Nm": 0.05, "presliding_rad": 1e-3}), motor)
    turned = run.pulley_position_rad - run.pulley_position_rad[0]
    np.testing.assert_allclose(carried(run), 0.05 * np.expm1(-turned / 1e-3), atol=3e-5)
    back = course(0.0, 0.02, 0.0, points=400)
    run = _swept(EffectSpec("bearing_friction:dahl", {"torque_Nm": 0.05, "presliding_rad": 1e-3}), back)
    turned = run.pulley_position_rad[400] - run.pulley_position_rad[400:]
    np.testing.assert_allclose(carried(run)[400:], 0.05 * (1 - 2 * np.exp(-turned / 1e-3)), atol=5e-4)


@pytest.mark.parametrize("speed", [0.05, 0.4, 2.0])
def test_lugre_slides_at_stribecks_curve_with_a_viscous_part(speed: float) -> None:
    law = {
        "torque_Nm": 0.05,
        "presliding_rad": 2e-4,
        "stribeck_gain": 0.5,
        "stribeck_rad_s": 0.3,
        "viscous_Nms_per_rad": 0.01,
    }
    dt = 1.0 / 400 / speed  # the pulley turns by one radian
    run = _swept(EffectSpec("bearing_friction:lugre", law), course(0.0, 2.0, points=400), dt)
    expected = 0.05 * (1 + 0.5 * math.exp(-((speed / 0.3) ** 2))) + 0.01 * speed
    np.testing.assert_allclose(-carried(run)[200:395], expected, rtol=2e-3)


def test_lugre_gives_before_it_slides_and_never_gives_back_more_than_it_took() -> None:
    law = {"torque_Nm": 0.05, "presliding_rad": 1e-3, "stribeck_gain": 0.2, "stribeck_rad_s": 0.3}
    motor = np.concatenate([course(0.0, 4e-5, points=50), course(4e-5, 0.01, -0.01, 0.01, points=200)])
    run = _swept(EffectSpec("bearing_friction:lugre", law), motor)
    turned = run.pulley_position_rad
    first = slice(1, 40)
    np.testing.assert_allclose(-carried(run)[first], 0.05 / 1e-3 * turned[first], rtol=0.03)
    work = np.cumsum(-0.5 * (carried(run)[1:] + carried(run)[:-1]) * np.diff(turned))
    assert np.min(work) > -1e-9
    assert work[-1] > 0.04 * 0.015


def test_a_lip_seal_holds_back_more_one_way() -> None:
    motor = course(0.0, 1.0, -1.0, points=200)
    law = {"torque_Nm": 0.05, "presliding_rad": 1e-4, "skew": 0.4}
    run = _swept(EffectSpec("bearing_friction:unlike_ways", law), motor)
    np.testing.assert_allclose(carried(run)[20:195], -0.05 * 1.4, rtol=1e-3)
    np.testing.assert_allclose(carried(run)[220:395], 0.05 * 0.6, rtol=1e-3)


def test_a_tilted_bearing_holds_back_by_the_moment() -> None:
    motor, load = course(0.0, 1.0, -1.0, points=200), course(-0.8, 0.8, -0.8, points=200)
    law = {"torque_Nm": 0.03, "presliding_rad": 1e-4, "moment_coefficient": 0.2}
    effect = EffectSpec("bearing_friction:by_moment", law)
    run = simulate(joint(), clock(motor), motor, load, effects=(effect,))
    held = load - carried(run)
    np.testing.assert_allclose(held[20:195], 0.03 + 0.2 * np.abs(load[20:195]), atol=5e-4)
    np.testing.assert_allclose(held[220:395], -0.03 - 0.2 * np.abs(load[220:395]), atol=5e-4)


def _crossing(form: str, load: np.ndarray, motor: np.ndarray, **parameters: float) -> np.ndarray:
    """What a form of backlash adds to the joint's angle."""
    config = joint()
    effect = EffectSpec(f"termination_backlash:{form}", parameters)
    with_gap = simulate(config, clock(load), motor, load, effects=(effect,)).joint_position_rad
    return np.asarray(with_gap - simulate(config, clock(load), motor, load).joint_position_rad)


def test_grease_lets_the_key_cross_its_gap_at_the_speed_of_the_load() -> None:
    load = np.concatenate([np.full(100, -0.5), np.full(200, 0.5)])
    added = _crossing("greased", load, 0 * load, gap_rad=2e-3, damping_Nms_per_rad=250.0)
    np.testing.assert_allclose(added[:99], -1e-3, atol=1e-12)
    crossing = -1e-3 + 0.5 / 250.0 * 0.01 * np.arange(1, 80)
    np.testing.assert_allclose(added[101:180], crossing, atol=1.1e-5)
    np.testing.assert_allclose(added[220:], 1e-3, atol=1e-12)


def test_a_key_on_springs_follows_the_load_until_its_gap_is_closed() -> None:
    load = course(-0.6, 0.6, points=120)
    added = _crossing("sprung", load, 0 * load, gap_rad=2e-3, closes_Nm=0.2)
    np.testing.assert_allclose(added, 1e-3 * np.clip(load / 0.2, -1.0, 1.0), atol=1e-12)


def test_a_wedged_key_changes_its_flank_only_when_pulled_over() -> None:
    load = np.concatenate([course(0.3, -0.6, points=120), course(-0.6, 0.6, points=160)])
    added = _crossing("wedged", load, 0 * load, gap_rad=2e-3, holds_Nm=0.2)
    falling, rising = added[:120], added[120:]
    np.testing.assert_allclose(falling, 1e-3 * np.where(load[:120] < -0.2, -1.0, 1.0), atol=1e-12)
    np.testing.assert_allclose(rising, 1e-3 * np.where(load[120:] > 0.2, 1.0, -1.0), atol=1e-12)


def test_a_worn_clearance_is_widest_where_it_has_worn() -> None:
    motor = course(-1.0, 1.0, points=200)
    load = np.where(np.arange(len(motor)) % 2 == 0, 0.4, -0.4)
    config = joint()
    law = {"gap_rad": 4e-3, "share": 0.75, "place_rad": 0.2, "width_rad": 0.3}
    run = simulate(config, clock(load), motor, load, effects=(EffectSpec("termination_backlash:worn", law),))
    apart = run.joint_position_rad - run.pulley_position_rad
    half = 2e-3 * (0.25 + 0.75 * np.exp(-(((run.pulley_position_rad - 0.2) / 0.3) ** 2)))
    np.testing.assert_allclose(apart, half * np.sign(load), atol=1e-12)
    amid, far = (
        np.argmin(np.abs(run.pulley_position_rad - 0.2)),
        np.argmax(np.abs(run.pulley_position_rad - 0.2)),
    )
    assert abs(apart[amid]) > 3.0 * abs(apart[far])


def test_a_set_screw_works_loose_while_the_load_moves() -> None:
    swings = np.where(np.arange(100) // 10 % 2 == 0, 0.05, -0.05)  # at an even rate; a rest in between
    load = -0.225 + np.cumsum(np.concatenate([[0.0], swings, np.zeros(100), swings, swings]))
    law = {"gap_rad": 2e-3, "share": 0.2, "time_s": 0.5, "duration_s": 3.0}
    added = _crossing("loosening", load, 0 * load, **law)
    grown = np.interp(clock(load), [0.5, 1.0, 2.0, 3.5], [0.2, 0.4, 0.4, 1.0])
    np.testing.assert_allclose(added, 1e-3 * grown * np.sign(load), atol=1e-12)


def test_a_dragging_link_stands_still_while_it_is_not_loaded() -> None:
    motor = np.concatenate([np.zeros(50), course(0.0, 2e-3, points=100), np.full(100, 2e-3)])
    load = np.concatenate([np.linspace(0.5, 0.0, 50), np.zeros(150), np.linspace(0.0, -0.5, 51)])
    config = joint()
    effect = EffectSpec("termination_backlash:dragging_link", {"gap_rad": 4e-3, "drag_Nm": 0.1})
    run = simulate(config, clock(load), motor, load, effects=(effect,))
    apart = run.joint_position_rad - run.pulley_position_rad
    still = slice(60, 150)  # the pulley turns by 1e-3 under the link, which lay on the upper flank
    assert np.ptp(run.joint_position_rad[still]) < 1e-9
    assert np.ptp(run.pulley_position_rad[still]) > 5e-4
    assert np.max(np.abs(apart)) <= 2e-3 + 1e-12
    np.testing.assert_allclose(
        apart[np.abs(run.load_path_Nm) >= 0.1], 2e-3 * np.sign(load[np.abs(load) >= 0.1])
    )


def test_two_clearances_open_at_two_loads() -> None:
    load = course(-1.0, 1.0, points=200)
    added = _crossing("two_clearances", load, 0 * load, gap_rad=2e-3, share=0.3, preload_Nm=0.4)
    expected = 3e-4 * np.sign(load) + 7e-4 * np.sign(load - 0.4)
    apart = np.minimum(np.abs(load), np.abs(load - 0.4)) > 1e-6
    np.testing.assert_allclose(added[apart], expected[apart], atol=1e-12)


def test_a_coupling_sprung_both_ways_opens_at_three_loads() -> None:
    load = course(-1.0, 1.0, points=200)
    added = _crossing("both_ways", load, 0 * load, gap_rad=2e-3, share=0.4, up_Nm=0.5, down_Nm=0.2)
    expected = 4e-4 * np.sign(load) + 3e-4 * (np.sign(load - 0.5) + np.sign(load + 0.2))
    apart = np.min([np.abs(load - at) for at in (0.0, 0.5, -0.2)], axis=0) > 1e-6
    np.testing.assert_allclose(added[apart], expected[apart], atol=1e-12)


def test_runout_of_other_parts_bends_the_transmission(plain: PlantRun) -> None:
    config = joint()
    s, motor = config.stages[0], np.linspace(-2.0, 2.0, 200)
    law = {"eccentricity_m": 1e-4, "phase_rad": 0.7}
    oval = _swept(EffectSpec("pulley_runout:oval", law), motor).joint_position_rad
    wound = s.output_radius_m * oval + 1e-4 * (np.sin(2 * oval + 0.7) - math.sin(0.7))
    assert np.max(np.abs(wound - s.input_radius_m * motor)) < 2e-7
    inner = _swept(EffectSpec("pulley_runout:input_pulley", law), motor).joint_position_rad
    paid = s.input_radius_m * motor + 1e-4 * (np.sin(motor + 0.7) - math.sin(0.7))
    assert np.max(np.abs(s.output_radius_m * inner - paid)) < 2e-7
    disc = play(
        "pulley_runout:encoder_disc", amplitude_rad=1e-3, phase_rad=0.2, second=0.5, second_phase_rad=1.0
    )
    q = plain.joint_position_rad
    expected = 1e-3 * (np.sin(q + 0.2) + 0.5 * np.sin(2 * q + 1.0))
    np.testing.assert_allclose(disc.joint_position_rad - q, expected, atol=1e-12)


@pytest.mark.parametrize(("circuit", "share"), [("open", 1.0), ("closed", 0.5)])
def test_an_idler_out_of_true_lengthens_the_path_of_one_cable(circuit: str, share: float) -> None:
    """By as much the joint stays behind, or by half of it where the other cable gives way as far."""
    config, motor = joint(circuit), np.linspace(0.0, 2.0, 200)
    law = {"eccentricity_m": 1e-4, "phase_rad": 0.7, "idler_radius_m": 0.016}
    effect = EffectSpec("pulley_runout:idler", law)
    run = simulate(config, clock(motor), motor, 0 * motor, effects=(effect,))
    wave = np.sin(1.25 * motor + 0.7) - math.sin(0.7)
    behind = 0.02 * motor - 0.04 * run.joint_position_rad
    np.testing.assert_allclose(behind, share * 1e-4 * wave, atol=3e-7)
    tighter = run.tension_h_N - simulate(config, clock(motor), motor, 0 * motor).tension_h_N
    if circuit == "closed":
        assert np.corrcoef(tighter, wave)[0, 1] > 0.9
    else:
        np.testing.assert_allclose(tighter, 0.0, atol=1e-6)


def test_clocks_drift_wait_and_hold(plain: PlantRun) -> None:
    inner = slice(8, -8)

    def late(values: np.ndarray, delay: np.ndarray | float) -> np.ndarray:
        return np.asarray(CubicSpline(T, values)(T - delay))[inner]

    def is_late(shown: np.ndarray, values: np.ndarray, delay: np.ndarray | float) -> None:
        """To a hundredth of what the delay does: another curve between the same samples."""
        size = np.max(np.abs(late(values, delay) - values[inner]))
        np.testing.assert_allclose(shown[inner], late(values, delay), atol=0.01 * size)

    drift = play("clock_skew:drift", delay_s=0.04, at_start=0.25, span_s=4.0)
    is_late(drift.joint_position_rad, plain.joint_position_rad, 0.04 * (0.25 + 0.75 * T / 4.0))
    again = play("clock_skew:resynchronised", delay_s=0.02, period_s=1.3, start_s=0.303)
    is_late(again.joint_position_rad, plain.joint_position_rad, 0.04 / 1.3 * np.mod(T - 0.303, 1.3))
    torque = play("clock_skew:torque_late", delay_s=0.03)
    is_late(torque.joint_torque_Nm, LOAD, 0.03)
    motor = play("clock_skew:motor_late", delay_s=-0.03)
    is_late(motor.motor_position_rad, MOTOR, -0.03)
    np.testing.assert_array_equal(motor.joint_position_rad, plain.joint_position_rad)
    stale = play("clock_skew:stale", delay_s=0.025).joint_position_rad
    fresh = np.abs(T / 0.05 - np.round(T / 0.05)) < 1e-6
    np.testing.assert_allclose(stale[fresh], plain.joint_position_rad[fresh], atol=1e-9)
    assert np.count_nonzero(np.abs(np.diff(stale)) > 1e-12) <= np.count_nonzero(fresh)


def test_packets_wait_as_long_as_they_should_on_average(plain: PlantRun) -> None:
    ages = []
    for seed in range(20):
        shown = play("clock_skew:jitter", delay_s=0.03, packet_s=0.04, seed=float(seed)).joint_position_rad
        speed = np.gradient(plain.joint_position_rad, T)
        quick = np.abs(speed) > 0.5
        ages.append(np.mean(((plain.joint_position_rad - shown) / speed)[quick][5:]))
    assert np.mean(ages) == pytest.approx(0.03, rel=0.15)


def test_strangers_follow_their_equations(plain: PlantRun) -> None:
    slipped = play("encoder_hub_slip", slip_rad=1e-3, time_s=1.505)
    np.testing.assert_allclose(
        slipped.joint_position_rad - plain.joint_position_rad, 1e-3 * (T > 1.5), atol=1e-12
    )
    grown = play("joint_encoder_drift", coefficient_rad_per_K=1e-4, reference_degC=21.0)
    np.testing.assert_allclose(
        grown.joint_position_rad - plain.joint_position_rad, 1e-4 * (WARM - 21.0), atol=1e-12
    )
    slow = play("torque_sensor_lag", lag_s=0.05).joint_torque_Nm
    rate = np.gradient(slow, T)
    np.testing.assert_allclose((slow + 0.05 * rate)[5:-5], LOAD[5:-5], atol=0.01)
    config = joint()
    still = 0.0 * T
    for name, parameters, factor in (
        ("neighbour_tightens", {"coefficient_per_unit": 0.1}, 1 + 0.1 * OTHER),
        ("self_heating", {"fraction": 0.1, "lag_s": 1.0}, np.ones(len(T))),  # no load, no heat
    ):
        run = simulate(config, T, still, still, effects=(EffectSpec(name, parameters),), other_1=OTHER)
        np.testing.assert_allclose(run.tension_h_N / config.stages[0].pretension_N, factor, rtol=1e-6)
    warm = simulate(
        config, T, still, still + 0.1, effects=(EffectSpec("self_heating", {"fraction": 0.1, "lag_s": 1.0}),)
    )
    mean = 0.5 * (warm.tension_h_N + warm.tension_l_N) / config.stages[0].pretension_N
    np.testing.assert_allclose(mean / mean[0], 1 - 0.1 * (1 - np.exp(-T)), atol=1e-3)


def test_play_before_the_input_pulley_is_taken_up_by_motor_or_load() -> None:
    config = joint()
    motor = course(0.0, 0.02, -0.02, points=100)
    held = EffectSpec("input_play", {"gap_rad": 8e-3, "drag_Nm": 1.0})
    run = simulate(config, clock(motor), motor, 0 * motor, effects=(held,))
    turned, at = 0.0, []
    for shown in motor:
        turned = min(max(turned, shown - 4e-3), shown + 4e-3)
        at.append(turned)
    np.testing.assert_allclose(run.joint_position_rad, 0.5 * np.asarray(at), atol=1e-9)
    np.testing.assert_array_equal(run.motor_position_rad, motor)
    load = course(0.5, -0.5, points=100)
    pushed = EffectSpec("input_play", {"gap_rad": 8e-3, "drag_Nm": 0.0})
    with_play = simulate(config, clock(load), 0 * load, load, effects=(pushed,)).joint_position_rad
    without = simulate(config, clock(load), 0 * load, load).joint_position_rad
    assert (with_play - without)[20] == pytest.approx(0.5 * 4e-3, rel=0.02)
    assert (with_play - without)[-1] == pytest.approx(-0.5 * 4e-3, rel=0.02)


def test_a_flange_lifts_the_cable_beyond_its_foot_alone() -> None:
    config = joint()
    s, motor = config.stages[0], np.linspace(-2.0, 2.0, 200)
    run = _swept(EffectSpec("flange_climb", {"radius_m_per_rad": 2e-3, "from_rad": 0.3}), motor)
    q = run.joint_position_rad
    wound = s.output_radius_m * q + 1e-3 * np.maximum(q - 0.3, 0.0) ** 2
    assert np.max(np.abs(wound - s.input_radius_m * motor)) < 2e-7
