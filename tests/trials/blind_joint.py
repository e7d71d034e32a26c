"""A joint and its recordings for tests of the scoreboard."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig, parse_joint
from cablecomp.observer import Observer

NOISE_RAD = 1e-5
JOINT = parse_joint(
    {
        "schema": 1,
        "name": "blind",
        "drive": {
            "circuit": "closed",
            "stage": [
                {
                    "output_radius_m": 0.02,
                    "input_radius_m": 0.01,
                    "free_length_m": 0.05,
                    "EA_N": 15000.0,
                    "pretension_N": 50.0,
                    "mu_output": 0.12,
                    "mu_input": 0.12,
                    "wrap_output_rad": 12.0,
                    "wrap_input_rad": 12.0,
                }
            ],
        },
        "tolerance": {"EA_N": 0.04, "pretension_N": 0.06, "mu_output": 0.2, "mu_input": 0.2},
        "sensors": {"joint_position_noise_rad": NOISE_RAD, "joint_torque_noise_Nm": 1e-5},
    },
    "blind",
)


def recording(joint: JointConfig, seed: int, noise: bool = True) -> dict[str, NDArray[np.float64]]:
    """Ramps at two rates with holds, input locked; the joint encoder is noisy."""
    rng = np.random.default_rng(seed)
    turns = np.array([0.0, 0.7, 0.7, -0.6, -0.6, 0.5, -0.4, 0.3, 0.3, -0.2, 0.6, 0.0, 0.0])
    time = np.arange(0.0, 40.0, 0.02)
    at = np.cumsum([0.0, *rng.uniform(0.8, 4.0, len(turns) - 1)])
    load = np.interp(time, at * 40.0 / at[-1], turns)
    columns = {"time_s": time, "motor_position_rad": np.zeros_like(time), "joint_torque_Nm": load}
    columns["joint_position_rad"] = Observer(joint).run(columns)["joint_position_rad"]
    sigma = NOISE_RAD if noise else 0.0
    columns["joint_position_rad"] = columns["joint_position_rad"] + sigma * rng.standard_normal(len(time))
    return columns


def turning(seed: int) -> dict[str, NDArray[np.float64]]:
    """Both pulleys turn under a load of two frequencies; the motor's torque is recorded, without noise of its own."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 40.0, 0.02)
    columns = {
        "time_s": time,
        "motor_position_rad": 0.8 * np.sin(1.1 * time),
        "joint_torque_Nm": 0.4 * np.sin(1.7 * time) + 0.3 * np.sin(2.9 * time),
    }
    ran = Observer(JOINT).run(columns)
    columns["joint_position_rad"] = ran["joint_position_rad"] + NOISE_RAD * rng.standard_normal(len(time))
    columns["motor_torque_Nm"] = ran["predicted_motor_torque_Nm"]
    return columns
