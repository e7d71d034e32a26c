"""Several starts: the best point to begin from, the best for each session, fits from each of several points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import FloatArray


def lowest(problem: Problem, starts: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray | None]:
    """(x, residual) of the start that leaves least; the first, without a residual, if none can be followed."""
    found = [(x, r) for x in starts if (r := problem.followed(x)) is not None]
    return min(found, key=lambda f: float(f[1] @ f[1]), default=(starts[0], None))


def lowest_by_session(problem: Problem, starts: Sequence[FloatArray]) -> tuple[float, FloatArray] | None:
    """(cost, x): the first start that can be followed, but what is a session's own from the start that leaves least of
    its recordings; None if none can be followed."""
    found = [(x, _by_session(problem, r)) for x in starts if (r := problem.followed(x)) is not None]
    if not found:
        return None
    costs = np.stack([c for _, c in found])
    best = np.argmin(costs, axis=0)
    x = found[0][0].copy()
    for k, s in enumerate(problem.sessions):
        for j, p in enumerate(problem.parameters):
            if p.session == s:
                x[j] = found[int(best[k])][0][j]
    return float(np.sum(costs[best, np.arange(costs.shape[1])])), x


def multi_start(
    problem: Problem, starts: Sequence[FloatArray], evaluations: int, tolerance: float
) -> list[Fit]:
    """A fit from each start, as `solve` does it, best first; those that cannot be followed are left out."""
    fits = []
    for x in starts:
        try:
            fits.append(solve(problem, x, evaluations, tolerance))
        except InputError:
            continue
    return sorted(fits, key=lambda f: f.cost)


def _by_session(problem: Problem, residual: FloatArray) -> FloatArray:
    """Half the sum of squares of each session's rows."""
    place = {s: k for k, s in enumerate(problem.sessions)}
    total = np.zeros(len(place))
    for c, span in problem.spans().items():
        owners = problem.owners(c)
        mine = np.array([place[e.session] for e in problem.evidence])[owners]
        total += 0.5 * np.bincount(mine, residual[span] ** 2, minlength=len(place))
    return total
