"""What goes first where data left out do not tell models apart: the fewer parameters, what is no physics, what is
plausible, what explains most alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.linear import anchor
from cablecomp.diagnosis.explain.model import (
    Model,
    Round,
    Term,
    Tried,
    amount_resolved,
    bears,
    common,
    loss,
    ranked,
    without,
)
from cablecomp.diagnosis.explain.plausible import better_word, over_plausible, runs_away
from cablecomp.diagnosis.explain.scores import demanded, left_out, score_difference
from cablecomp.diagnosis.explain.screening import ask_all, rough
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import solve


def in_order(models: list[Model], groups: Groups, selected_in: Mapping[frozenset[str], float]) -> list[Model]:
    """Models, best first, in the order in which a search takes them; `selected_in`: share of resampled data in which
    what each has added was the best of its round."""
    surest = _surest_first(models, groups, selected_in)
    return _plausible_first(_mounted_anew_first(simplest_first(surest, groups), groups), groups)


def _surest_first(
    models: list[Model], groups: Groups, selected_in: Mapping[frozenset[str], float]
) -> list[Model]:
    """Models, best first, but one that more resampled data choose, with no more parameters, before one that ends a
    little lower: which of two does hangs on the weights that both are fitted with."""
    size, best = common(models, groups), models[0]
    most = (1.0 + LIMITS.close_call) * loss(best, size, groups)
    parameters = len(best.fit.problem.parameters)
    near = [
        m for m in models if loss(m, size, groups) <= most and len(m.fit.problem.parameters) <= parameters
    ]
    first = max(near, key=lambda m: selected_in.get(m.added, 0.0))
    return [first, *(m for m in models if m is not first)]


def simplest_first(models: list[Model], groups: Groups) -> list[Model]:
    """Models, best first, but one with fewer parameters before one that predicts as well: what a law adds to
    another has to bring something."""
    size = common(models, groups)
    most = (1.0 + LIMITS.tie) * loss(models[0], size, groups)
    alike = [m for m in models if loss(m, size, groups) <= most]
    first = min(alike, key=lambda m: len(m.fit.problem.parameters))
    return [first, *(m for m in models if m is not first)]


def _mounted_anew_first(models: list[Model], groups: Groups) -> list[Model]:
    """Models, best first, but one in which the drive was only mounted anew before one with an effect in the place of
    that which does not predict clearly better: that a session's cables are less tight is no physics that is missing,
    and an effect that is there as well comes beside it."""
    own = next((m for m in models if mounted_anew_for(m, models[0])), None)
    if own is None or worth_its_terms(models[0], own, groups):
        return models
    return [own, *(m for m in models if m is not own)]


def mounted_anew_for(model: Model, other: Model) -> bool:
    """Whether a model has a drive mounted anew in place of effects of the other, and no effect that this one lacks."""
    mine, others = ({t.name for t in m.terms if not isinstance(t, Dependence)} for m in (model, other))
    return mine < others and any(isinstance(t, Dependence) and t.mounted_anew for t in model.terms)


def _plausible_first(models: list[Model], groups: Groups) -> list[Model]:
    """Models, best first, but one of no more effects, more of which have plausible amounts, before one that does not
    predict better by far."""
    best = models[0]
    plain = [m for m in models if len(m.terms) <= len(best.terms) and implausible(m) < implausible(best)]
    first = next((m for m in plain if not outdoes(best, m, groups)), best)
    return [first, *(m for m in models if m is not first)]


def outdoes(model: Model, than: Model, groups: Groups) -> bool:
    """Whether a model predicts clearly better than another; by far, where it takes more that is not plausible."""
    step = score_difference(model.left_out, than.left_out, groups)
    far = step.gain > LIMITS.dethrone_left or implausible(model) <= implausible(than)
    return far and step.z >= LIMITS.z_dethrone


def implausible(model: Model) -> int:
    """How many of its effects have amounts far beyond what is plausible for the drive as fitted, or a shape
    beyond which another effect is the better word."""
    fit, effects = model.fit, [t for t in model.terms if isinstance(t, Hypothesis)]
    return sum(over_plausible(fit, h) > LIMITS.beyond_plausible or better_word(fit, h) != "" for h in effects)


def with_the_first(model: Model, rounds: Sequence[Round], groups: Groups) -> Model:
    """The model with what explains most alone in the place of an effect that was tried alone too, where that predicts
    as well: two that stand in for each other are told apart by what they explain alone, if by anything. What nearly all
    data choose alone need not be the simpler law."""
    alone = _tried_alone(rounds)
    first = max(alone, key=lambda t: t.selected_in, default=None)
    if first is None or keeps(model, first.model) or not demanded(first.difference, first=True):
        return model
    term, values, others = first.term, first.model.fit.values, {t.term.name for t in alone}
    if not isinstance(term, Hypothesis) or any(_of_one_effect(t, term) for t in model.terms):
        return model
    swapped = [_in_its_place(model, t, term, values, groups) for t in model.terms if t.name in others]
    plain = [m for m in swapped if m is not None and implausible(m) <= implausible(model)]
    as_well = ranked([m for m in plain if not outdoes(model, m, groups)], groups)[:1]
    if as_well and surest_alone(rounds, term):
        return as_well[0]
    return simplest_first([*as_well, model], groups)[0]


def surest_alone(rounds: Sequence[Round], term: Hypothesis) -> bool:
    """Whether nearly all resampled data choose this effect where each is alone beside the calibrated drive. Not of an
    event: the best of many instants follows much of what it is not."""
    first = max(_tried_alone(rounds), key=lambda t: t.selected_in, default=None)
    return (
        first is not None
        and first.term.name == term.name
        and not term.has_instant
        and first.selected_in >= LIMITS.surest
        and demanded(first.difference, first=True)
    )


def _tried_alone(rounds: Sequence[Round]) -> list[Tried]:
    return [t for t in rounds[0].tried if len(t.model.terms) == 1] if rounds else []


def _in_its_place(
    model: Model, term: Term, other: Hypothesis, alone: Mapping[str, float], groups: Groups
) -> Model | None:
    """The model with another effect, `alone` the values with it alone, in the place of one of its own; None where it
    cannot follow."""
    base = without(model, term, groups)
    answers = ask_all([anchor(base.fit)], other) if base else []
    begun = rough(answers, LIMITS.rough, [alone]) if answers else []
    if base is None or not begun:
        return None
    try:
        fit = solve(begun[0].problem, begun[0].x, LIMITS.settled, LIMITS.tolerance, begun[0].J)
    except InputError:
        return None
    if runs_away(fit, other) or not amount_resolved(fit, other) or not bears(fit):
        return None
    return Model((*base.terms, other), fit, left_out(fit, groups))


def alone_by_far(rounds: Sequence[Round], term: Term) -> bool:
    """Whether any other effect, beside the calibrated drive, leaves far more of the loss on data left out: no other is
    the better word then, and no two of them together."""
    leaves = [
        (t.term, 1.0 - t.difference.gain) for t in _tried_alone(rounds) if isinstance(t.term, Hypothesis)
    ]
    own = min((left for h, left in leaves if h.name == term.name), default=1.0)
    others = (left for h, left in leaves if isinstance(term, Hypothesis) and not h.same_as(term))
    return own < LIMITS.by_far * min(others, default=1.0)


def _of_one_effect(term: Term, other: Hypothesis) -> bool:
    """Whether both ask for one effect, by two amounts of it: a model has an effect once."""
    return isinstance(term, Hypothesis) and term.effect.id == other.effect.id


def keeps(model: Model, before: Model) -> bool:
    """Whether a model has all that was added to an earlier one."""
    return before.added <= model.added


def worth_its_terms(model: Model, than: Model, groups: Groups) -> bool:
    """Whether a model is worth its further terms."""
    return demanded(score_difference(model.left_out, than.left_out, groups))
