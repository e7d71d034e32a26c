"""Laws without a physical name: what is left of the joint angle as a series in one channel, or in that of each session
by itself, kept if it holds on data left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from cablecomp.config import Empirical
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.explain.scores import ScoreDifference, score_difference
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.signal.smoothing import BoolArray, FloatArray, IntArray

TERMS = 10
"""Chebyshev terms after the constant: resolves a tenth of the stroke, as fine as the ripple of a strand on a
drum is."""
RIDGE = 1e-3
"""Share of the terms' mean energy that holds their coefficients back."""
CURVES_OVER = ("motor_position_rad", "joint_torque_Nm")
OWN_CURVE_OVER = "motor_position_rad"
"""What a curve of each session's own is looked for over: a motor that is mounted anew counts its angle from elsewhere,
and a cable that is led anew meets other places of its drums and guides."""
WAVE_OVER = "motor_position_rad"
"""What a wave is looked for over: teeth, poles, an encoder's graduation."""
FEWEST_WAVES, MOST_PER_TURN = 2.0, 60.0
"""Periods of a wave: so many at least in what its channel covers, so many at most per revolution."""
PER_PERIOD = 4.0
"""Steps of a wave's frequency, per period over what its channel covers."""
SHORTEST = 3.0
"""Judged rows per period, in the median, below which rows do not tell a wave."""


@dataclass(frozen=True)
class Found:
    """A law that holds, as the configuration has it, one of each session where it is that one's own, and its score
    against the model without it."""

    laws: tuple[Empirical, ...]
    difference: ScoreDifference

    @property
    def law(self) -> Empirical:
        """The law, of several sessions' the first."""
        return self.laws[0]


def empirical_laws(model: Model, groups: Groups) -> list[Found]:
    """The series and the wave that hold, best first, each fitted to what the ones before left."""
    rows = _joint_rows(model, groups)
    found: list[Found] = []
    asked: list[Callable[[_Rows], _Held | None]] = [*(partial(_curve, c) for c in CURVES_OVER), _wave]
    if len(model.fit.problem.sessions) > 1:
        asked.append(_own_curve)
    while True:
        held = [(h, ask) for ask in asked if (h := ask(rows)) is not None]
        if not held:
            return found
        best, by = max(held, key=lambda pair: pair[0].found.difference.gain)
        found.append(best.found)
        asked.remove(by)
        rows = replace(rows, left=rows.left - best.predicted)


@dataclass(frozen=True)
class _Rows:
    """The joint angle's rows: what is left of them (weighted), their weights over sigma, and what is left out in
    turn."""

    evidence: Sequence[Evidence]
    left: FloatArray
    weight: FloatArray
    groups: Groups

    def at(self, here: BoolArray, evidence: Sequence[Evidence]) -> _Rows:
        """The same of some recordings, whose rows these are."""
        g = self.groups
        groups = Groups(g.block[here], g.fold[here], g.by, g.channel[here])
        return _Rows(evidence, self.left[here], self.weight[here], groups)


class _Held(NamedTuple):
    found: Found
    predicted: FloatArray


def _joint_rows(model: Model, groups: Groups) -> _Rows:
    problem = model.fit.problem
    first = problem.spans()[JOINT].start
    rows = slice(first, first + len(problem.owners(JOINT)))
    weight = np.concatenate([e.weight[e.counted[JOINT]] for e in problem.evidence])
    block = groups.block[rows]
    here = Groups(block, groups.fold[rows], groups.by, np.zeros_like(block))
    return _Rows(problem.evidence, model.left_out[rows].copy(), weight / problem.weighing.sigma[JOINT], here)


def _own_curve(rows: _Rows) -> _Held | None:
    """The series of each session's own, about where its motor counts from, of those sessions of which data left out
    tell one."""
    laws, predicted = [], np.zeros(len(rows.left))
    for session in dict.fromkeys(e.session for e in rows.evidence):
        own = _rows_of(session, rows.evidence)
        mine = rows.at(own, [e for e in rows.evidence if e.session == session])
        series = _series(OWN_CURVE_OVER, mine)
        if series is None:
            continue
        law, there = series
        helps = score_difference(mine.left - there, mine.left, mine.groups).gain > 0.0
        if helps and _holds_elsewhere(OWN_CURVE_OVER, mine):
            laws.append(law.model_copy(update={"id": f"{law.id}_per_session", "session": session}))
            predicted[own] = there
    step = score_difference(rows.left - predicted, rows.left, rows.groups)
    return _Held(Found(tuple(laws), step), predicted) if laws and _holds(step) else None


def _curve(channel: str, rows: _Rows) -> _Held | None:
    """The series in one channel, fitted to what is left; None where it does not hold on data left out."""
    series = _series(channel, rows)
    if series is None:
        return None
    law, predicted = series
    step = score_difference(rows.left - predicted, rows.left, rows.groups)
    return _Held(Found((law,), step), predicted) if _holds(step) and _holds_elsewhere(channel, rows) else None


def _series(channel: str, rows: _Rows) -> tuple[Empirical, FloatArray] | None:
    """The series in one channel, and what it predicts of rows that were left out; None where it does not move."""
    if not all(channel in e.columns for e in rows.evidence):
        return None
    x = _read(channel, rows.evidence)
    if not np.ptp(x) > 0.0:
        return None
    centre, half = 0.5 * float(x.max() + x.min()), 0.5 * float(np.ptp(x))
    T = _basis(x, centre, half) * rows.weight[:, None]
    name = "ripple_by_" + channel.removesuffix("_rad").removesuffix("_Nm").replace("position", "angle")
    law = Empirical(
        id=name, law="chebyshev", of=channel, centre=centre, half_width=half,
        coefficients_rad=(0.0, *(float(c) for c in _ridge(T, rows.left))),
    )  # fmt: skip
    return law, _crossed(T, rows.left, rows.groups.fold)


def _read(channel: str, evidence: Sequence[Evidence]) -> FloatArray:
    return np.concatenate([e.at_rows(channel)[e.counted[JOINT]] for e in evidence])


def _count(e: Evidence) -> int:
    return int(e.counted[JOINT].sum())


def _rows_of(session: str, evidence: Sequence[Evidence]) -> BoolArray:
    """Which rows are a session's; all of them where it has no name."""
    return np.repeat([session in ("", e.session) for e in evidence], [_count(e) for e in evidence])


def _wave(rows: _Rows) -> _Held | None:
    """The wave over the motor's angle, its frequency the best of a grid, chosen anew wherever data are left out; None
    where it does not hold on these."""
    parts = [e.at_rows(WAVE_OVER)[e.counted[JOINT]] for e in rows.evidence]
    x, grid = np.concatenate(parts), _frequencies(parts)
    if not len(grid):
        return None
    every = [_waves(x, k) * rows.weight[:, None] for k in grid]
    predicted = np.zeros(len(x))
    for k in np.unique(rows.groups.fold):
        out = rows.groups.fold == k
        here = [T[~out] for T in every]
        T = _waves(x, _best(grid, here, x[~out], rows.weight[~out], rows.left[~out])) * rows.weight[:, None]
        predicted[out] = T[out] @ _ridge(T[~out], rows.left[~out])
    step = score_difference(rows.left - predicted, rows.left, rows.groups)
    if not _holds(step):
        return None
    frequency = _best(grid, every, x, rows.weight, rows.left)
    law = Empirical(
        id="wave_by_motor_angle", law="fourier", of=WAVE_OVER, half_width=np.pi / frequency,
        coefficients_rad=(0.0, *(float(c) for c in _ridge(_waves(x, frequency) * rows.weight[:, None], rows.left))),
    )  # fmt: skip
    return _Held(Found((law,), step), predicted)


def _best(
    grid: FloatArray, every: Sequence[FloatArray], x: FloatArray, weight: FloatArray, left: FloatArray
) -> float:
    """The frequency whose wave takes most off what is left (weighted), to a sixteenth of the grid's step; `every`: the
    waves of the grid, weighted."""
    top = int(np.argmax([_taken_off(T, left) for T in every]))
    near = grid[top] + (grid[1] - grid[0]) * np.linspace(-1.0, 1.0, 33) if len(grid) > 1 else grid
    fine = [_taken_off(_waves(x, k) * weight[:, None], left) for k in near]
    return float(near[int(np.argmax(fine))])


def _frequencies(parts: Sequence[FloatArray]) -> FloatArray:
    """Frequencies [1/rad of the phase per rad] at which a wave is asked for: from two periods over what the channel
    covers to as many as the rows resolve; none where it hardly moves."""
    reach = float(np.ptp(np.concatenate(parts)))
    steps = np.concatenate([np.abs(np.diff(v)) for v in parts])
    usual = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    if reach <= 0.0 or usual <= 0.0:
        return np.empty(0)
    low, step = FEWEST_WAVES * 2.0 * np.pi / reach, 2.0 * np.pi / (PER_PERIOD * reach)
    high = min(MOST_PER_TURN, 2.0 * np.pi / (SHORTEST * usual))
    return np.arange(low, high, step)


def _waves(x: FloatArray, frequency: float) -> FloatArray:
    return np.column_stack((np.sin(frequency * x), np.cos(frequency * x)))


def _taken_off(T: FloatArray, y: FloatArray) -> float:
    """Square that the columns take off y."""
    along = T.T @ y
    return float(along @ np.linalg.solve(T.T @ T + 1e-12 * np.trace(T.T @ T) * np.eye(T.shape[1]), along))


def _holds(step: ScoreDifference) -> bool:
    """Whether a law takes off enough on data left out."""
    return step.z > LIMITS.z and step.gain > LIMITS.gain


def _holds_elsewhere(channel: str, rows: _Rows) -> bool:
    """Whether the series helps on recordings that reach about as far in its channel, learnt from those that reach less
    and more, and on those that reach furthest: a curve over the load may be what another law does at these loads, and
    mislead at others."""
    x = _read(channel, rows.evidence)
    counts = [_count(e) for e in rows.evidence]
    owner = np.repeat(np.arange(len(counts)), counts)
    away = np.abs(x - np.median(x))
    reach = np.array([np.max(away[owner == k], initial=0.0) for k in range(len(counts))])
    order = np.argsort(reach)
    level = np.empty(len(counts), dtype=np.int64)
    steps = reach[order][1:] > LIMITS.law_reach * reach[order][:-1]
    level[order] = np.concatenate([[0], np.cumsum(steps)])
    of_row, furthest = level[owner], int(level.max())
    if len(counts) < LIMITS.recordings or furthest == 0:
        return True
    predicted = np.zeros(len(x))
    for k in range(furthest + 1):
        out = of_row == k
        seen = x[~out]
        centre, half = 0.5 * float(seen.max() + seen.min()), 0.5 * float(np.ptp(seen))
        T = _basis(x, centre, half) * rows.weight[:, None]
        predicted[out] = T[out] @ _ridge(T[~out], rows.left[~out])
    there = replace(rows.groups, block=np.where(of_row == furthest, rows.groups.block, -1))
    return all(score_difference(rows.left - predicted, rows.left, g).gain > 0.0 for g in (rows.groups, there))


def value_of(law: Empirical, recording: Evidence) -> FloatArray:
    """What a law adds to the joint angle [rad] on a recording's judged rows, as the observer runs it: nothing in
    another session than its own."""
    if law.session not in ("", recording.session):
        return np.zeros(len(recording.rows))
    return np.asarray(
        _of(law, recording.at_rows(law.of)) @ np.array(law.coefficients_rad[1:]), dtype=np.float64
    )


def refitted(
    laws: Sequence[Empirical], recordings: Sequence[Evidence], left: Sequence[FloatArray]
) -> list[Empirical]:
    """The same series fitted to other data, a wave's frequency chosen anew: `left`, each recording's misfit [rad] on
    counted rows, one law after the other; nothing of a session that is not there."""
    weight = np.concatenate([e.weight[e.counted[JOINT]] for e in recordings])
    rest = np.concatenate(left)
    found = []
    for law in laws:
        parts = [e.at_rows(law.of)[e.counted[JOINT]] for e in recordings]
        x = np.concatenate(parts)
        if law.law == "fourier" and len(grid := _frequencies(parts)):
            every = [_waves(x, k) * weight[:, None] for k in grid]
            frequency = _best(grid, every, x, weight, rest * weight)
            law = law.model_copy(update={"half_width": np.pi / frequency})
        T = _of(law, x) * _rows_of(law.session, recordings)[:, None]
        c = _ridge(T * weight[:, None], rest * weight)
        rest = rest - T @ c
        found.append(law.model_copy(update={"coefficients_rad": (0.0, *(float(v) for v in c))}))
    return found


def _of(law: Empirical, x: FloatArray) -> FloatArray:
    """What a law's coefficients after the constant belong to."""
    return (
        _waves(x, np.pi / law.half_width) if law.law == "fourier" else _basis(x, law.centre, law.half_width)
    )


def _basis(x: FloatArray, centre: float, half: float) -> FloatArray:
    """Chebyshev polynomials after the constant of a channel held within its range."""
    inside = np.clip((x - centre) / half, -1.0, 1.0)
    return np.asarray(np.polynomial.chebyshev.chebvander(inside, TERMS)[:, 1:], dtype=np.float64)


def _ridge(T: FloatArray, y: FloatArray) -> FloatArray:
    if not T.any():
        return np.zeros(T.shape[1])
    scale = RIDGE * float(np.trace(T.T @ T)) / T.shape[1]
    return np.asarray(np.linalg.solve(T.T @ T + scale * np.eye(T.shape[1]), T.T @ y), dtype=np.float64)


def _crossed(T: FloatArray, y: FloatArray, fold: IntArray) -> FloatArray:
    """Prediction of each fold from the others."""
    predicted = np.zeros(len(y))
    for k in np.unique(fold):
        out = fold == k
        predicted[out] = T[out] @ _ridge(T[~out], y[~out])
    return predicted
