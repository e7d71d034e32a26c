"""An effect and a pretension of each session's own, tried together: where a mounting or a posture leaves the cables far
less tight, neither is worth anything without the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.folds import shown_apart
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.multi_start import lowest_by_session
from cablecomp.estimation.problem import Problem
from cablecomp.estimation.standing import PRETENSION
from cablecomp.signal.smoothing import FloatArray

FACTORS: Final = np.geomspace(0.1, 4.0, 9)
"""A session's pretension over the common one, at first."""
AMOUNTS: Final = (0.3, 1.0)
"""The effect's amount over where it usually begins, at first."""


def with_own_pretensions(
    problem: Problem, h: Hypothesis, values: Mapping[str, float], cold: Mapping[str, float], by: str
) -> tuple[Dependence, Fit] | None:
    """A rough fit of a problem that has effect `h`, every session with a pretension of its own; None where sessions
    cannot have one.

    `values`: where the model without the effect stands; `cold`: where effects begin; `by`: what is left out in turn.
    Each session begins at the factor that suits its own recordings best, all other things being equal.
    """
    common = next((p for p in problem.parameters if p.name == PRETENSION), None)
    if common is None or len(shown_apart(problem, by)) < 2 or problem.states(PRETENSION):
        return None
    own = problem.with_own(problem.parameters.index(common))
    begin = {**cold, **values}
    amount = h.key(h.amount.name)
    best: tuple[float, FloatArray] | None = None
    for share in AMOUNTS:
        given = {**begin, amount: share * cold.get(amount, begin.get(amount, 0.0))}
        found = _scanned(own, given, begin.get(PRETENSION, common.start))
        if found is not None and (best is None or found[0] < best[0]):
            best = found
    if best is None:
        return None
    try:
        return Dependence(PRETENSION, "session"), solve(own, best[1], LIMITS.rough + 3, LIMITS.tolerance)
    except InputError:
        return None


def _scanned(
    problem: Problem, values: Mapping[str, float], pretension_N: float
) -> tuple[float, FloatArray] | None:
    """(cost, x) with the best of `FACTORS` for each session: what the pretension of one does, its own rows tell."""
    starts = [
        np.array(
            [
                p.x(factor * pretension_N if p.session else values.get(p.name, p.start))
                for p in problem.parameters
            ]
        )
        for factor in FACTORS
    ]
    return lowest_by_session(problem, starts)
