"""The search, start to end: hypotheses compared among a spread few of the recordings, what is found fitted to all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cablecomp.diagnosis.body import spread
from cablecomp.diagnosis.calibration.drive import Calibrated
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import (
    Model,
    Selection,
    Term,
    bears,
    common,
    left_off,
    loss,
    lost,
    placed,
    stripped,
    without,
)
from cablecomp.diagnosis.explain.scores import left_out
from cablecomp.diagnosis.explain.selection import select
from cablecomp.diagnosis.explain.ties import implausible
from cablecomp.diagnosis.explain.turned import told
from cablecomp.diagnosis.folds import Groups, make_groups
from cablecomp.diagnosis.pace import Pace
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.history import with_own_carryover, zero_by_history
from cablecomp.estimation.least_squares import Fit, covariance, derivative_of_part, refit, solve, weighed


@dataclass(frozen=True)
class Search:
    """What a search came to.

    `pool`: every hypothesis, also what these recordings cannot tell. `selection`: its rounds and its model, about the
    recordings searched. `final`: that model about all recordings; `groups`: what of these is left out in turn.
    `cut_short`: the time was up. `put_in`: names of terms that no round chose, put in the place of others afterwards.
    """

    pool: Sequence[Hypothesis]
    selection: Selection
    final: Model
    groups: Groups
    cut_short: bool
    put_in: frozenset[str] = frozenset()


def search(drive: Calibrated, pool: Sequence[Hypothesis], rng: np.random.Generator, pace: Pace) -> Search:
    """Find the model that data left out demand, beginning at the calibrated drive."""
    evidence = drive.fit.problem.evidence
    some = spread(evidence, LIMITS.searched)
    whole = len(some) == len(evidence)
    calibrated = drive.fit if whole else _about(drive.fit, some)
    nominal = drive.nominal if whole else _nominal(calibrated)
    groups = make_groups(calibrated)
    asked = told(pool, drive.fit.problem.config, evidence)
    selection = select(calibrated, nominal, asked, groups, rng, pace)
    cut_short = pace.over
    pace.tell("last fit", 0.9)
    final = _without_idle_growth(
        _settled(selection.final.terms, selection.final.fit, drive, groups), drive, groups
    )
    selection = replace(selection, final=final)
    if not whole:
        groups = make_groups(drive.fit)
        final = _about_all(final, drive, groups)
    return Search(pool, selection, final, groups, cut_short)


def done_without(found: Search, term: Term, drive: Calibrated) -> Search | None:
    """The search's model without one of its terms; None where it cannot follow the recordings then."""
    known = found.selection.known
    smaller = without(found.final, term, found.groups, known)
    if smaller is None:
        return None
    final = _settled(smaller.terms, smaller.fit, drive, found.groups)
    whole = found.selection.final is found.final
    about = final if whole else without(found.selection.final, term, found.selection.groups, known)
    if about is None:
        return None
    return replace(found, final=final, selection=replace(found.selection, final=about))


def exchanged(found: Search, model: Model, drive: Calibrated) -> Search | None:
    """The search with another model about its recordings, with the weights of its own; None where that predicts no
    better, or is no answer."""
    before, groups = found.selection.final, found.selection.groups
    size = common([before], groups)
    effects = [t for t in model.terms if isinstance(t, Hypothesis)]
    answers = bears(model.fit) and not any(lost(model.fit, h) for h in effects)
    plausible = implausible(model) <= implausible(before)
    if not (answers and plausible and loss(model, size, groups) < loss(before, size, groups)):
        return None
    about = _settled(model.terms, model.fit, drive, groups)
    whole = before is found.final
    final = about if whole else _about_all(about, drive, found.groups)
    put_in = found.put_in | (model.added - before.added)
    return replace(found, final=final, selection=replace(found.selection, final=about), put_in=put_in)


def _about(fit: Fit, some: Sequence[Evidence]) -> Fit:
    """The fit about some of its recordings."""
    return solve(fit.problem.with_evidence(some), fit.x, 6, J=derivative_of_part(fit, some))


def _about_all(model: Model, drive: Calibrated, groups: Groups) -> Model:
    """The model about all recordings again: the calibrated drive where nothing was found."""
    if not model.terms:
        return without_effects(model, drive, groups)
    everything = model.fit.problem.with_evidence(drive.fit.problem.evidence)
    fit = with_own_carryover(solve(everything, model.fit.x, 8))
    return _settled(model.terms, fit, drive, groups)


def _nominal(fit: Fit) -> Fit:
    """The nominal drive about the same recordings, evaluated."""
    problem = fit.problem
    x = problem.start
    return Fit(problem, x, problem.residual(x), problem.jacobian(x))


def _settled(terms: tuple[Term, ...], fit: Fit, drive: Calibrated, groups: Groups) -> Model:
    """The fit with weights that its own remainder asks for, so that its uncertainties mean something; as it is where
    the drive cannot be followed with these."""
    # a calibrated drive may keep for ever what the law that it lacks forgets; where every run is dear, as it is
    floor = drive.floor if fit.problem.fine else drive.floor.with_history(zero_by_history(fit))
    for _ in range(2):
        try:
            fit = refit(fit, weighed(fit, floor), 6)
        except InputError:
            break
    return Model(terms, fit, left_out(fit, groups))


def _without_idle_growth(model: Model, drive: Calibrated, groups: Groups) -> Model:
    """The model without further amounts that go on growing and are not told from none: a controller would run away with
    them."""
    problem = model.fit.problem
    free = {p.name: k for k, p in enumerate(problem.parameters)}
    told = np.abs(model.fit.x) >= LIMITS.goes_on * np.sqrt(np.diag(covariance(model.fit)))
    idle: set[str] = set()
    for t in (t for t in model.terms if isinstance(t, Hypothesis)):
        for p in (p for p in t.effect.parameters if p.goes_on and p is not t.amount):
            if t.key(p.name) in free and not told[free[t.key(p.name)]]:
                idle |= {t.key(q.name) for q in t.effect.parameters if p.name in (q.name, q.of)}
    if not idle:
        return model
    smaller = left_off(problem, idle)
    try:
        fit = solve(smaller, placed(model.fit, smaller), LIMITS.settled, LIMITS.tolerance)
    except InputError:
        return model
    return _settled(model.terms, fit, drive, groups)


def without_effects(model: Model, drive: Calibrated, groups: Groups) -> Model:
    """The model with no effect in it: what differs between sessions or with a condition stays where it is the drive's
    own; the calibrated drive where nothing does."""
    own = tuple(t for t in model.terms if isinstance(t, Dependence) and t.of_drive)
    calibrated = Model((), drive.fit, left_out(drive.fit, groups))
    if not own:
        return calibrated
    if own == model.terms:
        return model
    problem = model.fit.problem
    for effect in (t for t in model.terms if isinstance(t, Hypothesis)):
        problem = stripped(problem, effect)
    try:
        fit = solve(problem, placed(model.fit, problem), LIMITS.settled, LIMITS.tolerance)
    except InputError:
        return calibrated
    return _settled(own, fit, drive, groups)
