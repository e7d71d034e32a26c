"""One blind trial: a joint, what is concealed in it, and the recordings that its sensors make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from firmware_sim.plant import FINE, EffectSpec, PlantError, PlantRun
from firmware_sim.plant.records import Floats
from firmware_sim.trials.confounded import Case, case_by_name, draw_truth
from firmware_sim.trials.courses import KINDS, Course, Range, draw_course
from firmware_sim.trials.joints import DrawnJoint, draw_joint, log_uniform
from firmware_sim.trials.measures import PlainDrive, plain_measures
from firmware_sim.trials.plan import Assignment
from firmware_sim.trials.sensors import draw_sensors, noise_floor_rad, read_sensors
from firmware_sim.trials.sizes import LARGEST, SMALLEST, Sized, give_size, run_course
from firmware_sim.trials.strangers import STRANGERS
from firmware_sim.trials.suspects import CATALOGUE, Scene, Shape, Suspect, by_id

RECORDINGS = 2
PAUSE_S = 30.0  # between two recordings
_ATTEMPTS = 80
_TAUT = 0.02  # of T0, the least tension that a trial may come down to
_SUSPECTS = {**by_id(CATALOGUE), **by_id(STRANGERS)}


@dataclass(frozen=True)
class Trial:
    """A trial with its truth. `partner` is the other explanation where the trial is confounded by design;
    `floor_rad` what the sensors' noise leaves of a perfect model."""

    assignment: Assignment
    joint: DrawnJoint
    effects: tuple[Sized, ...]
    plain: PlainDrive
    courses: tuple[Course, ...]
    recordings: tuple[Mapping[str, Floats], ...]
    floor_rad: float
    neighbour: bool
    partner: str = ""


def draw_trial(seed: int, wanted: Assignment) -> Trial:
    """Draw a trial; the same seed and assignment give the same trial, bit for bit.

    Joints that cannot show the effect in the size asked for, or that go slack, are drawn anew. Raises
    PlantError if none of a bounded number will do.
    """
    for attempt in range(_ATTEMPTS):
        rng = np.random.default_rng([seed, 7, wanted.number, attempt])
        try:
            trial = _draw(rng, wanted)
        except PlantError:
            continue
        if trial is not None:
            return trial
    raise PlantError(f"trial {wanted.number} ({wanted}): no joint of {_ATTEMPTS} can show it")


def _draw(rng: np.random.Generator, wanted: Assignment) -> Trial | None:
    if wanted.kind == "confounded":
        return _draw_confounded(rng, wanted, case_by_name(wanted.case))
    suspects = [_SUSPECTS[name] for name in wanted.effects]
    joint = draw_joint(rng, as_stated=wanted.kind == "nothing", closed=any(s.closed for s in suspects))
    kind = str(rng.choice([k for k in KINDS if all(k in s.courses for s in suspects)]))
    one_sided = not any(s.two_sided for s in suspects) and rng.uniform() < 0.15
    within = usable(joint, one_sided)
    warm = any(s.warm for s in suspects) or rng.uniform() < 0.2
    courses = _one_after_another([draw_course(rng, kind, within, warm) for _ in range(RECORDINGS)])
    scene, plain_run = plain_scene(joint, courses[0])
    effects = _size_all(rng, scene, suspects, plain_run)
    if effects is None:
        return None
    neighbour = any(s.neighbour for s in suspects) or rng.uniform() < 0.6
    joint = joint.with_sensors(draw_sensors(rng, joint, scene.plain))
    return _record(rng, wanted, joint, scene.plain, effects, courses, neighbour)


def _draw_confounded(rng: np.random.Generator, wanted: Assignment, case: Case) -> Trial | None:
    joint = draw_joint(rng, between=case.geometry_friction, closed=True)
    within = usable(joint)
    true, partner = draw_truth(rng, case)
    courses = _one_after_another([case.course(rng, within) for _ in range(RECORDINGS)])
    if case.tie is not None:
        courses = case.tie(joint, courses)
    usual, _ = plain_scene(joint, draw_course(rng, "bench", within))  # what sensors are bought for
    scene, plain_run = plain_scene(joint, courses[0])
    # sizes count in loops of the usual course: this one may hardly have any
    own = {k: getattr(scene.plain, k) for k in ("speed_rms", "acceleration_rms", "other_rms")}
    scene = replace(scene, plain=replace(usual.plain, **own))
    assert case.shape is not None
    shape = case.shape(rng, scene, true)
    if case.sizes[1] > 1.0:
        drawn = _as_drawn(scene, true, shape, plain_run)
        sized = drawn if drawn.size >= SMALLEST else None
    else:
        sized = give_size(scene, true, shape, log_uniform(rng, *case.sizes), plain_run)
    if sized is None:
        return None
    joint = joint.with_sensors(draw_sensors(rng, joint, usual.plain))
    neighbour = "crosstalk" in case.pair or rng.uniform() < 0.6
    return _record(rng, wanted, joint, scene.plain, (sized,), courses, neighbour, partner)


def _as_drawn(scene: Scene, identifier: str, shape: Shape, plain: PlantRun) -> Sized:
    spec = EffectSpec(identifier, shape.parameters(shape.first))
    added = run_course(scene, (spec,)).joint_position_rad - plain.joint_position_rad
    return Sized(spec, float(np.std(added)) / scene.plain.loop_rad)


def usable(joint: DrawnJoint, one_sided: bool = False) -> Range:
    """What courses of this joint may use."""
    return Range(joint.load_Nm, joint.travel_rad, 1.0 / joint.true.ratio, one_sided)


def plain_scene(joint: DrawnJoint, course: Course) -> tuple[Scene, PlantRun]:
    """The scene of a course with the measures of its plain drive, and the plain drive's run."""
    unmeasured = PlainDrive(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    run = run_course(Scene(joint, course, unmeasured))
    return Scene(joint, course, plain_measures(course.seen, run.joint_position_rad, joint.true.ratio)), run


def _size_all(
    rng: np.random.Generator, scene: Scene, suspects: Sequence[Suspect], plain: PlantRun
) -> tuple[Sized, ...] | None:
    found = []
    for suspect in suspects:
        shape = suspect.shape(rng, scene)
        sized = give_size(scene, suspect.id, shape, log_uniform(rng, SMALLEST, LARGEST), plain)
        if sized is None:
            return None
        found.append(sized)
    return tuple(found)


def _one_after_another(courses: Sequence[Course]) -> tuple[Course, ...]:
    """One clock for all recordings: what happened in the first is past in the second."""
    start, found = 0.0, []
    for course in courses:
        found.append(course.later(start))
        start = float(np.ceil(found[-1].time_s[-1] + PAUSE_S))
    return tuple(found)


def _record(
    rng: np.random.Generator,
    wanted: Assignment,
    joint: DrawnJoint,
    plain: PlainDrive,
    effects: tuple[Sized, ...],
    courses: tuple[Course, ...],
    neighbour: bool,
    partner: str = "",
) -> Trial | None:
    recordings = []
    for course in courses:
        run = run_course(Scene(joint, course, plain), [e.spec for e in effects], FINE)
        if is_slack(run, joint):
            return None
        recordings.append(read_sensors(rng, run, joint, course, neighbour))
    floor = noise_floor_rad(joint, plain)
    return Trial(wanted, joint, effects, plain, courses, tuple(recordings), floor, neighbour, partner)


def is_slack(run: PlantRun, joint: DrawnJoint) -> bool:
    """Whether a cable came so near to going slack that the trial would be about that."""
    least = float(run.tension_h_N.min())
    if joint.true.circuit == "closed":
        least = min(least, float(run.tension_l_N.min()))
    return least < _TAUT * joint.stage.pretension_N
