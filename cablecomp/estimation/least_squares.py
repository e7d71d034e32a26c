"""Bounded least squares from one start, and what of a fit is kept; several starts: `multi_start.py`.

The derivative is our own, as SciPy's `jac="2-point"` would simulate every recording once for every parameter after each
step: secants simulate none, known columns are kept, and a session's own parameter asks for its recordings alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from cablecomp.estimation.departures import FEWEST, departures, set_anew
from cablecomp.estimation.evidence import JOINT, Evidence, rms_by_time
from cablecomp.estimation.limits import MOVED_SD, ZERO
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.signal.autocorrelation import integrated_time_of_parts
from cablecomp.signal.smoothing import FloatArray

ROUND = 6
"""Residuals asked for between two derivatives by differences: secants go stale."""


@dataclass(frozen=True)
class Fit:
    """A solution: coordinates, weighted residual (priors last) and its derivative."""

    problem: Problem
    x: FloatArray
    residual: FloatArray
    J: FloatArray

    @property
    def cost(self) -> float:
        """Half the sum of squares, priors included."""
        return 0.5 * float(self.residual @ self.residual)

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return self.problem.values(self.x)

    def at_bound(self) -> tuple[str, ...]:
        """Parameters that ended on a bound of theirs (a lower bound of zero is an answer, not a bound)."""
        low, high = self.problem.bounds()
        found = []
        for p, x, a, b in zip(self.problem.parameters, self.x, low, high, strict=True):
            if b - x < 1e-3 * (b - a) or (x - a < 1e-3 * (b - a) and (p.log or p.low != 0.0)):
                found.append(p.name)
        return tuple(found)


def solve(
    problem: Problem,
    x: FloatArray | None = None,
    evaluations: int = 20,
    tolerance: float = 1e-4,
    J: FloatArray | None = None,
) -> Fit:
    """Least squares from x (default: the parameters' starts) by SciPy's trust region, bounds kept, until a
    round of steps would lower the cost by less than `tolerance` of it. The derivative is taken by differences
    between rounds, and by secants within.

    `J`: a derivative that is roughly known at x, for the first round. Raises InputError if the drive cannot
    follow the recordings where the fit begins and ends.
    """
    x = inside(problem, problem.start if x is None else x)
    residual = problem.residual(x)
    rough = J is not None and J.shape == (len(residual), len(x))
    fit = Fit(problem, x, residual, J if rough and J is not None else problem.jacobian(x, residual))
    left = evaluations
    while left > 0 and len(x):
        found, spent = _steps(fit, min(left, ROUND), tolerance)
        left -= spent
        won = fit.cost - found.cost
        if won <= tolerance * fit.cost and not rough:
            break
        better = found if won > 0.0 else fit
        fit = replace(better, J=problem.jacobian(better.x, better.residual))
        rough = False
    if problem.refused(fit.residual):
        problem.misfits(fit.x)
    return fit


def approach(
    problem: Problem,
    x: FloatArray,
    beside: Mapping[int, FloatArray],
    evaluations: int,
    tolerance: float,
    residual: FloatArray | None = None,
) -> Fit:
    """A few steps from x with columns of the derivative that are known about there, improved by secants: what
    comes of it is good for a comparison, and its own derivative is rough. `residual`: that at x, where it is known and
    x lies well inside of the bounds. Raises InputError as `solve` does."""
    x = inside(problem, x)
    residual = problem.residual(x) if residual is None else residual
    found, _ = _steps(
        Fit(problem, x, residual, problem.jacobian(x, residual, beside)), evaluations, tolerance
    )
    if problem.refused(found.residual):
        problem.misfits(found.x)
    return found


def inside(problem: Problem, x: FloatArray) -> FloatArray:
    """The point itself, or the nearest one well inside of the bounds."""
    low, high = problem.bounds()
    margin = 1e-6 * np.minimum(high - low, 1.0)  # coordinates are about 1, however far the bounds
    return np.asarray(np.clip(x, low + margin, high - margin), dtype=np.float64)


def _steps(fit: Fit, evaluations: int, tolerance: float) -> tuple[Fit, int]:
    """Trust-region steps from a fit whose derivative is known; after each, C. Broyden's rank-one update takes its place
    (A Class of Methods for Solving Nonlinear Simultaneous Equations, 1965). Also returns how many residuals
    were asked for."""
    problem, known = fit.problem, {fit.x.tobytes(): fit.residual}
    last = fit

    def residual(x: FloatArray) -> FloatArray:
        key = x.tobytes()
        if key not in known:
            known[key] = problem.residual(x)
        return known[key]

    def derivative(x: FloatArray) -> FloatArray:
        nonlocal last
        step = x - last.x
        square = float(step @ step)
        if square > 0.0:
            r = residual(x)
            error = r - last.residual - last.J @ step
            last = Fit(problem, x, r, last.J + np.outer(error, step / square))
        return last.J

    low, high = problem.bounds()
    found = least_squares(
        residual,
        fit.x,
        jac=derivative,
        bounds=(low, high),
        x_scale="jac",
        ftol=tolerance,
        xtol=1e-4,
        gtol=1e-6,
        max_nfev=evaluations + 1,
    )
    return Fit(problem, found.x, found.fun, found.jac), len(known) - 1


def derivative_of_part(fit: Fit, part: Sequence[Evidence]) -> FloatArray:
    """What is known of the derivative about some of a fit's recordings, or about fewer of their rows."""
    wanted, J = {e.name: e for e in part}, fit.J
    smaller = fit.problem.with_evidence(part)
    blocks = []
    for c, span in fit.problem.spans().items():
        first = span.start
        for e in fit.problem.evidence:
            count = int(e.counted[c].sum()) if c in e.counted else 0
            if count and e.name in wanted:
                blocks.append(J[first : first + count][wanted[e.name].counted[c][e.counted[c]]])
            first += count
        blocks.append(np.zeros((smaller.bases[c].penalty_rows, J.shape[1])))
    return np.concatenate([*blocks, J[len(J) - J.shape[1] :]])


def derivative_of_rest(fit: Fit, problem: Problem) -> FloatArray | None:
    """The fit's derivative by the parameters that a smaller problem still has; None where those are others."""
    names = [p.name for p in fit.problem.parameters]
    if not all(p.name in names for p in problem.parameters):
        return None
    columns = [names.index(p.name) for p in problem.parameters]
    data = len(fit.J) - len(names)
    return np.asarray(fit.J[[*range(data), *(data + k for k in columns)]][:, columns], dtype=np.float64)


def fitted_to_part(fit: Fit, part: Sequence[Evidence], evaluations: int) -> Fit:
    """A fit about some of its rows only, from where it stands, along secants: what is left out is then
    predicted by it."""
    J = derivative_of_part(fit, part)
    return approach(fit.problem.with_evidence(part), fit.x, dict(enumerate(J.T)), evaluations, 1e-4)


def weighed(fit: Fit, floor: Weighing) -> Weighing:
    """What a misfit counts for, out of what this fit leaves: RMS by channel times the root of the longest memory, never
    below `floor`; the recordings' zeros by how they scatter (one step of expectation-maximisation)."""
    problem = fit.problem
    left = {c: problem.left(fit.x, c) for c in problem.channels}
    sigma, zero_sd, moved, size, memory = {}, {}, {}, {}, 1.0
    for c in problem.channels:
        parts = []
        for r, m in zip(problem.evidence, left[c], strict=True):
            if c in r.counted and r.counted[c].sum() > FEWEST:
                parts.append((r.weight * m)[r.counted[c]])
        whole = np.concatenate(parts)
        size[c] = float(np.sqrt(np.mean(np.minimum(whole**2, 16.0 * np.median(whole**2) / 0.455))))
        memory = max(memory, integrated_time_of_parts(parts))
    for c in problem.channels:
        # one memory for all: a channel whose misfit wanders may not be given up for the sake of another
        sigma[c] = max(size[c] * float(np.sqrt(memory)), floor.sigma[c])
        zeros = problem.zeros(fit.x)[c]
        scatter = departures(problem, zeros)
        if scatter is not None:
            seen = min(scatter.sd, ZERO * size[c])
            zero_sd[c] = max(seen, floor.zero_sd.get(c, 0.0))
            if scatter.moved is None:
                anew = set_anew(problem, c, zeros, left[c], floor.history.get(c, 0.0))
            else:
                anew = scatter.moved
            moved[c] = dict.fromkeys(anew, MOVED_SD * max(sigma[c], zero_sd[c]))
    return Weighing(sigma, zero_sd, moved, floor.history)


def refit(fit: Fit, weighing: Weighing, evaluations: int = 10) -> Fit:
    """The same fit with other weights, from where it stands."""
    J = fit.J.copy()
    for c, span in fit.problem.spans().items():
        J[span] *= fit.problem.weighing.sigma[c] / weighing.sigma[c]
    return solve(fit.problem.with_weighing(weighing), fit.x, evaluations, J=J)


def covariance(fit: Fit) -> FloatArray:
    """Covariance of x: the inverse of J'J, priors in it; directions that nothing shows stay as wide as their bounds."""
    J = fit.J
    if not J.shape[1]:
        return np.empty((0, 0))
    low, high = fit.problem.bounds()
    A = np.vstack([J, np.diag(1.0 / np.maximum(high - low, 1e-9))])
    size = np.linalg.norm(A, axis=0)
    # of A and not of A'A, whose rounding takes what is little known for what is known exactly
    _, s, vt = np.linalg.svd(np.linalg.qr(A / size, mode="r"))
    root = vt.T / np.maximum(s, 1e-15 * s[0]) / size[:, None]
    return np.asarray(root @ root.T, dtype=np.float64)


def rms_left(fit: Fit, channel: str = JOINT) -> float:
    """RMS of what the fit leaves of a channel, recordings' own zeros taken off, weighed by the time that the rows which
    count stand for."""
    return rms_by_time(*_left_with_weights(fit, channel))


def rms_of_rows(fit: Fit, channel: str = JOINT) -> float:
    """RMS of the same as rows of a residual have it, times their weights: what a sigma stands beside."""
    left, weight = _left_with_weights(fit, channel)
    return float(np.sqrt(np.mean((weight * left) ** 2)))


def _left_with_weights(fit: Fit, channel: str) -> tuple[FloatArray, FloatArray]:
    parts = [
        (m[kept], r.weight[kept])
        for r, m in zip(fit.problem.evidence, fit.problem.left(fit.x, channel), strict=True)
        if (kept := r.counted.get(channel)) is not None
    ]
    left, weight = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return left, weight
