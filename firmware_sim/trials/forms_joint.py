"""What can be concealed of other forms: loads on the pulley, and what lies between pulley and file."""

from __future__ import annotations

import math

import numpy as np

from firmware_sim.trials.joints import log_uniform
from firmware_sim.trials.suspects import ANY, TURNING, Scene, Shape, Suspect, angle, sign


def _torque(scene: Scene) -> float:
    """Torque for one loop width, N·m."""
    return scene.plain.loop_rad / scene.plain.compliance


def _presliding(rng: np.random.Generator, scene: Scene) -> float:
    return log_uniform(rng, 0.004, 0.04) * scene.plain.deflection_range_rad


def _dahl(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"presliding_rad": _presliding(rng, scene)}
    return Shape(fixed, {"torque_Nm": 1.0}, _torque(scene), 0.4 * scene.joint.load_Nm)


def _lugre(rng: np.random.Generator, scene: Scene) -> Shape:
    speed = max(scene.plain.speed_rms, 1e-9)
    fixed = {
        "presliding_rad": _presliding(rng, scene),
        "stribeck_gain": float(rng.uniform(0.1, 0.6)),
        "stribeck_rad_s": log_uniform(rng, 0.1, 1.0) * speed,
    }
    scaled = {"torque_Nm": 1.0, "viscous_Nms_per_rad": float(rng.uniform(0.1, 0.6)) / speed}
    return Shape(fixed, scaled, 0.7 * _torque(scene), 0.3 * scene.joint.load_Nm)


def _lip_seal(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "presliding_rad": _presliding(rng, scene),
        "skew": sign(rng) * float(rng.uniform(0.2, 0.6)),
    }
    return Shape(fixed, {"torque_Nm": 1.0}, _torque(scene), 0.3 * scene.joint.load_Nm)


def _stiffening(rng: np.random.Generator, scene: Scene) -> Shape:
    first = 1.5 * scene.plain.loop_rad / scene.plain.load_rms
    fixed = {"knee_Nm": float(rng.uniform(0.1, 0.4)) * scene.joint.load_Nm}
    return Shape(fixed, {"compliance_rad_per_Nm": 1.0}, first, 100.0 * first)


def _softening(rng: np.random.Generator, scene: Scene) -> Shape:
    first = 0.7 * scene.plain.loop_rad / scene.plain.load_rms
    fixed = {"knee_Nm": float(rng.uniform(0.2, 0.8)) * scene.joint.load_Nm}
    return Shape(fixed, {"compliance_rad_per_Nm": 1.0}, first, 100.0 * first)


def _staged(rng: np.random.Generator, scene: Scene) -> Shape:
    beyond = log_uniform(rng, 0.1, 0.4) if rng.uniform() < 0.5 else log_uniform(rng, 2.5, 8.0)
    first = scene.plain.loop_rad / scene.plain.load_rms
    fixed = {"knee_Nm": float(rng.uniform(0.2, 0.6)) * scene.joint.load_Nm, "beyond": beyond}
    return Shape(fixed, {"compliance_rad_per_Nm": 1.0}, first, 100.0 * first)


def _one_way(rng: np.random.Generator, scene: Scene) -> Shape:
    first = scene.plain.loop_rad / scene.plain.load_rms
    skew = sign(rng) * float(rng.uniform(0.4, 1.0))
    return Shape({"skew": skew}, {"compliance_rad_per_Nm": 1.0}, first, 100.0 * first)


def _rubber(rng: np.random.Generator, scene: Scene) -> Shape:
    first = scene.plain.loop_rad / scene.plain.load_rms
    fixed = {"share": float(rng.uniform(0.2, 0.7)), "lag_s": log_uniform(rng, 0.1, 2.0)}
    return Shape(fixed, {"compliance_rad_per_Nm": 1.0}, first, 100.0 * first)


def _bushing(rng: np.random.Generator, scene: Scene) -> Shape:
    first = scene.plain.loop_rad / scene.plain.load_rms
    fixed = {"share": float(rng.uniform(0.3, 0.8)), "lag_s": log_uniform(rng, 0.03, 0.3)}
    return Shape(fixed, {"compliance_rad_per_Nm": 1.0}, first, 100.0 * first)


def _greased_gap(rng: np.random.Generator, scene: Scene) -> Shape:
    gap = 2.0 * scene.plain.loop_rad
    damping = log_uniform(rng, 0.03, 0.4) * scene.plain.load_rms / gap  # so long does it take to cross
    return Shape({"damping_Nms_per_rad": damping}, {"gap_rad": 1.0}, gap, 0.2)


def _dragging(rng: np.random.Generator, scene: Scene) -> Shape:
    drag = float(rng.uniform(0.05, 0.2)) * scene.joint.load_Nm
    return Shape({"drag_Nm": drag}, {"gap_rad": 1.0}, 2.0 * scene.plain.loop_rad, 0.2)


def _sprung_key(rng: np.random.Generator, scene: Scene) -> Shape:
    closes = float(rng.uniform(0.05, 0.3)) * scene.joint.load_Nm
    return Shape({"closes_Nm": closes}, {"gap_rad": 1.0}, 2.0 * scene.plain.loop_rad, 0.2)


def _wedging_key(rng: np.random.Generator, scene: Scene) -> Shape:
    holds = float(rng.uniform(0.03, 0.2)) * scene.joint.load_Nm
    return Shape({"holds_Nm": holds}, {"gap_rad": 1.0}, 2.0 * scene.plain.loop_rad, 0.2)


def _worn_teeth(rng: np.random.Generator, scene: Scene) -> Shape:
    travel = scene.joint.travel_rad
    fixed = {
        "share": float(rng.uniform(0.5, 0.9)),
        "place_rad": float(rng.uniform(-0.5, 0.5)) * travel,
        "width_rad": float(rng.uniform(0.2, 0.6)) * travel,
    }
    return Shape(fixed, {"gap_rad": 1.0}, 3.0 * scene.plain.loop_rad, 0.2)


def _three_gaps(rng: np.random.Generator, scene: Scene) -> Shape:
    up, down = (float(m) * scene.joint.load_Nm for m in rng.uniform(0.1, 0.5, 2))
    fixed = {"share": float(rng.uniform(0.2, 0.6)), "up_Nm": up, "down_Nm": down}
    return Shape(fixed, {"gap_rad": 1.0}, 2.0 * scene.plain.loop_rad, 0.2)


def _two_gaps(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "share": float(rng.uniform(0.3, 0.7)),
        "preload_Nm": sign(rng) * float(rng.uniform(0.1, 0.4)) * scene.joint.load_Nm,
    }
    return Shape(fixed, {"gap_rad": 1.0}, 2.0 * scene.plain.loop_rad, 0.2)


def _eccentric(rng: np.random.Generator, scene: Scene) -> Shape:
    radius = scene.joint.stage.output_radius_m
    first = 2.0 * scene.plain.loop_rad * radius
    limit = 0.05 * min(radius, scene.joint.stage.input_radius_m)
    return Shape({"phase_rad": angle(rng)}, {"eccentricity_m": 1.0}, first, limit)


def _disc(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "phase_rad": angle(rng),
        "second": float(rng.uniform(-0.6, 0.6)),
        "second_phase_rad": angle(rng),
    }
    return Shape(fixed, {"amplitude_rad": 1.0}, 2.0 * scene.plain.loop_rad, 0.1)


_LATEST_S = 0.045


def _late(scene: Scene) -> float:
    return scene.plain.loop_rad / max(scene.plain.speed_rms, 1e-9)


def _drifting(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "at_start": float(rng.uniform(-0.3, 0.3)),
        "span_s": float(scene.course.time_s[-1]),
    }
    return Shape(fixed, {"delay_s": sign(rng, 0.3)}, 2.0 * _late(scene), _LATEST_S)


def _queueing(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"packet_s": log_uniform(rng, 0.02, 0.2), "seed": float(rng.integers(0, 2**31))}
    return Shape(fixed, {"delay_s": 1.0}, 0.7 * _late(scene), _LATEST_S)


def _late_torque(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({}, {"delay_s": sign(rng, 0.3)}, 0.05, 0.08)


def _late_motor(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({}, {"delay_s": sign(rng, 0.3)}, _late(scene), _LATEST_S)


def _stale(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({}, {"delay_s": 1.0}, 0.8 * _late(scene), _LATEST_S)


def _inertia(scene: Scene) -> float:
    return _torque(scene) / max(scene.plain.acceleration_rms, 1e-9)


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


def _sprung(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"phase_rad": angle(rng), "spring_share": float(rng.uniform(0.2, 1.0))}
    return Shape(fixed, {"moment_Nm": 1.0}, 1.5 * _torque(scene), 0.4 * scene.joint.load_Nm)


def _linkage(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "phase_rad": angle(rng),
        "second": sign(rng) * float(rng.uniform(0.3, 0.9)),
        "second_phase_rad": angle(rng),
    }
    return Shape(fixed, {"moment_Nm": 1.0}, 1.5 * _torque(scene), 0.4 * scene.joint.load_Nm)


def _most(scene: Scene) -> float:
    return max(float(np.max(np.abs(scene.course.other))), 1e-9)


def _tilting(rng: np.random.Generator, scene: Scene) -> Shape:
    tilt = sign(rng) * float(rng.uniform(0.4, 1.2)) / _most(scene)
    fixed = {"phase_rad": angle(rng), "tilt_rad_per_unit": tilt}
    return Shape(fixed, {"moment_Nm": 1.0}, 2.0 * _torque(scene), 0.5 * scene.joint.load_Nm)


def _leaning(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "phase_rad": angle(rng),
        "lean_rad_per_unit": sign(rng) * float(rng.uniform(0.6, 1.4)) / _most(scene),
        "upright_rad": float(rng.uniform(-0.6, 0.6)),
    }
    return Shape(fixed, {"moment_Nm": 1.0}, 2.0 * _torque(scene), 0.5 * scene.joint.load_Nm)


def _cross(scene: Scene) -> float:
    return _torque(scene) / max(scene.plain.other_rms, 1e-9)


def _late_neighbour(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"lag_s": log_uniform(rng, 0.05, 0.6)}, {"load_coefficient": sign(rng)}, _cross(scene), 0.5)


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


JOINT = (
    Suspect("bearing_friction:dahl", ANY, _dahl),
    Suspect("bearing_friction:lugre", TURNING, _lugre),
    Suspect("bearing_friction:unlike_ways", ANY, _lip_seal),
    Suspect("series_compliance:stiffening", ANY, _stiffening),
    Suspect("series_compliance:softening", ANY, _softening),
    Suspect("series_compliance:staged", ANY, _staged),
    Suspect("series_compliance:one_way", ANY, _one_way, two_sided=True),
    Suspect("series_compliance:rubber", ANY, _rubber),
    Suspect("series_compliance:bushing", ANY, _bushing),
    Suspect("termination_backlash:greased", ANY, _greased_gap, two_sided=True),
    Suspect("termination_backlash:dragging_link", ANY, _dragging, two_sided=True),
    Suspect("termination_backlash:two_clearances", ANY, _two_gaps, two_sided=True),
    Suspect("termination_backlash:both_ways", ANY, _three_gaps, two_sided=True),
    Suspect("termination_backlash:sprung", ANY, _sprung_key, two_sided=True),
    Suspect("termination_backlash:wedged", ANY, _wedging_key, two_sided=True),
    Suspect("termination_backlash:worn", TURNING, _worn_teeth, two_sided=True),
    Suspect("pulley_runout:oval", TURNING, _eccentric),
    Suspect("pulley_runout:input_pulley", TURNING, _eccentric),
    Suspect("pulley_runout:encoder_disc", TURNING, _disc),
    Suspect("clock_skew:drift", TURNING, _drifting),
    Suspect("clock_skew:jitter", TURNING, _queueing),
    Suspect("clock_skew:torque_late", ANY, _late_torque),
    Suspect("clock_skew:motor_late", TURNING, _late_motor),
    Suspect("clock_skew:stale", TURNING, _stale),
    Suspect("inertial_load:flexible_link", TURNING, _flexible),
    Suspect("inertial_load:folding_arm", TURNING, _folding),
    Suspect("inertial_load:half_filled", TURNING, _half_filled),
    Suspect("inertial_load:two_modes", TURNING, _two_modes),
    Suspect("inertial_load:dragged_along", TURNING, _fluid_coupling),
    Suspect("gravity_load:sprung", TURNING, _sprung),
    Suspect("gravity_load:linkage", TURNING, _linkage),
    Suspect("gravity_load:tilting_base", TURNING, _tilting, neighbour=True, turned=True),
    Suspect("gravity_load:leaning_base", TURNING, _leaning, neighbour=True, turned=True),
    Suspect("crosstalk:lagged", ANY, _late_neighbour, neighbour=True),
    Suspect("crosstalk:quadratic", ANY, _bent_neighbour, neighbour=True),
    Suspect("crosstalk:touching", ANY, _touching_neighbour, neighbour=True),
    Suspect("crosstalk:posed", TURNING, _posed_neighbour, neighbour=True),
    Suspect("crosstalk:dragged", ANY, _dragged_neighbour, neighbour=True),
    Suspect("crosstalk:stopped", ANY, _stopped_neighbour, neighbour=True),
)
