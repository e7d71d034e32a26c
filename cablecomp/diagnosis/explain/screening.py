"""Ask every hypothesis cheaply: how far would the misfit fall, by one or two simulations beside a fitted model.

At an anchor (a fit, or the nominal drive) with residual r and derivative J, an effect's contribution d = r(0) -
r(a) at a size a that is worth seeing tells the cost after a joint linear step. What promises anything is then
fitted for a few steps from each anchor: where calibration has paid for a missing effect, the way there begins
at the nominal drive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from cablecomp.config import EffectEntry
from cablecomp.diagnosis.explain.asked_events import best_course, best_event
from cablecomp.diagnosis.explain.cycles import best_cycle
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, Start
from cablecomp.diagnosis.explain.linear import (
    Anchor,
    Best,
    best_pair,
    best_start,
    better_shaped,
    shapes_worth_asking,
    worth_a_shape,
)
from cablecomp.diagnosis.explain.plausible import runs_away
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import Fit, approach, inside
from cablecomp.estimation.multi_start import lowest, multi_start
from cablecomp.estimation.parameter import vague_drive
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Answer:
    """What a hypothesis promises at its best start: cost after it (half the sum of squares; of each channel), its
    problem with the effect in it, points to begin from, the derivative there; `plain`: the same without a shape that
    it may do without; `next`: the same of the next best shape, where that promises about as much."""

    hypothesis: Hypothesis
    cost: float
    by_channel: FloatArray
    problem: Problem
    starts: tuple[FloatArray, ...]
    J: FloatArray
    plain: Answer | None = None
    next: Answer | None = None


def with_entry(problem: Problem, h: Hypothesis, entry: EffectEntry) -> Problem:
    """The problem with the effect beside what it has, its parameters free."""
    joint = problem.config.model_copy(update={"effect": (*problem.config.effect, entry)})
    values = dict(entry.parameters)
    return replace(problem, config=joint, parameters=(*problem.parameters, *h.free(values, problem.config)))


PART = 0.3
"""Of what a linear answer promises, gone at first where the whole of it leads astray."""


def ask(here: Anchor, h: Hypothesis, worth: float = inf) -> Answer | None:
    """The best linear answer over the hypothesis's starts; None if it cannot be simulated or shows nothing. It is asked
    for no shape where it leaves more than `worth` without one."""
    found = _plainly(here, h)
    if found is None:
        return None
    plain, best = found
    if plain.cost > worth:
        return plain
    other = _shaped(here, h, best) if h.further or h.has_instant or h.cycle_start else None
    return plain if other is None else replace(other, plain=plain)


def ask_all(anchors: Sequence[Anchor], h: Hypothesis) -> list[Answer]:
    """What a hypothesis promises at each anchor, best first. Only where it leaves less than the first anchor without it
    are shapes asked for at the others, and at the first of a law that is run on every sample at size after size."""
    worth = LIMITS.promise * anchors[0].fit.cost
    dear = h.effect.rates and h.effect.saturates
    asked = [ask(here, h, worth if k or dear else inf) for k, here in enumerate(anchors)]
    return sorted((a for a in asked if a is not None), key=lambda a: a.cost)


def _plainly(here: Anchor, h: Hypothesis) -> tuple[Answer, Best] | None:
    """The best over the hypothesis's starts, and as it was found."""
    if h.has_phase:
        best = best_pair(here, h, [{}])
    else:
        best = best_event(here, h) if h.has_instant else best_start(here, h)
    return None if best is None else (_answer(here, h, best), best)


def _shaped(here: Anchor, h: Hypothesis, best: Best) -> Answer | None:
    """The best with one of the shapes that its starts leave out, where that promises enough more; an event is asked at
    every instant with each of them, then for its course."""
    # where every run is dear no shape is asked for but what goes with speed; of an event, its course alone
    further = h.further if not here.fit.problem.fine else h.further_at_speed
    if h.has_phase:
        if h.cycle_start and not (h.channel or here.fit.problem.fine):
            cycle = best_cycle(here, h, best)
            if cycle is not None and worth_a_shape(cycle.by_channel, best.by_channel, LIMITS.cycled):
                return _answer(here, h, cycle)
        pair = best_pair(here, h, further) if further else None
        worth = pair is not None and worth_a_shape(pair.by_channel, best.by_channel)
        return _answer(here, h, pair) if pair is not None and worth else None
    if h.has_instant:
        everywhere = (replace(h, starts=tuple(Start({**s.values, **f}) for s in h.starts)) for f in further)
        otherwise = [best_event(here, e) for e in everywhere]
        lasting = (best, *otherwise) if h.duration else ()
        courses = [best_course(here, h, e) for e in lasting if e is not None]
        shaped = otherwise + courses
    else:
        shapes = shapes_worth_asking(here, h, _by_shape(best, further))
        shaped = [best_start(here, replace(h, starts=starts)) for starts in shapes]
    promised = sorted((f for f in shaped if f is not None), key=lambda f: f.cost)
    if not promised:
        return None
    other = promised[0]
    # what an event promises may be out of reach of its fit, which then decides between the shapes; of what goes far
    # beyond a straight line, or beside a drive known by order of magnitude, no promise decides
    enough = other.cost < best.cost if h.has_instant else worth_a_shape(other.by_channel, best.by_channel)
    vague = vague_drive(here.fit.problem.parameters)
    if not (enough or h.effect.saturates or (vague and not h.has_instant)):
        return None
    near = [f for f in promised[1:2] if not h.has_instant and f.cost < LIMITS.another_shape * other.cost]
    return replace(_answer(here, h, other), next=_answer(here, h, near[0]) if near else None)


def _by_shape(best: Best, further: Sequence[Mapping[str, float]]) -> list[tuple[Start, ...]]:
    """Starts beside the best one, those of one shape together."""
    found: dict[frozenset[str], list[Start]] = {}
    for values in further:
        found.setdefault(frozenset(values), []).append(Start({**best.values, **values}))
    return [tuple(starts) for starts in found.values()]


def in_another_course(here: Anchor, h: Hypothesis, now: Best) -> Answer | None:
    """What an event promises in the best of its likely courses; None where that is not enough more than `now`."""
    bare = {k: v for k, v in now.values.items() if k not in h.of_course}
    other = best_course(here, h, now._replace(values=bare))
    worth = other is not None and worth_a_shape(other.by_channel, now.by_channel)
    return _answer(here, h, other) if other is not None and worth else None


def in_another_shape(here: Anchor, h: Hypothesis, now: Best) -> Answer | None:
    """What a law promises in the best of the shapes that it is asked for by itself; None where that is not enough more
    than `now`."""
    shapes = tuple(Start({**now.values, **f}) for f in h.further)
    other = best_start(here, replace(h, starts=shapes), float(now.values[h.amount.name]))
    worth = other is not None and worth_a_shape(other.by_channel, now.by_channel)
    return _answer(here, h, other) if other is not None and worth else None


def _answer(here: Anchor, h: Hypothesis, best: Best) -> Answer:
    values, d, size = best.values, best.d, best.size
    problem = with_entry(here.fit.problem, h, h.entry(values))
    old = here.fit.problem.parameters
    count, new = len(old), problem.parameters[len(old) :]
    (amount,) = (k for k, p in enumerate(new) if p.base.endswith("." + h.amount.name))
    x = np.concatenate([here.fit.x, [p.x(p.start) for p in new]])
    value = float(values[h.amount.name])
    along = np.concatenate([here.step(here.fit.residual - value / size * d), np.zeros(len(new))])

    def begun(share: float) -> FloatArray:
        part = x.copy()
        part[count + amount] = new[amount].x(share * value)
        return part

    # rows of the residual: data first, then priors of old and new parameters
    data = len(here.fit.residual) - count
    J = np.zeros((data + len(problem.parameters), len(problem.parameters)))
    J[:data, :count] = here.fit.J[:data]
    J[data : data + count, :count] = here.fit.J[data:]
    J[:data, count + amount] = -d[:data] / size * new[amount].slope(x[count + amount])
    shares = (PART, *LIMITS.saturating) if h.effect.saturates else (PART,)
    parts = (begun(share) + share * along for share in shares)
    starts = (x, x + along, *parts, begun(PART))
    begin = tuple(inside(problem, s) for s in starts)
    return Answer(h, best.cost, best.by_channel, problem, begin, J)


def _begun(a: Answer, evaluations: int) -> Fit | None:
    """A short fit from where an answer begins; without the shape that it may do without, where that is as good."""
    # of the effect's further parameters the answer tells no derivative
    known = {int(k): a.J[:, k] for k in np.flatnonzero(np.any(a.J != 0.0, axis=0))}
    # what the effect does together with a step of all else may, put beside them as they are, be far off
    dear = a.problem.fine and not a.hypothesis.effect.saturates
    x, residual = lowest(a.problem, a.starts[:2] if dear else a.starts)
    try:
        fit = approach(a.problem, x, known, 3 if a.problem.fine else evaluations, LIMITS.tolerance, residual)
    except InputError:
        fit = None
    following = None if a.next is None else _begun(a.next, evaluations)
    if fit is None or (following is not None and following.cost < fit.cost):
        fit = following or fit
    plain = None if a.plain is None else _begun(a.plain, evaluations)
    if plain is None or fit is None:
        return fit or plain
    as_good = not better_shaped(fit, plain) and not runs_away(plain, a.hypothesis)
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
