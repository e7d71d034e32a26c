"""One trial: a joint, what is concealed in it, an imperfect world around it, and the recordings made there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from firmware_sim.plant import EffectSpec, PlantError, PlantRun, StageConfig
from firmware_sim.trials.confounded import Case as Tie
from firmware_sim.trials.confounded import draw_truth
from firmware_sim.trials.courses import KINDS, RATES_HZ, Course, draw_course
from firmware_sim.trials.history import uneven, with_history
from firmware_sim.trials.imperfections import Imperfections, draw_imperfections, drawn_numbers, settled
from firmware_sim.trials.joints import OFF_NOMINAL, DrawnJoint, draw_joint, log_uniform
from firmware_sim.trials.legs import Leg, legs_of
from firmware_sim.trials.measures import PlainDrive
from firmware_sim.trials.order import Order, Wanted, concealable, order
from firmware_sim.trials.scene import PAUSE_S, plain_scene, usable
from firmware_sim.trials.sensors import NEIGHBOUR_ANGLE, NEIGHBOUR_LOAD, draw_sensors, noise_floor_rad
from firmware_sim.trials.sizes import LARGEST, SMALLEST, Sized, give_size, run_course
from firmware_sim.trials.suspects import Scene, Shape, Suspect
from firmware_sim.trials.tabletop import sessions_of, shape_of, table_courses
from firmware_sim.trials.tightened import ABOUT_T0

SAMPLES = (10_000, 12_000)
"""Of all recordings of a trial together."""

RECORDINGS = {1: 0.2, 2: 0.5, 3: 0.3}
CONFOUNDED_RECORDINGS = 2
FAR_SMALLER = 1.0 / 3.0  # at most so large is a companion meant to be, of what the trial is about
BY_ORDER = 1.0  # tolerance of what is guessed of a drive that one has not built: a decade
RATIO_MEASURED = 0.02  # of its ratio, which its two angles tell
_ATTEMPTS = 80
_PAIRS = 3


@dataclass(frozen=True)
class Hidden:
    """An effect that is there, and whether it is what the trial is about (`main`) or goes along (`companion`)."""

    sized: Sized
    role: str


@dataclass(frozen=True)
class World:
    """A trial with all its truth; `joint` holds the true drive of the first session and the nominal one,
    `partner` is the other explanation of a trial that is confounded by design."""

    order: Order
    joint: DrawnJoint
    plain: PlainDrive
    floor_rad: float
    hidden: tuple[Hidden, ...]
    legs: tuple[Leg, ...]
    how: Imperfections
    other: str
    partner: str = ""


def draw_world(wanted: Wanted, number: int) -> World:
    """Draw a trial; the same wish and number give the same trial, bit for bit.

    Joints that cannot show what is asked for, or that go slack, are drawn anew, and of two effects that no joint shows
    together another pair. Raises PlantError if none of a bounded number will do.
    """
    for again in range(_PAIRS):
        asked = order(wanted, number, again)
        for attempt in range(_ATTEMPTS):
            rng = np.random.default_rng([wanted.seed, 21, number, attempt])
            try:
                world = _draw_confounded(rng, asked, asked.tie) if asked.tie else _draw(rng, wanted, asked)
            except PlantError:
                continue
            if world is not None:
                return world
        if asked.kind != "pair":
            break
    names = ", ".join(s.id for s in asked.suspects) or (asked.tie.name if asked.tie else "")
    raise PlantError(f"trial {number} ({asked.kind}: {names}): no joint of {_ATTEMPTS} can show it")


def _draw(rng: np.random.Generator, wanted: Wanted, asked: Order) -> World | None:
    how = draw_imperfections(rng, wanted.imperfections, asked.kind)
    if asked.case is not None:
        how = how.having("sessions", sessions_of(rng, asked.case, drawn_numbers(rng, "sessions")))
    if any(s.motor_torque for s in asked.suspects):
        how = how.having("motor_torque", {"noise_of_range": log_uniform(rng, 0.002, 0.01)})
    as_stated = asked.kind == "none" and wanted.imperfections == "none" and rng.uniform() < 0.3
    joint = draw_joint(rng, as_stated, closed=any(s.closed for s in asked.suspects))
    turns = 0.0 if asked.case is not None else _turns(rng, asked.suspects)
    if asked.case is not None:
        courses, sessions = table_courses(rng, joint, how)
    else:
        courses = _courses(rng, asked.suspects, joint, how, turns)
        sessions = tuple(range(len(courses))) if "sessions" in how else (0,) * len(courses)
    scene, plain_run = plain_scene(joint, courses[0])
    joint = joint.with_sensors(draw_sensors(rng, joint, scene.plain))
    floor = noise_floor_rad(joint, scene.plain)
    hidden = _conceal(rng, wanted, asked, how, scene, plain_run)
    if hidden is None:
        return None
    how = settled(how, _channel_rates(scene.plain, usable(joint).motor_per_joint, courses), floor)
    if "configuration" in how:
        joint = _off(joint, how, scene.plain)
    if "vague" in how:
        joint = _guessed(joint, how)
    needed = any(s.neighbour for s in asked.suspects)
    other = (NEIGHBOUR_ANGLE if turns else NEIGHBOUR_LOAD) if needed or rng.uniform() < 0.6 else ""
    if asked.case is not None:
        other = f"other_{asked.case.condition}"
    specs = [h.sized.spec for h in hidden]
    legs = legs_of(rng, joint, scene.plain, specs, courses, sessions, how, other)
    return None if legs is None else World(asked, joint, scene.plain, floor, hidden, legs, how, other)


def _channel_rates(plain: PlainDrive, motor_per_joint: float, courses: Sequence[Course]) -> dict[str, float]:
    """RMS speed with which each channel moves, in rad/s of the joint angle, in the quickest of the recordings."""
    seen = [c.seen for c in courses]
    loads = max(float(np.std(np.gradient(c.load_Nm, c.time_s))) for c in seen)
    turns = max(float(np.std(np.gradient(c.motor_rad, c.time_s))) for c in seen) / motor_per_joint
    speed = max(plain.speed_rms, turns)
    return {"joint_position": speed, "motor_position": speed, "joint_torque": plain.compliance * loads}


def _draw_confounded(rng: np.random.Generator, asked: Order, case: Tie) -> World | None:
    """A trial in which two explanations coincide, in a world without imperfections: they would tell them apart."""
    joint = draw_joint(rng, between=case.geometry_friction, closed=True)
    within = usable(joint)
    true, partner = draw_truth(rng, case)
    courses: list[Course] = []
    for _ in range(CONFOUNDED_RECORDINGS):
        start = float(np.ceil(courses[-1].time_s[-1] + PAUSE_S)) if courses else 0.0
        courses.append(case.course(rng, within).later(start))
    if case.tie is not None:
        courses = list(case.tie(joint, courses))
    usual, _ = plain_scene(joint, draw_course(rng, "bench", within))  # what sensors are bought for
    scene, plain_run = plain_scene(joint, courses[0])
    # sizes count in loops of the usual course: this one may hardly have any
    own = {k: getattr(scene.plain, k) for k in ("speed_rms", "acceleration_rms", "other_rms")}
    scene = replace(scene, plain=replace(usual.plain, **own))
    shape = case.shape(rng, scene, true)
    if case.sizes is None:
        drawn = _as_drawn(scene, true, shape, plain_run)
        sized = drawn if drawn.size >= SMALLEST else None
    else:
        sized = give_size(scene, true, shape, log_uniform(rng, *case.sizes), plain_run)
    if sized is None:
        return None
    joint = joint.with_sensors(draw_sensors(rng, joint, usual.plain))
    floor, how = noise_floor_rad(joint, scene.plain), Imperfections()
    other = NEIGHBOUR_LOAD if "crosstalk" in case.pair or rng.uniform() < 0.6 else ""
    hidden = (Hidden(sized, "main"),)
    specs = [h.sized.spec for h in hidden]
    legs = legs_of(rng, joint, scene.plain, specs, courses, (0,) * len(courses), how, other)
    return (
        None if legs is None else World(asked, joint, scene.plain, floor, hidden, legs, how, other, partner)
    )


def _as_drawn(scene: Scene, identifier: str, shape: Shape, plain: PlantRun) -> Sized:
    spec = EffectSpec(identifier, shape.parameters(shape.first))
    added = run_course(scene, (spec,)).joint_position_rad - plain.joint_position_rad
    return Sized(spec, float(np.std(added)) / scene.plain.loop_rad)


def _courses(
    rng: np.random.Generator, suspects: Sequence[Suspect], joint: DrawnJoint, how: Imperfections, turns: float
) -> tuple[Course, ...]:
    """One to three courses on one clock, each with its history; an effect shows in the first at the latest."""
    showing = [k for k in KINDS if all(k in s.courses for s in suspects)]
    rate = float(rng.choice(RATES_HZ))
    count = int(rng.choice(list(RECORDINGS), p=list(RECORDINGS.values())))
    if "sessions" in how:
        count = max(count, 2)
    lasts = float(rng.uniform(*SAMPLES)) / rate / count
    two_sided = any(s.two_sided for s in suspects)
    within = usable(joint, not two_sided and rng.uniform() < 0.15)
    within = replace(within, neighbour=turns or None)
    warm = any(s.warm for s in suspects) or rng.uniform() < 0.2
    same, kind = rng.uniform() < 0.6, str(rng.choice(showing))
    start, found = 0.0, []
    for k in range(count):
        if k > 0 and not same:
            kind = str(rng.choice(KINDS))
        course = draw_course(rng, kind, within, warm, rate, lasts)
        if "uneven" in how:
            course = uneven(rng, course, how["uneven"]["jitter"])
        course = course.later(start)
        start = float(np.ceil(course.time_s[-1] + PAUSE_S))
        if "history" in how:
            course = with_history(rng, course, within, how["history"]["course"], how["history"]["lasts_s"])
        found.append(course)
    return tuple(found)


def _turns(rng: np.random.Generator, suspects: Sequence[Suspect]) -> float:
    """How far the neighbouring joint turns either way [rad]; 0 where its channel is the load on it. What needs none of
    them gets either."""
    needs = [s for s in suspects if s.neighbour]
    turned = any(s.turned for s in needs) if needs else rng.uniform() < 0.5
    return float(rng.uniform(0.4, 1.4)) if turned else 0.0


def _conceal(
    rng: np.random.Generator,
    wanted: Wanted,
    asked: Order,
    how: Imperfections,
    scene: Scene,
    plain: PlantRun,
) -> tuple[Hidden, ...] | None:
    found = []
    if asked.case is not None:
        given = shape_of(rng, replace(scene, course=scene.course.seen), asked.case)
        if given is None:
            return ()
        sized = give_size(scene, *given, log_uniform(rng, 0.1, LARGEST), plain)
        return None if sized is None else (Hidden(sized, "main"),)
    for suspect, size in zip(asked.suspects, _sizes(rng, asked.kind), strict=False):
        sized = _sized(rng, suspect, size, (SMALLEST, LARGEST), scene, plain)
        if sized is None:
            return None
        found.append(Hidden(sized, "main"))
    if "companions" in how:
        taken = {h.sized.spec.id.partition(":")[0] for h in found}
        least = min(h.sized.size for h in found)
        for drawn in how["companions"]["sizes"]:
            size = min(drawn, FAR_SMALLER * least)
            suspect = _companion(rng, wanted, scene, taken)
            sized = _sized(rng, suspect, size, (0.3 * size, 1.5 * size), scene, plain)
            if sized is not None:  # what cannot show here is no company
                found.append(Hidden(sized, "companion"))
                taken.add(suspect.id.partition(":")[0])
    return tuple(found)


def _sizes(rng: np.random.Generator, kind: str) -> tuple[float, ...]:
    """Sizes of what a trial is about, over the loop: of a pair half the time one large and one small."""
    if kind != "pair":
        return (log_uniform(rng, SMALLEST, LARGEST),)
    if rng.uniform() < 0.5:
        sizes = (log_uniform(rng, 0.15, LARGEST), log_uniform(rng, SMALLEST, 0.1))
        return sizes if rng.uniform() < 0.5 else sizes[::-1]
    return (log_uniform(rng, 0.05, LARGEST), log_uniform(rng, 0.05, LARGEST))


def _sized(
    rng: np.random.Generator,
    suspect: Suspect,
    size: float,
    within: tuple[float, float],
    scene: Scene,
    plain: PlantRun,
) -> Sized | None:
    shape = suspect.shape(rng, replace(scene, course=scene.course.seen))
    return give_size(scene, suspect.id, shape, size, plain, within, suspect.motor_torque)


def _companion(rng: np.random.Generator, wanted: Wanted, scene: Scene, taken: set[str]) -> Suspect:
    """A further effect that the course can show, of the laws asked for."""
    closed = scene.joint.true.circuit == "closed"
    fit = [
        s
        for s in concealable(wanted.laws)
        if scene.course.kind in s.courses
        and s.id.partition(":")[0] not in taken
        and not (s.warm or s.neighbour or s.two_sided or s.motor_torque or (s.closed and not closed))
        and not (closed and s.id in ABOUT_T0)  # far larger from session to session than within one
    ]
    return fit[int(rng.integers(len(fit)))]


def _off(joint: DrawnJoint, how: Imperfections, plain: PlainDrive) -> DrawnJoint:
    """The configuration off the joint: radii, length and wraps, of which no tolerance speaks, and one value beyond
    its tolerance. Radii are off by no more than a third of the loop over the travel."""
    numbers, stage = how["configuration"], joint.nominal.stages[0]
    most = plain.loop_rad / (3.0 * joint.travel_rad)
    values = dict(stage.__dict__)
    for key in ("output_radius_m", "input_radius_m", "free_length_m"):
        share = numbers[key] if key == "free_length_m" else float(np.clip(numbers[key], -most, most))
        values[key] *= math.exp(share)
    for key in ("wrap_output_rad", "wrap_input_rad"):
        values[key] += numbers[key]
    key = numbers["beyond_tolerance"]
    true = joint.true.stages[0].__dict__[key]
    values[key] = true * math.exp(numbers["sigmas"] * joint.tolerance[key])
    stated = {name: float(f"{value:.4e}") for name, value in values.items()}
    return replace(joint, nominal=replace(joint.nominal, stages=(StageConfig(**stated),)))


def _guessed(joint: DrawnJoint, how: Imperfections) -> DrawnJoint:
    """The drive stated by order of magnitude only, and its ratio by measure: what hardware has that nobody drew."""
    stage = joint.nominal.stages[0]
    off = {key: value * math.exp(how["vague"].get(key, 0.0)) for key, value in stage.__dict__.items()}
    stated = {name: float(f"{value:.4e}") for name, value in off.items()}
    tolerance = {"input_radius_m": RATIO_MEASURED, **dict.fromkeys(OFF_NOMINAL, BY_ORDER)}
    return replace(
        joint, nominal=replace(joint.nominal, stages=(StageConfig(**stated),)), tolerance=tolerance
    )
