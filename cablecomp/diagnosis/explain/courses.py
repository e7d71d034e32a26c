"""What an event does from one instant on: with these as its steps it may happen at once, evenly, in steps, again.

Where it was over before the first sample it does d(t); from an instant t_k on, about d(t) 1(t >= t_k), zeros found
anew.
A course g that rises by w_k at t_k does sum_k w_k d 1(t >= t_k): what any course would take off follows from the inner
products of these columns alone, without a run of the drive for each.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.problem import Misfits, Problem
from cablecomp.signal.smoothing import FloatArray


class Course(NamedTuple):
    """How an event goes: from when [s], how long [s] (0: at once) and how curved (1: evenly); or in steps, each further
    one so long after the first [s] and so many times as large."""

    instant_s: float
    duration_s: float
    curve: float = 1.0
    steps: tuple[tuple[float, float], ...] = ()

    @property
    def lasts_s(self) -> float:
        """From its first to its last [s]."""
        return self.steps[-1][0] if self.steps else self.duration_s


def how_far(course: Course, time_s: FloatArray) -> FloatArray:
    """g, how far an event has gone at these times, 0..1."""
    since_s = time_s - course.instant_s
    if not course.steps:
        return _gone(since_s, np.array(course.duration_s), np.array(course.curve))
    steps = ((0.0, 1.0), *course.steps)
    gone = np.array([size * (since_s >= after) for after, size in steps])
    return np.asarray(np.sum(gone, axis=0) / sum(size for _, size in steps), dtype=np.float64)


def _gone(since_s: FloatArray, duration_s: FloatArray, curve: FloatArray) -> FloatArray:
    """How far events have gone so long after their instants."""
    share = np.where(duration_s > 0.0, np.clip(since_s / np.maximum(duration_s, 1e-300), 0.0, 1.0), 1.0)
    share = np.where(curve >= 1.0, share**curve, 1.0 - (1.0 - share) ** (1.0 / curve))
    return np.where(since_s >= 0.0, share, 0.0)


def before_all(problem: Problem) -> float:
    """An instant before the first sample of all [s]."""
    return min(float(e.columns["time_s"][0]) for e in problem.evidence) - 1.0


def instants_of(problem: Problem, count: int) -> FloatArray:
    """So many instants, evenly over the rows that count, with some before and some after [s]."""
    time = np.concatenate([e.at_rows("time_s")[e.counted[c]] for e in problem.evidence for c in e.counted])
    shares = np.linspace(LIMITS.edge, 1.0 - LIMITS.edge, count)
    return np.asarray(np.quantile(time, shares), dtype=np.float64)


def from_each(problem: Problem, over: Misfits, none: Misfits, instants: FloatArray) -> FloatArray:
    """What an event takes off the residual's data rows from each of these instants on, a column each: `over` and `none`
    are the misfits with it over before the first sample and without it."""
    return problem.rows({
        c: [
            (b - a)[:, None] * (e.at_rows("time_s")[:, None] >= instants)
            for e, a, b in zip(problem.evidence, over[c], none[c], strict=True)
        ]
        for c in problem.channels
    })  # fmt: skip


def likely(instants: FloatArray, gram: FloatArray, along: FloatArray) -> list[Course]:
    """The course that takes off most of what is left, of each curve, best first: evenly for a while, or ever more
    slowly or quickly.

    `gram` (k, k), `along` (k,): inner products of the columns of `from_each` with one another and with what is left.
    """
    courses, rises = _courses(tuple(instants.tolist()))
    taken = _taken(rises, gram, along)
    best: dict[float, Course] = {}
    for k in np.argsort(-taken):
        if taken[k] > 0.0:
            best.setdefault(courses[k].curve, courses[k])
    closer = [_closer(instants, gram, along, c) for c in best.values()]
    return [c for _, c in sorted(closer, key=lambda found: -found[0])]


def _taken(rises: FloatArray, gram: FloatArray, along: FloatArray) -> FloatArray:
    """What each course takes off the square, at its best size of the sign asked for."""
    gain = rises @ along
    square = np.einsum("ck,ck->c", rises @ gram, rises)
    return np.where((square > 0.0) & (gain > 0.0), gain**2 / np.maximum(square, 1e-300), 0.0)


def _closer(instants: FloatArray, gram: FloatArray, along: FloatArray, c: Course) -> tuple[float, Course]:
    """The best course of as many steps about this one, and what it takes off."""
    taken = 0.0
    width = 0.15
    for _ in range(4):
        moves = width * np.linspace(-1.0, 1.0, 7)
        near = [
            c._replace(instant_s=c.instant_s + a * c.duration_s, duration_s=c.duration_s * (1.0 + b))
            for a, b in itertools.product(moves.tolist(), moves.tolist())
        ]
        near = [n for n in near if _inside(instants, n)] or [c]
        found = _taken(_rises(instants, near), gram, along)
        k = int(np.argmax(found))
        taken, c = float(found[k]), near[k]
        width *= 0.4
    return taken, c


@lru_cache(maxsize=8)
def _courses(instants: tuple[float, ...]) -> tuple[list[Course], FloatArray]:
    """Courses, and how far each rises at each of the instants (courses x instants)."""
    first, last = instants[0], instants[-1]
    found = []
    for duration in np.geomspace(LIMITS.briefest, 1.0, LIMITS.durations) * (last - first):
        starts = np.arange(first, last, max(0.1 * duration, (last - first) / len(instants)))
        for start, curve in itertools.product(starts.tolist(), (1.0, *LIMITS.curved)):
            found.append(Course(start, float(duration), curve))
    at = np.array(instants)
    found = [c for c in found if _inside(at, c)]
    return found, _rises(at, found)


def _inside(instants: FloatArray, c: Course) -> bool:
    """Whether its beginning has a before and an after; it may go on."""
    return bool(instants[0] <= c.instant_s <= instants[-1])


def _rises(instants: FloatArray, courses: Sequence[Course]) -> FloatArray:
    """How far each course rises about each of the instants."""
    begins, lasts, curve = (
        np.array(values)[:, None] for values in zip(*(c[:3] for c in courses), strict=True)
    )
    return np.asarray(np.diff(_gone(_between(instants) - begins, lasts, curve)), dtype=np.float64)


def _between(instants: FloatArray) -> FloatArray:
    """Edges halfway between the instants."""
    middle = 0.5 * (instants[1:] + instants[:-1])
    return np.concatenate([[2.0 * instants[0] - middle[0]], middle, [2.0 * instants[-1] - middle[-1]]])
