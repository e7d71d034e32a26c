"""Forward selection: asked cheaply, fitted roughly, the promising ones to the end, the best by data left out; then done without
what is not missed.

Besides effects, a round tries dependences: a parameter that is each session's own, or grows with a condition.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cablecomp.diagnosis.explain.dependence import Dependence, ask_dependences, may_depend
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.scores import (
    Groups,
    Lead,
    block_losses,
    confidence_set,
    lead,
    left_out,
    scales,
    selected_in,
)
from cablecomp.diagnosis.explain.screening import Anchor, Answer, anchor, ask_all, rough
from cablecomp.diagnosis.parallel import side_by_side
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import MOTOR
from cablecomp.estimation.least_squares import Fit, refit, rms_left, solve
from cablecomp.estimation.parameter import DECADE, by_condition
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.signal.smoothing import FloatArray

Progress = Callable[[str, float], None]
Term = Hypothesis | Dependence
"""What a round may add to a model."""


@dataclass(frozen=True)
class Model:
    """A drive with what was added to it, fitted; its residual with each fold left out."""

    terms: tuple[Term, ...]
    fit: Fit
    left_out: FloatArray
    by_thinning: float = 1.0
    """Loss of the model before on thinned rows over that on every sample, where this one alone runs on every sample."""

    @property
    def name(self) -> str:
        """Names of what was added, joined."""
        return " + ".join(t.name for t in self.terms) or "calibrated drive"


@dataclass(frozen=True)
class Tried:
    """One hypothesis of a round: its model, its lead over the model before, share of resampled data in which it was best."""

    term: Term
    model: Model
    lead: Lead
    selected_in: float


@dataclass(frozen=True)
class Round:
    """One step: what was promised (cost before over cost after a linear step, by name), what was fitted, what was taken."""

    base: Model
    promised: Mapping[str, float]
    tried: tuple[Tried, ...]
    accepted: Tried | None


@dataclass(frozen=True)
class Selection:
    """The calibrated drive, the rounds, the final model; answers of the first round (how much each effect could show)."""

    baseline: Model
    rounds: tuple[Round, ...]
    final: Model
    groups: Groups
    answers: tuple[Answer, ...] = field(default=())


def select(
    baseline: Fit,
    nominal: Fit | None,
    pool: Sequence[Hypothesis],
    groups: Groups,
    rng: np.random.Generator,
    progress: Progress,
    budget_s: float = 150.0,
) -> Selection:
    """Add what data left out demand, one at a time, `LIMITS.beam` models side by side; then leave out what is not missed.

    `nominal`: the drive as configured, evaluated: where calibration has paid for a missing effect, the way to the effect
    begins there. `budget_s`: no round is begun after so much time.
    """
    sharp = searching(baseline)
    first = reweighed(Model((), baseline, left_out(baseline, groups)), sharp, groups)
    if nominal is not None:
        problem = nominal.problem.with_weighing(sharp)
        nominal = Fit(problem, nominal.x, problem.residual(nominal.x), problem.jacobian(nominal.x))
    beam: list[tuple[Model, Fit | None]] = [(first, nominal)]
    rounds: list[Round] = []
    answers: tuple[Answer, ...] = ()
    cold = _cold(pool, baseline)
    best = first
    begin = time.monotonic()
    for number in range(0 if quiet(baseline) else LIMITS.rounds):
        if number and time.monotonic() - begin > budget_s:
            break
        candidates: list[tuple[Round, Tried]] = []
        for model, start in beam:
            round_, answered = _one_round(model, start, pool, groups, rng, progress, number, cold)
            answers = answers or answered
            rounds.append(round_)
            candidates += [(round_, t) for t in round_.tried]
        good = [t for _, t in candidates if _demanded(t, number)]
        fresh = _ranked([t.model for t in good], groups)
        if not fresh:
            break
        size = _common([fresh[0]], groups)
        most = LIMITS.close * _loss(fresh[0], size, groups)
        kept = [m for m in fresh[: LIMITS.beam] if _loss(m, size, groups) < most]
        sharper = searching(fresh[0].fit)
        carried = _ranked([reweighed(m, sharper, groups) for m in kept], groups)
        rival = best if best.fit.problem.fine == carried[0].fit.problem.fine else None
        if rival is None or not number or _better(carried[0], reweighed(rival, sharper, groups), groups):
            best = carried[0]
        if quiet(best.fit):
            break
        beam = [(m, None) for m in carried]
    final = _pruned(best, groups)
    return Selection(first, tuple(rounds), final, groups, answers)


def _ranked(models: Sequence[Model], groups: Groups) -> list[Model]:
    """By loss on data left out, each set of terms once."""
    found: dict[frozenset[str], Model] = {}
    if not models:
        return []
    size = _common(models, groups)
    for m in sorted(models, key=lambda m: _loss(m, size, groups)):
        found.setdefault(frozenset(t.name for t in m.terms), m)
    return list(found.values())


def _demanded(t: Tried, number: int) -> bool:
    """Whether data left out demand what a round tried."""
    return t.lead.z > (LIMITS.z if number else LIMITS.z_first) and t.lead.gain > LIMITS.gain


def _better(model: Model, than: Model, groups: Groups) -> bool:
    """Whether a model is worth its further terms."""
    step = lead(model.left_out, than.left_out, groups)
    return step.z > LIMITS.z and step.gain > LIMITS.gain


def _one_round(
    model: Model,
    nominal: Fit | None,
    pool: Sequence[Hypothesis],
    groups: Groups,
    rng: np.random.Generator,
    progress: Progress,
    number: int,
    cold: Mapping[str, float] | None,
) -> tuple[Round, tuple[Answer, ...]]:
    anchors = [anchor(f) for f in (model.fit, nominal) if f is not None]
    names = {t.name for t in model.terms}
    ids = {t.effect.id for t in model.terms if isinstance(t, Hypothesis)}
    left = [h for h in pool if h.name not in names and (h.effect.id not in ids or h.effect.texts)]
    done = number / LIMITS.rounds

    def answer(h: Hypothesis) -> list[Answer]:
        progress(f"asking {h.name}", done)
        return ask_all(anchors, h)

    answers = [a for a in side_by_side(answer, left) if a]
    before = 0.5 * float(model.fit.residual @ model.fit.residual)
    fine = _finely(model, groups) if any(_wants_rates(a[0], model, before) for a in answers) else None
    if fine is not None:
        there = [anchor(fine.fit)]
        answers = [
            (ask_all(there, a[0].hypothesis) or a) if _wants_rates(a[0], model, before) else a
            for a in answers
        ]
    dependences = (
        [] if number == 0 and not model.fit.problem.parameters else ask_dependences(model.fit, model.terms)
    )
    promised = {a[0].hypothesis.name: before / max(a[0].cost, 1e-12) for a in answers}
    promised |= {d.name: before / max(c, 1e-12) for d, c, _ in dependences}
    trades = cold is not None and number > 0
    worth = [a for a in answers if a[0].cost < LIMITS.promise * before or (trades and a[0].hypothesis.trades)]
    if number > 0:
        worth = sorted(worth, key=lambda a: a[0].cost)[: LIMITS.tried_later]
    promising = max(LIMITS.promising - 2 * number, LIMITS.promising // 2)

    def begin(a: list[Answer]) -> Fit | None:
        progress(f"trying {a[0].hypothesis.name}", done)
        return rough(a, LIMITS.rough, cold if a[0].hypothesis.trades else None)

    roughs = side_by_side(begin, worth)
    ranked: list[tuple[float, tuple[Term, ...], Problem, FloatArray]] = []
    for f, a in zip(roughs, worth, strict=True):
        if f is not None:
            ranked.append((f.cost, (a[0].hypothesis,), f.problem, f.x))
    for found in side_by_side(lambda c: _by_conditions(c), list(ranked)):
        ranked += found
    for d, cost, problem in dependences:
        ranked.append((cost, (d,), problem, _placed(model.fit, problem)))
    ranked.sort(key=lambda c: c[0])
    top = ranked[0][0] if ranked else 0.0
    chosen = [
        c
        for k, c in enumerate(ranked[:promising])
        if c[0] < before and (k < 2 or c[0] < LIMITS.hopeless * top)
    ]

    def finish(c: tuple[float, tuple[Term, ...], Problem, FloatArray]) -> Model | None:
        progress(f"fitting {c[1][0].name}", done)
        try:
            fit = solve(c[2], c[3], 15, LIMITS.tolerance)
        except InputError:
            return None
        ratio = 1.0
        if fine is not None and fit.problem.fine:
            size = scales(model.left_out, groups)
            ratio = _loss(model, size, groups) / max(_loss(fine, size, groups), 1e-300)
        return Model((*model.terms, *c[1]), fit, left_out(fit, groups), ratio)

    models = [m for m in side_by_side(finish, chosen) if m is not None]
    leads = {
        m.name: lead(
            m.left_out, fine.left_out if fine is not None and m.fit.problem.fine else model.left_out, groups
        )
        for m in models
    }
    shares = selected_in({n: v.by_block for n, v in leads.items()}, rng)
    first = len(model.terms)
    tried = [Tried(m.terms[first], m, leads[m.name], shares[m.name]) for m in models]
    tried.sort(key=lambda t: -t.lead.gain)
    good = [t for t in tried if _demanded(t, number)]
    return Round(model, promised, tuple(tried), good[0] if good else None), tuple(
        x for a in answers for x in a
    )


def searching(fit: Fit) -> Weighing:
    """Weights for a search beyond this fit: a part of what it leaves of each channel, never below the sensor's noise."""
    problem = fit.problem
    sigma = {}
    for c in problem.channels:
        noise = float(np.sqrt(np.mean([e.noise.get(c, 0.0) ** 2 for e in problem.evidence])))
        sigma[c] = max(LIMITS.search_weight * rms_left(fit, c), noise, 1e-12)
    # zeros may not take up what an effect could explain: an offset that follows the load is a compliance
    spread = {
        c: float(np.clip(problem.weighing.zero_sd.get(c, 0.0), 0.1 * sigma[c], LIMITS.zero * sigma[c]))
        for c in problem.channels
    }
    return Weighing(sigma, spread)


def reweighed(model: Model, weighing: Weighing, groups: Groups) -> Model:
    """The model refitted with other weights."""
    fit = refit(model.fit, weighing, 6)
    return replace(model, fit=fit, left_out=left_out(fit, groups))


def _cold(pool: Sequence[Hypothesis], baseline: Fit) -> dict[str, float] | None:
    """Where every effect would begin beside the nominal drive; None where the drive is known better than by order of magnitude
    (calibration then stays in its valley)."""
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
        found |= {f"effect.{h.effect.id}.{k}": v for k, v in values.items() if not isinstance(v, str)}
    return found


def _wants_rates(a: Answer, model: Model, before: float) -> bool:
    return (
        a.hypothesis.effect.rates
        and not model.fit.problem.fine
        and before / max(a.cost, 1e-12) > LIMITS.worth_rates
    )


def _finely(model: Model, groups: Groups) -> Model:
    """The model run on every sample: what a law with rates is compared with."""
    fit = solve(model.fit.problem.finely(), model.fit.x, 4)
    return Model(model.terms, fit, left_out(fit, groups))


def quiet(fit: Fit) -> bool:
    """Whether all that is left of every channel is its sensor's noise."""
    problem = fit.problem
    for c in problem.channels:
        noise = float(np.sqrt(np.mean([e.noise.get(c, 0.0) ** 2 for e in problem.evidence])))
        if rms_left(fit, c) > np.sqrt(LIMITS.quiet) * noise:
            return False
    return True


def _by_conditions(
    c: tuple[float, tuple[Term, ...], Problem, FloatArray],
) -> list[tuple[float, tuple[Term, ...], Problem, FloatArray]]:
    """The same effect with an amount that grows with a condition, for each condition of three values and more."""
    cost, (term,), problem, x = c
    assert isinstance(term, Hypothesis)
    found: list[tuple[float, tuple[Term, ...], Problem, FloatArray]] = []
    for condition in problem.evidence[0].condition:
        values = [e.condition[condition] for e in problem.evidence]
        if len(set(values)) < 3:
            continue
        name = f"effect.{term.effect.id}.{term.amount.name}"
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
        if fit.cost < LIMITS.promise * cost:
            found.append((fit.cost, (term, Dependence(name, condition)), fit.problem, fit.x))
    return found


def _placed(fit: Fit, problem: Problem) -> FloatArray:
    """Coordinates of a changed problem: what has the same name, or the same base, stands where it stood."""
    before = dict(
        zip((p.name for p in fit.problem.parameters), fit.problem.values(fit.x).values(), strict=True)
    )
    return np.array(
        [
            p.x(before.get(p.name, before.get(p.base, p.start) if not p.condition else 0.0))
            for p in problem.parameters
        ]
    )


def _common(models: Sequence[Model], groups: Groups) -> FloatArray:
    """One yardstick for several models: of each channel, what the best of them leaves."""
    return np.asarray(np.min([scales(m.left_out, groups) for m in models], axis=0), dtype=np.float64)


def _loss(model: Model, size: FloatArray, groups: Groups) -> float:
    """Loss on data left out by a common yardstick."""
    return model.by_thinning * float(np.sum(block_losses(model.left_out, size, groups)))


def without(model: Model, term: Term, groups: Groups) -> Model | None:
    """The model without one of its terms, refitted."""
    kept = tuple(t for t in model.terms if t is not term)
    problem = _stripped(model.fit.problem, term)
    start = _placed(model.fit, problem)
    try:
        fit = solve(problem, start, 10, LIMITS.tolerance)
    except InputError:
        return None
    return Model(kept, fit, left_out(fit, groups))


def _stripped(problem: Problem, term: Term) -> Problem:
    if isinstance(term, Dependence):
        return term.undone(problem)
    entries = tuple(e for e in problem.config.effect if not _is(e.id, e.parameters, term))
    free = tuple(p for p in problem.parameters if not p.name.startswith(f"effect.{term.effect.id}."))
    return replace(problem, config=problem.config.model_copy(update={"effect": entries}), parameters=free)


def _is(identifier: str, parameters: Mapping[str, object], term: Hypothesis) -> bool:
    channel = term.name.partition(":")[2]
    return identifier == term.effect.id and (not channel or channel in parameters.values())


def _pruned(model: Model, groups: Groups) -> Model:
    """Leave out, weakest first, every term whose absence costs less than an effect has to bring."""
    while len(model.terms) > 1:
        weakest: tuple[float, Model] | None = None
        for term in model.terms[:-1]:
            if any(isinstance(t, Dependence) and t.belongs_to(term) for t in model.terms):
                continue
            smaller = without(model, term, groups)
            if smaller is None:
                continue
            step = lead(model.left_out, smaller.left_out, groups)
            if (step.z < LIMITS.z or step.gain < LIMITS.gain) and (weakest is None or step.gain < weakest[0]):
                weakest = (step.gain, smaller)
        if weakest is None:
            return model
        model = weakest[1]
    return model


def rivals(
    model: Model, term: Hypothesis, pool: Sequence[Hypothesis], groups: Groups, rng: np.random.Generator
) -> tuple[tuple[str, ...], dict[str, Lead]]:
    """Effects that stand in for a term as well (its model confidence set, itself left out), and the term's lead over each
    that was tried in its place."""
    base = without(model, term, groups)
    if base is None:
        return (), {}
    here = anchor(base.fit)
    names = {t.name for t in model.terms}
    before = 0.5 * float(base.fit.residual @ base.fit.residual)
    asked = side_by_side(lambda h: ask_all([here], h), [h for h in pool if h.name not in names])
    answers = [a for a in asked if a and a[0].cost < LIMITS.promise * before]
    answers = sorted(answers, key=lambda a: a[0].cost)[: LIMITS.promising - 2]
    fitted = side_by_side(lambda a: rough(a, LIMITS.rough), answers)
    roughs = sorted(
        ((f, a[0]) for f, a in zip(fitted, answers, strict=True) if f is not None), key=lambda p: p[0].cost
    )
    size = scales(model.left_out, groups)
    losses = {term.name: block_losses(model.left_out, size, groups)}
    leads: dict[str, Lead] = {}
    chosen = roughs[: LIMITS.promising // 2]
    fits = side_by_side(lambda p: _tried(p[0]), chosen)
    for fit, (_, a) in zip(fits, chosen, strict=True):
        if fit is None:
            continue
        other = Model((*base.terms, a.hypothesis), fit, left_out(fit, groups))
        leads[a.hypothesis.name] = lead(model.left_out, other.left_out, groups)
        losses[a.hypothesis.name] = block_losses(other.left_out, size, groups)
    kept = confidence_set(losses, rng)
    return tuple(n for n in kept if n != term.name), leads


def _tried(fit: Fit) -> Fit | None:
    try:
        return solve(fit.problem, fit.x, 10, LIMITS.tolerance)
    except InputError:
        return None


__all__ = ["Anchor", "Model", "Round", "Selection", "Tried", "rivals", "select", "without"]
