"""Forward selection: rounds of hypotheses, the best by data left out; then done without what is not missed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from cablecomp.diagnosis.explain.asked_again import with_better_forms
from cablecomp.diagnosis.explain.beginning import Beginning, cold_starts
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import (
    Model,
    Round,
    Selection,
    Term,
    Tried,
    amount_resolved,
    bears,
    common,
    fitted_in,
    loss,
    ranked,
    reweighed,
    searching,
    without,
)
from cablecomp.diagnosis.explain.rounds import one_round
from cablecomp.diagnosis.explain.scores import demanded, left_out, score_difference
from cablecomp.diagnosis.explain.seen import Seen
from cablecomp.diagnosis.explain.ties import (
    alone_by_far,
    implausible,
    in_order,
    keeps,
    mounted_anew_for,
    outdoes,
    with_the_first,
    worth_its_terms,
)
from cablecomp.diagnosis.explain.usual import least_square
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.pace import Pace
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import noise_rms
from cablecomp.estimation.least_squares import Fit, rms_left
from cablecomp.estimation.parallel import in_processes
from cablecomp.estimation.problem import Weighing


def select(
    baseline: Fit,
    nominal: Fit | None,
    pool: Sequence[Hypothesis],
    groups: Groups,
    rng: np.random.Generator,
    pace: Pace,
) -> Selection:
    """Add what data left out demand, one at a time, `LIMITS.beam` models side by side; then leave out what is
    not missed.

    `nominal`: the drive as configured, evaluated: where calibration has paid for a missing effect, the way to
    the effect begins there. Once the time is up no further round begins.
    """
    sharp = searching(baseline)
    first = reweighed(Model((), baseline, left_out(baseline, groups)), sharp, groups)
    if nominal is not None:
        problem = nominal.problem.with_weighing(sharp)
        nominal = Fit(problem, nominal.x, problem.residual(nominal.x), problem.jacobian(nominal.x))
    beam: list[tuple[Model, Fit | None]] = [(first, nominal)]
    rounds: list[Round] = []
    latest: list[Round] = []
    cold = cold_starts(pool, baseline)
    below = first if cold is not None and len(baseline.problem.repeated) > 1 else None
    best, seen = first, Seen()
    for number in range(0 if quiet(baseline) else LIMITS.rounds + LIMITS.later_rounds):
        if number >= LIMITS.rounds:
            pool, beam = _still_demanded(pool, latest, best), beam[:1]
        if (pace.over and number) or not pool:
            break
        latest = []
        for model, start in beam:
            known = fitted_in((*rounds, *latest))
            latest.append(
                one_round(Beginning(model, start, pool, groups, pace, number, cold, known, seen), rng)
            )
        rounds += latest
        tried = [t for r in latest for t in r.tried]
        found = _carried(tried, groups, None if number == 0 else best)
        if found is None:
            break
        carried, sharper = found
        best = _reigning(best, carried, first, sharper, groups) if number else carried[0]
        if quiet(best.fit):
            break
        carried = sorted(carried, key=lambda m: m is not best)
        # a law that is run on every sample is a hundred times as dear: the best model alone goes on from there
        carried = carried[: 1 if carried[0].fit.problem.fine else LIMITS.beam]
        if below is not None and not carried[0].fit.problem.fine:
            below = carried[0] if number == 0 else _further_down(below, latest, sharper, groups)
            carried = _beside_doubtful(carried, below)
        beam = [(m, None) for m in carried]
    final = _pruned(best, rounds, groups)
    final = with_the_first(final, rounds, groups) if rounds else final
    return Selection(first, tuple(rounds), final, groups, seen)


def _beside_doubtful(carried: list[Model], below: Model | None) -> list[Model]:
    """The models carried on, with the plausible one that lies lowest beside them where one of them is not plausible."""
    if below is None or any(m.added == below.added for m in carried) or not any(map(implausible, carried)):
        return carried
    return [*carried, below]


def _further_down(below: Model, latest: Sequence[Round], sharper: Weighing, groups: Groups) -> Model | None:
    """The plausible model that lies lowest of those that extend `below`; None where there is none. Of a drive known by
    order of magnitude in several sessions, it may predict well only with a further effect beside it (friction of a
    jaw's motor halved the cost of its path and, without the stiffening cable, predicted the largest load worse)."""
    tried = [t.model for r in latest if r.base.added == below.added for t in r.tried]
    plain = [m for m in tried if implausible(m) == 0 and bears(m.fit)]
    if not plain:
        return None
    found = reweighed(min(plain, key=lambda m: m.fit.cost), sharper, groups)
    return found if all(amount_resolved(found.fit, t) for t in found.terms) else None


def _still_demanded(pool: Sequence[Hypothesis], latest: Sequence[Round], best: Model) -> list[Hypothesis]:
    """What data left out demanded in the latest rounds and the best model has not: another took off more each time."""
    names = {t.term.name for r in latest for t in r.tried if demanded(t.difference)} - best.added
    return [h for h in pool if h.name in names]


def _carried(
    tried: Sequence[Tried], groups: Groups, before: Model | None
) -> tuple[list[Model], Weighing] | None:
    """The models that data left out demand and that come near the best one, fitted to the weights that this one asks
    for, best first; with those weights. None where there is none. `before`: the best of earlier rounds; where the best
    now lacks an effect of it, what keeps these and predicts as well is carried on, too."""
    good = [t.model for t in tried if demanded(t.difference, first=before is None)]
    # first what has an answer: of one set of terms that come from two models, one may have none
    fresh = ranked([m for m in good if bears(m.fit)] or good, groups)
    if not fresh:
        return None
    size = common([fresh[0]], groups)
    most = LIMITS.close * loss(fresh[0], size, groups)
    near = [m for k, m in enumerate(fresh) if k <= LIMITS.beam or mounted_anew_for(m, fresh[0])]
    kept = [m for m in near if loss(m, size, groups) < most]
    if before is not None and not keeps(fresh[0], before):
        others = ranked(
            [t.model for t in tried if t.difference.gain > 0.0 and keeps(t.model, before)], groups
        )
        if others and not any(others[0] is m for m in kept) and not outdoes(fresh[0], others[0], groups):
            kept.append(others[0])
    sharper = searching(fresh[0].fit)
    again = list(in_processes(lambda m: with_better_forms(reweighed(m, sharper, groups), groups), kept))
    carried = ranked([m for m in again if all(amount_resolved(m.fit, t) for t in m.terms)], groups)
    if not carried:
        return None
    # of the same terms, put beside either model of the beam, the larger share stands
    shares = {t.model.added: t.selected_in for t in sorted(tried, key=lambda t: t.selected_in)}
    return in_order(carried, groups, shares), sharper


def _reigning(
    best: Model, carried: Sequence[Model], baseline: Model, sharper: Weighing, groups: Groups
) -> Model:
    """The model to go by: the first of those carried on that is worth its further terms, if it extends the best so
    far, or has fewer amounts that are not plausible, or takes off much that this one leaves, and predicts clearly
    better than one that extends this. Laws have other forms in reality, and two wrong ones can follow what is left of
    the right one a little more closely."""
    if best.fit.problem.fine != carried[0].fit.problem.fine:
        return carried[0]
    rival = reweighed(best, sharper, groups)
    base: Model | None = None
    worth = [m for m in carried if worth_its_terms(m, rival, groups)]
    for m in worth:
        if keeps(m, best) or implausible(m) < implausible(best):
            return m
        base = base or reweighed(baseline, sharper, groups)
        if _dethrones(m, rival, base, groups):
            return next((k for k in worth if keeps(k, best) and not outdoes(m, k, groups)), m)
    return best


def _dethrones(model: Model, best: Model, baseline: Model, groups: Groups) -> bool:
    """Whether a model takes off so much of what the best one leaves that it may do without effects of that one: the
    fewer of them, the less it has to."""
    size = common([model], groups)
    left = loss(best, size, groups)
    gone = left - loss(model, size, groups)
    taken_off = loss(baseline, size, groups) - left
    given_up = best.added - model.added
    part = len(given_up) / max(len(best.terms), 1)
    return gone > min(LIMITS.dethrone * taken_off, LIMITS.dethrone_left * part * left)


def quiet(fit: Fit) -> bool:
    """Whether all that is left of every channel is its sensor's noise, or too little to stand out of what the joint is
    known to leave."""
    problem = fit.problem
    return all(
        rms_left(fit, c) ** 2
        <= max(LIMITS.quiet * noise_rms(problem.evidence, c) ** 2, least_square(problem.config, c))
        for c in problem.channels
    )


def _pruned(model: Model, rounds: Sequence[Round], groups: Groups) -> Model:
    """Leave out, weakest first, every term whose absence costs less than it had to bring: the first of all as the
    first, the others as further ones. None whose part another takes up with an amount that is not plausible, nor what
    alone explains by far the most: that several others together do as well is chance rather than physics."""
    while len(model.terms) > 1:
        weakest: tuple[float, Model] | None = None
        bound = [t for t in model.terms if isinstance(t, Dependence)]
        asked = [
            term
            for term in model.terms[:-1]
            if not any(t.belongs_to(term) for t in bound) and not alone_by_far(rounds, term)
        ]
        fewer = in_processes(partial(_without, model, groups=groups, known=fitted_in(rounds)), asked)
        for term, smaller in zip(asked, fewer, strict=True):
            if smaller is None or implausible(smaller) > implausible(model):
                continue
            step = score_difference(model.left_out, smaller.left_out, groups)
            first = term is model.terms[0]
            if not demanded(step, first=first) and (weakest is None or step.gain < weakest[0]):
                weakest = (step.gain, smaller)
        if weakest is None:
            return model
        model = weakest[1]
    return model


def _without(model: Model, term: Term, groups: Groups, known: Sequence[Model]) -> Model | None:
    """The model without one of its terms; of a drive mounted anew beside events, with these where they are: elsewhere,
    between two sessions, an event does nearly what mounting did, and is another event."""
    events = any(isinstance(t, Hypothesis) and t.has_instant for t in model.terms)
    mounting = isinstance(term, Dependence) and term.mounted_anew
    return without(model, term, groups, () if mounting and events else known)
