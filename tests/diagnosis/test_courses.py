"""When an event happened: at once, evenly, in steps; found from what it does once it is over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_drive import TOLERANT, calibrated, recorded

from cablecomp.diagnosis.explain.courses import EVENLY, Course, how_far, instants_of, likely
from cablecomp.diagnosis.explain.discrepancy import _courses
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.linear import anchor
from cablecomp.diagnosis.explain.screening import ask
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.least_squares import Fit
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec

TIME = np.linspace(0.0, 60.0, 900)
DOES = 1.0 + 0.4 * np.sin(1.3 * TIME)
"""What an event does once it is over, growing and falling with the load."""
NOISE = 0.02 * np.random.default_rng(7).standard_normal(len(TIME))


def gone(course: Course) -> FloatArray:
    """How far an event has gone, told step by step or as a ramp."""
    if course.steps == EVENLY:
        return (
            np.interp(TIME, [course.instant_s, course.instant_s + course.duration_s], [0.0, 1.0])
            ** course.curve
        )
    at = np.linspace(course.instant_s, course.instant_s + course.duration_s, course.steps)
    return np.mean([t <= TIME for t in at], axis=0)


COURSES = [
    Course(11.0, 23.0, 2),
    Course(20.0, 9.0, 3),
    Course(8.0, 40.0, 5),
    Course(17.0, 21.0, EVENLY),
    Course(15.0, 30.0, EVENLY, 0.4),
    Course(12.0, 35.0, EVENLY, 2.5),
]


@pytest.mark.parametrize("course", COURSES, ids=str)
def test_a_course_is_as_it_is_told(course: Course) -> None:
    assert how_far(course, TIME) == pytest.approx(gone(course), abs=1e-12)
    at_once = how_far(course._replace(duration_s=0.0, steps=EVENLY), TIME)
    assert at_once == pytest.approx(1.0 * (course.instant_s <= TIME))


@pytest.mark.parametrize(
    "true",
    COURSES,
    ids=str,
)
def test_the_course_is_found_that_takes_off_most(true: Course) -> None:
    """Seed 7; a straight line beside it is nobody's: what other parameters do is taken off before."""
    instants = np.linspace(0.5, 59.5, 160)
    columns = np.stack([DOES * (t <= TIME) for t in instants], axis=1)
    left = DOES * gone(true) + NOISE
    line = np.stack([np.ones_like(TIME), TIME], axis=1)
    q = np.linalg.qr(line)[0]
    columns, left = columns - q @ (q.T @ columns), left - q @ (q.T @ left)
    first = likely(instants, columns.T @ columns, columns.T @ left)[0]
    assert (first.steps, first.curve) == (true.steps, true.curve)
    assert first.instant_s == pytest.approx(true.instant_s, abs=0.6)
    assert first.duration_s == pytest.approx(true.duration_s, abs=0.9)
    turned = likely(instants, columns.T @ columns, -columns.T @ left)
    assert first not in turned


def test_what_an_event_does_is_known_from_before_the_first_sample() -> None:
    """A slip fitted at 30 s, of which a fit's reach is three seconds: from the first of the instants on it does what it
    does from its own on."""
    course = {"slip_m": 1e-4, "time_s": 30.0}
    body, drive = calibrated(recorded([EffectSpec("clamp_slip", course)], 45.0))
    slip = next(h for h in hypotheses(TOLERANT, body.used) if h.name == "clamp_slip")
    answer = ask(anchor(drive.fit), slip)
    assert answer is not None
    problem = answer.problem
    fit = Fit(problem, problem.start, problem.residual(problem.start), problem.jacobian(problem.start))
    time = problem.evidence[0].at_rows("time_s")[problem.evidence[0].counted[JOINT]]
    does = _courses(fit, slip)[0][problem.spans()[JOINT]][: len(time)]
    before = does[time < instants_of(problem, LIMITS.steps)[0]].mean()
    early, late = (does[(a < time) & (time < a + 8.0)].mean() - before for a in (15.0, 33.0))
    assert abs(late) > 0.5 * np.ptp(does)
    assert early == pytest.approx(late, rel=0.1)


@pytest.mark.parametrize(
    ("effect", "amount", "size"), [("clamp_slip", "slip_m", 1e-4), ("strand_break", "fraction", 0.3)]
)
def test_an_event_in_steps_is_promised_with_them(effect: str, amount: str, size: float) -> None:
    """The plant's clamp lets go three times (its wires break so): each event as the other's explains far less."""
    course = {"time_s": 12.0, "duration_s": 16.0, "steps": 3.0}
    body, drive = calibrated(recorded([EffectSpec(f"{effect}:in_steps", {amount: size, **course})], 45.0))
    promised = {}
    for h in hypotheses(TOLERANT, body.used):
        if h.has_instant:
            answer = ask(anchor(drive.fit), h)
            assert answer is not None
            promised[h.name] = answer
    right = promised.pop(effect)
    values = right.problem.config.effect[-1].parameters
    assert values["steps"] == 3.0
    assert values["time_s"] == pytest.approx(12.0, abs=0.3)
    assert values["duration_s"] == pytest.approx(16.0, abs=0.6)
    assert right.plain is not None
    assert right.cost < 0.1 * right.plain.cost
    (wrong,) = promised.values()
    assert right.cost < 0.5 * wrong.cost


@pytest.mark.parametrize(
    ("form", "law", "curve"),
    [
        ("strand_break:accelerating", {"fraction": 0.3, "time_s": 8.0, "duration_s": 25.0}, 2.5),
        ("clamp_slip:settling", {"slip_m": 1e-4, "time_s": 8.0, "lag_s": 8.0}, 0.4),
    ],
)
def test_an_event_that_gets_quicker_or_settles_is_promised_so(
    form: str, law: dict[str, float], curve: float
) -> None:
    """The plant's wires break by the square of the time, its clamp settles by an exponential, which the catalogue has
    not: each nearer to its curve than to an even course, which is asked for as well."""
    effect = form.partition(":")[0]
    body, drive = calibrated(recorded([EffectSpec(form, law)], 45.0))
    (event,) = (h for h in hypotheses(TOLERANT, body.used) if h.name == effect)
    answer = ask(anchor(drive.fit), event)
    assert answer is not None
    values = answer.problem.config.effect[-1].parameters
    assert values["curve"] == curve
    straight = tuple(p for p in event.effect.parameters if p.role != "curve")
    evenly = ask(anchor(drive.fit), replace(event, effect=replace(event.effect, parameters=straight)))
    assert evenly is not None
    assert "curve" not in evenly.problem.config.effect[-1].parameters
    assert answer.cost < 0.8 * evenly.cost
