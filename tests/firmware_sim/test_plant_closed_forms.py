"""The plant converges to the thesis's closed forms, which it does not know."""

from __future__ import annotations

import numpy as np
import pytest
from plant_joints import (
    clock,
    closed_loading,
    closed_unloading,
    course,
    geometry_friction,
    joint,
    open_loading,
    open_unloading,
)

from firmware_sim.plant import NORMAL, PlantConfig, PlantRun, Resolution, simulate

FINER = Resolution(friction_step=0.01)


def locked(config: PlantConfig, load: np.ndarray, resolution: Resolution = NORMAL) -> PlantRun:
    """Input pulley held, load given in units of R T0."""
    s = config.stages[0]
    moment = load * s.output_radius_m * s.pretension_N
    return simulate(config, clock(load), np.zeros(len(load)), moment, resolution=resolution)


@pytest.mark.parametrize("peak", [1.5, -0.7])
def test_open_circuit_follows_its_loading_and_unloading_curves(peak: float) -> None:
    config = joint("open")
    s = config.stages[0]
    load = course(0.0, peak, 0.0)
    run = locked(config, load, FINER)
    n = 200
    up = np.array([open_loading(s, m) for m in load[1 : n + 1]])
    down = np.array([open_unloading(s, m, peak) for m in load[n:]])
    whole = np.concatenate([[0.0], up[:-1], down])
    assert np.max(np.abs(run.joint_position_rad - whole)) < 0.002 * np.max(np.abs(whole))
    np.testing.assert_allclose(run.tension_h_N, s.pretension_N * (1 + load), rtol=1e-6)


@pytest.mark.parametrize("free_length_m", [0.008, 0.06, 0.5])
def test_closed_circuit_follows_its_loading_and_unloading_curves(free_length_m: float) -> None:
    config = joint(free_length_m=free_length_m)
    s = config.stages[0]
    peak = 1.3
    load = course(0.0, peak, 0.0)
    run = locked(config, load, FINER)
    n = 200
    up = np.array([closed_loading(s, m) for m in load[1:n]])
    down = np.array([closed_unloading(s, m, peak) for m in load[n:]])
    whole = np.concatenate([[[0.0, 1.0, 1.0]], up, down])
    assert np.max(np.abs(run.joint_position_rad - whole[:, 0])) < 0.003 * np.max(whole[:, 0])
    assert np.max(np.abs(run.tension_h_N / s.pretension_N - whole[:, 1])) < 0.002
    assert np.max(np.abs(run.tension_l_N / s.pretension_N - whole[:, 2])) < 0.002


def test_error_falls_with_the_spacing_and_ends_below_half_a_percent() -> None:
    config = joint(wrap_output_rad=14.0, wrap_input_rad=16.0, mu_output=0.3, mu_input=0.3, free_length_m=0.2)
    s = config.stages[0]
    load = course(0.0, 1.2, points=60)
    truth = np.array([0.0] + [closed_loading(s, m)[0] for m in load[1:]])
    errors = []
    for step in (0.06, 0.03, 0.015, 0.0075):
        run = locked(config, load, Resolution(friction_step=step))
        errors.append(float(np.sqrt(np.mean((run.joint_position_rad - truth) ** 2))) / truth[-1])
    assert errors[0] < 5e-3
    assert errors[-1] < 5e-4
    assert errors[-1] < 0.5 * errors[0]


def test_zero_load_stiffness_is_the_free_spans() -> None:
    config = joint()
    s = config.stages[0]
    m = 0.01
    run = locked(config, course(0.0, m, points=10), Resolution(friction_step=0.002))
    moment = m * s.output_radius_m * s.pretension_N
    expected = 2 * s.EA_N * s.output_radius_m**2 / s.free_length_m
    # the wraps give way a little even at this load: by m/(4 GF)
    softer = 1 + m / (4 * geometry_friction(s))
    assert moment / run.joint_position_rad[-1] == pytest.approx(expected / softer, rel=3e-3)


def test_a_wrap_that_slips_to_its_end_stops_softening() -> None:
    config = joint("open", wrap_output_rad=2.0, wrap_input_rad=2.0)
    s = config.stages[0]
    load = course(0.0, 3.0, points=400)
    run = locked(config, load, FINER)
    # all slips beyond m = e^(mu θ) − 1; then every point's tension is in proportion, and so is the stretch
    at = load > 1.05 * np.expm1(max(s.mu_output * 2.0, s.mu_input * 2.0))
    tangent = np.diff(run.joint_position_rad[at]) / np.diff(load[at])
    length = s.free_length_m
    for mu, radius in ((s.mu_output, s.output_radius_m), (s.mu_input, s.input_radius_m)):
        length += radius * -np.expm1(-mu * 2.0) / mu
    assert tangent == pytest.approx(s.pretension_N * length / (s.EA_N * s.output_radius_m), rel=3e-3)


def test_a_slack_cable_leaves_the_other_alone() -> None:
    config = joint(free_length_m=0.5, wrap_output_rad=3.0, wrap_input_rad=3.0)
    s = config.stages[0]
    load = course(0.0, 3.0, 0.0, -3.0, 0.0, points=150)
    run = locked(config, load)
    assert np.min(run.tension_l_N) == 0.0
    slack = run.tension_l_N == 0.0
    np.testing.assert_allclose(
        run.tension_h_N[slack], load[slack] * s.pretension_N, atol=2e-3 * s.pretension_N
    )
    assert np.min(run.tension_h_N) == 0.0
    assert run.failures == 0
