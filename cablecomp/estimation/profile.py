"""Profile likelihood intervals: how far one parameter may go before the others can no longer make up for it.

The deviance of a value v is D(v) = 2 (C(v) - C), where C is the cost of the fit and C(v) that of the best fit with the
parameter held at v; v belongs to the interval while D(v) < 3.84, the 95 % point of chi-squared with one degree of
freedom (D. J. Venzon and S. H. Moolgavkar, A Method for Computing Profile-Likelihood-Based Confidence Intervals, 1988).
Near a bound, and where the fit bends, that is not the estimate plus and minus two standard deviations.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import sqrt
from typing import Final

import numpy as np
from scipy.optimize import brentq

from cablecomp.config import with_values
from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import Fit, approach, covariance, derivative_of_rest

LEVEL: Final = 1.96
"""Root of the deviance at an end of a 95 % interval."""
EVALUATIONS: Final = 6
"""Of the fit of all others at a value; they begin where the fit's own derivative says that they go."""
FACTOR: Final = 3.0
"""By which a value is moved outward, or inward, until the end lies between two."""
TIMES: Final = 5
"""So often at most: where the derivative's own standard deviation is off by more, the end is open."""
SHARE: Final = 0.03
"""Of the distance from the value, to which an end is found."""
OPEN: Final = 100.0
"""Root of the deviance of a value at which the drive cannot follow the recordings: far outside."""


def profile_interval(fit: Fit, name: str, wider: float = 1.0) -> tuple[float, float] | None:
    """The 95 % interval of a parameter, in its own unit; an end that lies beyond a bound is the bound. None for what is
    a session's own or a gain by a condition, which a configuration cannot hold.

    `wider`: by which the root of the deviance at an end is larger than the likelihood alone asks."""
    place = {p.name: k for k, p in enumerate(fit.problem.parameters) if p.name == p.base}
    k = place.get(name)
    if k is None:
        return None
    p = fit.problem.parameters[k]
    level = wider * LEVEL
    return p.value(_end(fit, k, p.x(p.low), level)), p.value(_end(fit, k, p.x(p.high), level))


def _end(fit: Fit, k: int, bound: float, level: float) -> float:
    """Coordinate of the end towards a bound."""
    here = float(fit.x[k])
    way = bound - here
    step = level * sqrt(max(float(covariance(fit)[k, k]), 0.0)) / max(abs(way), 1e-300)

    @cache
    def beyond(share: float) -> float:
        return _root_of_deviance(fit, k, here + share * way) - level

    outside = min(step, 1.0)
    for _ in range(TIMES):  # outward until it is outside, ...
        if beyond(outside) > 0.0 or outside == 1.0:
            break
        outside = min(FACTOR * outside, 1.0)
    if beyond(outside) <= 0.0:
        return bound
    for _ in range(TIMES):  # ... and inward until the next one is inside
        if beyond(outside / FACTOR) <= 0.0:
            outside = float(brentq(beyond, outside / FACTOR, outside, xtol=SHARE * outside))
            break
        outside /= FACTOR
    return here + outside * way


def _root_of_deviance(fit: Fit, k: int, x: float) -> float:
    """sqrt(D) with the k-th coordinate held at x, all others fitted again."""
    p = fit.problem.parameters[k]
    others = [j for j in range(len(fit.x)) if j != k]
    held = replace(
        fit.problem,
        config=with_values(fit.problem.config, {p.name: p.value(x)}),
        parameters=tuple(fit.problem.parameters[j] for j in others),
    )
    J = derivative_of_rest(fit, held)
    assert J is not None  # of the fit's own parameters
    # the others' joint step for this one's, out of the fit's derivative: dx = -(J'J)^-1 J'j (x - x_k)
    data = len(J) - len(others)
    moved = np.concatenate([fit.J[:data, k] * (x - fit.x[k]), np.zeros(len(others))])
    begin = fit.x[others] - np.linalg.lstsq(J, moved, rcond=1e-8)[0]
    try:
        again = approach(held, begin, dict(enumerate(J.T)), EVALUATIONS, 1e-4)
    except InputError:
        return OPEN
    prior = 0.5 * ((x - p.centre_x) / p.sd) ** 2 if np.isfinite(p.sd) else 0.0
    return sqrt(max(2.0 * (again.cost + prior - fit.cost), 0.0))
