"""One round of the search: every hypothesis asked cheaply, the promising ones fitted roughly, the best of them
to the end.

Besides effects, a round tries dependences: a parameter that is each session's own, or grows with a condition.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cablecomp.diagnosis.explain.dependence import Dependence, ask_dependences, may_depend
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import (
    Model,
    Round,
    Term,
    Tried,
    finely,
    is_told,
    loss,
    most_told,
    placed,
)
from cablecomp.diagnosis.explain.model import ranked as ranked_models
from cablecomp.diagnosis.explain.scores import demanded, left_out, scales, score_difference, selected_in
from cablecomp.diagnosis.explain.screening import Answer, anchor, ask_all, rough
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.pace import Pace
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import MOTOR
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.parallel import side_by_side
from cablecomp.estimation.parameter import DECADE, by_condition
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Begun:
    """A fit that has been begun: its cost so far, what it adds, where it stands, and what is roughly known of
    its derivative."""

    cost: float
    terms: tuple[Term, ...]
    problem: Problem
    x: FloatArray
    J: FloatArray | None = None


def one_round(
    model: Model,
    nominal: Fit | None,
    pool: Sequence[Hypothesis],
    groups: Groups,
    rng: np.random.Generator,
    pace: Pace,
    number: int,
    cold: Mapping[str, float] | None,
    known: Sequence[Model],
) -> Round:
    """Every hypothesis and dependence beside `model`. `nominal`: a further point to ask from; `cold`: values to
    begin from where the drive is known by order of magnitude only; `known`: models of earlier rounds, to begin
    from as well. Once the time is up nothing further is begun but the most promising fit."""
    anchors = [anchor(f) for f in (model.fit, nominal) if f is not None]
    ids = {t.effect.id for t in model.terms if isinstance(t, Hypothesis)}
    left = [h for h in pool if h.effect.id not in ids]  # a second of the same would share its parameters
    done = number / LIMITS.rounds

    def answer(h: Hypothesis) -> list[Answer]:
        pace.tell(f"asking {h.name}", done)
        return [] if pace.over else ask_all(anchors, h)

    answers = [a for a in side_by_side(answer, left) if a]
    before = 0.5 * float(model.fit.residual @ model.fit.residual)
    fine = finely(model, groups) if any(_wants_rates(a[0], model, before) for a in answers) else None
    if fine is not None:
        there = [anchor(fine.fit)]
        answers = [
            (ask_all(there, a[0].hypothesis) or a) if _wants_rates(a[0], model, before) else a
            for a in answers
        ]
    dependences = (
        []
        if number == 0 and not model.fit.problem.parameters
        else ask_dependences(model.fit, model.terms, groups.by)
    )
    trades = cold is not None and number > 0
    worth = [a for a in answers if a[0].cost < LIMITS.promise * before or (trades and a[0].hypothesis.trades)]
    if number > 0:
        dear = 2 if model.fit.problem.fine else 1
        worth = sorted(worth, key=lambda a: a[0].cost)[: LIMITS.tried_later // dear]
    promising = max(LIMITS.promising - 2 * number, LIMITS.promising // 2)

    def begin(a: list[Answer]) -> list[Fit]:
        pace.tell(f"trying {a[0].hypothesis.name}", done)
        if pace.over:
            return []
        further = _further(a[0].hypothesis, model, known, cold) if a[0].hypothesis.trades else []
        return rough(a, LIMITS.rough, further)

    roughs = side_by_side(begin, worth)
    ranked: list[Begun] = []
    second: list[Begun] = []
    for fits, a in zip(roughs, worth, strict=True):
        for k, f in enumerate(fits[: 2 if trades and a[0].hypothesis.trades else 1]):
            (second if k else ranked).append(Begun(f.cost, (a[0].hypothesis,), f.problem, f.x, f.J))
    for found in side_by_side(lambda c: _by_conditions(c), list(ranked)):
        ranked += found
    for d, cost, problem in dependences:
        ranked.append(Begun(cost, (d,), problem, placed(model.fit, problem)))
    ranked.sort(key=lambda c: c.cost)
    top = ranked[0].cost if ranked else 0.0
    chosen = [
        c
        for k, c in enumerate(ranked[:promising])
        if c.cost < before and (k < 2 or c.cost < LIMITS.hopeless * top)
    ]

    # what lies lower need not predict better: of two valleys both are fitted to the end
    taken = [c.terms[0].name for c in chosen]
    chosen += [c for c in second if c.terms[0].name in taken and c.cost < LIMITS.hopeless * top]

    def finish(c: Begun) -> Model | None:
        pace.tell(f"fitting {c.terms[0].name}", done)
        if pace.over and c is not chosen[0]:
            return None
        try:
            fit = solve(c.problem, c.x, 15, LIMITS.tolerance, c.J)
        except InputError:
            return None
        terms = tuple(most_told(fit, t, pool) if isinstance(t, Hypothesis) else t for t in c.terms)
        if not is_told(fit, terms[0]):
            return None
        ratio = 1.0
        if fine is not None and fit.problem.fine:
            size = scales(model.left_out, groups)
            ratio = loss(model, size, groups) / max(loss(fine, size, groups), 1e-300)
        return Model((*model.terms, *terms), fit, left_out(fit, groups), ratio)

    models = ranked_models([m for m in side_by_side(finish, chosen) if m is not None], groups)
    differences = {
        m.name: score_difference(
            m.left_out, fine.left_out if fine is not None and m.fit.problem.fine else model.left_out, groups
        )
        for m in models
    }
    shares = selected_in({n: v.by_block for n, v in differences.items()}, rng)
    first = len(model.terms)
    tried = [Tried(m.terms[first], m, differences[m.name], shares[m.name]) for m in models]
    tried.sort(key=lambda t: -t.difference.gain)
    good = [t for t in tried if demanded(t.difference, first=number == 0)]
    return Round(model, tuple(tried), good[0] if good else None)


def _further(
    h: Hypothesis, model: Model, known: Sequence[Model], cold: Mapping[str, float] | None
) -> list[Mapping[str, float]]:
    """Values to begin from beside where calibration stands: effects that trade places sit in a valley of their
    own, and an earlier model that has this one may have found it; what that model lacks begins at a part of its
    amount."""
    names = {t.name for t in model.terms}
    having = [m for m in known if any(t.name == h.name for t in m.terms) and len(m.terms) <= len(names)]
    if not having:
        return [cold] if cold is not None and names else []
    best = max(having, key=lambda m: len(names & {t.name for t in m.terms}))
    values = dict(best.fit.values)
    amounts = {t.key(t.amount.name) for t in model.terms if isinstance(t, Hypothesis)}
    for name, value in model.fit.values.items():
        values.setdefault(name, LIMITS.part * value if name in amounts else value)
    return [values]


def cold_starts(pool: Sequence[Hypothesis], baseline: Fit) -> dict[str, float] | None:
    """Where every effect would begin beside the nominal drive; None where the drive is known better than by
    order of magnitude (calibration then stays in its valley)."""
    if not any(p.sd >= DECADE for p in baseline.problem.parameters if np.isfinite(p.sd)):
        return None
    evidence = baseline.problem.evidence
    torque = [
        float(np.std(e.columns[c])) for e in evidence for c in (MOTOR, "joint_torque_Nm") if c in e.columns
    ]
    found: dict[str, float] = {}
    for h in pool:
        values = dict(h.starts[0].values if h.effect.posture else h.starts[len(h.starts) // 2].values)
        if (
            h.amount.unit == "N m" and torque
        ):  # a share of the torques that go round: moments are not known beforehand
            values[h.amount.name] = 0.25 * float(np.median(torque))
        found |= {h.key(k): v for k, v in values.items() if not isinstance(v, str)}
    return found


def _wants_rates(a: Answer, model: Model, before: float) -> bool:
    return (
        a.hypothesis.effect.rates
        and not model.fit.problem.fine
        and before / max(a.cost, 1e-12) > LIMITS.worth_rates
    )


def _by_conditions(begun: Begun) -> list[Begun]:
    """The same effect with an amount that grows with a condition, for each condition of three values and more."""
    problem, x, term = begun.problem, begun.x, begun.terms[0]
    assert isinstance(term, Hypothesis)
    found: list[Begun] = []
    for condition in problem.evidence[0].condition:
        values = [e.condition[condition] for e in problem.evidence]
        if len(set(values)) < LIMITS.conditions:
            continue
        name = term.key(term.amount.name)
        amount = next((p for p in problem.parameters if p.name == name), None)
        if amount is None or not may_depend(name, condition):
            continue
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
