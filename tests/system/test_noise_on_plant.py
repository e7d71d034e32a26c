"""With true parameters and noisy sensors the prediction stands at the joint encoder's noise floor."""

from __future__ import annotations

import numpy as np
import pytest
from joints import WIDE, closed

from cablecomp.config import parse_joint
from cablecomp.observer import Observer
from firmware_sim.plant import PlantConfig, simulate

JOINT_NOISE_RAD = 2e-5


@pytest.mark.parametrize(("filter_Hz", "most"), [(0.0, 1.5), (40.0, 1.3)])
def test_prediction_error_over_the_noise_floor(filter_Hz: float, most: float) -> None:
    data = closed(WIDE, "wide")
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 0.001)
    motor = 1.5 * np.sin(0.9 * time) + 0.3 * np.sin(2.3 * time)
    load = 1.8 * np.sin(1.7 * time) * np.cos(0.23 * time)
    run = simulate(PlantConfig.from_dict(data), time, motor, load)
    columns = {
        "time_s": time,
        "motor_position_rad": motor + 2e-5 * rng.standard_normal(len(time)),
        "joint_torque_Nm": load + 2e-3 * rng.standard_normal(len(time)),
    }
    measured = run.joint_position_rad + JOINT_NOISE_RAD * rng.standard_normal(len(time))
    config = parse_joint({**data, "observer": {"input_filter_Hz": filter_Hz}}, "test")
    error = measured - Observer(config).run(columns)["joint_position_rad"]
    assert np.sqrt(np.mean(error**2)) < most * JOINT_NOISE_RAD
    deflection = measured - 0.375 * columns["motor_position_rad"]
    line = np.polyval(np.polyfit(load, deflection, 1), load)
    assert np.std(deflection - line) > 10.0 * JOINT_NOISE_RAD  # what a linear stiffness leaves
