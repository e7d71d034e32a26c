"""How recordings' zeros depart from their session's: by chance, with the load, or because one was set anew.

What follows the load is a drive that yields, and a model's to explain: were it taken for chance, no model would be
asked for it. A zero far off all others was set anew, and says nothing of how the others scatter. Of few recordings it
is what they leave within that tells how far is far.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from cablecomp.effects.catalogue import role_of
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.limits import FAR, MOVED, OF_HISTORY, TELLING
from cablecomp.estimation.problem import Problem
from cablecomp.estimation.simulate import load_of
from cablecomp.signal.smoothing import FloatArray

FEWEST: Final = 8
"""Rows of a recording that say nothing of its zero."""
ROUNDS: Final = 30
"""Of reweighted least squares: ten settle it."""


class Departures(NamedTuple):
    """`sd`: by how much zeros depart by chance, in the channel's unit; `moved`: recordings whose zero was set anew;
    None where too few tell one by the others."""

    sd: float
    moved: frozenset[str] | None


def departures(problem: Problem, zeros: Mapping[str, FloatArray]) -> Departures | None:
    """How the recordings' zeros of one channel scatter; None where no session has several."""
    repeated = [r for r in problem.evidence if r.session in problem.repeated]
    if not repeated:
        return None
    departed = np.array([float(zeros[r.name][0] - zeros[r.session][0]) for r in repeated])
    usual = Departures(float(np.sqrt(np.mean(departed**2))), None)
    A = _lines(repeated, [load_of(problem.config, r.columns) for r in repeated])
    count = A.shape[1]
    if len(departed) < count + TELLING:
        return usual
    left = np.abs(departed - A @ _least_absolute(A, departed))
    scale = (
        float(np.median(np.sort(left)[count:])) / 0.6745
    )  # as many as there are coefficients are met exactly
    kept = left <= MOVED * scale
    free = int(kept.sum()) - count
    if free < TELLING:
        return usual
    left = departed[kept] - A[kept] @ np.linalg.lstsq(A[kept], departed[kept], rcond=None)[0]
    moved = frozenset(r.name for r, k in zip(repeated, kept, strict=True) if not k)
    return Departures(min(float(np.sqrt(left @ left / free)), usual.sd), moved)


def set_anew(
    problem: Problem,
    channel: str,
    zeros: Mapping[str, FloatArray],
    left: Sequence[FloatArray],
    history: float = 0.0,
) -> frozenset[str]:
    """Of few recordings those whose zero lies further from the others' of their session than all that is left within
    recordings could move it, or a `history` that nobody recorded [the channel's unit]. Where loads differ by more than
    they vary within, a drive that yields does it too; an event in the model moves zeros apart itself, and nothing is
    found beside it.

    `left`: misfit of the channel on judged rows, by recording, its zero taken off [the channel's unit]."""
    if any(role_of(p.base) == "instant" for p in problem.parameters):
        return frozenset(problem.weighing.moved.get(channel, ()))
    found: set[str] = set()
    for session in problem.repeated:
        seen = [
            (r, m[r.counted[channel]])
            for r, m in zip(problem.evidence, left, strict=True)
            if r.session == session and channel in r.counted and r.counted[channel].sum() > FEWEST
        ]
        if len(seen) < 2:
            continue
        within = float(np.sqrt(np.mean(np.concatenate([m - np.mean(m) for _, m in seen]) ** 2)))
        zero = np.array([float(zeros[r.name][0] + np.mean(m)) for r, m in seen])
        loads = [np.atleast_1d(load_of(problem.config, r.columns)) for r, _ in seen]
        varies = float(np.sqrt(np.mean([np.var(v) for v in loads])))
        load = np.array([float(np.mean(v)) for v in loads])
        usual = int(np.argmin([np.median(np.abs(zero - z)) for z in zero]))
        far = np.abs(zero - zero[usual]) > max(FAR * within, OF_HISTORY * history)
        alike = np.abs(load - load[usual]) <= varies
        found |= {r.name for (r, _), gone in zip(seen, far & alike, strict=True) if gone}
    return frozenset(found)


def _lines(recordings: Sequence[Evidence], loads: Sequence[FloatArray | float]) -> FloatArray:
    """A zero of each session's, and the mean and the RMS of the recordings' loads, each where it says more."""
    sessions = [r.session for r in recordings]
    A = np.column_stack([np.array([float(s == t) for s in sessions]) for t in dict.fromkeys(sessions)])
    sizes = np.array([float(np.sqrt(np.mean(np.square(v)))) for v in loads])
    for v in (np.array([float(np.mean(v)) for v in loads]), sizes):
        apart = v - A @ np.linalg.lstsq(A, v, rcond=None)[0]
        if float(np.ptp(apart)) > 0.1 * float(sizes.max()):
            A = np.column_stack((A, v / float(sizes.max())))
    return np.asarray(A, dtype=np.float64)


def _least_absolute(A: FloatArray, b: FloatArray) -> FloatArray:
    """x of least sum |b - A x| (by least squares with weights 1/sqrt(|b - A x|)): what one value far off does not
    move. Own code: `statsmodels`' quantile regression would bring pandas for these lines."""
    x = np.linalg.lstsq(A, b, rcond=None)[0]
    for _ in range(ROUNDS):
        w = 1.0 / np.sqrt(np.maximum(np.abs(b - A @ x), 1e-6 * float(np.abs(b).max()) + 1e-300))
        x = np.linalg.lstsq(w[:, None] * A, w * b, rcond=None)[0]
    return np.asarray(x, dtype=np.float64)
