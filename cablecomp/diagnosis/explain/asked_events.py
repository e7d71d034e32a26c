"""When an event happened, asked beside a fitted model: at once, at the best of many instants; in the likely courses of
one that takes its time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cablecomp.diagnosis.explain.courses import Course, before_all, from_each, instants_of, likely
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, Start, at_instants
from cablecomp.diagnosis.explain.linear import Anchor, Best, best_start, worth_a_shape
from cablecomp.diagnosis.explain.steps import course_in, in_steps, moved_closer
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.signal.smoothing import FloatArray


def best_event(here: Anchor, h: Hypothesis) -> Best | None:
    """The best linear answer over the instants of an event, looked for more closely about the best of them."""
    best = best_start(here, h)
    if best is None:
        return None
    t = float(best.values[h.instant])
    times = sorted(float(s.values[h.instant]) for s in h.starts)
    width = times[1] - times[0]
    for _ in range(2 if here.fit.problem.fine else 4):
        width *= 0.5
        closer = best_start(here, at_instants(h, (t - 0.5 * width, t + 0.5 * width)), best.size)
        if closer is not None and closer.cost < best.cost:
            best = closer
            t = float(best.values[h.instant])
    if h.two_sided:  # the other cable is softer in its own way, not in the opposite one
        mirrored = replace(at_instants(h, (t,)), starts=(_turned(h, t),))
        other = best_start(here, mirrored, -best.size)
        # what one cable promises by the opposite of what it does is the other's
        opposite = float(best.values[h.amount.name]) * best.size < 0.0
        if other is not None and (opposite or other.cost < best.cost):
            best = other
    return best


def best_course(here: Anchor, h: Hypothesis, best: Best) -> Best | None:
    """The best linear answer over the likely courses of an event of this shape, of either cable."""
    values, size = best.values, best.size
    sizes = (size, -size) if h.two_sided else (size,)
    found: dict[str, Best] = {}
    for s in sizes:
        for c in _likely(here, h, values, s):
            start = Start({**values, h.amount.name: s, **h.course(c)})
            answer, kind = best_start(here, replace(h, starts=(start,))), _kind(c)
            if answer is not None and (kind not in found or answer.cost < found[kind].cost):
                found[kind] = answer
    evenly, curved, stepped = (found.get(kind) for kind in ("", "curve", "steps"))
    bends = curved and (evenly is None or worth_a_shape(curved.by_channel, evenly.by_channel))
    smooth = curved if bends else evenly
    other = best if smooth is None or best.cost < smooth.cost else smooth
    if stepped and worth_a_shape(stepped.by_channel, other.by_channel, LIMITS.stepped):
        return stepped
    return smooth


def _kind(c: Course) -> str:
    """What of a course the event has: "steps", a "curve", "" where it goes evenly."""
    return "steps" if c.steps else "curve" if c.curve != 1.0 else ""


def _likely(here: Anchor, h: Hypothesis, values: Mapping[str, float | str], size: float) -> list[Course]:
    """The courses that promise most, of an event of this size, were it over before the first sample."""
    problem = here.fit.problem
    over = here.with_event(h, {**values, h.amount.name: size, h.instant: before_all(problem)})
    if over is None:
        return []
    left = here.beyond(here.fit.residual)

    def products(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        rows = from_each(problem, over, here.misfits, at)
        beyond = here.beyond(np.concatenate([rows, np.zeros((len(problem.parameters), len(at)))]))
        return beyond.T @ beyond, beyond.T @ left

    instants = instants_of(problem, LIMITS.course_instants)
    gram, along = products(instants)
    found = likely(instants, gram, along)[: LIMITS.courses]
    steps = in_steps(gram, along, float(left @ left)) if h.goes_in_steps else None
    if steps is not None:
        wide = float(np.median(np.diff(instants)))
        near = np.unique(np.add.outer(instants[list(steps.at)], wide * np.linspace(-1.0, 1.0, 11)))
        places = tuple(np.searchsorted(near, instants[list(steps.at)]).tolist())
        found.append(course_in(moved_closer(*products(near), steps._replace(at=places)), near))
    return found


def _turned(h: Hypothesis, t: float) -> Start:
    """The event at t with the other sign."""
    base = h.starts[0].values
    return Start({**base, h.instant: t, h.amount.name: -float(base[h.amount.name])})
