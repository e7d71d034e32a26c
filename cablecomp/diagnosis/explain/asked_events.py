"""When an event happened, asked beside a fitted model: at once, at the best of many instants; in the likely courses of
one that takes its time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cablecomp.diagnosis.explain.courses import Course, before_all, from_each, instants_of, likely
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, Start, at_instants, inside_of
from cablecomp.diagnosis.explain.linear import Anchor, Best, best_start, contribution
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.signal.smoothing import FloatArray


def best_event(here: Anchor, h: Hypothesis) -> Best | None:
    """The best linear answer over the instants of an event, of either cable: those from which on what it does promises
    most, looked at more closely one by one."""
    base = h.starts[0].values
    signs = (1.0, -1.0) if h.two_sided else (1.0,)
    # the other cable is softer in its own way, not in the opposite one
    ways = ({**base, h.amount.name: sign * float(base[h.amount.name])} for sign in signs)
    one_way = replace(h, two_sided=False)
    found = [_at_once(here, replace(one_way, starts=(Start(way),)), h) for way in ways]
    return min((f for f in found if f is not None), key=lambda f: f[0], default=None)


def _at_once(here: Anchor, way: Hypothesis, h: Hypothesis) -> Best | None:
    """The best linear answer of an event this way, at the instants of the hypothesis and between them."""
    own = [float(s.values[h.instant]) for s in h.starts]
    spans = [inside_of(e) for e in here.fit.problem.evidence]
    closer = instants_of(here.fit.problem, LIMITS.course_instants).tolist()
    times = np.unique([*own, *(t for t in closer if any(a <= t <= b for a, b in spans))])
    middle = at_instants(way, (own[len(own) // 2],)).starts[0]
    sized = contribution(here, way, middle)
    if sized is None:
        return None
    inner = _inner_products(here, way, middle.values, sized[1], times)
    best = best_start(here, at_instants(way, own if inner is None else _peaks(times, *inner)))
    width = 0.5 * float(np.median(np.diff(times if inner is not None else np.sort(own))))
    for _ in range(2 if here.fit.problem.fine or inner is not None else 4):
        if best is None:
            return None
        t = float(best[1][h.instant])
        nearer = best_start(here, at_instants(way, (t - width, t + width)))
        best = nearer if nearer is not None and nearer[0] < best[0] else best
        width *= 0.5
    return best


def _peaks(times: FloatArray, gram: FloatArray, along: FloatArray) -> list[float]:
    """The instants from which on an event takes off most, apart from each other."""
    taken = np.where(along > 0.0, along**2, 0.0) / np.maximum(np.diag(gram), 1e-300)
    apart = len(times) // (2 * LIMITS.instants)
    found: list[int] = []
    for k in np.argsort(-taken):
        if len(found) < LIMITS.instants_run and all(abs(k - other) > apart for other in found):
            found.append(int(k))
    return [float(times[k]) for k in found]


def best_course(here: Anchor, h: Hypothesis, best: Best) -> Best | None:
    """The best linear answer over the likely courses of an event of this shape, of either cable."""
    values, size = best[1], best[3]
    sizes = (size, -size) if h.two_sided else (size,)
    starts = [
        Start({**values, h.amount.name: s, **h.course(c)}) for s in sizes for c in _likely(here, h, values, s)
    ]
    asked = (best_start(here, replace(h, starts=(s,))) for s in starts)
    found = sorted((f for f in asked if f is not None), key=lambda f: f[0])
    steps = h.effect.of_role("steps")
    if steps is None:
        return next(iter(found), None)
    evenly = next((f for f in found if steps.name not in f[1]), None)
    otherwise = min(best[0], best[0] if evenly is None else evenly[0])
    first = next((f for f in found if steps.name in f[1]), None)
    if first is None or first[0] >= otherwise:
        return evenly
    stepped = _stepped(here, h, first)
    return stepped if stepped[0] < LIMITS.stepped * otherwise else evenly


def _stepped(here: Anchor, h: Hypothesis, best: Best) -> Best:
    """An event in steps with these where they are best: between two rows no derivative tells where one is."""
    width = 0.08 * float(best[1][h.duration])
    for _ in range(4):
        begins, lasts = float(best[1][h.instant]), float(best[1][h.duration])
        moved = ((0, 1), (0, -1), (1, 0), (-1, 0), (1, -1), (-1, 1))
        near = tuple(
            Start({**best[1], h.instant: begins + a * width, h.duration: lasts + b * width}) for a, b in moved
        )
        closer = best_start(here, replace(h, starts=near))
        if closer is not None and closer[0] < best[0]:
            best = closer
        else:
            width *= 0.4
    return best


def _likely(here: Anchor, h: Hypothesis, values: Mapping[str, float | str], size: float) -> list[Course]:
    """The courses that promise most, of an event of this size."""
    instants = instants_of(here.fit.problem, LIMITS.course_instants)
    inner = _inner_products(here, h, values, size, instants)
    return [] if inner is None else likely(instants, *inner)[: LIMITS.courses]


def _inner_products(
    here: Anchor, h: Hypothesis, values: Mapping[str, float | str], size: float, instants: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Of what an event of this size does from each of these instants on, as it does were it over before the first
    sample: with one another, and with what is left; None where from most of them on it does nothing so, or it cannot be
    followed."""
    problem = here.fit.problem
    over = h.entry({**values, h.amount.name: size, h.instant: before_all(problem)})
    joint = problem.config.model_copy(update={"effect": (*problem.config.effect, over)})
    try:
        does, does_not = replace(problem, config=joint).misfits(here.fit.x), here.misfits
    except InputError:
        return None
    rows = from_each(problem, does, does_not, instants)
    beyond = here.beyond(np.concatenate([rows, np.zeros((len(problem.parameters), len(instants)))]))
    left = here.beyond(here.fit.residual)
    gram = beyond.T @ beyond
    nothing = float(np.median(np.diag(gram))) <= 1e-12 * float(left @ left)
    return None if nothing else (gram, beyond.T @ left)
