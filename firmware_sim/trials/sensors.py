"""Sensors fit for a joint: so fine that the noise floor is a small share of its hysteresis loop."""

from __future__ import annotations

import math

import numpy as np

from firmware_sim.trials.joints import DrawnJoint, log_uniform
from firmware_sim.trials.measures import PlainDrive

NEIGHBOUR_LOAD, NEIGHBOUR_ANGLE = "other_neighbour_Nm", "other_neighbour_rad"
"""The channel of a neighbouring joint: the load on it, or how far it is turned."""
TEMPERATURE_NOISE_K = 0.02
NEIGHBOUR_NOISE = 0.002  # of its range


def draw_sensors(rng: np.random.Generator, joint: DrawnJoint, plain: PlainDrive) -> dict[str, float]:
    """Noise and resolution of all channels, as a configuration's [sensors] states them.

    The floor in the joint angle is 0.5–2 % of the loop; the torque sensor has 0.1–0.3 % of the greatest load,
    less where that alone would make up the floor.
    """
    floor = log_uniform(rng, 0.005, 0.02) * plain.loop_rad
    ratio = joint.true.ratio
    torque = min(float(rng.uniform(0.001, 0.003)) * joint.load_Nm, 0.45 * floor / plain.compliance)
    values = {
        "joint_position_noise_rad": 0.75 * floor,
        "joint_position_resolution_rad": 1.2 * floor,
        "motor_position_noise_rad": 0.2 * floor / ratio,
        "motor_position_resolution_rad": 0.3 * floor / ratio,
        "joint_torque_noise_Nm": torque,
        "joint_torque_resolution_Nm": 0.5 * torque,
    }
    return {key: float(f"{value:.3e}") for key, value in values.items()}


def noise_floor_rad(joint: DrawnJoint, plain: PlainDrive) -> float:
    """What the sensors' noise leaves between a perfect model and the joint encoder, rad."""
    s, ratio = joint.sensors, joint.true.ratio
    return math.sqrt(
        s["joint_position_noise_rad"] ** 2
        + s["joint_position_resolution_rad"] ** 2 / 12.0
        + (ratio * s["motor_position_noise_rad"]) ** 2
        + (ratio * s["motor_position_resolution_rad"]) ** 2 / 12.0
        + (plain.compliance * s["joint_torque_noise_Nm"]) ** 2
        + (plain.compliance * s["joint_torque_resolution_Nm"]) ** 2 / 12.0
    )
