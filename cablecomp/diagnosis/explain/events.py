"""What an event has to show for its name: it is asked at many instants, and the best of them counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cablecomp.diagnosis.explain.courses import Course
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.plausible import amount_of
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.least_squares import Fit, covariance


def values_of(fit: Fit, term: Hypothesis) -> dict[str, float | str]:
    """The values of an effect in a fit, those that were chosen among them."""
    entry = next((e for e in fit.problem.config.effect if e.id == term.effect.id), None)
    given = {} if entry is None else dict(entry.parameters)
    names = (p.name for p in term.effect.parameters)
    return given | {n: fit.values[term.key(n)] for n in names if term.key(n) in fit.values}


def course_of(fit: Fit, term: Hypothesis) -> Course:
    """How an event goes in a fit."""
    return term.course_by(values_of(fit, term))


def untold(fit: Fit, term: Hypothesis, removes: float, ahead_z: float = 0.0) -> str:
    """What of an event the data do not tell, in words; "" where they do, for what is no event, and where
    anything of the drive is known by order of magnitude only: there a size trades places with it, and its deviation
    says little.

    Its size has to stand out of none by `LIMITS.event_size` stated deviations (noise has its best of many instants,
    too); of one that still goes on when the last recording ends, that is how fast it goes: how long it would have gone
    on is nobody's; nor is a share that trades with it (of a slip that the other cable takes up). Where its instant may
    be any within reach, it has to take off `LIMITS.event_anywhere` of the calibrated drive's mean square, `removes`.
    Neither is asked of one that is ahead of none and of its nearest rival by `LIMITS.z_sure` each, `ahead_z` the less:
    that its size trades with another's says little then."""
    found = amount_of(fit, term)
    loosely = any(p.vague and not p.of_effect for p in fit.problem.parameters)
    if not term.has_instant or found is None or loosely or ahead_z >= LIMITS.z_sure:
        return ""
    amount, value = found
    sd = np.sqrt(np.maximum(np.diag(covariance(_held(fit, term))), 0.0))
    place = {p.name: k for k, p in enumerate(fit.problem.parameters)}
    k = place[amount.name]
    own = LIMITS.wider * float(sd[k]) * abs(amount.slope(float(fit.x[k])))
    if abs(value - term.amount.neutral) < LIMITS.event_size * own:
        return f"its size is {abs(value - term.amount.neutral) / max(own, 1e-300):.1f} of its own deviations"
    when = place.get(term.key(term.instant))
    if when is None or removes >= LIMITS.event_anywhere:
        return ""
    low, high = fit.problem.bounds()
    if float(sd[when]) < LIMITS.event_placed * float(high[when] - low[when]):
        return ""
    return f"these data do not tell when it happened, and it takes off {removes:.0%} alone"


def _held(fit: Fit, term: Hypothesis) -> Fit:
    """The fit with the event's shares as they are, and its duration where it lasts beyond the last sample."""
    course = course_of(fit, term)
    last_s = max(float(e.columns["time_s"][-1]) for e in fit.problem.evidence)
    held = {term.key(p.name) for p in term.effect.parameters if p.is_share}
    if course.instant_s + course.duration_s > last_s:
        held.add(term.key(term.duration))
    J = fit.J.copy()
    J[:, [p.name in held for p in fit.problem.parameters]] = 0.0
    return replace(fit, J=J)
