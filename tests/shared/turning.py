"""A joint whose both pulleys turn under load, and recordings of it by the observer itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cablecomp.config import JointConfig, Limits, load_joint
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, hypotheses
from cablecomp.effects import with_effects
from cablecomp.estimation.evidence import Evidence
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray

JOINT = load_joint(Path(__file__).parents[2] / "configs" / "joints" / "wrist-capstan.toml")
NOISE_RAD = 2e-5
REACH = Limits(motor_position_min_rad=-1.8, motor_position_max_rad=1.8, joint_torque_max_Nm=1.6)
LIMITED = JOINT.model_copy(update={"limits": REACH})


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


def after_a_history(seed: int, softness: float = 0.0) -> dict[str, FloatArray]:
    """A recording of small loads with the motor at rest, after the joint was wound back and forth under great ones that
    nobody recorded."""
    before = course(14.0, seed=seed)
    time = np.arange(0.0, 16.0, 0.02)
    small = 0.5 * np.sin(1.1 * time + seed) * (1.0 - np.exp(-time))
    ease = np.linspace(1.0, 0.0, 100)
    motor, load = (before[c] for c in ("motor_position_rad", "joint_torque_Nm"))
    whole = {
        "motor_position_rad": np.concatenate([motor, motor[-1] * ease, np.zeros_like(time)]),
        "joint_torque_Nm": np.concatenate([load, load[-1] * ease, small]),
    }
    whole["time_s"] = 0.02 * np.arange(len(whole["joint_torque_Nm"]))
    joint = with_effects(JOINT, [("series_compliance", {"compliance_rad_per_Nm": softness})])
    angle = Observer(joint).run(whole)["joint_position_rad"]
    noise = NOISE_RAD * np.random.default_rng(seed).standard_normal(len(angle))
    return {c: v[-len(time) :] for c, v in {**whole, "joint_position_rad": angle + noise}.items()}


def gathered(*, warm: bool = False) -> tuple[Evidence, ...]:
    """The recording gathered; `warm`: beside a temperature that moves."""
    columns = recorded()
    if warm:
        columns["temperature_degC"] = 20.0 + np.sin(columns["time_s"])
    return gather_body(JOINT, {"a/1": columns}).used


def hypothesis(effect: str, name: str) -> Hypothesis:
    """What is asked of it about an effect."""
    return next(h for h in hypotheses(JOINT, gathered()) if h.effect.id == effect and h.name == name)
