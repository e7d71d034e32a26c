"""Table-top recordings of several sessions, with a channel that tells how the drive stood: what depends on what."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from firmware_sim.plant.records import Floats
from firmware_sim.trials.courses import KINDS, RATES_HZ, Course, draw_course
from firmware_sim.trials.history import uneven, with_history
from firmware_sim.trials.imperfections import Imperfections
from firmware_sim.trials.joints import DrawnJoint, log_uniform
from firmware_sim.trials.scene import PAUSE_S, usable
from firmware_sim.trials.suspects import Scene, Shape

SESSIONS, SAMPLES = 2, 11_000
_GREATEST = 1.5  # rad, of a bend or of a wrist's turn


@dataclass(frozen=True)
class Case:
    """What may depend on what in such a trial.

    `condition` is the name under which the configuration knows the channel `other_<condition>`; `effect` is what is
    concealed (empty: nothing, or in half of the trials plain routing friction); `depends` pairs a parameter with what
    it depends on; `pretension` says how far the sessions' pretensions lie apart (standard deviation of logarithms).
    """

    name: str
    condition: str
    effect: str
    depends: tuple[tuple[str, str], ...]
    pretension: float


CASES = (
    Case(
        "bent_sheath",
        "sheath_bend_rad",
        "routing_friction:bending",
        (("routing_friction.mu_angle", "sheath_bend_rad"),),
        0.01,
    ),
    Case("tightened_anew", "sheath_bend_rad", "", (("pretension_N", "session"),), 0.15),
    Case("turning_wrist", "wrist_rad", "neighbour_tightens", (("pretension_N", "wrist_rad"),), 0.01),
    Case(
        "bent_and_tightened",
        "sheath_bend_rad",
        "routing_friction:bending",
        (("routing_friction.mu_angle", "sheath_bend_rad"), ("pretension_N", "session")),
        0.15,
    ),
    Case("steady", "sheath_bend_rad", "", (), 0.01),
)


def table_courses(
    rng: np.random.Generator, joint: DrawnJoint, how: Imperfections
) -> tuple[tuple[Course, ...], tuple[int, ...]]:
    """Two or three courses in each session, each at a stand of its own; the session of each."""
    rate, each = float(rng.choice(RATES_HZ)), int(rng.integers(2, 4))
    lasts = SAMPLES / rate / (SESSIONS * each)
    kind, within = str(rng.choice(KINDS)), usable(joint)
    start, found = 0.0, []
    for level in _stands(rng, each):
        course = draw_course(rng, kind, within, False, rate, lasts)
        if "uneven" in how:
            course = uneven(rng, course, how["uneven"]["jitter"])
        course = replace(course, other=_stand(rng, course.time_s, level)).later(start)
        start = float(np.ceil(course.time_s[-1] + PAUSE_S))
        if "history" in how:
            before = with_history(rng, course, within, how["history"]["course"], how["history"]["lasts_s"])
            course = replace(before, other=np.r_[np.full(before.history, course.other[0]), course.other])
        found.append(course)
    return tuple(found), tuple(k // each for k in range(SESSIONS * each))


def _stands(rng: np.random.Generator, each: int) -> list[float]:
    """Stands of all recordings; those of one session cover the range, in any order."""
    found: list[float] = []
    for _ in range(SESSIONS):
        spread = (np.arange(each) + rng.uniform(0.2, 0.8, each)) / each
        found += [float(x) for x in rng.permutation(_GREATEST * spread)]
    return found


def _stand(rng: np.random.Generator, time: Floats, level: float) -> Floats:
    """A stand that is kept, or in a third of the recordings changes slowly."""
    swing = 0.15 if rng.uniform() < 1 / 3 else 0.0
    phase = 2.0 * np.pi * ((time - time[0]) / (time[-1] - time[0]) * rng.uniform(0.3, 1.0) + rng.uniform())
    return np.asarray(level + swing * np.sin(phase))


def shape_of(rng: np.random.Generator, scene: Scene, case: Case) -> tuple[str, Shape] | None:
    """What is concealed, by its id, and its shape; None where it is nothing."""
    arc = max(float(rng.uniform(0.03, 0.15)) * scene.joint.stage.free_length_m, 1e-3)
    if case.effect == "routing_friction:bending":
        growth = log_uniform(rng, 0.5, 3.0)
        scaled = {"mu_angle": 1.0, "mu_angle_per_unit": growth}
        return case.effect, Shape({"arc_length_m": arc}, scaled, 0.15, 1.5, absent=False)
    if case.effect == "neighbour_tightens":
        way = float(rng.choice((-1.0, 1.0)))
        return case.effect, Shape({}, {"coefficient_per_unit": way / _GREATEST}, 0.2, 0.35)
    if rng.uniform() < 0.5:
        return "routing_friction", Shape({"arc_length_m": arc}, {"mu_angle": 1.0}, 0.3, 3.0, absent=False)
    return None


def sessions_of(rng: np.random.Generator, case: Case, drawn: dict[str, Any]) -> dict[str, Any]:
    """The numbers of the sessions, with pretensions as far apart as the case has them."""
    logs = rng.normal(0.0, case.pretension, SESSIONS)
    if case.pretension > 0.1:  # apart for certain, not by luck
        gap = float(rng.uniform(1.0, 2.5)) * case.pretension
        logs = 0.5 * gap * np.array([1.0, -1.0]) * rng.choice((-1.0, 1.0))
    return {**drawn, "pretension_factor": [float(x) for x in np.exp(logs)]}


def case_in_turn(seed: int, place: int) -> Case:
    """Every case once in each round, in a new order each round."""
    turn, within = divmod(place, len(CASES))
    return CASES[int(np.random.default_rng([seed, 6, turn]).permutation(len(CASES))[within])]
