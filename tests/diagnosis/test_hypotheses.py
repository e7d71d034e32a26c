"""Fits of hypotheses against the independent plant: events are found to the sample, calibration gone astray
is no dead end, and what a tolerance can conceal is seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from cablecomp.config import parse_joint
from cablecomp.diagnosis.forms import all_forms
from cablecomp.diagnosis.hidden import hidden_effects
from cablecomp.diagnosis.hypotheses import fit_roughly, fold_of, polish, start_of
from cablecomp.diagnosis.screening import probe_all
from cablecomp.diagnosis.setting import Setting, set_up
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

STAGE = {
    "output_radius_m": 0.03, "input_radius_m": 0.015, "free_length_m": 0.08, "EA_N": 20000.0,
    "pretension_N": 60.0, "mu_output": 0.12, "mu_input": 0.14, "wrap_output_rad": 9.0, "wrap_input_rad": 12.0,
}  # fmt: skip
TRUE = {**STAGE, "EA_N": 20500.0, "pretension_N": 57.5, "mu_output": 0.135, "mu_input": 0.125}
NOISE = {"joint_position_rad": 1e-5, "joint_torque_Nm": 1e-3, "motor_position_rad": 1e-5}


def setting(
    load: FloatArray, motor: FloatArray, effects: Sequence[EffectSpec], noise: float = 1.0
) -> Setting:
    """Recording of the plant at 100 Hz, so many times the usual noise, and the nominal joint calibrated to
    it."""
    time = 0.01 * np.arange(len(load))
    drive = {"schema": 1, "name": "true", "drive": {"circuit": "closed", "stage": [TRUE]}}
    run = simulate(PlantConfig.from_dict(drive), time, motor, load, effects=effects)
    rng = np.random.default_rng(5)
    columns = {"time_s": time}
    for name, sigma in NOISE.items():
        columns[name] = run.channels()[name] + noise * sigma * rng.standard_normal(len(time))
    joint = parse_joint(
        {
            "schema": 1,
            "name": "test",
            "drive": {"circuit": "closed", "stage": [STAGE]},
            "tolerance": {"EA_N": 0.04, "pretension_N": 0.06, "mu_output": 0.25, "mu_input": 0.25},
            "sensors": {
                "joint_position_noise_rad": noise * NOISE["joint_position_rad"],
                "joint_torque_noise_Nm": noise * NOISE["joint_torque_Nm"],
                "motor_position_noise_rad": noise * NOISE["motor_position_rad"],
            },
        },
        "test",
    )  # fmt: skip
    return set_up(joint, [columns], np.random.default_rng(0))


@pytest.fixture(scope="module")
def course() -> tuple[FloatArray, FloatArray]:
    """Load and motor angle of 40 s, both pulleys turning."""
    time = np.arange(0.0, 40.0, 0.01)
    soft = 1.0 - np.exp(-time)
    load = soft * (0.8 * np.sin(2.3 * time) + 0.5 * np.sin(1.1 * time))
    return load, soft * (0.8 * np.sin(0.9 * time) + 0.5 * np.sin(1.7 * time))


def test_a_slip_of_the_clamp_is_found_to_the_sample(course: tuple[FloatArray, FloatArray]) -> None:
    slip = EffectSpec("clamp_slip", {"slip_m": 2e-5, "time_s": 17.33})
    s = setting(*course, [slip])
    start = start_of(s.problem, s.calibrated, s.layout)
    groups = [g for g in all_forms(s.problem.config, s.around) if g[0].effect.id == "clamp_slip"]
    probes = probe_all(s.problem, start, groups, lambda what, share: None)
    models, _ = fit_roughly(s.problem, start, probes, s.layout, True, lambda what, share: None)
    whole, fold = polish(s.problem, fold_of(s.problem, models["clamp_slip"], s.layout), s.layout)
    (entry,) = whole.entries()
    assert entry.parameters["time_s"] == pytest.approx(17.33, abs=0.02)
    assert entry.parameters["slip_m"] == pytest.approx(2e-5, rel=0.03)
    kept = s.layout.heldout | s.layout.training
    assert np.sqrt(np.mean(fold.residual_rad[kept] ** 2)) < 1.2 * s.floor_rad


def test_a_small_slow_load_conceals_a_soft_mount() -> None:
    time = np.arange(0.0, 40.0, 0.01)
    s = setting(0.12 * np.sin(0.2 * np.pi * time), np.zeros_like(time), [], noise=0.1)
    groups = [g for g in all_forms(s.problem.config, s.around) if g[0].effect.id == "series_compliance"]
    probes = probe_all(s.problem, s.calibrated, groups, lambda what, share: None)
    (hidden,) = hidden_effects(s.problem, s.calibrated, probes, s.layout)
    assert (hidden.effect, hidden.behind) == ("series_compliance", "EA_N")
    # what is said of it holds: large by itself, and gone once the calibration has moved
    plain = s.problem.predict(s.problem.joint(s.calibrated.c))
    together = s.problem.predict(hidden.model)
    alone = s.problem.predict(
        s.problem.joint(s.calibrated.c).model_copy(update={"effect": hidden.model.effect})
    )
    assert np.std(alone - plain) > 1.5 * s.floor_rad
    assert np.std(together - plain) < 0.5 * s.floor_rad
