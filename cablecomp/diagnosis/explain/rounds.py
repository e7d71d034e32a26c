"""One round of the search: every hypothesis asked cheaply, the promising ones fitted roughly, the best of them
to the end.

Besides effects, a round tries dependences: a parameter that is each session's own, or grows with a condition.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cablecomp.diagnosis.explain.beginning import Beginning, Begun, further
from cablecomp.diagnosis.explain.dependence import Dependence, ask_dependences, gain_is_told, may_depend
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.linear import anchor, likeliest
from cablecomp.diagnosis.explain.model import (
    Model,
    Round,
    Tried,
    best_resolved,
    common,
    finely,
    loss,
    lost,
    no_answer,
    placed,
)
from cablecomp.diagnosis.explain.model import ranked as ranked_models
from cablecomp.diagnosis.explain.pairs import with_own_pretensions
from cablecomp.diagnosis.explain.plausible import falls_between, runs_away
from cablecomp.diagnosis.explain.scores import (
    block_losses,
    demanded,
    left_out,
    scales,
    score_difference,
    selected_in,
)
from cablecomp.diagnosis.explain.screening import Answer, ask_all, rough
from cablecomp.diagnosis.explain.seen import Seen
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.parallel import in_processes
from cablecomp.estimation.parameter import by_condition


def one_round(at: Beginning, rng: np.random.Generator) -> Round:
    """Every hypothesis and dependence beside a model: asked, begun, the promising ones fitted to the end and compared
    with the model on data left out."""
    answers = _asked(at)
    fine = finely(at.model, at.groups) if any(_wants_rates(a[0], at) for a in answers) else None
    if fine is not None:
        there = [anchor(fine.fit)]
        answers = [(ask_all(there, a[0].hypothesis) or a) if _wants_rates(a[0], at) else a for a in answers]
    worth, others = _worth(at, answers)
    begun = _begun(at, worth)
    found = _ended(_chosen(*begun, at), at, fine)
    # what is no answer takes nobody's place
    more, _ = _rough(at, others[: sum(m is None for m in found)])
    found += _ended([c for c in more if c.cost < at.cost], at, fine)
    tried, away = _tried(found, at, fine, rng)
    if not any(t.difference.z > LIMITS.z_sure for t in _good(tried, at)):
        pairs, _ = _tried(_ended(_pairs(begun[0], at), at, fine), at, fine, rng)
        tried = sorted([*tried, *pairs], key=lambda t: -t.difference.gain)
    good = _good(tried, at)
    return Round(at.model, tuple(tried), good[0] if good else None, tuple(away))


def _good(tried: Sequence[Tried], at: Beginning) -> list[Tried]:
    """What data left out demand."""
    return [t for t in tried if demanded(t.difference, first=at.number == 0)]


def _ended(chosen: Sequence[Begun], at: Beginning, fine: Model | None) -> list[Model | None]:
    """What is chosen fitted to the end, None for what is no answer; once the time is up the first alone."""

    def finish(c: Begun) -> Model | None:
        at.tell(f"fitting {c.terms[0].name}")
        return None if at.pace.over and c is not chosen[0] else _finished(c, at, fine)

    return list(in_processes(finish, chosen))


def _tried(
    ended: Sequence[Model | None], at: Beginning, fine: Model | None, rng: np.random.Generator
) -> tuple[list[Tried], list[Model]]:
    """What has ended compared with the model; and what has run away."""
    found = [m for m in ended if m is not None]
    models = ranked_models([m for m in found if not _away(m, at)], at.groups)
    return _compared(models, at, fine, rng), [m for m in found if _away(m, at)]


def _away(model: Model, at: Beginning) -> bool:
    """Whether what was added to a model has left what is plausible of it."""
    added = model.terms[len(at.model.terms)]
    return isinstance(added, Hypothesis) and runs_away(model.fit, added)


def _pairs(begun: Sequence[Begun], at: Beginning) -> list[Begun]:
    """The effects that came nearest, each with a pretension of every session's own: where the drive is known by order
    of magnitude, without which one of them may hardly help."""
    cold = at.cold
    if cold is None or at.number == 0 or at.pace.over or at.model.fit.problem.fine:
        return []
    near = [(c, h) for c in begun for h in c.terms[:1] if isinstance(h, Hypothesis) and h.trades]

    def begin(pair: tuple[Begun, Hypothesis]) -> list[Begun]:
        at.tell(f"trying {pair[1].name} with a pretension of each session's own")
        found = with_own_pretensions(pair[0].problem, pair[1], at.model.fit.values, cold, at.groups.by)
        if found is None:
            return []
        dependence, fit = found
        return [Begun(fit.cost, (pair[1], dependence), fit.problem, fit.x, fit.J)]

    found = [b for part in in_processes(begin, near[: LIMITS.pairs]) for b in part]
    return [b for b in found if b.cost < at.cost]


def _asked(at: Beginning) -> list[list[Answer]]:
    """What each hypothesis that the model has not promises, by a linear step from each anchor. In a later round those
    that promise most by what was seen of them before are asked."""
    here = anchor(at.model.fit, seen=at.seen)
    nominal = [] if at.nominal is None else [anchor(at.nominal)]
    ids = {t.effect.id for t in at.model.terms if isinstance(t, Hypothesis)}
    left = [h for h in at.pool if h.effect.id not in ids]  # a second of the same would share its parameters
    if at.number > 0:
        left = likeliest(here, left, LIMITS.asked_later, at.trades)

    def answer(h: Hypothesis) -> tuple[list[Answer], Seen]:
        at.tell(f"asking {h.name}")
        own = at.seen.only(h)
        return [] if at.pace.over else ask_all([replace(here, seen=own), *nominal], h), own

    answers = in_processes(answer, left, _dear)
    for _, seen in answers:
        at.seen.learn(seen)
    return [a for a, _ in answers if a]


def _dear(h: Hypothesis) -> float:
    """Which hypotheses take long: those that are run on every sample, then those that come at any instant."""
    return 2.0 * h.effect.rates + h.has_instant


def _worth(at: Beginning, answers: Sequence[list[Answer]]) -> tuple[list[list[Answer]], list[list[Answer]]]:
    """The answers that are tried, and those that come next, best first in a later round."""
    model = at.model
    worth = [a for a in answers if a[0].cost < LIMITS.promise * at.cost or at.trades(a[0].hypothesis)]
    if at.number == 0:
        return worth, []
    dear = 2 if model.fit.problem.fine else 1
    worth = sorted(worth, key=lambda a: a[0].cost)
    most = LIMITS.tried_later // dear
    trading = LIMITS.tried_trading // dear if len(model.fit.problem.repeated) > 1 else 0
    traded = [a for a in worth[most:] if at.trades(a[0].hypothesis)][:trading]
    return worth[:most] + traded, [a for a in worth[most:] if not any(a is t for t in traded)]


def _begun(at: Beginning, worth: Sequence[list[Answer]]) -> tuple[list[Begun], list[Begun]]:
    """Rough fits of what promises anything, dependences among them, best first; and the second valleys of effects that
    trade places."""
    model = at.model
    first, second = _rough(at, worth)
    if first and first[0].problem.evidence[0].condition:
        for found in in_processes(_by_conditions, list(first)):
            first += found
    if at.number > 0 or model.fit.problem.parameters:
        for d, cost, problem in ask_dependences(model.fit, model.terms, at.groups.by):
            first.append(Begun(cost, (d,), problem, placed(model.fit, problem)))
    return sorted(first, key=lambda c: c.cost), second


def _rough(at: Beginning, worth: Sequence[list[Answer]]) -> tuple[list[Begun], list[Begun]]:
    """Rough fits of these answers; and of the second valleys of effects that trade places."""

    def begin(a: list[Answer]) -> list[Fit]:
        h = a[0].hypothesis
        at.tell(f"trying {h.name}")
        found = [] if at.pace.over else rough(a, LIMITS.rough, further(h, at) if h.trades else [])
        return [f for f in found if not falls_between(f, h)]

    first: list[Begun] = []
    second: list[Begun] = []
    for fits, a in zip(in_processes(begin, worth, lambda a: _dear(a[0].hypothesis)), worth, strict=True):
        h = a[0].hypothesis
        for k, f in enumerate(fits[: 2 if at.trades(h) else 1]):
            (second if k else first).append(Begun(f.cost, (h,), f.problem, f.x, f.J))
    return first, second


def _chosen(first: Sequence[Begun], second: Sequence[Begun], at: Beginning) -> list[Begun]:
    """What is fitted to the end. What lies lower need not predict better: of two valleys both are. A drive mounted anew
    takes no effect's place: sessions differ whatever is missing, and an event between two of them does nearly as well.
    """
    promising = max(LIMITS.promising - 2 * at.number, LIMITS.promising // 2)
    most = LIMITS.hopeless * (first[0].cost if first else 0.0)
    nearest = _of_so_many(first, promising)
    chosen = [c for k, c in enumerate(nearest) if c.cost < at.cost and (k < 2 or c.cost < most)]
    taken = [c.terms[0].name for c in chosen]
    chosen += [c for c in first if _mounts_anew(c) and c.terms[0].name not in taken and c.cost < at.cost]
    return chosen + [c for c in second if c.terms[0].name in taken and c.cost < most]


def _of_so_many(begun: Sequence[Begun], most: int) -> list[Begun]:
    """Those that come first, of so many terms: an effect that is asked for by several amounts takes one place."""
    found: list[Begun] = []
    for c in begun:
        seen = {_place(b) for b in found}
        if _place(c) not in seen and len(seen) >= most:
            break
        found.append(c)
    return found


def _mounts_anew(c: Begun) -> bool:
    """Whether it is only how the drive stands in each session."""
    return isinstance(c.terms[0], Dependence) and c.terms[0].mounted_anew


def _place(c: Begun) -> str:
    """Whose place it takes: its effect's, or a dependence's own."""
    term = c.terms[0]
    return term.effect.id if isinstance(term, Hypothesis) else term.name


def _finished(c: Begun, at: Beginning, fine: Model | None) -> Model | None:
    """The model with what was begun, fitted to the end; None where it cannot be followed, or is none of it, or, beside
    other effects, has left what is plausible of it."""
    try:
        fit = solve(c.problem, c.x, LIMITS.to_the_end, LIMITS.tolerance, c.J)
    except InputError:
        return None
    terms = tuple(best_resolved(fit, t, at.pool) if isinstance(t, Hypothesis) else t for t in c.terms)
    refused = lost if at.number > 0 else no_answer
    if refused(fit, terms[0]):
        return None
    ratio = 1.0
    if fine is not None and fit.problem.fine:
        size = scales(at.model.left_out, at.groups)
        ratio = loss(at.model, size, at.groups) / max(loss(fine, size, at.groups), 1e-300)
    return Model((*at.model.terms, *terms), fit, left_out(fit, at.groups), ratio)


def _compared(
    models: Sequence[Model], at: Beginning, fine: Model | None, rng: np.random.Generator
) -> list[Tried]:
    """Each model's score against the one before, run as finely as it is itself; best first."""
    if not models:
        return []
    differences = {
        m.name: score_difference(
            m.left_out,
            fine.left_out if fine is not None and m.fit.problem.fine else at.model.left_out,
            at.groups,
        )
        for m in models
    }
    size = common(models, at.groups)
    losses = {m.name: m.by_thinning * block_losses(m.left_out, size, at.groups) for m in models}
    shares = selected_in(losses, rng)
    added = len(at.model.terms)
    tried = [Tried(m.terms[added], m, differences[m.name], shares[m.name]) for m in models]
    return sorted(tried, key=lambda t: -t.difference.gain)


def _wants_rates(a: Answer, at: Beginning) -> bool:
    """Whether a law with rates promises so much that it is worth a run on every sample."""
    worth = at.cost / max(a.cost, 1e-12) > LIMITS.worth_rates
    return a.hypothesis.effect.rates and not at.model.fit.problem.fine and worth


def _by_conditions(begun: Begun) -> list[Begun]:
    """The same effect with an amount that grows with a condition, for each condition that tells it."""
    problem, x, term = begun.problem, begun.x, begun.terms[0]
    assert isinstance(term, Hypothesis)
    found: list[Begun] = []
    for condition in problem.evidence[0].condition:
        if not gain_is_told(problem, condition):
            continue
        name = term.key(term.amount.name)
        amount = next((p for p in problem.parameters if p.name == name), None)
        if amount is None or not may_depend(name, condition):
            continue
        values = [e.condition[condition] for e in problem.evidence]
        here = replace(
            amount, start=max(amount.value(float(x[problem.parameters.index(amount)])), amount.scale)
        )
        gain = by_condition(here, condition, float(np.ptp(values)))
        changed = replace(problem, parameters=(*problem.parameters, gain))
        try:
            fit = solve(changed, np.append(x, gain.x(0.3 * here.start / float(np.ptp(values)))), LIMITS.rough)
        except InputError:
            continue
        if fit.cost < LIMITS.promise * begun.cost:
            found.append(Begun(fit.cost, (term, Dependence(name, condition)), fit.problem, fit.x, fit.J))
    return found
