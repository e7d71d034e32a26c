"""What a fitted model says of an effect by a straight line: what the effect adds at a size worth seeing, and what of
that no step of the model's own parameters can do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from typing import NamedTuple

import numpy as np

from cablecomp.diagnosis.explain.hypotheses import Hypothesis, Start
from cablecomp.diagnosis.explain.seen import Added, Seen, Starts
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parameter import reach_of
from cablecomp.estimation.problem import Misfits, Problem, of_recording
from cablecomp.signal.smoothing import FloatArray


class Best(NamedTuple):
    """The best start: cost (and of each channel) after a linear step, values with the linear amount, contribution of
    the size asked, that size."""

    cost: float
    values: dict[str, float | str]
    d: FloatArray
    size: float
    by_channel: FloatArray


@dataclass(frozen=True)
class Anchor:
    """A point to ask from: a fit of the model so far, and an orthonormal basis of what its parameters can do.

    Below the residual's rows stands one for each parameter, what a step in it costs: far steps are beyond what a
    straight line tells, and a promise that rests on them is none.
    """

    fit: Fit
    Q: FloatArray
    J: FloatArray
    over: dict[tuple[int, tuple[object, ...]], Mapping[str, FloatArray]] = field(default_factory=dict)
    """Misfits of recordings that begin after an event, by the recording's place and what happened."""
    seen: Seen = field(default_factory=Seen)
    """What was asked beside earlier models does there."""

    @cached_property
    def rated(self) -> FloatArray | None:
        """The residual with the drive run on every sample; None where it cannot be followed so."""
        return self.fit.problem.finely().followed(self.fit.x)

    @cached_property
    def misfits(self) -> Misfits:
        """What the drive leaves as it stands here."""
        return self.fit.problem.misfits(self.fit.x)

    def with_event(self, h: Hypothesis, values: Mapping[str, float | str]) -> Misfits | None:
        """What it leaves with an event beside it; None where it cannot be followed so. A recording that ended before
        is as it was; in one that begins when all is over it is the same whenever and however that came."""
        course = h.course_by(values)
        begins, ends = course.instant_s, course.instant_s + course.lasts_s
        aside = h.of_course | {h.instant}
        what = (h.effect.id, *sorted((k, v) for k, v in values.items() if k not in aside))
        known: dict[int, Mapping[str, FloatArray]] = {}
        after = []
        for k, e in enumerate(self.fit.problem.evidence):
            first, last = (float(e.columns["time_s"][at]) for at in (0, -1))
            if last < begins:
                known[k] = of_recording(self.misfits, k)
            elif first >= ends:
                after.append(k)
                if (k, what) in self.over:
                    known[k] = self.over[k, what]
        try:
            found = with_effect(self.fit.problem, h, values).misfits(self.fit.x, known)
        except InputError:
            return None
        self.over.update({(k, what): of_recording(found, k) for k in after})
        return found

    def step(self, v: FloatArray) -> FloatArray:
        """Where the anchor's parameters go, by a linear step, to make up for a residual v."""
        scale = np.sqrt(np.maximum(np.sum(self.J**2, axis=0), 1e-300))
        return np.asarray(-np.linalg.lstsq(self.J / scale, self._below(v))[0] / scale, dtype=np.float64)

    def beyond(self, v: FloatArray) -> FloatArray:
        """What the anchor's parameters cannot do of v."""
        whole = self._below(v)
        return np.asarray(whole - self.Q @ (self.Q.T @ whole), dtype=np.float64)

    def _below(self, v: FloatArray) -> FloatArray:
        return np.concatenate([v, np.zeros((self.J.shape[1], *v.shape[1:]))])


def anchor(fit: Fit, reach: float = LIMITS.reach, seen: Seen | None = None) -> Anchor:
    """An anchor at a fit (or any evaluated point); `reach`: share of the cost that a step by one in a parameter
    costs; `seen`: what was asked elsewhere."""
    seen = Seen() if seen is None else seen
    count = fit.J.shape[1]
    cost = np.sqrt(reach * 2.0 * fit.cost) * np.eye(count)
    J = np.concatenate([fit.J, cost])
    if not count:
        return Anchor(fit, np.empty((len(J), 0)), J, seen=seen)
    scale = np.sqrt(np.maximum(np.sum(J**2, axis=0), 1e-300))
    u, s, _ = np.linalg.svd(J / scale, full_matrices=False)
    return Anchor(fit, u[:, s > 1e-6], J, seen=seen)


def best_start(here: Anchor, h: Hypothesis, about: float | None = None) -> Best | None:
    """The best linear answer over the hypothesis's starts; `about`: a size that is known to be worth seeing."""
    answers: list[Best | None] = []
    size = about  # what was worth seeing at one start is about that at the next
    # an event's instants are looked at coarsely where every run is dear
    dear = h.has_instant and here.fit.problem.fine
    starts = h.starts[1::3] if len(h.starts) > 9 and dear else h.starts
    for (start,) in worth_asking(here, h, [(s,) for s in starts]):
        found = contribution(here, h, start, size)
        # of an event the instant decides, which is looked for ever more closely
        if about is None and not h.has_instant:
            here.seen.keep(h, (start,), here.fit, [] if found is None else [found])
        if found is not None:
            d, size = found
            answers.append(linearly(here, h, start, d, size))
    best = _lowest(answers)
    if best is None or not h.effect.saturates:
        return best
    answers = [best]
    low, high = reach_of(h.amount, here.fit.problem.config)
    for part in LIMITS.sizes:
        other = min(max(part * best.size, low), high)
        shown = difference(here, h, {**best.values, h.amount.name: other})
        if shown is not None:
            answers.append(linearly(here, h, Start(best.values), shown, other))
    return _lowest(answers)


def best_pair(here: Anchor, h: Hypothesis, shapes: Sequence[Mapping[str, float]]) -> Best | None:
    """The best linear answer of amount and phase as a pair (a cos, a sin), over these shapes and the hypothesis's
    starts: the first half of those are cosines, the others their sines."""
    half = len(h.starts) // 2
    both = zip(h.starts[:half], h.starts[half:], strict=True)
    pairs = [tuple(Start({**s.values, **f}) for s in pair) for pair in both for f in shapes]
    answers: list[Best | None] = []
    for cosine, sine in worth_asking(here, h, pairs):
        first = contribution(here, h, cosine)
        second = contribution(here, h, sine, first and first[1])
        found = [] if first is None or second is None else [first, second]
        here.seen.keep(h, (cosine, sine), here.fit, found)
        if found:
            answers.append(_paired(here, h, cosine, found))
    return _lowest(answers)


def worth_asking(here: Anchor, h: Hypothesis, starts: Sequence[Starts]) -> list[Starts]:
    """Of the points to ask from those that what was seen beside earlier models puts first; all of them where something
    has not been asked."""
    return [starts[k] for k in _first([promised(here, h, s) for s in starts])]


def shapes_worth_asking(
    here: Anchor, h: Hypothesis, shapes: Sequence[tuple[Start, ...]]
) -> list[tuple[Start, ...]]:
    """The same of shapes, each by the best of its starts."""
    costs = [[promised(here, h, (s,)) for s in starts] for starts in shapes]
    least = [None if None in cs else min(c for c in cs if c is not None) for cs in costs]
    return [shapes[k] for k in _first(least)]


def _first(costs: Sequence[float | None]) -> list[int]:
    """Places of the least of these costs, so many as are asked again; all places where one is not known."""
    known = [c for c in costs if c is not None]
    if len(known) < len(costs):
        return list(range(len(costs)))
    return sorted(sorted(range(len(costs)), key=known.__getitem__)[: LIMITS.asked_again])


def promised(here: Anchor, h: Hypothesis, starts: Starts) -> float | None:
    """Cost after a linear step by what was seen from there beside an earlier model; None where nothing was."""
    found = here.seen.recall(h, starts, here.fit)
    if found is None:
        return None
    if not found:
        return inf
    best = _paired(here, h, starts[0], found) if len(starts) > 1 else linearly(here, h, starts[0], *found[0])
    return inf if best is None else best.cost


def likeliest(
    here: Anchor, pool: Sequence[Hypothesis], most: int, besides: Callable[[Hypothesis], bool]
) -> list[Hypothesis]:
    """Of the hypotheses so many that promise most by what was seen of them (half where every run is dear), those of
    which nothing was, or not enough (of what saturates other sizes do other things), and `besides` whatever they
    promise."""
    most //= 2 if here.fit.problem.fine else 1
    costs: dict[str, float] = {}
    for h in pool:
        starts = [] if h.effect.saturates else here.seen.starts_of(h)
        known = (promised(here, h, s) for s in starts)
        costs[h.name] = min((c for c in known if c is not None), default=-inf)
    told = sorted(c for c in costs.values() if c > -inf)
    worst = told[most - 1] if len(told) > most else inf
    return [h for h in pool if costs[h.name] <= worst or besides(h)]


def _lowest(answers: Sequence[Best | None]) -> Best | None:
    return min((a for a in answers if a is not None), key=lambda a: a.cost, default=None)


def linearly(here: Anchor, h: Hypothesis, start: Start, d: FloatArray, size: float) -> Best | None:
    """The linear answer by what a start adds at a size; None where that is nothing that the anchor cannot do."""
    left, own = here.beyond(here.fit.residual), here.beyond(d)
    energy, square = float(left @ left), float(own @ own)
    if square <= 1e-12 * energy:
        return None
    factor = float(left @ own) / square
    if not h.two_sided:
        factor = max(factor, 0.0)
    # a mirrored event's size is negative
    low, high = sorted(end / size for end in reach_of(h.amount, here.fit.problem.config))
    factor = min(max(factor, low), high)
    cost = 0.5 * (energy - 2.0 * factor * float(left @ own) + factor**2 * square)
    values = {**start.values, h.amount.name: size * (factor if factor != 0.0 else 0.1)}
    return Best(cost, values, d, size, by_channel(here.fit.problem, left - factor * own))


def _paired(here: Anchor, h: Hypothesis, cosine: Start, found: Sequence[Added]) -> Best | None:
    """The linear answer by what a cosine and a sine add; None where that is nothing."""
    (d0, s0), (d1, s1) = found
    left = here.beyond(here.fit.residual)
    own = np.column_stack((here.beyond(d0) / s0, here.beyond(d1) / s1))
    scale = np.maximum(np.linalg.norm(own, axis=0), 1e-300)
    pair = np.linalg.lstsq(own / scale, left, rcond=1e-6)[0] / scale
    pair = pair * min(1.0, h.amount.maximum / max(float(np.hypot(*pair)), 1e-300))
    rest = left - own @ pair
    size, phase = float(np.hypot(*pair)), float(np.arctan2(pair[1], pair[0]))
    if not size > 0.0:
        return None
    values = {**cosine.values, h.amount.name: size, h.phase: phase}
    d = (d0 / s0 * np.cos(phase) + d1 / s1 * np.sin(phase)) * size
    return Best(0.5 * float(np.sum(rest**2)), values, d, size, by_channel(here.fit.problem, rest))


def by_channel(problem: Problem, residual: FloatArray) -> FloatArray:
    """Half the sum of squares of each channel of a residual, with what priors and steps cost beside it."""
    square = np.array([float(np.sum(residual[s] ** 2)) for s in problem.spans().values()])
    beside = float(np.sum(residual**2) - np.sum(square))
    return np.asarray(0.5 * (square + beside), dtype=np.float64)


def worth_a_shape(shaped: FloatArray, plain: FloatArray, share: float = LIMITS.shaped) -> bool:
    """Whether a shape leaves less than that share of some channel's cost without it (`by_channel`), and less in all: a
    motor's torque in which an inertia is missing would hide what it wins."""
    return bool(np.any(shaped < share * plain) and np.sum(shaped) < np.sum(plain))


def better_shaped(shaped: Fit, plain: Fit) -> bool:
    """The same of fits."""
    return worth_a_shape(
        by_channel(shaped.problem, shaped.residual), by_channel(plain.problem, plain.residual)
    )


NOTHING = 1e6
"""How many times as large a contribution has to be to be worth seeing, so that it counts as none."""


def contribution(
    here: Anchor, h: Hypothesis, start: Start, about: float | None = None
) -> tuple[FloatArray, float] | None:
    """What the effect adds to the prediction (weighted) at a size that is about as large as the residual, looked for
    from `about` on, or from the start's own."""
    wanted = max(float(np.linalg.norm(here.fit.residual)), 1.0)
    size = float(start.values[h.amount.name]) if about is None else about
    low, high = reach_of(h.amount, here.fit.problem.config)
    result = None
    size = min(max(size, low), high) if size else size
    for _ in range(4):
        d = difference(here, h, {**start.values, h.amount.name: size})
        if d is None:
            size *= 0.1
            continue
        result = (d, size)
        length = float(np.linalg.norm(here.beyond(d))) + 0.1 * float(np.linalg.norm(d))
        ratio = wanted / max(length, 1e-9 * wanted)
        wider = min(max(size * float(np.clip(ratio, 1e-3, 1e3)), low), high)
        # what shows nothing at a plausible size (an event before all rows) shows nothing at any
        if 0.4 < ratio < 2.5 or ratio > NOTHING or wider == size:
            break
        size = wider
    return result


def difference(here: Anchor, h: Hypothesis, values: dict[str, float | str]) -> FloatArray | None:
    """What the effect adds at these values. A law with rates is run on every sample, with it and without: rows thinned
    by travel know no acceleration."""
    problem, before = here.fit.problem, here.fit.residual
    if h.has_instant:
        misfits = here.with_event(h, values)
        return None if misfits is None else before - problem.weighted(here.fit.x, misfits)
    if h.effect.rates and not problem.fine:
        if here.rated is None:
            return None
        problem, before = problem.finely(), here.rated
    found = with_effect(problem, h, values).followed(here.fit.x)
    return None if found is None else before - found


def with_effect(problem: Problem, h: Hypothesis, values: Mapping[str, float | str]) -> Problem:
    """The problem with an effect beside what the drive has, nothing of it free."""
    joint = problem.config.model_copy(update={"effect": (*problem.config.effect, h.entry(values))})
    return replace(problem, config=joint)
