"""Effects of the plant against their laws, worked out apart from it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from plant_effect_course import LOAD, MOTOR, OTHER, WARM, T, play
from plant_joints import clock, course, joint

from firmware_sim.plant import EffectSpec, PlantConfig, PlantRun, simulate


def test_effects_on_the_channels_follow_their_equations(plain: PlantRun) -> None:
    path = plain.load_path_Nm
    cases = {
        "series_compliance": ({"compliance_rad_per_Nm": 1e-3}, 1e-3 * path),
        "termination_backlash": ({"gap_rad": 2e-3}, 1e-3 * np.sign(path)),
        "stiffening_mount": (
            {"compliance_rad_per_Nm": 1e-3, "saturation_Nm": 0.5},
            5e-4 * np.tanh(path / 0.5),
        ),
        "frame_flex": ({"compliance_rad_per_unit": 1e-3}, 1e-3 * OTHER),
        "joint_encoder_ripple": (
            {"amplitude_rad": 1e-3, "order": 2.0, "phase_rad": 0.3},
            1e-3 * np.sin(2 * plain.joint_position_rad + 0.3),
        ),
    }
    for name, (parameters, expected) in cases.items():
        run = play(name, **parameters)
        np.testing.assert_allclose(
            run.joint_position_rad - plain.joint_position_rad, expected, atol=1e-12, err_msg=name
        )
    sensed = play("torque_sensor_quadratic", coefficient_per_Nm=0.1).joint_torque_Nm
    np.testing.assert_allclose(sensed, LOAD + 0.1 * LOAD**2, atol=1e-12)
    drifted = play("torque_sensor_drift", coefficient_Nm_per_K=0.1).joint_torque_Nm
    np.testing.assert_allclose(drifted, LOAD + 0.1 * (WARM - 20.0), atol=1e-12)
    motor = play("motor_encoder_ripple", amplitude_rad=1e-3, order=7.0).motor_position_rad
    np.testing.assert_allclose(motor, MOTOR + 1e-3 * np.sin(7 * MOTOR), atol=1e-12)


def test_effects_in_the_load_path_change_the_moment_that_the_cables_carry(plain: PlantRun) -> None:
    q = plain.pulley_position_rad
    speed, acceleration = np.gradient(q, T), np.gradient(np.gradient(q, T), T)
    cases = {
        "crosstalk": ({"load_coefficient": 0.3}, 0.3 * OTHER),
        "gravity_load": ({"moment_Nm": 0.3, "phase_rad": 0.2}, -0.3 * np.sin(q + 0.2)),
        "joint_viscous_friction": ({"coefficient_Nms_per_rad": 0.2}, -0.2 * speed),
        "inertial_load": ({"inertia_kgm2": 0.1}, -0.1 * acceleration),
        "parallel_spring": (
            {"stiffness_Nm_per_rad": 0.6, "saturation_Nm": 0.2},
            -0.2 * np.tanh(0.6 * q / 0.2),
        ),
    }
    for name, (parameters, expected) in cases.items():
        run = play(name, **parameters)
        change = run.load_path_Nm - LOAD
        assert np.max(np.abs(change - expected)[20:-5]) < 0.03 * np.max(np.abs(expected)), name
        # and the cables do carry it
        radius = joint().stages[0].output_radius_m
        np.testing.assert_allclose(radius * (run.tension_h_N - run.tension_l_N), run.load_path_Nm, atol=2e-5)


def test_bearing_friction_takes_its_torque_off_by_the_direction_of_turning() -> None:
    config = joint()
    s = config.stages[0]
    motor = course(0.0, 1.0, -1.0, 0.0, points=100)
    effect = EffectSpec("bearing_friction", {"torque_Nm": 0.05, "load_coefficient": 0.02})
    run = simulate(config, clock(motor), motor, 0 * motor, effects=(effect,))
    carried = s.output_radius_m * (run.tension_h_N - run.tension_l_N)
    limit = 0.05 + 0.02 * s.output_radius_m * (run.tension_h_N + run.tension_l_N)
    turning = np.sign(np.gradient(motor))
    for part in (slice(20, 95), slice(120, 295), slice(320, 398)):
        np.testing.assert_allclose(carried[part], -turning[part] * limit[part], rtol=1e-3)


def test_a_guide_holds_back_by_e_to_the_mu_angle_in_both_directions() -> None:
    config = joint("open", free_length_m=0.2)
    motor = course(0.0, 2.0, -2.0, points=400)
    effect = EffectSpec("routing_friction", {"mu_angle": 0.4, "arc_length_m": 0.02})
    run = simulate(config, clock(motor), motor, 0 * motor, effects=(effect,))
    ratio = run.tension_h_in_N / run.tension_h_N
    # the motor turning forward pays cable out: it holds less than the load side pulls
    assert ratio[390] == pytest.approx(math.exp(-0.4), rel=2e-3)
    assert ratio[790] == pytest.approx(math.exp(0.4), rel=2e-3)


def test_a_guide_that_sticks_keeps_the_far_side_unmoved() -> None:
    config = joint("open", free_length_m=0.2)
    s = config.stages[0]
    load = course(0.0, 0.2, 0.0, points=50) * s.output_radius_m * s.pretension_N
    effect = EffectSpec("routing_friction", {"mu_angle": 1.0, "arc_length_m": 0.05})
    run = simulate(config, clock(load), 0 * load, load, effects=(effect,))
    np.testing.assert_allclose(run.tension_h_in_N, s.pretension_N, rtol=1e-6)


def test_viscous_slip_creeps_by_diffusion() -> None:
    """With next to no Coulomb friction the wrap follows EA y_xx = (c/R) y_t: its end creeps by the known
    series."""
    wrap, radius, c = 6.0, 0.04, 2.0e5
    config = joint(
        "open",
        mu_output=1e-7,
        mu_input=50.0,
        wrap_output_rad=wrap,
        output_radius_m=radius,
        free_length_m=0.05,
    )
    s = config.stages[0]
    length = wrap * radius
    time_constant = 4 * length**2 * c / (radius * s.EA_N * math.pi**2)
    t = np.concatenate([[0.0, 1e-4], 1e-4 + np.geomspace(2e-3, 4, 500) * time_constant])
    load = np.full(len(t), 0.02 * radius * s.pretension_N)
    load[0] = 0.0
    run = simulate(
        config,
        t,
        0 * t,
        load,
        effects=(EffectSpec("viscous_slip", {"coefficient_Ns_per_m_rad": c}),),
    )
    stretch = 0.02 * s.pretension_N / s.EA_N
    n = np.arange(0, 200)[:, None] * 2 + 1
    left = (8 / math.pi**2) * np.sum(np.exp(-(n**2) * (t[None, :] - 1e-4) / time_constant) / n**2, axis=0)
    expected = stretch * (s.free_length_m + length * (1 - left)) / radius
    at = t > 0.05 * time_constant
    assert np.max(np.abs(run.joint_position_rad - expected)[at]) < 0.02 * expected[-1]


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("pretension_relaxation", {"fraction": 0.05, "time_constant_s": 0.7}),
        ("thermal_pretension", {"coefficient_per_K": 0.02, "reference_degC": 21.0}),
    ],
)
def test_pretension_follows_its_law_without_load(name: str, parameters: dict[str, float]) -> None:
    config = joint()
    run = simulate(config, T, 0 * T, 0 * T, effects=(EffectSpec(name, parameters),), temperature_degC=WARM)
    thermal = name == "thermal_pretension"
    factor = 1 + 0.02 * (WARM - 21.0) if thermal else 1 - 0.05 * np.log1p(T / 0.7)
    np.testing.assert_allclose(run.tension_h_N, config.stages[0].pretension_N * factor, rtol=1e-6)
    np.testing.assert_allclose(run.tension_l_N, run.tension_h_N, rtol=1e-9)


def test_stiffening_cable_follows_its_tangent() -> None:
    """Open circuit without slip: dT/dε = EA (1 + b (T/T0 − 1)) integrates to ln(1 + b m) in the free span."""
    b = 0.4
    config = joint("open", mu_output=20.0, mu_input=20.0, free_length_m=1.0)
    s = config.stages[0]
    load = course(0.0, 1.5, points=60)
    moment = load * s.output_radius_m * s.pretension_N
    bent = simulate(
        config, clock(load), 0 * load, moment, effects=(EffectSpec("nonlinear_cable", {"stiffening": b}),)
    )
    expected = s.pretension_N * s.free_length_m / (s.EA_N * s.output_radius_m) * np.log1p(b * load) / b
    assert np.max(np.abs(bent.joint_position_rad - expected)) < 0.01 * expected[-1]


def test_strand_friction_is_a_play_in_the_free_span() -> None:
    config = joint("open")
    s = config.stages[0]
    load = course(0.0, 0.8, -0.4, 0.5, points=100)
    moment = load * s.output_radius_m * s.pretension_N
    effect = EffectSpec("strand_friction", {"fraction": 0.5, "yield_N": 8.0})
    plain = simulate(config, clock(load), 0 * load, moment)
    run = simulate(config, clock(load), 0 * load, moment, effects=(effect,))
    state, expected = 0.0, []
    for tension in plain.tension_h_N - s.pretension_N:
        state = min(max(state, tension - 8.0), tension + 8.0)
        expected.append(0.5 * s.free_length_m / s.EA_N * state / s.output_radius_m)
    change = run.joint_position_rad - plain.joint_position_rad
    assert np.max(np.abs(change - expected)) < 2e-3 * np.max(np.abs(expected))


def test_pressure_dependent_friction_changes_the_affected_wrap() -> None:
    """Loading elongation with mu = mu0 (T/T0)^−n: δ = R T0/(EA mu0) ∫ (τ − 1) τ^(n − 1) dτ."""
    n, peak = 0.4, 2.5
    config = joint("open", mu_input=100.0, input_radius_m=0.04, free_length_m=0.05)
    s = config.stages[0]
    load = course(0.0, peak - 1, points=100)
    moment = load * s.output_radius_m * s.pretension_N
    effect = EffectSpec("pressure_dependent_friction", {"exponent": n})
    run = simulate(config, clock(load), 0 * load, moment, effects=(effect,))
    tau = 1 + load
    wrapped = (tau ** (n + 1) - 1) / (n + 1) - (tau**n - 1) / n
    scale = s.pretension_N / s.EA_N
    expected = scale * (wrapped / s.mu_output + s.free_length_m / s.output_radius_m * load)
    assert np.max(np.abs(run.joint_position_rad - expected)) < 5e-3 * expected[-1]


def test_rough_groove_is_met_where_the_joint_stands() -> None:
    """With mu = mu0 (1 + a cos(q − φ)) the same small loop leaves another rest at another place."""
    config = joint("open", mu_output=0.3, mu_input=5.0, wrap_output_rad=14.0)
    scale = config.stages[0].output_radius_m * config.stages[0].pretension_N
    rough = EffectSpec("position_dependent_friction", {"amplitude": 0.6, "phase_rad": 0.5})
    peak = 0.25
    for place in (0.0, 1.2, math.pi):
        load = course(0.0, peak, 0.0, points=40) * scale
        motor = np.full(len(load), place / config.ratio)
        run = simulate(config, clock(load), motor, load, effects=(rough,))
        left = run.joint_position_rad[-1] - run.joint_position_rad[0]
        # the plain law in the coordinate w = ∫ mu ds: left over is a bump of height ln(1 + peak)/2 in ln T
        depth = np.linspace(0.0, 4.0, 20000)
        mu = 0.3 * (1 + 0.6 * np.cos(place - depth - 0.5))
        w = np.cumsum(mu) * (depth[1] - depth[0])
        bump = np.maximum(np.minimum(w, math.log1p(peak) - w), 0.0)
        s = config.stages[0]
        expected = s.pretension_N / s.EA_N * np.sum(np.expm1(bump)) * (depth[1] - depth[0])
        other = 0.5 * s.pretension_N / s.EA_N / s.mu_input * _bump_area(peak)
        assert left == pytest.approx(expected + other, rel=0.02)


def _bump_area(peak: float) -> float:
    """∫ (T/T0 − 1) dw over the bump that a swing to `peak` leaves behind, (3-21) at m = 0 times mu."""
    return 2 * math.sqrt(1 + peak) - 2 - math.log1p(peak)


def test_runout_bends_the_transmission() -> None:
    config = joint()
    motor = np.linspace(-2.0, 2.0, 200)
    effect = EffectSpec("pulley_runout", {"eccentricity_m": 2e-4, "phase_rad": 0.7})
    run = simulate(config, clock(motor), motor, 0 * motor, effects=(effect,))
    s = config.stages[0]
    q = run.joint_position_rad
    wound = s.output_radius_m * q + 2e-4 * (np.sin(q + 0.7) - math.sin(0.7))
    assert np.max(np.abs(wound - s.input_radius_m * motor)) < 2e-7


def test_events_leave_what_was_before_untouched(plain: PlantRun) -> None:
    for name, parameters in (
        ("clamp_slip", {"slip_m": 2e-4, "time_s": 2.005}),
        ("strand_break", {"fraction": 0.3, "time_s": 2.005}),
    ):
        run = play(name, **parameters)
        change = run.joint_position_rad - plain.joint_position_rad
        assert np.max(np.abs(change[T < 2.0])) == 0.0
        assert np.min(np.abs(change[T > 2.02])) > 0.0
        assert run.tension_h_N[-1] < plain.tension_h_N[-1]
    hidden = play("clamp_slip", slip_m=2e-5, time_s=2.005, behind_wrap=1.0)
    open_way = play("clamp_slip", slip_m=2e-5, time_s=2.005)
    held = np.ptp(hidden.joint_position_rad - plain.joint_position_rad)
    assert held < 0.5 * np.ptp(open_way.joint_position_rad - plain.joint_position_rad)


def test_clock_skew_stamps_the_joint_late(plain: PlantRun) -> None:
    for delay in (0.03, -0.03):
        run = play("clock_skew", delay_s=delay)
        inner = slice(5, -5)
        np.testing.assert_allclose(
            run.joint_position_rad[inner],
            np.interp(T - delay, T, plain.joint_position_rad)[inner],
            atol=1e-12,
        )


def test_configuration_effects_and_given_effects_both_act() -> None:
    config = joint()
    own = PlantConfig(
        config.name,
        config.circuit,
        config.stages,
        effects=(EffectSpec("series_compliance", {"compliance_rad_per_Nm": 1e-3}),),
    )
    other = EffectSpec("termination_backlash", {"gap_rad": 2e-3})
    both = simulate(own, T, MOTOR, LOAD, effects=(other,))
    plain = simulate(config, T, MOTOR, LOAD)
    change = both.joint_position_rad - plain.joint_position_rad
    np.testing.assert_allclose(change, 1e-3 * LOAD + 1e-3 * np.sign(LOAD), atol=1e-9)
