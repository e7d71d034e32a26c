"""What can be concealed of other forms: friction between the cable and what it lies on."""

from __future__ import annotations

import numpy as np

from firmware_sim.trials.joints import log_uniform
from firmware_sim.trials.suspects import ANY, TURNING, Scene, Shape, Suspect, angle, sign


def _arc(rng: np.random.Generator, scene: Scene) -> float:
    return max(float(rng.uniform(0.03, 0.15)) * scene.joint.stage.free_length_m, 1e-3)


def _several(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "arc_length_m": _arc(rng, scene),
        "count": float(rng.integers(2, 5)),
        "first": float(rng.uniform(0.1, 0.6)),
    }
    return Shape(fixed, {"mu_angle": 1.0}, 0.3, 3.0, absent=False)


def _unlike(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "arc_length_m": _arc(rng, scene),
        "skew": sign(rng) * float(rng.uniform(0.3, 1.0)),
        "first": float(rng.uniform(0.15, 0.85)),
    }
    return Shape(fixed, {"mu_angle": 1.0}, 0.3, 3.0, absent=False)


def _greased(rng: np.random.Generator, scene: Scene) -> Shape:
    stage = scene.joint.stage
    speed = max(stage.output_radius_m * scene.plain.speed_rms, 1e-9)
    viscous = float(rng.uniform(0.3, 1.5)) * stage.pretension_N / speed
    fixed = {"arc_length_m": _arc(rng, scene), "first": float(rng.uniform(0.3, 0.7))}
    return Shape(fixed, {"mu_angle": 1.0, "viscous_Ns_per_m": viscous}, 0.2, 2.0, absent=False)


def _wiped(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"arc_length_m": _arc(rng, scene), "first": float(rng.uniform(0.15, 0.85))}
    scaled = {"hold_N": scene.joint.stage.pretension_N, "mu_angle": float(rng.uniform(0.0, 0.3))}
    return Shape(fixed, scaled, 0.3, 0.9, absent=False)


def _slip_speed(scene: Scene) -> float:
    """How fast cable slips on a drum, about, m/s: once through the deflection in a second."""
    return scene.plain.deflection_range_rad * scene.joint.stage.output_radius_m


def _thinning(rng: np.random.Generator, scene: Scene) -> Shape:
    unit = scene.joint.stage.EA_N / scene.joint.stage.output_radius_m
    fixed = {
        "exponent": float(rng.uniform(0.3, 0.7)),
        "speed_m_s": log_uniform(rng, 0.3, 2.0) * _slip_speed(scene),
    }
    return Shape(fixed, {"coefficient_Ns_per_m_rad": unit}, 0.3, 100.0)


def _strengthening(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"speed_m_s": log_uniform(rng, 0.03, 0.5) * _slip_speed(scene)}
    return Shape(fixed, {"gain": 1.0}, 1.0, 2.0)


def _eyring(rng: np.random.Generator, scene: Scene) -> Shape:
    unit = scene.joint.stage.EA_N / scene.joint.stage.output_radius_m
    speed = log_uniform(rng, 0.05, 0.5) * _slip_speed(scene)
    return Shape({"speed_m_s": speed}, {"coefficient_Ns_per_m_rad": unit}, 0.5, 300.0)


def _one_drum(rng: np.random.Generator, scene: Scene) -> Shape:
    unit = scene.joint.stage.EA_N / scene.joint.stage.output_radius_m
    return Shape({"on_input": float(rng.integers(0, 2))}, {"coefficient_Ns_per_m_rad": unit}, 0.5, 100.0)


def _floor(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"exponent": float(rng.uniform(0.8, 2.5))}
    return Shape(fixed, {"floor": -1.0}, 1.2, 0.85, base={"floor": 1.0})


def _exponential(rng: np.random.Generator, scene: Scene) -> Shape:
    way = sign(rng, 0.2)
    return Shape({}, {"rate": way}, 2.0, 1.4 if way > 0 else 0.5)


def _pressed_flat(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({}, {"rate": 1.0}, 2.0, 15.0)


def _worn_through(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"place": float(rng.uniform(-0.25, 0.4))}
    return Shape(fixed, {"floor": -1.0}, 1.2, 0.85, base={"floor": 1.0})


def _ploughed(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"place": float(rng.uniform(0.85, 1.35))}, {"adhesion": 1.0}, 1.5, 2.0)


def _patch(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "place_rad": float(rng.uniform(-0.8, 0.8)) * scene.joint.travel_rad,
        "width_rad": float(rng.uniform(0.15, 0.6)),
    }
    return Shape(fixed, {"height": 1.0}, 2.0, 8.0)


def _input_drum(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"phase_rad": angle(rng)}, {"amplitude": 1.0}, 1.5, 0.9)


def _threaded(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {"order": float(rng.uniform(2.5, 8.0)), "phase_rad": angle(rng)}
    return Shape(fixed, {"amplitude": 1.0}, 1.5, 0.9)


def _polished(rng: np.random.Generator, scene: Scene) -> Shape:
    fixed = {
        "place_rad": float(rng.uniform(-0.6, 0.6)) * scene.joint.travel_rad,
        "width_rad": float(rng.uniform(0.05, 0.25)),
    }
    return Shape(fixed, {"height": 1.0}, 1.5, 5.0)


def _fleet(rng: np.random.Generator, scene: Scene) -> Shape:
    place = float(rng.uniform(-0.6, 0.6)) * scene.joint.travel_rad
    return Shape({"place_rad": place}, {"growth_per_rad": 1.0}, 1.0, 5.0)


def _burr(rng: np.random.Generator, scene: Scene) -> Shape:
    shape = _patch(rng, scene)
    grain = sign(rng) * float(rng.uniform(0.4, 0.9))
    return Shape({**shape.fixed, "grain": grain}, shape.scaled, shape.first, shape.largest)


FRICTION = (
    Suspect("routing_friction:several_guides", ANY, _several),
    Suspect("routing_friction:unlike_paths", ANY, _unlike),
    Suspect("routing_friction:greased", TURNING, _greased),
    Suspect("routing_friction:wiper", ANY, _wiped),
    Suspect("viscous_slip:power_law", ANY, _thinning),
    Suspect("viscous_slip:strengthening", ANY, _strengthening),
    Suspect("viscous_slip:one_drum", ANY, _one_drum),
    Suspect("viscous_slip:eyring", ANY, _eyring),
    Suspect("pressure_dependent_friction:floor", ANY, _floor),
    Suspect("pressure_dependent_friction:exponential", ANY, _exponential),
    Suspect("pressure_dependent_friction:worn_through", ANY, _worn_through),
    Suspect("pressure_dependent_friction:pressed_flat", ANY, _pressed_flat),
    Suspect("pressure_dependent_friction:ploughed", ANY, _ploughed),
    Suspect("position_dependent_friction:patch", TURNING, _patch),
    Suspect("position_dependent_friction:threaded", TURNING, _threaded),
    Suspect("position_dependent_friction:input_drum", TURNING, _input_drum),
    Suspect("position_dependent_friction:burr", TURNING, _burr),
    Suspect("position_dependent_friction:polished", TURNING, _polished),
    Suspect("position_dependent_friction:fleet_angle", TURNING, _fleet),
)
