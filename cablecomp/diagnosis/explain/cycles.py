"""What comes and goes again and again, a payload that is picked up and put down: in which cycle.

With d_c(t) and d_s(t) what the effect's cosine and sine do while they are there, a course g(t) of 0 and 1 does about
a_c d_c + a_s d_s at all times and b_c g d_c + b_s g d_s beside it: what any cycle takes off follows from the inner
products of d_c and d_s over short stretches of time, without a run of the drive for each (`courses.py` does so for
events).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from cablecomp.diagnosis.explain.courses import before_all, from_each, instants_of
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, Start
from cablecomp.diagnosis.explain.linear import Anchor, Best, difference, linearly, with_effect
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.problem import Misfits
from cablecomp.signal.smoothing import FloatArray

CLOSER: Final = 6
"""How often a cycle's neighbours are looked at, twice as near each time."""
MOVES: Final = np.linspace(-1.0, 1.0, 5)
"""How far these stand off, over the largest that is looked at."""


class Cycle(NamedTuple):
    """From one coming to the next, when one was [s], and for what share of that time it stays."""

    period_s: float
    start_s: float
    held: float

    def turned(self, begin_s: float) -> Cycle:
        """There when this one is not; its first coming after `begin_s` is told."""
        later = (self.start_s + self.held * self.period_s - begin_s) % self.period_s
        return Cycle(self.period_s, begin_s + later, 1.0 - self.held)


@dataclass(frozen=True)
class Products:
    """Inner products, beyond what the anchor's parameters do, of what cosine and sine do in each stretch of time
    (2, k, 2, k), and with what is left (2, k); the stretches' ends [s]."""

    gram: FloatArray
    along: FloatArray
    ends_s: FloatArray

    @cached_property
    def by_stretch(self) -> FloatArray:
        """The first, a row for each stretch: k, 4 k."""
        return np.ascontiguousarray(np.moveaxis(self.gram, 1, 0).reshape(len(self.ends_s) - 1, -1))

    @cached_property
    def throughout(self) -> FloatArray:
        """Those of all stretches together with each: 2, 2, k."""
        return np.asarray(self.gram.sum(axis=1), dtype=np.float64)


def best_cycle(here: Anchor, h: Hypothesis, plain: Best) -> Best | None:
    """The best linear answer over the cycles in which an effect with a phase may come and go, of this shape; None where
    there is none, or recordings have clocks of their own, on which no cycle goes on."""
    if any(e.shift_s for e in here.fit.problem.evidence):
        return None
    products = _products(here, h, plain)
    if products is None:
        return None
    cycle, pairs = likeliest(products)
    always, held_up = pairs[:2], pairs[:2] + pairs[2:]
    size = min(float(np.linalg.norm(held_up)), h.amount.maximum)
    if not size > 0.0:
        return None
    share = float(np.clip(always @ held_up / (held_up @ held_up), 0.0, LIMITS.always))
    period, held, always_there = h.of_cycle
    values = {
        **plain.values,
        h.amount.name: size,
        h.phase: math.atan2(held_up[1], held_up[0]),
        period: cycle.period_s,
        h.cycle_start: cycle.start_s,
        held: cycle.held,
        always_there: share,
    }
    d = difference(here, h, values)
    if d is None:
        return None
    here.seen.keep(h, (Start(values),), here.fit, [(d, size)])
    return linearly(here, h, Start(values), d, size)


def _products(here: Anchor, h: Hypothesis, plain: Best) -> Products | None:
    """None where one of the two cannot be followed."""
    problem = here.fit.problem
    begins_s = np.concatenate([[before_all(problem)], instants_of(problem, LIMITS.cycle_stretches - 1)])
    ends_s = np.append(begins_s, max(float(e.columns["time_s"][-1]) for e in problem.evidence) + 1.0)
    parts = []
    for phase in (0.0, 0.5 * math.pi):
        over = _throughout(here, h, {**plain.values, h.amount.name: plain.size, h.phase: phase})
        if over is None:
            return None
        rows = from_each(problem, over, here.misfits, begins_s)
        rows[:, :-1] -= rows[:, 1:]
        parts.append(rows / plain.size)
    rows = np.concatenate(parts, axis=1)
    own = here.beyond(np.concatenate([rows, np.zeros((len(problem.parameters), rows.shape[1]))]))
    count = len(begins_s)
    gram, along = own.T @ own, own.T @ here.beyond(here.fit.residual)
    return Products(gram.reshape(2, count, 2, count), along.reshape(2, count), ends_s)


def _throughout(here: Anchor, h: Hypothesis, values: dict[str, float | str]) -> Misfits | None:
    """What the drive leaves with the effect there at all times."""
    try:
        return with_effect(here.fit.problem, h, values).misfits(here.fit.x)
    except InputError:
        return None


def likeliest(products: Products) -> tuple[Cycle, FloatArray]:
    """The cycle that takes off most, and what is always there and what comes and goes: cosine and sine of each. Of two
    that are there by turns, which do the same, the one while more is there."""
    begin, end = float(products.ends_s[1]), float(products.ends_s[-2])
    shortest = max(4.0 * (end - begin) / len(products.ends_s), LIMITS.least_cycle_s)
    periods = np.geomspace(shortest, max(2.0 * (end - begin), 2.0 * shortest), LIMITS.cycle_periods)
    starts = np.arange(LIMITS.cycle_starts) / LIMITS.cycle_starts
    best: list[tuple[float, Cycle]] = []
    for period in periods.tolist():
        cycles = [
            Cycle(period, begin + s * period, held) for s in starts.tolist() for held in LIMITS.cycle_held
        ]
        gone, _ = gains(products, cycles)
        k = int(np.argmax(gone))
        best.append((float(gone[k]), cycles[k]))
    best.sort(key=lambda found: -found[0])
    nearer = [_nearer(products, cycle) for _, cycle in best[: LIMITS.cycles]]
    gone, pairs = gains(products, nearer)
    k = int(np.argmax(gone))
    cycle, always, beside = nearer[k], pairs[k, :2], pairs[k, 2:]
    if np.linalg.norm(always) > np.linalg.norm(always + beside):
        cycle, always, beside = cycle.turned(begin), always + beside, -beside
    return cycle, np.concatenate([always, beside])


def _nearer(products: Products, cycle: Cycle) -> Cycle:
    """The cycle near this one that takes off most: ever closer about the best of a few longer, later, fuller ones."""
    width = 1.0
    for _ in range(CLOSER):
        near = [
            Cycle(
                cycle.period_s * math.exp(0.03 * longer),
                cycle.start_s + 0.05 * later * cycle.period_s,
                min(max(cycle.held + 0.1 * more, 0.02), 0.98),
            )
            for longer, later, more in itertools.product((width * MOVES).tolist(), repeat=3)
        ]
        gone, _ = gains(products, near)
        cycle = near[int(np.argmax(gone))]
        width *= 0.5
    return cycle


def gains(products: Products, cycles: Sequence[Cycle]) -> tuple[FloatArray, FloatArray]:
    """What each cycle takes off the cost, and with which cosine and sine at all times, and beside them while it is
    there."""
    courses = there(cycles, products.ends_s)
    count, stretches = courses.shape
    gram = np.empty((count, 2, 2, 2, 2))  # at all times or while there, cosine or sine; twice
    gram[:, 0, :, 0] = products.throughout.sum(axis=2)
    gram[:, 0, :, 1] = np.moveaxis(products.throughout @ courses.T, 2, 0)
    gram[:, 1, :, 0] = np.swapaxes(gram[:, 0, :, 1], 1, 2)
    each = (courses @ products.by_stretch).reshape(count, 4, stretches)
    gram[:, 1, :, 1] = (each @ courses[:, :, None]).reshape(count, 2, 2)
    along = np.empty((count, 2, 2))
    along[:, 0], along[:, 1] = products.along.sum(axis=1), courses @ products.along.T
    square, right = gram.reshape(-1, 4, 4), along.reshape(-1, 4)
    least = 1e-9 * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(4)
    pairs = np.linalg.solve(square + least, right[:, :, None])[:, :, 0]
    return 0.5 * np.sum(right * pairs, axis=1), pairs


def there(cycles: Sequence[Cycle], ends_s: FloatArray) -> FloatArray:
    """For what share of each stretch of time each of them is there, cycles x stretches."""
    period, start, held = np.array(cycles).T[:, :, None]
    since = (ends_s - start) / period
    whole = np.floor(since)
    so_long = period * (whole * held + np.minimum(since - whole, held))
    return np.asarray(np.diff(so_long) / np.maximum(np.diff(ends_s), 1e-12), dtype=np.float64)
