"""A drive with what was added to it: fitted, left out, compared with others by one yardstick; what a selection
consists of."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeGuard

import numpy as np

from cablecomp.config import EffectEntry, JointConfig
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.plausible import amount_of, falls_between, runs_away
from cablecomp.diagnosis.explain.scores import ScoreDifference, block_losses, left_out, scales
from cablecomp.diagnosis.explain.seen import Seen
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects import Parameter
from cablecomp.errors import InputError, SlackError
from cablecomp.estimation.departures import set_anew
from cablecomp.estimation.evidence import JOINT, Evidence, load_channel, noise_rms, rms_by_time
from cablecomp.estimation.history import with_own_carryover
from cablecomp.estimation.least_squares import Fit, derivative_of_rest, refit, rms_of_rows, solve
from cablecomp.estimation.limits import MOVED_SD
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.signal.smoothing import FloatArray

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

    @cached_property
    def carried(self) -> Fit:
        """Its fit about recordings with what its own drive carries over of unknown histories."""
        return with_own_carryover(self.fit)

    @property
    def added(self) -> frozenset[str]:
        """Names of what was added, in whatever order."""
        return frozenset(t.name for t in self.terms)

    @property
    def physics(self) -> frozenset[str]:
        """The same, whatever channel an effect reads that may do without."""
        return frozenset(t.name.replace(f":{t.channel}", "") if _may_read(t) else t.name for t in self.terms)


def _may_read(term: Term) -> TypeGuard[Hypothesis]:
    """Whether it is an effect that reads a channel and may do without."""
    return isinstance(term, Hypothesis) and term.channel != "" and term.effect.texts_optional


@dataclass(frozen=True)
class Tried:
    """One hypothesis of a round: its model, its score against the model before, share of resampled data in
    which it was best."""

    term: Term
    model: Model
    difference: ScoreDifference
    selected_in: float


@dataclass(frozen=True)
class Round:
    """One step: what was fitted, what was taken; models in which an effect alone left what is plausible of it, which
    are no answers."""

    base: Model
    tried: tuple[Tried, ...]
    accepted: Tried | None
    away: tuple[Model, ...] = ()


@dataclass(frozen=True)
class Selection:
    """The calibrated drive, the rounds, the final model; what was asked beside its models does."""

    baseline: Model
    rounds: tuple[Round, ...]
    final: Model
    groups: Groups
    seen: Seen

    @property
    def known(self) -> list[Model]:
        """Every model that was fitted to the end on the way."""
        return [self.baseline, *fitted_in(self.rounds)]


def fitted_in(rounds: Sequence[Round]) -> list[Model]:
    """The models of these rounds that were fitted to the end."""
    return [t.model for r in rounds for t in r.tried]


def ranked(models: Sequence[Model], groups: Groups) -> list[Model]:
    """By loss on data left out, each set of physics once: of two that end alike (an effect asked for by two of its
    amounts, of which one ends at none; with a channel that it may do without, and without) that of fewer parameters."""
    found: dict[frozenset[str], Model] = {}
    if not models:
        return []
    size = common(models, groups)
    for m in sorted(models, key=lambda m: loss(m, size, groups)):
        best = found.setdefault(m.physics, m)
        fewer = len(m.fit.problem.parameters) < len(best.fit.problem.parameters)
        if fewer and loss(m, size, groups) <= (1.0 + LIMITS.tie) * loss(best, size, groups):
            found[m.physics] = m
    return list(found.values())


def common(models: Sequence[Model], groups: Groups) -> FloatArray:
    """One yardstick for several models: of each channel, what the best of them leaves."""
    return np.asarray(np.min([scales(m.left_out, groups) for m in models], axis=0), dtype=np.float64)


def loss(model: Model, size: FloatArray, groups: Groups) -> float:
    """Loss on data left out by a common yardstick."""
    return model.by_thinning * float(np.sum(block_losses(model.left_out, size, groups)))


def searching(fit: Fit) -> Weighing:
    """Weights for a search beyond this fit: a part of what it leaves of each channel, never below the sensor's
    noise."""
    problem = fit.problem
    sigma = {}
    for c in problem.channels:
        sigma[c] = max(LIMITS.search_weight * rms_of_rows(fit, c), noise_rms(problem.evidence, c), 1e-12)
    # zeros may not take up what an effect could explain: an offset that follows the load is a compliance. Where there
    # are recordings enough to tell, a zero keeps what it counts for among rows that remember each other
    told = len(problem.evidence) >= LIMITS.recordings
    spread = {}
    for c in problem.channels:
        usual = problem.weighing.zero_sd.get(c, 0.0) * (sigma[c] / problem.weighing.sigma[c] if told else 1.0)
        spread[c] = float(np.clip(usual, 0.1 * sigma[c], LIMITS.zero * sigma[c]))
    before = problem.weighing
    anew = before.moved if told else _moved(fit)
    far = spread if told else {c: max(spread[c], sigma[c]) for c in sigma}
    moved = {c: dict.fromkeys(names, MOVED_SD * far[c]) for c, names in anew.items()}
    return Weighing(sigma, spread, moved, before.history)


def _moved(fit: Fit) -> dict[str, frozenset[str]]:
    """Of few recordings those whose zero was set anew, now that less is left."""
    problem = fit.problem
    zeros, past = problem.zeros(fit.x), problem.weighing.history
    return {
        c: set_anew(problem, c, zeros[c], problem.left(fit.x, c), past.get(c, 0.0))
        for c in problem.weighing.moved
    }


def reweighed(model: Model, weighing: Weighing, groups: Groups) -> Model:
    """The model refitted with other weights, and with what its own drive carries over of unknown histories."""
    fit = refit(model.carried, weighing, LIMITS.settled)
    return replace(model, fit=fit, left_out=left_out(fit, groups))


def best_resolved(fit: Fit, term: Hypothesis, pool: Sequence[Hypothesis]) -> Hypothesis:
    """The same effect by that of its amounts of which the fit found most: all of them are free in it."""
    same = [h for h in pool if (h.effect.id, h.channel) == (term.effect.id, term.channel)]
    values = fit.values

    def share(h: Hypothesis) -> float:
        value = values.get(h.key(h.amount.name), h.amount.neutral)
        return abs(value - h.amount.neutral) / max(abs(b) for b in h.amount.bounds(fit.problem.config))

    return max(same, key=share) if len(same) > 1 else term


def no_answer(fit: Fit, term: Term) -> str:
    """Why a term, as fitted, is none, in words: an effect's amount is none, an event is where no recording shows it; ""
    where it is one."""
    if isinstance(term, Hypothesis) and falls_between(fit, term):
        return "it falls between recordings or at an end of one; they differ in more than that"
    return "" if amount_resolved(fit, term) else "its amount is not told from none"


def lost(fit: Fit, term: Term) -> bool:
    """Whether a term, as fitted, is no answer, or an effect that has left what is plausible of it."""
    return no_answer(fit, term) != "" or (isinstance(term, Hypothesis) and runs_away(fit, term))


def amount_resolved(fit: Fit, term: Term) -> bool:
    """Whether an effect's own amount is more than none: a guide without friction is free cable, and yields as such.
    What depends on a condition may be none where that is none."""
    found = amount_of(fit, term) if isinstance(term, Hypothesis) else None
    if found is None or any(p.name.startswith(f"{found[0].name}~") for p in fit.problem.parameters):
        return True
    assert isinstance(term, Hypothesis)
    return abs(found[1] - term.amount.neutral) > least(term.amount, fit.problem.config)


def least(amount: Parameter, config: JointConfig) -> float:
    """What counts as none of an amount: far below the least that is plausible where that is known by orders of
    magnitude, else a small share of what is plausible."""
    low, high = amount.bounds(config)
    return LIMITS.none_of_least * low if amount.log else LIMITS.none * max(abs(low), abs(high))


def bears(fit: Fit) -> bool:
    """Whether the fitted drive can be run at `LIMITS.beyond` times the loads that it was fitted to: what falls apart
    just beyond its data predicts nothing there. An open circuit whose cable slackens says what no law can change."""
    problem = fit.problem
    stages = tuple(s.model_copy(update={"breaking_force_N": None}) for s in problem.config.drive.stage)
    drive = problem.config.drive.model_copy(update={"stage": stages})
    unbroken = replace(problem, config=problem.config.model_copy(update={"drive": drive}))
    try:
        for times in LIMITS.beyond:
            further = tuple(_loaded(problem.config, e, times) for e in problem.evidence)
            replace(unbroken, evidence=further).misfits(fit.x)
    except SlackError:
        return True
    except InputError:
        return False
    return True


def _loaded(config: JointConfig, e: Evidence, times: float) -> Evidence:
    """A recording with its load so many times as large."""
    load = load_channel(config, e.columns)
    return e if load is None else replace(e, columns={**e.columns, load: times * e.columns[load]})


def finely(model: Model, groups: Groups) -> Model:
    """The model run on every sample: what a law with rates is compared with."""
    fit = solve(model.fit.problem.finely(), model.fit.x, 4, J=model.fit.J)
    return Model(model.terms, fit, left_out(fit, groups))


def without(model: Model, term: Term, groups: Groups, known: Sequence[Model] = ()) -> Model | None:
    """The model without one of its terms, refitted; or a `known` one of just the terms that are left (`or_known`): an
    effect is not missed because the others stand in a valley, or have shapes, that are theirs only beside it."""
    kept = tuple(t for t in model.terms if t is not term)
    problem = stripped(model.fit.problem, term)
    start = placed(model.fit, problem)
    found = None
    try:
        fit = solve(problem, start, LIMITS.settled, LIMITS.tolerance, derivative_of_rest(model.fit, problem))
        found = Model(kept, fit, left_out(fit, groups))
    except InputError:
        pass
    return or_known(found, frozenset(t.name for t in kept), model, known, groups)


def or_known(
    found: Model | None, names: frozenset[str], like: Model, known: Sequence[Model], groups: Groups
) -> Model | None:
    """The model that was found, or the best `known` one of these terms, with the weights of the model that it is held
    against (`like`), where that predicts better."""
    problem, rows = like.fit.problem, len(like.left_out)
    of_these = [
        m
        for m in known
        if m.added == names and m.fit.problem.fine == problem.fine and len(m.left_out) == rows
    ]
    if not of_these:
        return found
    size = common([like, *of_these], groups)
    best = min(of_these, key=lambda m: loss(m, size, groups))
    if found is not None and loss(best, size, groups) >= loss(found, size, groups):
        return found
    best = reweighed(best, problem.weighing, groups)
    return best if found is None or loss(best, size, groups) < loss(found, size, groups) else found


def stripped(problem: Problem, term: Term) -> Problem:
    if isinstance(term, Dependence):
        return term.undone(problem)
    entries = tuple(e for e in problem.config.effect if not _is(e.id, e.parameters, term))
    free = tuple(p for p in problem.parameters if not p.name.startswith(f"effect.{term.effect.id}."))
    return replace(problem, config=problem.config.model_copy(update={"effect": entries}), parameters=free)


def moves_rad(model: Model, term: Hypothesis) -> float | None:
    """By how much an effect moves the joint's angle as it is fitted, RMS by time about each recording's mean [rad];
    None where the drive cannot follow the recordings without it."""
    fit = model.fit
    problem = stripped(fit.problem, term)
    try:
        less = problem.misfits(placed(fit, problem))[JOINT]
    except InputError:
        return None
    moves, weights = [], []
    for e, a, b in zip(problem.evidence, less, fit.problem.misfits(fit.x)[JOINT], strict=True):
        here = e.counted.get(JOINT)
        if here is not None and here.any():
            weight, moved = e.weight[here], (a - b)[here]
            moves.append(moved - np.average(moved, weights=weight**2))
            weights.append(weight)
    return rms_by_time(np.concatenate(moves), np.concatenate(weights))


def left_off(problem: Problem, keys: Collection[str]) -> Problem:
    """The problem without these parameters of effects (by full name): a configuration that leaves them out."""
    entries = tuple(
        EffectEntry(id=e.id, **{k: v for k, v in e.parameters.items() if f"effect.{e.id}.{k}" not in keys})
        for e in problem.config.effect
    )
    free = tuple(p for p in problem.parameters if p.base not in keys)
    return replace(problem, config=problem.config.model_copy(update={"effect": entries}), parameters=free)


def _is(identifier: str, parameters: Mapping[str, object], term: Hypothesis) -> bool:
    return identifier == term.effect.id and (not term.channel or term.channel in parameters.values())


def placed(fit: Fit, problem: Problem) -> FloatArray:
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
