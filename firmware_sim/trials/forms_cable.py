"""What can be concealed of other forms: the cable, its ends and its pretension."""

from __future__ import annotations

import numpy as np

from firmware_sim.trials.joints import log_uniform
from firmware_sim.trials.suspects import ANY, TURNING, Scene, Shape, Suspect, sign

_WHOLE = 4.0  # recordings and pauses last so many first recordings, at the most


def _span(scene: Scene) -> float:
    return float(np.ptp(scene.course.time_s))


def _power_creep(rng: np.random.Generator, scene: Scene) -> Shape:
    exponent, span = float(rng.uniform(0.2, 0.6)), _span(scene)
    age = 0.0 if rng.uniform() < 0.5 else log_uniform(rng, 0.05, 1.0) * span
    fixed = {"exponent": exponent, "scale_s": span, "age_s": age}
    return Shape(fixed, {"fraction": 1.0}, 0.1, 0.5 / _WHOLE**exponent)


def _bedding_in(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape(
        {"time_constant_s": float(rng.uniform(0.2, 0.9)) * _span(scene)}, {"fraction": 1.0}, 0.12, 0.4
    )


def _warm_creep(rng: np.random.Generator, scene: Scene) -> Shape:
    time_constant = log_uniform(rng, 2.0, 40.0)
    span = float(np.log1p(_span(scene) / time_constant))
    fixed = {"time_constant_s": time_constant, "doubling_K": float(rng.uniform(3.0, 8.0))}
    return Shape(fixed, {"fraction": 1.0}, 0.1 / span, 0.15 / span)


def _creep_in_two(rng: np.random.Generator, scene: Scene) -> Shape:
    share, span = float(rng.uniform(0.3, 0.7)), _span(scene)
    fixed = {"share": share, "time_constant_s": float(rng.uniform(0.05, 0.3)) * span, "lasts_s": span}
    return Shape(fixed, {"fraction": 1.0}, 0.1, 0.5 / (share + (1.0 - share) * _WHOLE))


def _run_in(rng: np.random.Generator, scene: Scene) -> Shape:
    way = float(np.abs(np.diff(scene.course.seen.motor_rad)).sum())
    return Shape({"travel_rad": log_uniform(rng, 0.3, 2.0) * way}, {"fraction": 1.0}, 0.12, 0.4)


def _under_load(rng: np.random.Generator, scene: Scene) -> Shape:
    usual = max(float(np.mean(np.abs(scene.course.seen.load_Nm))), 1e-9)
    return Shape(
        {"usual_Nm": usual, "time_constant_s": _span(scene)}, {"fraction": 1.0}, 0.1, 0.5 / np.cbrt(_WHOLE)
    )


def _stretched_creep(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "exponent": float(rng.uniform(0.3, 0.7)),
        "time_constant_s": log_uniform(rng, 0.1, 1.5) * _span(scene),
    }
    return Shape(fixed, {"fraction": 1.0}, 0.12, 0.4)


def _reach(scene: Scene, reference: float) -> float:
    return max(float(np.max(np.abs(scene.course.temperature_degC - reference))), 1e-3)


def _late_frame(rng: np.random.Generator, scene: Scene) -> Shape:
    reference = 20.0 + float(rng.uniform(-1.0, 1.0))
    fixed = {"reference_degC": reference, "lag_s": log_uniform(rng, 3.0, 20.0)}
    return Shape(fixed, {"coefficient_per_K": sign(rng) / _reach(scene, reference)}, 0.15, 0.4)


def _bent(rng: np.random.Generator, scene: Scene) -> Shape:
    reference = 20.0 + float(rng.uniform(-1.0, 1.0))
    reach = _reach(scene, reference)
    fixed = {"reference_degC": reference, "bend_per_K": sign(rng) * float(rng.uniform(0.3, 0.8)) / reach}
    return Shape(fixed, {"coefficient_per_K": sign(rng) / reach}, 0.1, 0.2)


def _from_contact(rng: np.random.Generator, scene: Scene) -> Shape:
    contact = float(np.quantile(scene.course.temperature_degC, rng.uniform(0.2, 0.6)))
    most = max(float(np.max(scene.course.temperature_degC)) - contact, 1e-3)
    return Shape({"contact_degC": contact}, {"coefficient_per_K": sign(rng) / most}, 0.15, 0.4)


def _transient(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"quick_s": float(rng.uniform(0.5, 3.0)), "slow_s": float(rng.uniform(15.0, 60.0))}
    return Shape(fixed, {"coefficient_per_K": sign(rng) / _reach(scene, 20.0)}, 0.2, 0.4)


def _sticking_frame(rng: np.random.Generator, scene: Scene) -> Shape:
    reference = 20.0 + float(rng.uniform(-1.0, 1.0))
    stick = float(rng.uniform(0.1, 0.3)) * float(np.ptp(scene.course.temperature_degC))
    fixed = {"reference_degC": reference, "stick_K": stick}
    return Shape(fixed, {"coefficient_per_K": sign(rng) / _reach(scene, reference)}, 0.15, 0.4)


def _saturating(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"reach": float(rng.uniform(0.3, 1.0))}, {"softness": 1.0}, 1.0, 0.93)


def _hertz(rng: np.random.Generator, scene: Scene) -> Shape:
    way = sign(rng, 0.2)
    return Shape({}, {"exponent": way}, 0.5, 0.75 if way > 0 else 0.4)


def _knee(rng: np.random.Generator, scene: Scene) -> Shape:
    way = sign(rng, 0.2)
    fixed = {"place": float(rng.uniform(0.7, 1.4)), "width": float(rng.uniform(0.08, 0.3))}
    return Shape(fixed, {"rise": way}, 1.0, 3.0 if way > 0 else 0.6)


def _s_shaped(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"place": float(rng.uniform(0.7, 1.4)), "width": float(rng.uniform(0.15, 0.4))}
    return Shape(fixed, {"dip": 1.0}, 0.5, 0.75)


def _swing(scene: Scene) -> float:
    """Tension that the greatest load brings, N."""
    return scene.joint.load_Nm / scene.joint.stage.output_radius_m


def _masing(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"yield_N": float(rng.uniform(0.1, 0.5)) * _swing(scene)}, {"fraction": 1.0}, 0.3, 5.0)


def _slow_strands(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"yield_N": float(rng.uniform(0.05, 0.25)) * _swing(scene), "time_s": log_uniform(rng, 0.05, 0.6)}
    return Shape(fixed, {"fraction": 1.0}, 0.3, 5.0)


def _pressed_strands(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"share": float(rng.uniform(0.03, 0.15))}, {"fraction": 1.0}, 0.3, 5.0)


def _mixed_strands(rng: np.random.Generator, scene: Scene) -> Shape:
    slow, pressed = _slow_strands(rng, scene), _pressed_strands(rng, scene)
    return Shape({**slow.fixed, **pressed.fixed}, {"fraction": 1.0}, 0.3, 5.0)


def _seating_strands(rng: np.random.Generator, scene: Scene) -> Shape:
    grip, seats = (float(u) * _swing(scene) for u in (rng.uniform(0.1, 0.4), rng.uniform(0.2, 0.6)))
    return Shape({"yield_N": grip, "seats_N": seats}, {"fraction": 1.0}, 0.3, 5.0)


def _rounded_strands(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"yield_N": float(rng.uniform(0.1, 0.4)) * _swing(scene)}, {"fraction": 1.0}, 0.3, 5.0)


def _slip(scene: Scene) -> tuple[float, float]:
    """Slip for one loop width, and the most that may go: a quarter of the pretension; m."""
    stage = scene.joint.stage
    shafts = 2.0 if scene.joint.true.circuit == "closed" else 1.0
    whole = stage.free_length_m + stage.output_radius_m / stage.mu_output
    first = 2.2 * shafts * stage.output_radius_m * scene.plain.loop_rad
    return first, 0.25 * stage.pretension_N / stage.EA_N * whole * shafts


def _while(rng: np.random.Generator, scene: Scene) -> dict[str, float]:
    """An instant in the first half of the first recording, and a duration within it."""
    span = _span(scene)
    start = float(scene.course.time_s[0]) + float(rng.uniform(0.15, 0.45)) * span
    other = 1.0 if scene.joint.true.circuit == "closed" and rng.uniform() < 0.4 else 0.0
    return {
        "time_s": round(start, 2),
        "duration_s": float(rng.uniform(0.12, 0.45)) * span,
        "cable_l": other,
    }


def _sliding(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape(_while(rng, scene), {"slip_m": 1.0}, *_slip(scene))


def _letting_go(rng: np.random.Generator, scene: Scene) -> Shape:
    steps = float(rng.integers(2, 6))
    return Shape({**_while(rng, scene), "steps": steps}, {"slip_m": 1.0}, *_slip(scene))


def _unequally(rng: np.random.Generator) -> dict[str, float]:
    """Two to five steps, each up to 2.5 times as large as the last, or as much smaller, waited for as unequally."""
    unequal = {k: log_uniform(rng, 0.4, 2.5) for k in ("growth", "wait")}
    return {"steps": float(rng.integers(2, 6)), **unequal}


def _letting_go_unequally(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({**_while(rng, scene), **_unequally(rng)}, {"slip_m": 1.0}, *_slip(scene))


def _settling(rng: np.random.Generator, scene: Scene) -> dict[str, float]:
    """As `_while`, most of it over in that time."""
    when = _while(rng, scene)
    lasts_s = when.pop("duration_s")
    return {**when, "lag_s": 0.5 * lasts_s}


def _biting_again(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape(_settling(rng, scene), {"slip_m": 1.0}, *_slip(scene))


def _wearing_in(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape(_settling(rng, scene), {"fraction": 1.0}, 0.5, 0.7)


def _breaking_unequally(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({**_while(rng, scene), **_unequally(rng)}, {"fraction": 1.0}, 0.5, 0.7)


def _at_once(rng: np.random.Generator, scene: Scene) -> dict[str, float]:
    time = scene.course.time_s
    return {"time_s": float(round(time[0] + rng.uniform(0.25, 0.75) * (time[-1] - time[0]), 2))}


def _other_slip(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape(_at_once(rng, scene), {"slip_m": 1.0}, *_slip(scene))


def _overload(rng: np.random.Generator, scene: Scene) -> Shape:
    share = 0.5 if scene.joint.true.circuit == "closed" else 1.0
    above = float(rng.uniform(0.3, 0.7)) * share * _swing(scene)
    first, most = _slip(scene)
    unit = 1.0 / (0.05 * _swing(scene) * _span(scene))  # so that x is the slip, about
    fixed = {"holds_N": scene.joint.stage.pretension_N + above}
    return Shape(fixed, {"rate_m_per_Ns": unit}, first, 4.0 * most)


def _walking(rng: np.random.Generator, scene: Scene) -> Shape:
    """It walks at the higher ones of the loads that pull its cable in that while."""
    when, course = _while(rng, scene), scene.course
    inside = (course.time_s > when["time_s"]) & (course.time_s < when["time_s"] + when["duration_s"])
    pulls = (-1.0 if when["cable_l"] else 1.0) * course.load_Nm[inside]
    low, high = float(np.min(pulls)), float(np.max(pulls))
    if high > 0.0:
        low = max(low, 0.0)
    holds = low + float(rng.uniform(0.1, 0.6)) * (high - low)
    return Shape({**when, "holds_Nm": holds}, {"slip_m": 1.0}, *_slip(scene))


def _breaking(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({**_while(rng, scene), "steps": float(rng.integers(2, 6))}, {"fraction": 1.0}, 0.5, 0.7)


def _fraying(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape(_while(rng, scene), {"fraction": 1.0}, 0.5, 0.7)


def _bent_over(rng: np.random.Generator, scene: Scene) -> Shape:
    when, course = _while(rng, scene), scene.course
    after = course.time_s[1:] > when["time_s"]
    way = float(np.abs(np.diff(course.motor_rad))[after].sum())
    fixed = {
        "time_s": when["time_s"],
        "cable_l": when["cable_l"],
        "travel_rad": float(rng.uniform(0.3, 0.7)) * max(way, 1e-2),
        "power": float(rng.uniform(1.5, 3.5)),
        "pace_rad_s": way / (float(course.time_s[-1]) - when["time_s"]),
    }
    return Shape(fixed, {"fraction": 1.0}, 0.5, 0.7)


def _other_break(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape(_at_once(rng, scene), {"fraction": 1.0}, 0.5, 0.7)


CABLE = (
    Suspect("pretension_relaxation:power_law", ANY, _power_creep, closed=True),
    Suspect("pretension_relaxation:exponential", ANY, _bedding_in, closed=True),
    Suspect("pretension_relaxation:warm_creep", ANY, _warm_creep, warm=True, closed=True),
    Suspect("pretension_relaxation:in_two", ANY, _creep_in_two, closed=True),
    Suspect("pretension_relaxation:by_travel", ANY, _run_in, closed=True),
    Suspect("pretension_relaxation:under_load", ANY, _under_load, closed=True),
    Suspect("pretension_relaxation:stretched", ANY, _stretched_creep, closed=True),
    Suspect("thermal_pretension:lagged", ANY, _late_frame, warm=True, closed=True),
    Suspect("thermal_pretension:quadratic", ANY, _bent, warm=True, closed=True),
    Suspect("thermal_pretension:transient", ANY, _transient, warm=True, closed=True),
    Suspect("thermal_pretension:from_contact", ANY, _from_contact, warm=True, closed=True),
    Suspect("thermal_pretension:sticking", ANY, _sticking_frame, warm=True, closed=True),
    Suspect("nonlinear_cable:saturating", ANY, _saturating),
    Suspect("nonlinear_cable:power_law", ANY, _hertz),
    Suspect("nonlinear_cable:knee", ANY, _knee),
    Suspect("nonlinear_cable:s_shaped", ANY, _s_shaped),
    Suspect("strand_friction:masing", ANY, _masing),
    Suspect("strand_friction:graded", ANY, _masing),
    Suspect("strand_friction:rate_dependent", ANY, _slow_strands),
    Suspect("strand_friction:proportional", ANY, _pressed_strands),
    Suspect("strand_friction:mixed_lay", ANY, _mixed_strands),
    Suspect("strand_friction:seating", ANY, _seating_strands),
    Suspect("strand_friction:bouc_wen", ANY, _rounded_strands),
    Suspect("clamp_slip:gradual", ANY, _sliding),
    Suspect("clamp_slip:in_steps", ANY, _letting_go),
    Suspect("clamp_slip:unequal_steps", ANY, _letting_go_unequally),
    Suspect("clamp_slip:worked_loose", ANY, _sliding),
    Suspect("clamp_slip:settling", ANY, _biting_again),
    Suspect("clamp_slip:other_cable", ANY, _other_slip, closed=True),
    Suspect("clamp_slip:overload", ANY, _overload),
    Suspect("clamp_slip:ratcheting", ANY, _walking),
    Suspect("strand_break:in_steps", ANY, _breaking),
    Suspect("strand_break:unequal_steps", ANY, _breaking_unequally),
    Suspect("strand_break:fatigued", ANY, _fraying),
    Suspect("strand_break:fraying", ANY, _fraying),
    Suspect("strand_break:bent_over_drums", TURNING, _bent_over),
    Suspect("strand_break:accelerating", ANY, _fraying),
    Suspect("strand_break:settling", ANY, _wearing_in),
    Suspect("strand_break:other_cable", ANY, _other_break, closed=True),
)
