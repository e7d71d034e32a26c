"""A cable tightened anew is the same cable: held against the plant, loaded to the same tensions from either."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from plant_joints import Floats, joint

from firmware_sim.plant import EffectSpec, StageConfig, simulate
from firmware_sim.trials.scene import is_no_trial
from firmware_sim.trials.tightened import ABOUT_T0, tightened

SPECS = (
    EffectSpec("nonlinear_cable", {"stiffening": 0.6}),
    EffectSpec("nonlinear_cable", {"stiffening": -0.4}),
    EffectSpec("nonlinear_cable:saturating", {"softness": 0.8, "reach": 0.6}),
    EffectSpec("nonlinear_cable:power_law", {"exponent": 0.7}),
    EffectSpec("nonlinear_cable:knee", {"rise": 2.0, "place": 1.1, "width": 0.2}),
    EffectSpec("nonlinear_cable:s_shaped", {"dip": 0.6, "place": 0.9, "width": 0.4}),
    EffectSpec("pressure_dependent_friction", {"exponent": 0.6}),
    EffectSpec("pressure_dependent_friction:floor", {"exponent": 1.0, "floor": 0.4}),
    EffectSpec("pressure_dependent_friction:exponential", {"rate": 1.0}),
    EffectSpec("pressure_dependent_friction:worn_through", {"place": 0.1, "floor": 0.4}),
    EffectSpec("pressure_dependent_friction:pressed_flat", {"rate": 5.0}),
    EffectSpec("pressure_dependent_friction:ploughed", {"adhesion": 0.9, "place": 1.2}),
)
FACTOR = 1.08


def test_every_law_about_the_pretension_is_tried() -> None:
    assert {s.id for s in SPECS} == set(ABOUT_T0)


def loop(stage: StageConfig, spec: EffectSpec) -> Floats:
    """Deflection of an open circuit, its mean taken off, while its tension swings between a third and twice 50 N for
    the second time: what went before the first is forgotten."""
    time = np.arange(0.0, 16.0, 0.02)
    tension = 58.0 + 40.0 * np.sin(2.0 * np.pi * time / 8.0)
    load = (tension - stage.pretension_N) * stage.output_radius_m * np.minimum(1.0, time)
    config = replace(joint("open"), stages=(stage,))
    shown = simulate(config, time, 0.0 * time, load, effects=[spec]).joint_position_rad[len(time) // 2 :]
    return np.asarray(shown - shown.mean())


@pytest.mark.parametrize("spec", SPECS, ids=lambda s: f"{s.id}{list(s.parameters.values())}")
def test_the_same_tensions_turn_the_joint_alike(spec: EffectSpec) -> None:
    """The same law about the new pretension, which is another cable, misses it by far more."""
    stage = joint("open").stages[0]
    before = loop(stage, spec)
    there, (about,) = tightened(stage, [spec], FACTOR)
    assert there.pretension_N == pytest.approx(FACTOR * stage.pretension_N)
    off = np.ptp(loop(there, about) - before) / np.ptp(before)
    other = np.ptp(loop(replace(stage, pretension_N=there.pretension_N), spec) - before) / np.ptp(before)
    assert off < 0.004
    assert off < 0.4 * other


def test_what_is_not_stated_about_it_stays() -> None:
    stage = joint("closed").stages[0]
    slip = EffectSpec("clamp_slip", {"slip_m": 1e-4, "time_s": 3.0})
    there, specs = tightened(stage, [slip], FACTOR)
    assert specs == [slip]
    assert there == replace(stage, pretension_N=FACTOR * stage.pretension_N)


@pytest.mark.parametrize(
    ("off_rad", "tension_N", "none"), [(0.02, 30.0, False), (0.02, 0.5, True), (26060.0, 30.0, True)]
)
def test_a_slack_cable_and_a_joint_that_the_plant_lost_are_no_trial(
    off_rad: float, tension_N: float, none: bool
) -> None:
    config = joint("open")
    drawn: Any = SimpleNamespace(true=config, stage=config.stages[0])
    motor = np.linspace(0.0, 3.0, 50)
    run: Any = SimpleNamespace(
        tension_h_N=np.full(50, tension_N),
        motor_true_rad=motor,
        joint_position_rad=config.ratio * motor + off_rad,
    )
    assert is_no_trial(run, drawn) is none
