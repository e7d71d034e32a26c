"""Which effects stand in for a named one as well: each tried in its place, the set that data left out cannot
tell apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from cablecomp.diagnosis.explain.courses import how_far
from cablecomp.diagnosis.explain.dependence import ask_dependences
from cablecomp.diagnosis.explain.discrepancy import left_out_with_discrepancy
from cablecomp.diagnosis.explain.events import course_of
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.linear import anchor, likeliest
from cablecomp.diagnosis.explain.model import Model, or_known, placed
from cablecomp.diagnosis.explain.plausible import better_word
from cablecomp.diagnosis.explain.scores import (
    ScoreDifference,
    block_losses,
    left_out,
    left_out_linearly,
    model_confidence_set,
    scales,
    score_difference,
    selected_in,
)
from cablecomp.diagnosis.explain.screening import ask_all, rough
from cablecomp.diagnosis.explain.seen import Seen
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.parallel import in_processes
from cablecomp.signal.smoothing import FloatArray

ALONE: Final = ScoreDifference(1.0, 99.0, 10.0)
"""Of an effect without which the drive cannot follow the recordings."""
NO_RIVAL: Final = ScoreDifference(1.0, 10.0, 10.0)
"""Of an effect in whose place nothing could be tried."""


class Rivals(NamedTuple):
    """What was tried in a term's place."""

    effects: tuple[str, ...] = ()
    """Those that stand in for it as well: its model confidence set, itself left out."""
    plain: tuple[str, ...] = ()
    """What is no effect and explains as much: a step of a zero, a drive mounted anew."""
    differences: Mapping[str, ScoreDifference] = MappingProxyType({})
    """The term's score against each that was tried."""
    models: Mapping[str, Model] = MappingProxyType({})
    """The model with each effect that was tried in its place."""
    lesser: tuple[str, ...] = ()
    """Those of them that claim more than the term and predict no better (`lesser`)."""
    selected_in: float = 1.0
    """Share of resampled data in which the term is the best of these."""
    any_form: ScoreDifference = ALONE
    """The term's score over the model without it where it may have another form of its own."""
    any_form_ahead: ScoreDifference = NO_RIVAL
    """The same against the nearest of the effects in its place, which may have other forms of theirs."""


def rivals(
    model: Model,
    term: Hypothesis,
    base: Model,
    pool: Sequence[Hypothesis],
    groups: Groups,
    seen: Seen,
    known: Sequence[Model],
    rng: np.random.Generator,
) -> Rivals:
    """Every effect that promises something, and for an event what is none, fitted in a term's place: beside `base`,
    the model without it, or as a `known` model has it; `seen`: what the search saw of them."""
    here = anchor(base.fit, seen=seen)
    beside = [t for t in base.terms if isinstance(t, Hypothesis)]
    ids = {t.effect.id for t in beside}
    before = 0.5 * float(base.fit.residual @ base.fit.residual)
    others = [h for h in pool if h.effect.id not in ids and not h.same_as(term)]
    others = likeliest(here, others, LIMITS.asked_later, lambda h: False)
    asked = in_processes(lambda h: ask_all([here], h), others)
    answers = [a for a in asked if a and a[0].cost < LIMITS.promise * before]
    answers = sorted(answers, key=lambda a: a[0].cost)[: LIMITS.promising - 2]
    fitted = [next(iter(f), None) for f in in_processes(lambda a: rough(a, LIMITS.rough), answers)]
    roughs = sorted(
        ((f, a[0]) for f, a in zip(fitted, answers, strict=True) if f is not None), key=lambda p: p[0].cost
    )
    left_by = partial(left_out_with_discrepancy, beside=beside, groups=groups, usual=term.has_instant)
    mine = left_by(model)
    size = scales(mine, groups)
    losses = {term.name: block_losses(mine, size, groups)}
    mine_freely = left_by(model, own=term)
    differences: dict[str, ScoreDifference] = {}
    freely: list[ScoreDifference] = []
    models: dict[str, Model] = {}
    chosen = roughs[: LIMITS.promising // 2]
    fits = in_processes(lambda p: _tried(p[0]), chosen)
    for fit, (_, a) in zip(fits, chosen, strict=True):
        # what only its most extreme shape fits is another effect's to explain
        if fit is None or better_word(fit, a.hypothesis):
            continue
        begun = Model((*base.terms, a.hypothesis), fit, left_out(fit, groups))
        other = or_known(begun, begun.added, model, known, groups) or begun
        if better_word(other.fit, a.hypothesis):
            other = begun
        models[a.hypothesis.name] = other
        theirs = left_by(other)
        differences[a.hypothesis.name] = score_difference(mine, theirs, groups)
        theirs_freely = left_by(other, own=a.hypothesis)
        freely.append(score_difference(mine_freely, theirs_freely, groups))
        losses[a.hypothesis.name] = block_losses(theirs, size, groups)
        if term.has_instant and a.hypothesis.has_instant:
            own, its = left_by(model, event=term), left_by(other, event=a.hypothesis)
            step = score_difference(own, its, groups)
            if step.z > differences[a.hypothesis.name].z:  # told apart where either way tells
                differences[a.hypothesis.name] = step
                behind = block_losses(its, size, groups) - block_losses(own, size, groups)
                losses[a.hypothesis.name] = losses[term.name] + behind
    kept = model_confidence_set(losses, rng)
    plain = _plain(model, base, term, groups)
    effects = tuple(n for n in kept if n != term.name)
    best = selected_in(losses, rng)
    return Rivals(
        effects,
        tuple(plain),
        {**differences, **plain},
        models,
        lesser(term, others, differences),
        best[term.name],
        score_difference(mine_freely, left_by(base), groups),
        min(freely, key=lambda d: d.z, default=NO_RIVAL),
    )


def lesser(
    term: Hypothesis, others: Sequence[Hypothesis], differences: Mapping[str, ScoreDifference]
) -> tuple[str, ...]:
    """Which others claim more than the term and predict no better, or by chance: a slip is a plain step of the reading,
    and an event that does no clearly better than a step stands in for none. `differences`: the term's against each."""
    if not term.effect.steps:
        return ()
    events = [h.name for h in others if h.has_instant and not h.effect.steps and h.name in differences]
    return tuple(
        n for n in events if differences[n].gain >= -LIMITS.tie or differences[n].z > -LIMITS.z_lesser
    )


class Plain(NamedTuple):
    """What is no effect, in a term's place: its name, what it leaves of data left out, and by how many standard errors
    the term has to predict better, or it stands in for the term."""

    name: str
    left_out: FloatArray
    z: float


def _plain(model: Model, base: Model, term: Hypothesis, groups: Groups) -> dict[str, ScoreDifference]:
    """What is no effect and stands in for a term, with the term's score against it."""
    found: dict[str, ScoreDifference] = {}
    for plain in (_zero_step(model, base, term, groups), _mounted_anew(base, groups)):
        if plain is not None:
            step = score_difference(model.left_out, plain.left_out, groups)
            if step.z < plain.z:
                found[plain.name] = step
    return found


def _zero_step(model: Model, base: Model, term: Hypothesis, groups: Groups) -> Plain | None:
    """A plain step, or creep, of the joint's zero in place of an event, as that goes; none while a recording lasts for
    one that may itself be such a step (nobody sets a zero then; between recordings it may be either)."""
    if not term.has_instant:
        return None
    course = course_of(model.fit, term)
    fit, problem = base.fit, base.fit.problem
    if term.effect.steps and any(_lasts_at(e, course.instant_s) for e in problem.evidence):
        return None
    after = [how_far(course, e.at_rows("time_s")) for e in problem.evidence]
    struck = next((e.session for e, a in zip(problem.evidence, after, strict=True) if a.any()), None)
    rows = [
        (e.weight * a * (e.session == struck))[e.counted[JOINT]] / problem.weighing.sigma[JOINT]
        for e, a in zip(problem.evidence, after, strict=True)
        if JOINT in e.counted
    ]
    column = np.zeros(len(fit.residual))
    first = problem.spans()[JOINT].start
    projected = problem.bases[JOINT].project(np.concatenate(rows))
    column[first : first + len(projected)] = projected
    A = np.column_stack((fit.J, column))
    step = np.linalg.lstsq(A, -fit.residual, rcond=None)[0]
    left = left_out_linearly(fit.residual + A @ step, A, groups)
    return Plain("a step of the joint encoder's zero", left, LIMITS.z_zero_step)


def _lasts_at(e: Evidence, instant_s: float) -> bool:
    time = e.columns["time_s"]
    return float(time[0]) <= instant_s <= float(time[-1])


def _mounted_anew(base: Model, groups: Groups) -> Plain | None:
    """A pretension of each session's own: sessions follow each other in time, and what lies between two looks like an
    instant; cables less tight look like a coupling that yields."""
    for dependence, _, problem in ask_dependences(base.fit, base.terms, groups.by):
        if dependence.mounted_anew:
            try:
                fit = solve(problem, placed(base.fit, problem), 10, LIMITS.tolerance)
            except InputError:
                return None
            return Plain("a pretension of each session's own", left_out(fit, groups), LIMITS.z)
    return None


def _tried(fit: Fit) -> Fit | None:
    try:
        return solve(fit.problem, fit.x, 10, LIMITS.tolerance, fit.J)
    except InputError:
        return None
