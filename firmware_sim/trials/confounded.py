"""Confounded by design: recordings in which two explanations coincide, so that none may be named alone.

Each case comes with what another experiment would show: more load, another speed, a temperature or a
neighbour that goes its own way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from firmware_sim.trials.courses import Course, Range, draw_course
from firmware_sim.trials.joints import DrawnJoint
from firmware_sim.trials.measures import PlainDrive
from firmware_sim.trials.sizes import run_course
from firmware_sim.trials.suspects import CATALOGUE, Scene, Shape, by_id


@dataclass(frozen=True)
class Case:
    """Two explanations that a course cannot tell apart.

    `pair` are the two; which one is true is drawn, but `calibration` partners (keys of the configuration)
    never are. `course` makes a recording; `tie` fits the recordings of a trial to the joint and to each
    other; `geometry_friction` bounds the joint's GF; `sizes` bound what is concealed (None: as its shape has it).
    """

    name: str
    pair: tuple[str, str]
    course: Callable[[np.random.Generator, Range], Course]
    shape: Callable[[np.random.Generator, Scene, str], Shape]
    geometry_friction: tuple[float, float] = (0.05, 10.0)
    sizes: tuple[float, float] | None = (0.03, 0.10)
    tie: Callable[[DrawnJoint, Sequence[Course]], tuple[Course, ...]] | None = None


def _slow_small_load(rng: np.random.Generator, within: Range) -> Course:
    """Input locked; one small swing of the load, slowly, there and back."""
    course = draw_course(rng, "bench", within)
    t, peak = course.time_s, float(rng.uniform(0.12, 0.2)) * within.load_Nm
    period = (t[-1] - t[0]) / float(rng.integers(3, 6))
    wave = 2.0 / math.pi * np.arcsin(np.sin(2.0 * math.pi * (t - t[0]) / period))
    return replace(course, load_Nm=np.asarray(peak * wave))


def _one_sine(rng: np.random.Generator, within: Range) -> Course:
    """A swing at a single frequency under a small load: acceleration and angle are in proportion.

    It grows so slowly that nothing rings.
    """
    course = draw_course(rng, "moving", within)
    t = course.time_s - course.time_s[0]
    grown = 0.5 - 0.5 * np.cos(math.pi * np.minimum(t / (0.7 * t[-1]), 1.0))
    joint = float(rng.uniform(0.25, 0.35)) * grown * np.sin(2.0 * math.pi * _SWING_HZ * t)
    load = within.load_Nm * (0.05 + 0.02 * np.sin(2.0 * math.pi * 0.04 * t))
    return replace(course, motor_rad=np.asarray(joint * within.motor_per_joint), load_Nm=np.asarray(load))


def _moving(rng: np.random.Generator, within: Range) -> Course:
    return draw_course(rng, "moving", within)


def _warming_up(rng: np.random.Generator, within: Range) -> Course:
    """The temperature rises with the logarithm of time, as creep does; both begin with the recording."""
    course = draw_course(rng, "bench" if rng.uniform() < 0.5 else "moving", within)
    rise = _WARMING_K * np.log1p((course.time_s - course.time_s[0]) / _WARMING_S)
    return replace(course, temperature_degC=np.asarray(20.0 + rise))


def _in_step(joint: DrawnJoint, courses: Sequence[Course]) -> tuple[Course, ...]:
    """The neighbour's load follows this joint's angle, as a weight's moment would."""
    plain = PlainDrive(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    angles = [run_course(Scene(joint, c, plain)).joint_position_rad for c in courses]
    return tuple(
        replace(c, other=np.asarray(joint.load_Nm * np.sin(q))) for c, q in zip(courses, angles, strict=True)
    )


_SWING_HZ = 0.75  # one for all recordings: at two frequencies inertia shows
_WARMING_K = 2.5
_WARMING_S = 8.0


def _within_tolerance(rng: np.random.Generator, scene: Scene, identifier: str) -> Shape:
    """A compliance that the tolerance of EA can hide."""
    share = float(rng.uniform(0.5, 1.0)) * scene.joint.tolerance["EA_N"]
    c = share * scene.plain.compliance
    return Shape({}, {"compliance_rad_per_Nm": c}, 1.0, 1.0)


def _own_shape(rng: np.random.Generator, scene: Scene, identifier: str) -> Shape:
    shape = by_id(CATALOGUE)[identifier].shape(rng, scene)
    if identifier == "pretension_relaxation":
        span = math.log1p(float(np.ptp(scene.course.time_s)) / _WARMING_S)
        return replace(shape, fixed={"time_constant_s": _WARMING_S}, first=0.1 / span, largest=0.3 / span)
    if identifier == "thermal_pretension":
        reach = float(np.max(scene.course.temperature_degC)) - 20.0
        return replace(
            shape, fixed={"reference_degC": 20.0}, scaled={"coefficient_per_K": -1.0 / reach}, largest=0.3
        )
    if identifier == "gravity_load":
        return replace(shape, fixed={"phase_rad": 0.0 if rng.uniform() < 0.5 else math.pi})
    return shape


def _up_high(rng: np.random.Generator, scene: Scene, identifier: str) -> Shape:
    """A weight that stands upright, or an inertia: both pull along the angle."""
    shape = _own_shape(rng, scene, identifier)
    return replace(shape, fixed={"phase_rad": math.pi}) if identifier == "gravity_load" else shape


CASES = (
    Case(
        "compliance_or_stiffness",
        ("series_compliance", "EA_N"),
        _slow_small_load,
        geometry_friction=(0.4, 2.0),
        shape=_within_tolerance,
        sizes=None,
    ),
    Case(
        "gravity_or_inertia", ("gravity_load", "inertial_load"), _one_sine, shape=_up_high, sizes=(0.02, 0.05)
    ),
    Case(
        "thermal_or_relaxation",
        ("thermal_pretension", "pretension_relaxation"),
        _warming_up,
        shape=_own_shape,
    ),
    Case("crosstalk_or_gravity", ("crosstalk", "gravity_load"), _moving, shape=_own_shape, tie=_in_step),
)


def draw_truth(rng: np.random.Generator, case: Case) -> tuple[str, str]:
    """Which of the two explanations is true, and the other one."""
    known = by_id(CATALOGUE)
    options = [e for e in case.pair if e in known]
    true = str(rng.choice(np.asarray(options)))
    return true, next(e for e in case.pair if e != true)
