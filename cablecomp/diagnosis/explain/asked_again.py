"""An effect of a model asked again how it goes: an event for its course, another for its shape. What was found since
has taken off what hid it, and beside the drive as calibrated without the effect its shape promised little."""

from __future__ import annotations

from dataclasses import replace

from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.events import values_of
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, Start
from cablecomp.diagnosis.explain.linear import anchor, best_start, better_shaped
from cablecomp.diagnosis.explain.model import Model, placed, stripped
from cablecomp.diagnosis.explain.scores import left_out
from cablecomp.diagnosis.explain.screening import in_another_course, in_another_shape, rough
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.least_squares import Fit, derivative_of_rest


def with_better_forms(model: Model, groups: Groups) -> Model:
    """The model with each effect in the form that takes off most now, where that is worth it: an event that others were
    found beside in another course, what goes by its plain law in another shape."""
    for term in model.terms:
        if isinstance(term, Hypothesis) and _may_go_otherwise(model, term):
            better = _in_another_form(model.fit, term)
            if better is not None:
                model = replace(model, fit=better, left_out=left_out(better, groups))
    return model


def _may_go_otherwise(model: Model, term: Hypothesis) -> bool:
    """Whether it is an event of another course, beside another effect that came later, run on thinned rows; or a law
    that has no shape yet, with rates where every sample is run. Its size hangs on no condition."""
    if any(isinstance(t, Dependence) and t.belongs_to(term) for t in model.terms):
        return False
    fine = model.fit.problem.fine
    if term.has_instant:
        return term.duration != "" and not fine and term is not model.terms[-1]
    shapes = {term.key(name) for values in term.further for name in values}
    plain = not shapes & {p.base for p in model.fit.problem.parameters}
    return bool(shapes) and plain and not term.has_phase and (term.effect.rates or not fine)


def _in_another_form(fit: Fit, term: Hypothesis) -> Fit | None:
    """The fit with the event in the best of its likely courses, or the law in the best of its shapes; None where that
    is no better."""
    problem = stripped(fit.problem, term)
    J = derivative_of_rest(fit, problem)
    if J is None:
        return None
    x = placed(fit, problem)
    residual = problem.followed(x)
    if residual is None:
        return None
    here = anchor(Fit(problem, x, residual, J))
    values = values_of(fit, term)
    now = best_start(here, replace(term, starts=(Start(values),)), float(values[term.amount.name]))
    if now is None:
        return None
    other = in_another_course(here, term, now) if term.has_instant else in_another_shape(here, term, now)
    if other is None:
        return None
    found = rough([other], LIMITS.settled)
    return found[0] if found and better_shaped(found[0], fit) else None
