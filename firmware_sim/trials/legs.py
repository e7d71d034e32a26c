"""The recordings of a trial: each played by the drive as it was then, through sensors as they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from firmware_sim.plant import NORMAL, EffectSpec, PlantConfig, PlantRun
from firmware_sim.plant.records import Floats
from firmware_sim.trials.courses import Course
from firmware_sim.trials.imperfections import Imperfections
from firmware_sim.trials.joints import DrawnJoint
from firmware_sim.trials.measures import PlainDrive
from firmware_sim.trials.scene import is_no_trial
from firmware_sim.trials.sizes import run_course
from firmware_sim.trials.spoil import Recorded, record
from firmware_sim.trials.suspects import Scene
from firmware_sim.trials.tightened import tightened


@dataclass(frozen=True)
class Leg:
    """One recording: what was done, the drive as it was then, the zeros of its sensors, and what was recorded.

    Angles are those of the joint without noise, as its encoder would show them: `true_rad` of the drive as it is,
    `plain_rad` without any effect, `without` each by its id where there are several; one value per row. `motor_Nm`
    holds the motor's torque without noise by the same names: `joint`, `plain`, `without_<id>`.
    """

    course: Course
    drive: PlantConfig
    session: int
    zeros: dict[str, float]
    recorded: Recorded
    true_rad: Floats
    plain_rad: Floats
    without: dict[str, Floats]
    motor_Nm: dict[str, Floats]


def legs_of(
    rng: np.random.Generator,
    joint: DrawnJoint,
    plain: PlainDrive,
    specs: Sequence[EffectSpec],
    courses: Sequence[Course],
    sessions: Sequence[int],
    how: Imperfections,
    other: str,
) -> tuple[Leg, ...] | None:
    """One leg for each course; None where a cable goes slack in one."""
    found = []
    zeros, factor = {"joint_position": joint.offset_rad}, 1.0
    for course, k in zip(courses, sessions, strict=True):
        if "sessions" in how:
            zeros, factor = _session(joint, how, k)
        leg = _leg(rng, joint, plain, specs, course, how, other, zeros, factor)
        if leg is None:
            return None
        found.append(replace(leg, session=k))
    return tuple(found)


def _session(joint: DrawnJoint, how: Imperfections, k: int) -> tuple[dict[str, float], float]:
    """Zeros of session k, and times how much its pretension is what it is meant to be."""
    numbers = how["sessions"]
    zeros = {
        "joint_position": joint.offset_rad + numbers["joint_zero_rad"][k],
        "joint_torque": numbers["torque_zero_of_load"][k] * joint.load_Nm,
    }
    return zeros, numbers["pretension_factor"][k] if joint.true.circuit == "closed" else 1.0


def _standing(
    joint: DrawnJoint, specs: Sequence[EffectSpec], factor: float
) -> tuple[DrawnJoint, list[EffectSpec]]:
    """The joint with these effects, its cables tightened so many times as much."""
    stage, there = tightened(joint.stage, specs, factor)
    return replace(joint, true=replace(joint.true, stages=(stage,))), there


def _leg(
    rng: np.random.Generator,
    joint: DrawnJoint,
    plain: PlainDrive,
    specs: Sequence[EffectSpec],
    course: Course,
    how: Imperfections,
    other: str,
    zeros: dict[str, float],
    factor: float,
) -> Leg | None:
    def played(effects: Sequence[EffectSpec]) -> PlantRun:
        stood, there = _standing(joint, effects, factor)
        return run_course(Scene(stood, course, plain), there, NORMAL)

    run, drive = played(specs), _standing(joint, [], factor)[0]
    if is_no_trial(run, drive):
        return None
    recorded = record(rng, run, joint.sensors, how, zeros, other)
    rows = recorded.rows
    without = {s.id: played([o for o in specs if o is not s]) for s in specs if len(specs) > 1}
    bare = run if not specs else played([])
    angles = {name: r.joint_position_rad[rows] for name, r in without.items()}
    torques = {"joint": run, "plain": bare, **{f"without_{name}": r for name, r in without.items()}}
    motor = {name: r.motor_torque_Nm[rows] for name, r in torques.items()}
    true, plain_rad = run.joint_position_rad[rows], bare.joint_position_rad[rows]
    return Leg(course, drive.true, 0, zeros, recorded, true, plain_rad, angles, motor)
