"""A joint whose both pulleys turn under load, and recordings of it by the observer itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cablecomp.config import JointConfig, load_joint
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray

JOINT = load_joint(Path(__file__).parents[2] / "configs" / "joints" / "wrist-capstan.toml")


def course(duration_s: float = 20.0, step_s: float = 0.02, seed: int = 1) -> dict[str, FloatArray]:
    """Motor angle and load of two frequencies each, from rest."""
    time = np.arange(0.0, duration_s, step_s)
    swell = 1.0 - np.exp(-time)
    return {
        "time_s": time,
        "motor_position_rad": 1.8 * np.sin(0.7 * time + 0.3 * seed) * swell,
        "joint_torque_Nm": 1.6 * np.sin(1.9 * time) * np.cos(0.23 * time + seed) * swell,
    }


def recorded(
    config: JointConfig = JOINT,
    noise_rad: float = 2e-5,
    offset_rad: float = 0.0,
    seed: int = 1,
    **further: float,
) -> dict[str, FloatArray]:
    """A course with the joint angle that the observer predicts, plus noise and a zero; `further` goes to `course`."""
    columns = course(seed=seed, **further)
    rng = np.random.default_rng(seed)
    angle = Observer(config).run(columns)["joint_position_rad"]
    noise = noise_rad * rng.standard_normal(len(angle))
    return {**columns, "joint_position_rad": angle + offset_rad + noise}
