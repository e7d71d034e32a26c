"""When an event happened: at once, evenly, in steps; found from what it does once it is over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_drive import TOLERANT, calibrated, recorded

from cablecomp.diagnosis.explain.courses import Course, how_far, instants_of, likely
from cablecomp.diagnosis.explain.discrepancy import _courses
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.linear import anchor
from cablecomp.diagnosis.explain.screening import ask, rough
from cablecomp.diagnosis.explain.steps import course_in, in_steps
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
    if course.steps:
        sizes = [1.0, *(size for _, size in course.steps)]
        at = [course.instant_s, *(course.instant_s + after for after, _ in course.steps)]
        return sum(size * (t <= TIME) for t, size in zip(at, sizes, strict=True)) / sum(sizes)
    u = np.interp(TIME, [course.instant_s, course.instant_s + course.duration_s], [0.0, 1.0])
    return u**course.curve if course.curve >= 1.0 else 1.0 - (1.0 - u) ** (1.0 / course.curve)


SMOOTH = [Course(17.0, 21.0), Course(15.0, 30.0, 0.4), Course(12.0, 35.0, 2.5)]
IN_STEPS = [
    Course(11.0, 0.0, steps=((23.0, 0.5),)),
    Course(20.0, 0.0, steps=((4.0, 1.0), (15.0, 3.0))),
    Course(8.0, 0.0, steps=((10.0, 2.0), (16.0, 1.5), (40.0, 0.8))),
]
LINE = np.linalg.qr(np.stack([np.ones_like(TIME), TIME], axis=1))[0]
"""A straight line beside an event is nobody's: what other parameters do is taken off before."""


@pytest.mark.parametrize("course", [*SMOOTH, *IN_STEPS], ids=str)
def test_a_course_is_as_it_is_told(course: Course) -> None:
    assert how_far(course, TIME) == pytest.approx(gone(course), abs=1e-12)
    at_once = how_far(Course(course.instant_s, 0.0), TIME)
    assert at_once == pytest.approx(1.0 * (course.instant_s <= TIME))


def from_instants(instants: FloatArray, true: Course) -> tuple[FloatArray, FloatArray]:
    """What an event does from each instant on, and what is left of it by its true course (seed 7), line apart."""
    columns = np.stack([DOES * (t <= TIME) for t in instants], axis=1)
    left = DOES * gone(true) + NOISE
    return columns - LINE @ (LINE.T @ columns), left - LINE @ (LINE.T @ left)


@pytest.mark.parametrize("true", SMOOTH, ids=str)
def test_the_course_is_found_that_takes_off_most(true: Course) -> None:
    instants = np.linspace(0.5, 59.5, 160)
    columns, left = from_instants(instants, true)
    first = likely(instants, columns.T @ columns, columns.T @ left)[0]
    assert first.curve == true.curve
    assert first.instant_s == pytest.approx(true.instant_s, abs=0.6)
    assert first.duration_s == pytest.approx(true.duration_s, abs=0.9)
    turned = likely(instants, columns.T @ columns, -columns.T @ left)
    assert first not in turned


@pytest.mark.parametrize("true", IN_STEPS, ids=str)
def test_steps_are_found_as_many_as_there_are_at_their_instants_and_of_their_sizes(true: Course) -> None:
    instants = np.linspace(0.5, 59.5, 160)
    columns, left = from_instants(instants, true)
    found = in_steps(columns.T @ columns, columns.T @ left, float(left @ left))
    assert found is not None
    course = course_in(found, instants)
    assert course.instant_s == pytest.approx(true.instant_s, abs=0.4)
    assert np.array(course.steps) == pytest.approx(np.array(true.steps), abs=0.5)
    # of the other sign there is none, or what takes off next to nothing
    turned = in_steps(columns.T @ columns, -columns.T @ left, float(left @ left))
    assert turned is None or turned.taken < 0.2 * found.taken


def test_of_one_step_no_second_is_made_that_counts() -> None:
    instants = np.linspace(0.5, 59.5, 160)
    columns, left = from_instants(instants, Course(float(instants[79]), 0.0))
    found = in_steps(columns.T @ columns, columns.T @ left, float(left @ left))
    alone = max((columns.T @ left) ** 2 / np.sum(columns**2, axis=0))
    assert found is None or float(left @ left) - found.taken > LIMITS.stepped * (float(left @ left) - alone)


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
    ("effect", "amount", "size", "late_s", "left", "rel"),
    [("clamp_slip", "slip_m", 1e-4, 0.3, 0.1, 0.25), ("strand_break", "fraction", 0.08, 2.2, 0.15, 0.35)],
)
@pytest.mark.parametrize(("growth", "wait"), [(1.0, 1.0), (1.3, 0.5)])
def test_an_event_in_steps_is_promised_with_them(
    effect: str, amount: str, size: float, late_s: float, left: float, rel: float, growth: float, wait: float
) -> None:
    """The plant's clamp lets go three times (its wires break so), each time `growth` times as much as before, after
    `wait` times as long: each event as the other's explains far less. A cable that grows softer shows it only when the
    load moves on, so its steps are placed less closely before it is run."""
    course = {"time_s": 12.0, "duration_s": 16.0, "steps": 3.0, "growth": growth, "wait": wait}
    body, drive = calibrated(
        recorded([EffectSpec(f"{effect}:unequal_steps", {amount: size, **course})], 45.0)
    )
    promised = {}
    for h in hypotheses(TOLERANT, body.used):
        if h.has_instant:
            answer = ask(anchor(drive.fit), h)
            assert answer is not None
            promised[h.name] = answer
    right = promised.pop(effect)
    values = right.problem.config.effect[-1].parameters
    assert values["time_s"] == pytest.approx(12.0, abs=0.3)
    assert values["second_after_s"] == pytest.approx(16.0 / (1.0 + wait), abs=late_s)
    assert values["third_after_s"] == pytest.approx(16.0, abs=late_s)
    assert "fourth_after_s" not in values
    assert right.plain is not None
    assert right.cost < left * right.plain.cost
    (fit,) = rough([right], LIMITS.settled)
    assert abs(fit.values[f"effect.{effect}.{amount}"]) == pytest.approx(size, rel=0.03)
    for step, times in (("second", growth), ("third", growth**2)):
        assert fit.values[f"effect.{effect}.{step}_size"] == pytest.approx(times, rel=rel)
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
