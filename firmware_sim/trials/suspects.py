"""What can be concealed: for every effect its shape, the parameters that its size scales, and the courses
in which it can show at all."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from firmware_sim.trials.courses import Course
from firmware_sim.trials.joints import DrawnJoint, log_uniform
from firmware_sim.trials.measures import PlainDrive

ANY = ("bench", "moving", "reaching")
TURNING = ("moving", "reaching")


@dataclass(frozen=True)
class Scene:
    """What a suspect's parameters are drawn for."""

    joint: DrawnJoint
    course: Course
    plain: PlainDrive


@dataclass(frozen=True)
class Shape:
    """An effect of known shape and open size: parameters = `fixed` and `base` plus `scaled` times x.

    `first` is a guess of x for a contribution of one loop width, `largest` what x may become. Where its part of the
    joint stays when x is 0 (a guide without friction is cable yet), `absent` is false.
    """

    fixed: Mapping[str, float]
    scaled: Mapping[str, float]
    first: float
    largest: float
    absent: bool = True
    base: Mapping[str, float] = field(default_factory=dict)

    def parameters(self, x: float) -> dict[str, float]:
        """All parameters at size x."""
        return {**self.fixed, **{k: self.base.get(k, 0.0) + unit * x for k, unit in self.scaled.items()}}


@dataclass(frozen=True)
class Suspect:
    """An effect that may be concealed: in which courses, whether it needs a temperature that moves, a load
    that changes its sign, a neighbour (that is `turned`: whose angle counts, not its load), a closed circuit (where an
    open one hangs on a weight, which holds the tension whatever the cable does), a motor torque that is recorded;
    `shape` draws everything but its size."""

    id: str
    courses: tuple[str, ...]
    shape: Callable[[np.random.Generator, Scene], Shape]
    warm: bool = False
    neighbour: bool = False
    turned: bool = False
    two_sided: bool = False
    closed: bool = False
    motor_torque: bool = False


def angle(rng: np.random.Generator) -> float:
    return float(rng.uniform(-math.pi, math.pi))


def sign(rng: np.random.Generator, minus: float = 0.5) -> float:
    return -1.0 if rng.uniform() < minus else 1.0


def instant(rng: np.random.Generator, scene: Scene) -> float:
    time = scene.course.time_s
    return float(round(time[0] + rng.uniform(0.25, 0.75) * (time[-1] - time[0]), 2))


def torque_for_a_loop(scene: Scene) -> float:
    """Torque on the pulley that turns it by one loop width, N·m."""
    return scene.plain.loop_rad / scene.plain.compliance


def _routing(rng: np.random.Generator, scene: Scene) -> Shape:
    arc = float(rng.uniform(0.03, 0.15)) * scene.joint.stage.free_length_m
    return Shape({"arc_length_m": max(arc, 1e-3)}, {"mu_angle": 1.0}, 0.3, 3.0, absent=False)


def _viscous(rng: np.random.Generator, scene: Scene) -> Shape:
    unit = scene.joint.stage.EA_N / scene.joint.stage.output_radius_m
    return Shape({}, {"coefficient_Ns_per_m_rad": unit}, 0.3, 100.0)


def _relaxation(rng: np.random.Generator, scene: Scene) -> Shape:
    time_constant = log_uniform(rng, 2.0, 40.0)
    span = math.log1p(float(scene.course.time_s[-1] - scene.course.time_s[0]) / time_constant)
    return Shape({"time_constant_s": time_constant}, {"fraction": 1.0}, 0.1 / span, 0.3 / span)


def _thermal(rng: np.random.Generator, scene: Scene) -> Shape:
    warm = scene.course.temperature_degC
    reference = 20.0 + float(rng.uniform(-1.0, 1.0))
    reach = max(float(np.max(np.abs(warm - reference))), 1e-3)
    unit = sign(rng) / reach
    return Shape({"reference_degC": reference}, {"coefficient_per_K": unit}, 0.1, 0.35)


def _bearing(rng: np.random.Generator, scene: Scene) -> Shape:
    stage, plain = scene.joint.stage, scene.plain
    share = 0.0 if rng.uniform() < 0.6 else float(rng.uniform(0.3, 1.0))
    radial = stage.output_radius_m * stage.pretension_N
    radial *= 2.0 if scene.joint.true.circuit == "closed" else 1.0
    presliding = log_uniform(rng, 0.004, 0.04) * plain.deflection_range_rad
    return Shape(
        {"presliding_rad": presliding},
        {"torque_Nm": 1.0 - 0.8 * share, "load_coefficient": 0.8 * share / radial},
        plain.loop_rad / plain.compliance,
        0.4 * scene.joint.load_Nm,
    )


def _series(rng: np.random.Generator, scene: Scene) -> Shape:
    first = scene.plain.loop_rad / scene.plain.load_rms
    return Shape({}, {"compliance_rad_per_Nm": 1.0}, first, 100.0 * first)


def _backlash(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({}, {"gap_rad": 1.0}, 2.0 * scene.plain.loop_rad, 0.2)


def _nonlinear(rng: np.random.Generator, scene: Scene) -> Shape:
    way = sign(rng, 0.2)
    return Shape({}, {"stiffening": way}, 0.5, 0.85 if way > 0 else 0.45)


def _strand(rng: np.random.Generator, scene: Scene) -> Shape:
    swing = scene.joint.load_Nm / scene.joint.stage.output_radius_m
    yields = float(rng.uniform(0.05, 0.25)) * swing
    return Shape({"yield_N": yields}, {"fraction": 1.0}, 0.3, 5.0)


def _pressure(rng: np.random.Generator, scene: Scene) -> Shape:
    way = sign(rng, 0.2)
    return Shape({}, {"exponent": way}, 2.0, 0.75 if way > 0 else 0.35)


def _position(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"phase_rad": angle(rng)}, {"amplitude": 1.0}, 1.5, 0.9)


def _runout(rng: np.random.Generator, scene: Scene) -> Shape:
    radius = scene.joint.stage.output_radius_m
    first = 2.0 * scene.plain.loop_rad * radius
    return Shape({"phase_rad": angle(rng)}, {"eccentricity_m": 1.0}, first, 0.1 * radius)


def _clock(rng: np.random.Generator, scene: Scene) -> Shape:
    first = scene.plain.loop_rad / max(scene.plain.speed_rms, 1e-9)
    return Shape({}, {"delay_s": sign(rng, 0.3)}, first, 0.045)


def _inertia(rng: np.random.Generator, scene: Scene) -> Shape:
    p = scene.plain
    first = p.loop_rad / p.compliance / max(p.acceleration_rms, 1e-9)
    return Shape({}, {"inertia_kgm2": 1.0}, first, 100.0 * first)


def _gravity(rng: np.random.Generator, scene: Scene) -> Shape:
    p = scene.plain
    return Shape(
        {"phase_rad": angle(rng)},
        {"moment_Nm": 1.0},
        2.0 * p.loop_rad / p.compliance,
        0.6 * scene.joint.load_Nm,
    )


def _clamp(rng: np.random.Generator, scene: Scene) -> Shape:
    stage = scene.joint.stage
    shafts = 2.0 if scene.joint.true.circuit == "closed" else 1.0
    first = 2.2 * shafts * stage.output_radius_m * scene.plain.loop_rad
    # a quarter of the pretension at the most may go
    whole = stage.free_length_m + stage.output_radius_m / stage.mu_output
    return Shape(
        {"time_s": instant(rng, scene)},
        {"slip_m": 1.0},
        first,
        0.25 * stage.pretension_N / stage.EA_N * whole * shafts,
    )


def _break(rng: np.random.Generator, scene: Scene) -> Shape:
    return Shape({"time_s": instant(rng, scene)}, {"fraction": 1.0}, 0.5, 0.7)


def _crosstalk(rng: np.random.Generator, scene: Scene) -> Shape:
    p = scene.plain
    first = p.loop_rad / p.compliance / max(p.other_rms, 1e-9)
    return Shape({}, {"load_coefficient": sign(rng)}, first, 0.5)


CATALOGUE = (
    Suspect("routing_friction", ANY, _routing),
    Suspect("viscous_slip", ANY, _viscous),
    Suspect("pretension_relaxation", ANY, _relaxation, closed=True),
    Suspect("thermal_pretension", ANY, _thermal, warm=True, closed=True),
    Suspect("bearing_friction", ANY, _bearing),
    Suspect("series_compliance", ANY, _series),
    Suspect("termination_backlash", ANY, _backlash, two_sided=True),
    Suspect("nonlinear_cable", ANY, _nonlinear),
    Suspect("strand_friction", ANY, _strand),
    Suspect("pressure_dependent_friction", ANY, _pressure),
    Suspect("position_dependent_friction", TURNING, _position),
    Suspect("pulley_runout", TURNING, _runout),
    Suspect("clock_skew", TURNING, _clock),
    Suspect("inertial_load", TURNING, _inertia),
    Suspect("gravity_load", TURNING, _gravity),
    Suspect("clamp_slip", ANY, _clamp),
    Suspect("strand_break", ANY, _break),
    Suspect("crosstalk", ANY, _crosstalk, neighbour=True),
)
"""Effects that a diagnosis knows, in the order of the catalogue."""


def by_id(suspects: tuple[Suspect, ...]) -> dict[str, Suspect]:
    """The suspects by their effect's id."""
    return {s.id: s for s in suspects}
