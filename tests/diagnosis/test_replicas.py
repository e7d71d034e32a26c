"""Rows to be fitted: what is measured and what is simulated are means over the same samples."""

from __future__ import annotations

import numpy as np
import pytest

from cablecomp.config import parse_joint
from cablecomp.diagnosis.fitting import INFLATION
from cablecomp.diagnosis.replicas import observe
from cablecomp.diagnosis.setting import set_up
from cablecomp.signal.smoothing import FloatArray, group_means
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

JOINT = {
    "schema": 1,
    "name": "test",
    "drive": {
        "circuit": "closed",
        "stage": [
            {
                "output_radius_m": 0.03, "input_radius_m": 0.015, "free_length_m": 0.08, "EA_N": 2e4,
                "pretension_N": 60.0, "mu_output": 0.1, "mu_input": 0.1, "wrap_output_rad": 9.0,
                "wrap_input_rad": 12.0,
            }
        ],
    },
}  # fmt: skip


@pytest.mark.parametrize("samples", [1200, 1201, 1205, 1211])
def test_a_row_and_its_steps_cover_the_same_samples(samples: int) -> None:
    """Also at the end of a recording that is no whole number of rows long: the joint is moving there."""
    time = 1e-3 * np.arange(samples)
    columns = {
        "time_s": time,
        "motor_position_rad": 2.0 * time**2,
        "joint_position_rad": time**2,
        "joint_torque_Nm": np.sin(time),
    }
    part, _ = observe(columns, parse_joint(JOINT, "test"), finest=3, each=4)
    assert group_means(part.inputs["time_s"], part.each) == pytest.approx(part.columns["time_s"], abs=1e-12)
    assert len(part.columns["time_s"]) == samples // 12
    assert part.columns["time_s"][-1] == pytest.approx(time[(samples // 12 - 1) * 12 :][:12].mean())


WEIGHT = {"moment_Nm": 1.0, "phase_rad": 0.0}
NOISE = {"joint_position_rad": 1e-5, "joint_torque_Nm": 2e-3, "motor_position_rad": 1e-5}


def recorded(motor: FloatArray, load: FloatArray, seed: int) -> dict[str, FloatArray]:
    """The plant with the nominal values of the joint, read with noise at 100 Hz."""
    time = 0.01 * np.arange(len(load))
    run = simulate(
        PlantConfig.from_dict(JOINT), time, motor, load, effects=[EffectSpec("gravity_load", WEIGHT)]
    )
    rng = np.random.default_rng(seed)
    return {"time_s": time} | {
        name: run.channels()[name] + sigma * rng.standard_normal(len(time)) for name, sigma in NOISE.items()
    }


def test_every_recording_is_weighed_by_the_noise_that_it_has() -> None:
    """Load and motion, and motion under a weight alone: a torque channel at rest says nothing of the compliance
    that its noise passes through."""
    t = 0.01 * np.arange(2000)
    motor = 0.4 * np.sin(0.9 * t)
    both = [
        recorded(motor, 1.5 * np.sin(1.7 * t), 1),
        recorded(motor, 0.0 * t, 2),
    ]
    stated = {f"{name.rpartition('_')[0]}_noise_{name.rpartition('_')[2]}": v for name, v in NOISE.items()}
    known = {"tolerance": {"EA_N": 0.02}, "sensors": stated, "effect": [{"id": "gravity_load", **WEIGHT}]}
    joint = parse_joint({**JOINT, **known}, "test")
    found = set_up(joint, both, np.random.default_rng(0))
    left = found.calibrated.residual * INFLATION
    first = found.problem.parts[0].rows
    for part in (left[:first], left[first:]):
        assert 0.8 < float(np.sqrt(np.mean(part**2))) < 1.25
