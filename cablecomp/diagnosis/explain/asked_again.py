"""An event of a model asked for its course again: what was found since has taken off what hid it."""

from __future__ import annotations

from dataclasses import replace

from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.events import values_of
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, Start
from cablecomp.diagnosis.explain.linear import anchor, best_start, better_shaped
from cablecomp.diagnosis.explain.model import Model, placed, stripped
from cablecomp.diagnosis.explain.scores import left_out
from cablecomp.diagnosis.explain.screening import in_another_course, rough
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.least_squares import Fit, derivative_of_rest


def with_better_courses(model: Model, groups: Groups) -> Model:
    """The model with each event that others were found beside in the course that takes off most now, where that is
    worth it."""
    for term in model.terms[:-1]:
        if isinstance(term, Hypothesis) and _may_go_otherwise(model, term):
            better = _in_another_course(model.fit, term)
            if better is not None:
                model = replace(model, fit=better, left_out=left_out(better, groups))
    return model


def _may_go_otherwise(model: Model, term: Hypothesis) -> bool:
    """Whether it is an event of another course, run on thinned rows, whose size hangs on no condition."""
    depends = any(isinstance(t, Dependence) and t.belongs_to(term) for t in model.terms)
    return term.has_instant and term.duration != "" and not depends and not model.fit.problem.fine


def _in_another_course(fit: Fit, term: Hypothesis) -> Fit | None:
    """The fit with the event in the best of its likely courses; None where that is no better."""
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
    other = None if now is None else in_another_course(here, term, now)
    if other is None:
        return None
    found = rough([other], LIMITS.settled)
    return found[0] if found and better_shaped(found[0], fit) else None
