"""What can be concealed of other forms: the joint's bearing and coupling, pulleys and clocks."""

from __future__ import annotations

import numpy as np

from firmware_sim.trials.joints import log_uniform
from firmware_sim.trials.suspects import ANY, TURNING, Scene, Shape, Suspect, angle, sign, torque_for_a_loop


def _presliding(rng: np.random.Generator, scene: Scene) -> float:
    return log_uniform(rng, 0.004, 0.04) * scene.plain.deflection_range_rad


def _dahl(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"presliding_rad": _presliding(rng, scene)}
    return Shape(fixed, {"torque_Nm": 1.0}, torque_for_a_loop(scene), 0.4 * scene.joint.load_Nm)


def _lugre(rng: np.random.Generator, scene: Scene) -> Shape:
    speed = max(scene.plain.speed_rms, 1e-9)
    fixed = {
        "presliding_rad": _presliding(rng, scene),
        "stribeck_gain": float(rng.uniform(0.1, 0.6)),
        "stribeck_rad_s": log_uniform(rng, 0.1, 1.0) * speed,
    }
    scaled = {"torque_Nm": 1.0, "viscous_Nms_per_rad": float(rng.uniform(0.1, 0.6)) / speed}
    return Shape(fixed, scaled, 0.7 * torque_for_a_loop(scene), 0.3 * scene.joint.load_Nm)


def _lip_seal(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "presliding_rad": _presliding(rng, scene),
        "skew": sign(rng) * float(rng.uniform(0.2, 0.6)),
    }
    return Shape(fixed, {"torque_Nm": 1.0}, torque_for_a_loop(scene), 0.3 * scene.joint.load_Nm)


def _tilted_bearing(rng: np.random.Generator, scene: Scene) -> Shape:
    """Most of it by the moment."""
    loaded = float(rng.uniform(0.5, 0.95))
    usual = scene.plain.load_rms
    scaled = {"torque_Nm": 1.0 - loaded, "moment_coefficient": loaded / usual}
    most = min(0.4 * scene.joint.load_Nm, 0.6 * usual)
    return Shape({"presliding_rad": _presliding(rng, scene)}, scaled, torque_for_a_loop(scene), most)


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


def _diaphragm(rng: np.random.Generator, scene: Scene) -> Shape:
    first = 1.5 * scene.plain.loop_rad / scene.plain.load_rms
    fixed = {"knee_Nm": float(rng.uniform(0.05, 0.4)) * scene.joint.load_Nm}
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


def _bracket(rng: np.random.Generator, scene: Scene) -> Shape:
    first = scene.plain.loop_rad / scene.plain.load_rms
    fixed = {"swing": float(rng.uniform(0.4, 0.9)), "phase_rad": angle(rng)}
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


def _set_screw(rng: np.random.Generator, scene: Scene) -> Shape:
    time = scene.course.time_s
    span = float(time[-1] - time[0])
    fixed = {
        "share": float(rng.uniform(0.0, 0.3)),
        "time_s": round(float(time[0]) + float(rng.uniform(0.1, 0.45)) * span, 2),
        "duration_s": float(rng.uniform(0.1, 0.5)) * span,
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


def _idler(rng: np.random.Generator, scene: Scene) -> Shape:
    radius = scene.joint.stage.output_radius_m
    idler = max(float(rng.uniform(0.2, 0.5)) * radius, 3e-3)
    cables = 2.0 if scene.joint.true.circuit == "closed" else 1.0
    first = 2.0 * cables * scene.plain.loop_rad * radius
    fixed = {"phase_rad": angle(rng), "idler_radius_m": idler}
    return Shape(fixed, {"eccentricity_m": 1.0}, first, min(0.1 * idler, 0.01))


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


def _set_right(rng: np.random.Generator, scene: Scene) -> Shape:
    period = log_uniform(rng, 3.0, 15.0)
    fixed = {"period_s": period, "start_s": float(rng.uniform(0.0, period))}
    return Shape(fixed, {"delay_s": sign(rng, 0.3)}, _late(scene), _LATEST_S)


JOINT = (
    Suspect("bearing_friction:dahl", ANY, _dahl),
    Suspect("bearing_friction:lugre", TURNING, _lugre),
    Suspect("bearing_friction:unlike_ways", ANY, _lip_seal),
    Suspect("bearing_friction:by_moment", TURNING, _tilted_bearing),
    Suspect("series_compliance:stiffening", ANY, _stiffening),
    Suspect("series_compliance:softening", ANY, _softening),
    Suspect("series_compliance:staged", ANY, _staged),
    Suspect("series_compliance:diaphragm", ANY, _diaphragm),
    Suspect("series_compliance:one_way", ANY, _one_way, two_sided=True),
    Suspect("series_compliance:rubber", ANY, _rubber),
    Suspect("series_compliance:bushing", ANY, _bushing),
    Suspect("series_compliance:anisotropic", TURNING, _bracket),
    Suspect("termination_backlash:greased", ANY, _greased_gap, two_sided=True),
    Suspect("termination_backlash:dragging_link", ANY, _dragging, two_sided=True),
    Suspect("termination_backlash:two_clearances", ANY, _two_gaps, two_sided=True),
    Suspect("termination_backlash:both_ways", ANY, _three_gaps, two_sided=True),
    Suspect("termination_backlash:sprung", ANY, _sprung_key, two_sided=True),
    Suspect("termination_backlash:wedged", ANY, _wedging_key, two_sided=True),
    Suspect("termination_backlash:worn", TURNING, _worn_teeth, two_sided=True),
    Suspect("termination_backlash:loosening", ANY, _set_screw, two_sided=True),
    Suspect("pulley_runout:oval", TURNING, _eccentric),
    Suspect("pulley_runout:input_pulley", TURNING, _eccentric),
    Suspect("pulley_runout:encoder_disc", TURNING, _disc),
    Suspect("pulley_runout:idler", TURNING, _idler),
    Suspect("clock_skew:drift", TURNING, _drifting),
    Suspect("clock_skew:jitter", TURNING, _queueing),
    Suspect("clock_skew:torque_late", ANY, _late_torque),
    Suspect("clock_skew:motor_late", TURNING, _late_motor),
    Suspect("clock_skew:stale", TURNING, _stale),
    Suspect("clock_skew:resynchronised", TURNING, _set_right),
)
