"""Several stages: what the thesis's chapter 5 says must come out of shafts and cables in a row."""

from __future__ import annotations

import numpy as np
import pytest
from plant_joints import clock, closed_loading, course, geometry_friction, mu_effective, open_loading

from firmware_sim.plant import PlantConfig, StageConfig, simulate

FIRST = StageConfig(0.05, 0.015, 0.10, 2.0e5, 30.0, 0.12, 0.15, 12.0, 14.0)
SECOND = StageConfig(0.04, 0.02, 0.06, 3.0e5, 60.0, 0.10, 0.14, 12.0, 14.0)


def locked(config: PlantConfig, load: np.ndarray) -> np.ndarray:
    """Joint angle under a load in units of R T0 of the output stage, motor held."""
    s = config.stages[-1]
    moment = load * s.output_radius_m * s.pretension_N
    return simulate(config, clock(load), np.zeros(len(load)), moment).joint_position_rad


def equivalent(first: StageConfig, last: StageConfig) -> StageConfig:
    """One stage in place of two in an open circuit, (5-13)..(5-21), with the friction all on the output
    pulley."""
    ratio = last.input_radius_m / last.output_radius_m
    share = ratio**2 * last.output_radius_m / first.output_radius_m * last.EA_N / first.EA_N
    mu = 1.0 / (share / mu_effective(first) + 1.0 / mu_effective(last))
    length = share * last.output_radius_m / first.output_radius_m * first.free_length_m + last.free_length_m
    values = {**last.__dict__, "free_length_m": length, "mu_output": mu, "mu_input": 1e9}
    return StageConfig(**values)


def test_open_stages_are_one_equivalent_stage() -> None:
    config = PlantConfig("two", "open", (FIRST, SECOND))
    load = course(0.0, 1.2, points=100)
    one = equivalent(FIRST, SECOND)
    expected = np.array([0.0] + [open_loading(one, m) for m in load[1:]])
    assert np.max(np.abs(locked(config, load) - expected)) < 5e-3 * expected[-1]


def test_parallel_closed_stages_are_one_equivalent_stage() -> None:
    config = PlantConfig("two", "closed", (FIRST, SECOND), "parallel")
    load = course(0.0, 1.2, points=100)
    one = equivalent(FIRST, SECOND)
    expected = np.array([0.0] + [closed_loading(one, m)[0] for m in load[1:]])
    assert np.max(np.abs(locked(config, load) - expected)) < 5e-3 * expected[-1]
    assert geometry_friction(one) > 0


def test_stages_in_series_add_their_deflections() -> None:
    config = PlantConfig("two", "closed", (FIRST, SECOND), "series")
    load = course(0.0, 0.9, points=100)
    ratio = SECOND.input_radius_m / SECOND.output_radius_m
    moment = SECOND.output_radius_m * SECOND.pretension_N
    expected = [0.0]
    for m in load[1:]:
        inner = m * moment * ratio / (FIRST.output_radius_m * FIRST.pretension_N)
        expected.append(closed_loading(SECOND, m)[0] + ratio * closed_loading(FIRST, inner)[0])
    assert np.max(np.abs(locked(config, load) - expected)) < 5e-3 * expected[-1]


@pytest.mark.parametrize("arrangement", ["series", "parallel"])
def test_stages_turn_together(arrangement: str) -> None:
    config = PlantConfig("two", "closed", (FIRST, SECOND), arrangement)
    t = np.arange(0, 4, 0.01)
    motor = 2.0 * np.sin(1.5 * t)
    run = simulate(config, t, motor, np.zeros_like(t))
    assert config.ratio == pytest.approx(0.3 * 0.5)
    assert np.max(np.abs(run.joint_position_rad - config.ratio * motor)) < 1e-4
    assert np.max(np.abs(run.motor_torque_Nm)) < 1e-3 * FIRST.input_radius_m * FIRST.pretension_N
