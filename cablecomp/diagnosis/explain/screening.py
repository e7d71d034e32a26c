"""Ask every hypothesis cheaply: how far would the misfit fall, by one or two simulations beside a fitted model.

At an anchor (a fit, or the nominal drive) with residual r and derivative J, an effect's contribution d = r(0) -
r(a) at a size a that is worth seeing tells the cost after a joint linear step. What promises anything is then
fitted for a few steps from each anchor: where calibration has paid for a missing effect, the way there begins
at the nominal drive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablecomp.config import EffectEntry
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, Start, at_instants, runs_away
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import Fit, approach, inside
from cablecomp.estimation.multi_start import lowest, multi_start
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Anchor:
    """A point to ask from: a fit of the model so far, and an orthonormal basis of what its parameters can do.

    Below the residual's rows stands one for each parameter, what a step in it costs: far steps are beyond what a
    straight line tells, and a promise that rests on them is none.
    """

    fit: Fit
    Q: FloatArray
    J: FloatArray

    @cached_property
    def rated(self) -> FloatArray | None:
        """The residual with the drive run on every sample; None where it cannot be followed so."""
        return self.fit.problem.finely().followed(self.fit.x)

    def step(self, v: FloatArray) -> FloatArray:
        """Where the anchor's parameters go, by a linear step, to make up for a residual v."""
        scale = np.sqrt(np.maximum(np.sum(self.J**2, axis=0), 1e-300))
        return np.asarray(-np.linalg.lstsq(self.J / scale, self._below(v))[0] / scale, dtype=np.float64)

    def beyond(self, v: FloatArray) -> FloatArray:
        """What the anchor's parameters cannot do of v."""
        whole = self._below(v)
        return np.asarray(whole - self.Q @ (self.Q.T @ whole), dtype=np.float64)

    def _below(self, v: FloatArray) -> FloatArray:
        return np.concatenate([v, np.zeros(self.J.shape[1])])


def anchor(fit: Fit, reach: float = LIMITS.reach) -> Anchor:
    """An anchor at a fit (or any evaluated point); `reach`: share of the cost that a step by one in a parameter
    costs."""
    count = fit.J.shape[1]
    cost = np.sqrt(reach * 2.0 * fit.cost) * np.eye(count)
    J = np.concatenate([fit.J, cost])
    if not count:
        return Anchor(fit, np.empty((len(J), 0)), J)
    scale = np.sqrt(np.maximum(np.sum(J**2, axis=0), 1e-300))
    u, s, _ = np.linalg.svd(J / scale, full_matrices=False)
    return Anchor(fit, u[:, s > 1e-6], J)


@dataclass(frozen=True)
class Answer:
    """What a hypothesis promises at its best start: cost after it (half the sum of squares), its problem with
    the effect in it, points to begin from, the derivative there; `plain`: the same without a shape that it may do
    without."""

    hypothesis: Hypothesis
    cost: float
    problem: Problem
    starts: tuple[FloatArray, ...]
    J: FloatArray
    plain: Answer | None = None


def with_entry(problem: Problem, h: Hypothesis, entry: EffectEntry) -> Problem:
    """The problem with the effect beside what it has, its parameters free."""
    joint = problem.config.model_copy(update={"effect": (*problem.config.effect, entry)})
    values = dict(entry.parameters)
    return replace(problem, config=joint, parameters=(*problem.parameters, *h.free(values, problem.config)))


PART = 0.3
"""Of what a linear answer promises, gone at first where the whole of it leads astray."""

_Best = tuple[float, dict[str, float | str], FloatArray, float]
"""Of the best start: cost, values with the linear amount, contribution of the size asked, that size."""


def ask(here: Anchor, h: Hypothesis) -> Answer | None:
    """The best linear answer over the hypothesis's starts; None if it cannot be simulated or shows nothing."""
    if h.has_phase:
        return _ask_pair(here, h)
    best = _event(here, h) if h.has_instant else _best(here, h)
    if best is None:
        return None
    cost, values, d, size = best
    plain = _answer(here, h, values, cost, d, size)
    shaped = _shaped(here, h, best) if h.further and not here.fit.problem.fine else None
    if shaped is None:
        return plain
    cost, values, d, size = shaped
    return replace(_answer(here, h, values, cost, d, size), plain=plain)


def _event(here: Anchor, h: Hypothesis) -> _Best | None:
    """The best linear answer over the instants of an event, looked for more closely about the best of them."""
    best = _best(here, h)
    if best is None:
        return None
    t = float(best[1][h.instant])
    times = sorted(float(s.values[h.instant]) for s in h.starts)
    width = times[1] - times[0]
    for _ in range(2 if here.fit.problem.fine else 4):
        width *= 0.5
        closer = _best(here, at_instants(h, (t - 0.5 * width, t + 0.5 * width)))
        if closer is not None and closer[0] < best[0]:
            best = closer
            t = float(best[1][h.instant])
    if h.two_sided:  # the other cable is softer in its own way, not in the opposite one
        mirrored = replace(at_instants(h, (t,)), starts=(_turned(h, t),))
        other = _best(here, mirrored)
        # what one cable promises by the opposite of what it does is the other's
        opposite = float(best[1][h.amount.name]) * best[3] < 0.0
        if other is not None and (opposite or other[0] < best[0]):
            best = other
    return best


def _shaped(here: Anchor, h: Hypothesis, best: _Best) -> _Best | None:
    """The best with one of the shapes that its starts leave out, where that promises enough more; an event that takes
    its time is asked for with its middle where the sudden one lies, one of another shape at every instant."""
    values = best[1]
    found = []
    starts = []
    for shape in h.further:
        if h.has_instant and h.duration not in shape:
            everywhere = tuple(Start({**s.values, **shape}) for s in h.starts)
            found.append(_event(here, replace(h, starts=everywhere)))
            continue
        begun = {h.instant: float(values[h.instant]) - 0.5 * shape[h.duration]} if h.duration in shape else {}
        starts.append(Start({**values, **begun, **shape}))
    found.append(_best(here, replace(h, starts=tuple(starts))))
    other = min((f for f in found if f is not None), key=lambda f: f[0], default=None)
    # what an event promises may be out of reach of its fit, which then decides between the shapes
    enough = 1.0 if h.has_instant else LIMITS.shaped
    return other if other is not None and other[0] < enough * best[0] else None


def _best(here: Anchor, h: Hypothesis) -> _Best | None:
    """The best linear answer over the hypothesis's starts."""
    left = here.beyond(here.fit.residual)
    energy = float(left @ left)
    best = None
    size = None  # what was worth seeing at one start is about that at the next
    # an event's instants are looked at coarsely where every run is dear
    for start in h.starts[1::3] if len(h.starts) > 9 and here.fit.problem.fine else h.starts:
        found = contribution(here, h, start, size)
        if found is None:
            continue
        d, size = found
        own = here.beyond(d)
        square = float(own @ own)
        if square <= 1e-12 * energy:
            continue
        factor = float(left @ own) / square
        if not h.two_sided:
            factor = max(factor, 0.0)
        # a mirrored event's size is negative
        low, high = sorted((h.amount.minimum / size, h.amount.maximum / size))
        factor = min(max(factor, low), high)
        cost = 0.5 * (energy - 2.0 * factor * float(left @ own) + factor**2 * square)
        values = {**start.values, h.amount.name: size * (factor if factor != 0.0 else 0.1)}
        if best is None or cost < best[0]:
            best = (cost, values, d, size)
    return best


def _turned(h: Hypothesis, t: float) -> Start:
    """The event at t with the other sign."""
    base = h.starts[0].values
    return Start({**base, h.instant: t, h.amount.name: -float(base[h.amount.name])})


def contribution(
    here: Anchor, h: Hypothesis, start: Start, about: float | None = None
) -> tuple[FloatArray, float] | None:
    """What the effect adds to the prediction (weighted) at a size that is about as large as the residual, looked for
    from `about` on, or from the start's own."""
    wanted = max(float(np.linalg.norm(here.fit.residual)), 1.0)
    size = float(start.values[h.amount.name]) if about is None else about
    low, high = h.amount.minimum, h.amount.maximum
    result = None
    for _ in range(4):
        size = min(max(size, low), high) if size else size
        d = _difference(here, h, {**start.values, h.amount.name: size})
        if d is None:
            size *= 0.1
            continue
        result = (d, size)
        length = float(np.linalg.norm(here.beyond(d))) + 0.1 * float(np.linalg.norm(d))
        ratio = wanted / max(length, 1e-9 * wanted)
        if 0.4 < ratio < 2.5 or abs(size * ratio) >= high * 3.0:
            break
        size *= float(np.clip(ratio, 1e-3, 1e3))
    return result


def _difference(here: Anchor, h: Hypothesis, values: dict[str, float | str]) -> FloatArray | None:
    """What the effect adds at these values. A law with rates is run on every sample, with it and without: rows thinned
    by travel know no acceleration."""
    problem, before = here.fit.problem, here.fit.residual
    if h.effect.rates and not problem.fine:
        if here.rated is None:
            return None
        problem, before = problem.finely(), here.rated
    joint = problem.config.model_copy(update={"effect": (*problem.config.effect, h.entry(values))})
    try:
        found = replace(problem, config=joint).followed(here.fit.x)
    except InputError:
        return None
    return None if found is None else before - found


def _answer(
    here: Anchor, h: Hypothesis, values: dict[str, float | str], cost: float, d: FloatArray, size: float
) -> Answer:
    problem = with_entry(here.fit.problem, h, h.entry(values))
    old = here.fit.problem.parameters
    count, new = len(old), problem.parameters[len(old) :]
    (amount,) = (k for k, p in enumerate(new) if p.base.endswith("." + h.amount.name))
    x = np.concatenate([here.fit.x, [p.x(p.start) for p in new]])
    value = float(values[h.amount.name])
    along = np.concatenate([here.step(here.fit.residual - value / size * d), np.zeros(len(new))])
    part = x.copy()
    part[count + amount] = new[amount].x(PART * value)
    # rows of the residual: data first, then priors of old and new parameters
    data = len(here.fit.residual) - count
    J = np.zeros((data + len(problem.parameters), len(problem.parameters)))
    J[:data, :count] = here.fit.J[:data]
    J[data : data + count, :count] = here.fit.J[data:]
    J[:data, count + amount] = -d[:data] / size * new[amount].slope(x[count + amount])
    starts = (x, x + along, part + PART * along, part)
    return Answer(h, cost, problem, tuple(inside(problem, s) for s in starts), J)


def _ask_pair(here: Anchor, h: Hypothesis) -> Answer | None:
    """Amount and phase as a pair (a cos, a sin): both contributions in one linear step."""
    first = contribution(here, h, h.starts[0])
    found = [first, contribution(here, h, h.starts[1], first and first[1])]
    if any(f is None for f in found):
        return None
    (d0, s0), (d1, s1) = (f for f in found if f is not None)
    left = here.beyond(here.fit.residual)
    own = np.column_stack((here.beyond(d0) / s0, here.beyond(d1) / s1))
    scale = np.maximum(np.linalg.norm(own, axis=0), 1e-300)
    pair = np.linalg.lstsq(own / scale, left, rcond=1e-6)[0] / scale
    pair = pair * min(1.0, h.amount.maximum / max(float(np.hypot(*pair)), 1e-300))
    cost = 0.5 * float(np.sum((left - own @ pair) ** 2))
    size, phase = float(np.hypot(*pair)), float(np.arctan2(pair[1], pair[0]))
    if not size > 0.0:
        return None
    values = {**h.starts[0].values, h.amount.name: size, h.phase: phase}
    d = (d0 / s0 * np.cos(phase) + d1 / s1 * np.sin(phase)) * size
    return _answer(here, h, values, cost, d, size)


def ask_all(anchors: Sequence[Anchor], h: Hypothesis) -> list[Answer]:
    """What a hypothesis promises at each anchor, best first."""
    asked = [ask(here, h) for here in anchors]
    return sorted((a for a in asked if a is not None), key=lambda a: a.cost)


def _begun(a: Answer, evaluations: int) -> Fit | None:
    """A short fit from where an answer begins; without the shape that it may do without, where that is as good."""
    # of the effect's further parameters the answer tells no derivative
    known = {int(k): a.J[:, k] for k in np.flatnonzero(np.any(a.J != 0.0, axis=0))}
    # what the effect does together with a step of all else may, put beside them as they are, be far off
    x, residual = lowest(a.problem, a.starts[:2] if a.problem.fine else a.starts)
    try:
        fit = approach(a.problem, x, known, 3 if a.problem.fine else evaluations, LIMITS.tolerance, residual)
    except InputError:
        fit = None
    plain = None if a.plain is None else _begun(a.plain, evaluations)
    if plain is None or fit is None:
        return fit or plain
    as_good = fit.cost > LIMITS.shaped * plain.cost and not runs_away(plain, a.hypothesis)
    return plain if as_good else fit


def rough(
    answers: Sequence[Answer], evaluations: int, further: Sequence[Mapping[str, float]] = ()
) -> list[Fit]:
    """Short fits from where each anchor's answer begins, best first; none if none can be followed.

    `further`: values to begin from as well (what they do not name, at its start).
    """
    fits = [f for f in (_begun(a, evaluations) for a in answers) if f is not None]
    problem = fits[0].problem if fits else answers[0].problem
    starts = [np.array([p.x(values.get(p.name, p.start)) for p in problem.parameters]) for values in further]
    fits += multi_start(problem, starts, 3 if problem.fine else evaluations + 3, LIMITS.tolerance)
    return sorted(fits, key=lambda f: f.cost)
