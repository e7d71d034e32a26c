"""What a joint did in a gap of its recording is neither physics that is missing nor a drive that is another."""

from __future__ import annotations

import numpy as np
import pytest
from joints import LONG, closed

from cablecomp.config import parse_joint
from cablecomp.diagnosis.diagnose import diagnose
from firmware_sim.plant import PlantConfig, simulate

STEP_S, NOISE_RAD = 0.01, 2e-5


@pytest.mark.parametrize("peak_Nm", [0.0, 1.3, -0.7])
def test_a_load_that_came_and_went_in_a_gap_is_told_and_named_nothing(peak_Nm: float) -> None:
    raw = closed(LONG)
    joint = parse_joint(raw, "gap")
    time = np.arange(0.0, 60.0, STEP_S)
    motor = 0.5 * np.sin(0.35 * time)
    # loads that come on, stay and go, each within 0.3 s
    levels = np.array([0.0, 1.2, 0.0, -0.9, 0.4, 0.0, -1.2, 0.6, 0.0, 0.9, -0.5, 0.0, 0.8, 0.0, -0.7, 0.0])
    begins = 3.7 * np.arange(len(levels))
    load = np.interp(time, np.ravel(np.column_stack((begins, begins + 3.4))), np.repeat(levels, 2))
    hidden = (time > 30.2) & (time < 31.2)
    load = load + peak_Nm * np.sin(np.pi * np.clip(time - 30.2, 0.0, 1.0)) ** 2
    angle = simulate(PlantConfig.from_dict(raw), time, motor, load).channels()["joint_position_rad"]
    rng = np.random.default_rng(8)
    columns = {
        "time_s": time,
        "motor_position_rad": motor,
        "joint_torque_Nm": load,
        "joint_position_rad": angle + NOISE_RAD * rng.standard_normal(len(time)),
    }
    found = diagnose(joint, {"one": {k: v[~hidden] for k, v in columns.items()}})
    assert found.verdict in ("consistent", "recalibrate")
    assert not found.named
    assert any("gap (30.2 to 31.2 s)" in line for line in found.warnings) is (peak_Nm != 0.0)
    assert found.baseline.heldout_rmse_rad < 3.0 * NOISE_RAD
