"""The steps in which an event goes, out of what it does from each of many instants on (`courses`).

With G the inner products of these columns with one another and b those with what is left, steps at the places S take
off w b(S), w = G(S, S)^-1 b(S) their sizes, every one of the sign asked for.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from cablecomp.diagnosis.explain.courses import Course
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects.course import FURTHER
from cablecomp.signal.smoothing import FloatArray

ALIKE: Final = 1e-4
"""Share of a column that others beside cannot do, below which they are the same step."""
LEAST: Final = 1e-9
"""Share of a column's square that is added to it, so that columns that are nothing can be divided by."""
MOST_MOVES: Final = 6
"""Rounds in which steps are moved, one after another; few are needed."""


class Steps(NamedTuple):
    """Steps of an event among some instants: their places, their sizes, what they take off the square."""

    at: tuple[int, ...]
    sizes: FloatArray
    taken: float


def in_steps(gram: FloatArray, along: FloatArray, square: float) -> Steps | None:
    """The fewest steps, two to four, of one sign, that leave not much more than one more would; None where no two do.

    `gram`, `along` as of `likely`, `square` of what is left. The best two of all, then one at a time, each moved to its
    best place beside the others.
    """
    best = _best_two(gram, along)
    while best is not None and len(best.at) <= len(FURTHER):
        further = _one_more(gram, along, best)
        if further is None or not _worth(further, best, square):
            break
        best = further
    return best


def _worth(further: Steps, steps: Steps, square: float) -> bool:
    """Whether a step more takes off enough of what these leave of a square, and beside what they take off."""
    least = LIMITS.least_step * steps.taken
    gone = further.taken - steps.taken
    return gone > max(least, (1.0 - LIMITS.another_step) * (square - steps.taken))


def moved_closer(gram: FloatArray, along: FloatArray, steps: Steps) -> Steps:
    """The same steps, each where it takes off most beside the others, until none moves."""
    for _ in range(MOST_MOVES):
        before = steps
        for k in range(len(steps.at)):
            others = steps.at[:k] + steps.at[k + 1 :]
            moved = _added(gram, along, others)
            if moved is not None and moved.taken > steps.taken:
                steps = moved
        if steps is before:
            break
    return steps


def _best_two(gram: FloatArray, along: FloatArray) -> Steps | None:
    """The two of one sign that take off most together: `_added` beside every single one, all at once."""
    square = np.diag(gram)
    alone = np.maximum(square * (1.0 + LEAST), 1e-300)[:, None]
    # row j: beside step j, column k: what that one cannot do of it
    own = square - gram**2 / alone
    free = along - gram * (along[:, None] / alone)
    size = np.where(own > ALIKE * square, free / np.maximum(own, 1e-300), 0.0)
    rest = (along[:, None] - gram * size) / alone
    taken = along[:, None] * rest + along * size
    able = (size > 0.0) & (rest > 0.0)
    if not able.any():
        return None
    j, k = np.unravel_index(int(np.argmax(np.where(able, taken, -np.inf))), taken.shape)
    both = sorted([(int(j), float(rest[j, k])), (int(k), float(size[j, k]))])
    return Steps(tuple(at for at, _ in both), np.array([s for _, s in both]), float(taken[j, k]))


def _one_more(gram: FloatArray, along: FloatArray, steps: Steps) -> Steps | None:
    added = _added(gram, along, steps.at)
    return None if added is None else moved_closer(gram, along, added)


def _added(gram: FloatArray, along: FloatArray, others: tuple[int, ...]) -> Steps | None:
    """These steps and the one beside them that takes off most, all of the sign asked for; None where there is none."""
    o = list(others)
    # what the others cannot do of each column, and of what is left
    bound = gram[np.ix_(o, o)] + LEAST * np.diag(gram[o, o])
    per = np.linalg.lstsq(bound, np.column_stack((gram[o], along[o])))[0]
    own = np.diag(gram) - np.einsum("ok,ok->k", gram[o], per[:, :-1])
    free = along - gram[o].T @ per[:, -1]
    size = np.where(own > ALIKE * np.diag(gram), free / np.maximum(own, 1e-300), 0.0)
    rest = per[:, -1:] - per[:, :-1] * size
    taken = along[o] @ rest + along * size
    able = (size > 0.0) & np.all(rest > 0.0, axis=0)
    if not able.any():
        return None
    k = int(np.argmax(np.where(able, taken, -np.inf)))
    order = np.argsort([*o, k])
    places, sizes = np.array([*o, k])[order], np.append(rest[:, k], size[k])[order]
    return Steps(tuple(places.tolist()), sizes, float(taken[k]))


def course_in(steps: Steps, instants: FloatArray) -> Course:
    """The course that these steps at these instants make."""
    first, *further = instants[list(steps.at)].tolist()
    sizes = (steps.sizes[1:] / steps.sizes[0]).tolist()
    return Course(first, 0.0, 1.0, tuple((t - first, size) for t, size in zip(further, sizes, strict=True)))
