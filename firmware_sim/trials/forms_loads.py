"""What can be concealed of other forms: loads on the pulley."""

from __future__ import annotations

import math

import numpy as np

from firmware_sim.plant.forms.courses import second_rate
from firmware_sim.trials.joints import log_uniform
from firmware_sim.trials.suspects import ANY, TURNING, Scene, Shape, Suspect, angle, sign, torque_for_a_loop


def _inertia(scene: Scene) -> float:
    return torque_for_a_loop(scene) / max(scene.plain.acceleration_rms, 1e-9)


def _flexible(rng: np.random.Generator, scene: Scene) -> Shape:
    swing = 2.0 * math.pi * float(rng.uniform(2.0, 6.0))
    damping = 2.0 * float(rng.uniform(0.1, 0.5)) * swing
    scaled = {"inertia_kgm2": 1.0, "stiffness_Nm_per_rad": swing**2, "damping_Nms_per_rad": damping}
    return Shape({}, scaled, _inertia(scene), 100.0 * _inertia(scene))


def _folding(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"swing": sign(rng) * float(rng.uniform(0.3, 0.9)), "phase_rad": angle(rng)}
    return Shape(fixed, {"inertia_kgm2": 1.0}, _inertia(scene), 100.0 * _inertia(scene))


def _half_filled(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "share": float(rng.uniform(0.2, 0.6)),
        "sways_rad_s": 2.0 * math.pi * log_uniform(rng, 0.2, 1.5),
        "damping_ratio": float(rng.uniform(0.1, 0.6)),
    }
    return Shape(fixed, {"inertia_kgm2": 1.0}, _inertia(scene), 100.0 * _inertia(scene))


def _two_modes(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "share": float(rng.uniform(0.3, 0.7)),
        "swings_rad_s": 2.0 * math.pi * log_uniform(rng, 0.8, 2.5),
        "apart": float(rng.uniform(2.5, 5.0)),
        "damping_ratio": float(rng.uniform(0.15, 0.5)),
    }
    return Shape(fixed, {"inertia_kgm2": 1.0}, _inertia(scene), 100.0 * _inertia(scene))


def _fluid_coupling(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"share": float(rng.uniform(0.3, 0.9)), "lag_s": log_uniform(rng, 0.05, 0.4)}
    return Shape(fixed, {"inertia_kgm2": 1.0}, _inertia(scene), 100.0 * _inertia(scene))


def _turning_base(rng: np.random.Generator, scene: Scene) -> Shape:
    coupling = sign(rng) * float(rng.uniform(0.4, 1.0))
    other = coupling * second_rate(scene.course.other, scene.course.time_s)
    both = math.hypot(scene.plain.acceleration_rms, float(np.std(other)))
    first = torque_for_a_loop(scene) / max(both, 1e-9)
    return Shape({"coupling": coupling}, {"inertia_kgm2": 1.0}, first, 100.0 * first)


def _sprung(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"phase_rad": angle(rng), "spring_share": float(rng.uniform(0.2, 1.0))}
    return Shape(fixed, {"moment_Nm": 1.0}, 1.5 * torque_for_a_loop(scene), 0.4 * scene.joint.load_Nm)


def _linkage(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "phase_rad": angle(rng),
        "second": sign(rng) * float(rng.uniform(0.3, 0.9)),
        "second_phase_rad": angle(rng),
    }
    return Shape(fixed, {"moment_Nm": 1.0}, 1.5 * torque_for_a_loop(scene), 0.4 * scene.joint.load_Nm)


def _most(scene: Scene) -> float:
    return max(float(np.max(np.abs(scene.course.other))), 1e-9)


def _tilting(rng: np.random.Generator, scene: Scene) -> Shape:
    tilt = sign(rng) * float(rng.uniform(0.4, 1.2)) / _most(scene)
    fixed = {"phase_rad": angle(rng), "tilt_rad_per_unit": tilt}
    return Shape(fixed, {"moment_Nm": 1.0}, 2.0 * torque_for_a_loop(scene), 0.5 * scene.joint.load_Nm)


def _leaning(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "phase_rad": angle(rng),
        "lean_rad_per_unit": sign(rng) * float(rng.uniform(0.6, 1.4)) / _most(scene),
        "upright_rad": float(rng.uniform(-0.6, 0.6)),
    }
    return Shape(fixed, {"moment_Nm": 1.0}, 2.0 * torque_for_a_loop(scene), 0.5 * scene.joint.load_Nm)


def _payload(rng: np.random.Generator, scene: Scene) -> Shape:
    period = log_uniform(rng, 5.0, 20.0)
    fixed = {
        "phase_rad": angle(rng),
        "share": float(rng.uniform(0.0, 0.4)),
        "start_s": float(rng.uniform(0.0, period)),
        "period_s": period,
        "held": float(rng.uniform(0.35, 0.65)),
        "lift_s": float(rng.uniform(0.1, 0.5)),
    }
    return Shape(fixed, {"moment_Nm": 1.0}, 2.5 * torque_for_a_loop(scene), 0.6 * scene.joint.load_Nm)


def _payloads(rng: np.random.Generator, scene: Scene) -> Shape:
    period = log_uniform(rng, 5.0, 15.0)
    fixed = {
        "phase_rad": angle(rng),
        "start_s": float(rng.uniform(0.0, period)),
        "period_s": period,
        "held": float(rng.uniform(0.35, 0.6)),
        "uneven": float(rng.uniform(0.2, 0.4)),
        "unlike": float(rng.uniform(0.3, 0.8)),
        "lift_s": float(rng.uniform(0.1, 0.5)),
    }
    return Shape(fixed, {"moment_Nm": 1.0}, 2.5 * torque_for_a_loop(scene), 0.6 * scene.joint.load_Nm)


def _cross(scene: Scene) -> float:
    return torque_for_a_loop(scene) / max(scene.plain.other_rms, 1e-9)


def _late_neighbour(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"lag_s": log_uniform(rng, 0.05, 0.6)}, {"load_coefficient": sign(rng)}, _cross(scene), 0.5)


def _passing_neighbour(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"lag_s": log_uniform(rng, 0.2, 2.0), "share": float(rng.uniform(0.6, 1.0))}
    return Shape(fixed, {"load_coefficient": sign(rng)}, 1.5 * _cross(scene), 0.6)


def _bent_neighbour(rng: np.random.Generator, scene: Scene) -> Shape:
    bend = sign(rng) * float(rng.uniform(0.4, 0.9)) / _most(scene)
    return Shape({"bend_per_unit": bend}, {"load_coefficient": sign(rng)}, _cross(scene), 0.3)


def _touching_neighbour(rng: np.random.Generator, scene: Scene) -> Shape:
    slack = float(rng.uniform(0.2, 0.6)) * _most(scene)
    return Shape({"slack_units": slack}, {"load_coefficient": sign(rng)}, 1.5 * _cross(scene), 0.6)


def _dragged_neighbour(rng: np.random.Generator, scene: Scene) -> Shape:
    friction = float(rng.uniform(0.15, 0.5)) * _most(scene)
    return Shape({"friction_units": friction}, {"load_coefficient": sign(rng)}, 1.2 * _cross(scene), 0.6)


def _stopped_neighbour(rng: np.random.Generator, scene: Scene) -> Shape:
    stop = float(rng.uniform(0.2, 0.6)) * _most(scene)
    return Shape({"stop_units": stop}, {"load_coefficient": sign(rng)}, 1.5 * _cross(scene), 0.8)


def _posed_neighbour(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"phase_rad": angle(rng)}, {"load_coefficient": sign(rng)}, 1.5 * _cross(scene), 0.6)


def _rubbing_neighbour(rng: np.random.Generator, scene: Scene) -> Shape:
    reach = log_uniform(rng, 0.02, 0.2) * _most(scene)
    return Shape(
        {"reach_units": reach}, {"torque_Nm": sign(rng)}, torque_for_a_loop(scene), 0.4 * scene.joint.load_Nm
    )


LOADS = (
    Suspect("inertial_load:flexible_link", TURNING, _flexible),
    Suspect("inertial_load:folding_arm", TURNING, _folding),
    Suspect("inertial_load:half_filled", TURNING, _half_filled),
    Suspect("inertial_load:two_modes", TURNING, _two_modes),
    Suspect("inertial_load:dragged_along", TURNING, _fluid_coupling),
    Suspect("inertial_load:turning_base", TURNING, _turning_base, neighbour=True, turned=True),
    Suspect("gravity_load:sprung", TURNING, _sprung),
    Suspect("gravity_load:linkage", TURNING, _linkage),
    Suspect("gravity_load:tilting_base", TURNING, _tilting, neighbour=True, turned=True),
    Suspect("gravity_load:leaning_base", TURNING, _leaning, neighbour=True, turned=True),
    Suspect("gravity_load:picked_up", TURNING, _payload),
    Suspect("gravity_load:sorted", TURNING, _payloads),
    Suspect("crosstalk:lagged", ANY, _late_neighbour, neighbour=True),
    Suspect("crosstalk:let_go", ANY, _passing_neighbour, neighbour=True),
    Suspect("crosstalk:quadratic", ANY, _bent_neighbour, neighbour=True),
    Suspect("crosstalk:touching", ANY, _touching_neighbour, neighbour=True),
    Suspect("crosstalk:posed", TURNING, _posed_neighbour, neighbour=True),
    Suspect("crosstalk:dragged", ANY, _dragged_neighbour, neighbour=True),
    Suspect("crosstalk:stopped", ANY, _stopped_neighbour, neighbour=True),
    Suspect("crosstalk:rubbing", ANY, _rubbing_neighbour, neighbour=True, turned=True),
)
