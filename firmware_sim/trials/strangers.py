"""Effects outside of any catalogue: physics that a diagnosis must locate and describe, and not name.

Some lie far from the catalogue, some near it (a neighbour that bends the frame, a cable climbing its groove,
play at the motor): every kind of the plant says which names are the nearest to it. What is a further form of
one of the catalogue's laws is not here.
"""

from __future__ import annotations

import math

import numpy as np

from firmware_sim.trials.suspects import (
    ANY,
    TURNING,
    Scene,
    Shape,
    Suspect,
    angle,
    instant,
    sign,
    torque_for_a_loop,
)


def _ageing(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"reversals": float(rng.uniform(3.0, 12.0))}, {"gain": 1.0}, 2.0, 3.0)


def _warm_friction(rng: np.random.Generator, scene: Scene) -> Shape:
    reach = max(float(np.max(np.abs(scene.course.temperature_degC - 20.0))), 1e-3)
    return Shape({"reference_degC": 20.0}, {"coefficient_per_K": sign(rng) / reach}, 1.0, 0.8)


def _seal(rng: np.random.Generator, scene: Scene) -> Shape:
    p = scene.plain
    first = p.loop_rad / p.compliance / max(p.speed_rms, 1e-9)
    return Shape({}, {"coefficient_Nms_per_rad": 1.0}, first, 100.0 * first)


def _harness(rng: np.random.Generator, scene: Scene) -> Shape:
    p = scene.plain
    steep = float(rng.uniform(3.0, 6.0)) / scene.joint.travel_rad
    return Shape(
        {},
        {"saturation_Nm": 1.0, "stiffness_Nm_per_rad": steep},
        p.loop_rad / p.compliance,
        0.5 * scene.joint.load_Nm,
    )


def _creep(rng: np.random.Generator, scene: Scene) -> Shape:
    first = 1.5 * scene.plain.loop_rad / scene.plain.load_rms
    return Shape(
        {"time_constant_s": float(rng.uniform(0.8, 5.0))}, {"compliance_rad_per_Nm": 1.0}, first, 50 * first
    )


def _joint_ripple(rng: np.random.Generator, scene: Scene) -> Shape:
    order = float(rng.integers(4, 11))
    return Shape(
        {"order": order, "phase_rad": angle(rng)}, {"amplitude_rad": 1.0}, 1.5 * scene.plain.loop_rad, 0.1
    )


def _motor_ripple(rng: np.random.Generator, scene: Scene) -> Shape:
    order = float(rng.integers(5, 12))
    ratio = scene.joint.true.ratio
    first = 1.5 * scene.plain.loop_rad / ratio
    return Shape({"order": order, "phase_rad": angle(rng)}, {"amplitude_rad": 1.0}, first, 0.1)


def _bent_sensor(rng: np.random.Generator, scene: Scene) -> Shape:
    load = scene.joint.load_Nm
    first = 2.0 * scene.plain.loop_rad / scene.plain.compliance / load**2
    return Shape({}, {"coefficient_per_Nm": sign(rng)}, first, 0.4 / load)


def _lazy_sensor(rng: np.random.Generator, scene: Scene) -> Shape:
    width = float(rng.uniform(0.1, 0.3)) * scene.joint.load_Nm
    first = torque_for_a_loop(scene) / width
    return Shape({"width_Nm": width}, {"fraction": 1.0}, first, 0.9)


def _drifting_sensor(rng: np.random.Generator, scene: Scene) -> Shape:
    swing = max(float(np.std(scene.course.temperature_degC)), 1e-3)
    first = torque_for_a_loop(scene) / swing
    return Shape({"reference_degC": 20.0}, {"coefficient_Nm_per_K": sign(rng)}, first, 100.0 * first)


def _harmonic_of_motor_torque(rng: np.random.Generator, scene: Scene) -> Shape:
    order = float(rng.integers(6, 22))
    first = torque_for_a_loop(scene) * scene.joint.true.ratio
    return Shape({"order": order, "phase_rad": angle(rng)}, {"amplitude_Nm": 1.0}, first, 100.0 * first)


def _frame(rng: np.random.Generator, scene: Scene) -> Shape:
    first = scene.plain.loop_rad / max(scene.plain.other_rms, 1e-9)
    return Shape({}, {"compliance_rad_per_unit": sign(rng)}, first, 100.0 * first)


def _climb(rng: np.random.Generator, scene: Scene) -> Shape:
    radius, travel = scene.joint.stage.output_radius_m, scene.joint.travel_rad
    first = 4.0 * scene.plain.loop_rad * radius / travel**2
    return Shape({}, {"radius_m_per_rad": sign(rng)}, first, 0.05 * radius)


def _flange(rng: np.random.Generator, scene: Scene) -> Shape:
    radius, travel = scene.joint.stage.output_radius_m, scene.joint.travel_rad
    foot = float(rng.uniform(-0.2, 0.5)) * travel
    first = 6.0 * scene.plain.loop_rad * radius / (travel - foot) ** 2
    return Shape({"from_rad": foot}, {"radius_m_per_rad": 1.0}, first, 0.1 * radius)


def _tip(rng: np.random.Generator, scene: Scene) -> Shape:
    first = scene.plain.loop_rad / scene.plain.load_rms
    stiff = 1.0 / max(first, 1e-9)
    inertia = stiff / (2.0 * math.pi * float(rng.uniform(6.0, 14.0))) ** 2
    damping = 2.0 * float(rng.uniform(0.05, 0.3)) * math.sqrt(stiff * inertia)
    fixed = {"stiffness_Nm_per_rad": stiff, "damping_Nms_per_rad": damping}
    return Shape(fixed, {"inertia_kgm2": inertia}, 1.0, 4.0, absent=False)


def _input_gap(rng: np.random.Generator, scene: Scene) -> Shape:
    drag = float(rng.uniform(0.0, 0.2)) * scene.joint.load_Nm
    return Shape(
        {"drag_Nm": drag}, {"gap_rad": 1.0}, 2.0 * scene.plain.loop_rad / scene.joint.true.ratio, 0.2
    )


def _own_heat(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"lag_s": float(rng.uniform(8.0, 30.0))}, {"fraction": 1.0}, 0.12, 0.35)


def _tightener(rng: np.random.Generator, scene: Scene) -> Shape:
    most = max(float(np.max(np.abs(scene.course.other))), 1e-9)
    return Shape({}, {"coefficient_per_unit": sign(rng) / most}, 0.1, 0.35)


def _hub(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"time_s": instant(rng, scene)}
    return Shape(fixed, {"slip_rad": sign(rng)}, 2.2 * scene.plain.loop_rad, 0.2)


def _slow_torque(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({}, {"lag_s": 1.0}, 0.1, 0.5)


def _warm_bracket(rng: np.random.Generator, scene: Scene) -> Shape:
    swing = max(float(np.std(scene.course.temperature_degC)), 1e-3)
    first = scene.plain.loop_rad / swing
    return Shape({"reference_degC": 20.0}, {"coefficient_rad_per_K": sign(rng)}, first, 100.0 * first)


STRANGERS = (
    Suspect("friction_ageing", ANY, _ageing),
    Suspect("friction_temperature", ANY, _warm_friction, warm=True),
    Suspect("joint_viscous_friction", TURNING, _seal),
    Suspect("parallel_spring", TURNING, _harness),
    Suspect("creeping_mount", ANY, _creep),
    Suspect("joint_encoder_ripple", TURNING, _joint_ripple),
    Suspect("motor_encoder_ripple", TURNING, _motor_ripple),
    Suspect("torque_sensor_quadratic", ANY, _bent_sensor),
    Suspect("torque_sensor_hysteresis", ANY, _lazy_sensor),
    Suspect("torque_sensor_drift", ANY, _drifting_sensor, warm=True),
    Suspect("frame_flex", ANY, _frame, neighbour=True),
    Suspect("groove_climb", TURNING, _climb),
    Suspect("flange_climb", TURNING, _flange),
    Suspect("tip_link", TURNING, _tip),
    Suspect("input_play", ANY, _input_gap, two_sided=True),
    Suspect("self_heating", ANY, _own_heat, closed=True),
    Suspect("neighbour_tightens", ANY, _tightener, neighbour=True, closed=True),
    Suspect("encoder_hub_slip", ANY, _hub),
    Suspect("torque_sensor_lag", ANY, _slow_torque),
    Suspect("joint_encoder_drift", ANY, _warm_bracket, warm=True),
    Suspect("motor_torque_cogging", TURNING, _harmonic_of_motor_torque, motor_torque=True),
)
