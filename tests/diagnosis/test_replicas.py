"""Rows to be fitted: what is measured and what is simulated are means over the same samples."""

from __future__ import annotations

import numpy as np
import pytest

from cablecomp.config import parse_joint
from cablecomp.diagnosis.replicas import observe
from cablecomp.identification.smoothing import group_means

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
