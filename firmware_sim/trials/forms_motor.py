"""Friction of the motor's shaft, of every form: it shows in the motor's torque alone, and is concealed on its own."""

from __future__ import annotations

import numpy as np

from firmware_sim.trials.joints import log_uniform
from firmware_sim.trials.suspects import TURNING, Scene, Shape, Suspect, angle, torque_for_a_loop


def _torque(scene: Scene) -> float:
    """Motor torque for one loop width, N·m."""
    return torque_for_a_loop(scene) * scene.joint.true.ratio


def _presliding(rng: np.random.Generator, scene: Scene) -> float:
    return log_uniform(rng, 1e-3, 1e-2) * float(np.ptp(scene.course.motor_rad))


def _most(scene: Scene) -> float:
    return 0.4 * scene.joint.load_Nm * scene.joint.true.ratio


def _friction(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape(
        {"presliding_rad": _presliding(rng, scene)}, {"torque_Nm": 1.0}, _torque(scene), _most(scene)
    )


def _lugre(rng: np.random.Generator, scene: Scene) -> Shape:
    speed = max(scene.plain.speed_rms / scene.joint.true.ratio, 1e-9)
    fixed = {
        "presliding_rad": _presliding(rng, scene),
        "stribeck_gain": float(rng.uniform(0.1, 0.6)),
        "stribeck_rad_s": log_uniform(rng, 0.1, 1.0) * speed,
    }
    scaled = {"torque_Nm": 1.0, "viscous_Nms_per_rad": float(rng.uniform(0.1, 0.6)) / speed}
    return Shape(fixed, scaled, 0.7 * _torque(scene), _most(scene))


def _gear(rng: np.random.Generator, scene: Scene) -> Shape:
    """Most of it by the torque that the gear passes on."""
    loaded = float(rng.uniform(0.5, 0.95))
    passed = scene.plain.load_rms * scene.joint.true.ratio
    scaled = {"torque_Nm": 1.0 - loaded, "share": loaded / passed}
    return Shape(
        {"presliding_rad": _presliding(rng, scene)}, scaled, _torque(scene), min(_most(scene), 0.5 * passed)
    )


def _uneven(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "presliding_rad": _presliding(rng, scene),
        "unevenness": float(rng.uniform(0.4, 0.9)),
        "order": float(rng.integers(1, 5)),
        "phase_rad": angle(rng),
    }
    return Shape(fixed, {"torque_Nm": 1.0}, _torque(scene), _most(scene))


MOTOR = (Suspect("motor_friction", TURNING, _friction, motor_torque=True),)
MOTOR_FORMS = (
    Suspect("motor_friction:lugre", TURNING, _lugre, motor_torque=True),
    Suspect("motor_friction:gear", TURNING, _gear, motor_torque=True),
    Suspect("motor_friction:uneven", TURNING, _uneven, motor_torque=True),
)
