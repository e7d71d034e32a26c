"""Laws have other forms in reality than in the catalogue: what one law of a model leaves for its form alone is no
reason for another name beside it.

The laws that a name stands beside may each do a little more or less with load, motor angle, time, direction and speed:
r(x, c) = r(x) + sum_kj c_kj phi_j dr/dx_k, x_k their parameters, phi_j functions of those, c_kj normal with sd
`LIMITS.form`. It is in the model with the name and in the one without it, and so the name has to explain what no other
form of the others can (M. Kennedy and A. O'Hagan, Bayesian calibration of computer models, J. R. Stat. Soc. B 63, 2001;
M. Plumlee, Bayesian calibration of inexact computer models, J. Am. Stat. Assoc. 112, 2017).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from cablecomp.diagnosis.explain.courses import before_all, from_each, instants_of
from cablecomp.diagnosis.explain.events import course_of
from cablecomp.diagnosis.explain.hypotheses import OF_COURSE, Hypothesis
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.explain.scores import left_out_linearly, movable
from cablecomp.diagnosis.explain.usual import usual_of
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects.catalogue import role_of
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.problem import Problem
from cablecomp.estimation.simulate import load_of
from cablecomp.signal.smoothing import FloatArray


def left_out_with_discrepancy(
    model: Model,
    beside: Sequence[Hypothesis],
    groups: Groups,
    *,
    event: Hypothesis | None = None,
    own: Hypothesis | None = None,
    usual: bool = False,
) -> FloatArray:
    """Weighted residual of every data row with its fold left out, where these effects of the model may have other forms
    (an event among them another course), one further `event` of it another course, and what is asked about its `own`
    form, too, and where what the joint is known to leave is let go by what it goes by (`usual`: of an event, which goes
    by none of that); as `left_out` where there is nothing of these."""
    fit, n = model.fit, len(groups.fold)
    laws = {h.effect.id for h in (*beside, own) if h is not None}
    columns = [
        fit.J[:n, k]
        for k, p in enumerate(fit.problem.parameters)
        if _law_of(p.name) in laws and role_of(p.base) not in ("instant", *OF_COURSE)
    ]
    forms = _forms(fit.problem) if columns else []
    free = [(c * f, LIMITS.form) for c in columns for f in forms]
    courses = (*((h, LIMITS.course) for h in (*beside, event)), (own, LIMITS.own_course))
    free += [(c, sd) for h, sd in courses if h is not None and h.has_instant for c in _courses(fit, h)]
    if usual:
        free += [(c, 1.0) for c in _usual(fit.problem)]
    if not free:
        return model.left_out
    D = np.stack([c for c, _ in free], axis=1)
    J = fit.J[:, movable(fit)]
    A = np.zeros((len(J) + D.shape[1], J.shape[1] + D.shape[1]))
    A[: len(J), : J.shape[1]], A[:n, J.shape[1] :] = J, D
    A[len(J) :, J.shape[1] :] = np.diag([1.0 / sd for _, sd in free])
    r = np.concatenate([fit.residual, np.zeros(D.shape[1])])
    return left_out_linearly(r + A @ np.linalg.lstsq(A, -r, rcond=None)[0], A, groups)


def _courses(fit: Fit, event: Hypothesis) -> list[FloatArray]:
    """What an event takes off the residual from each of some instants on (`courses`). Events of another kind differ by
    what they do, not by when."""
    problem = fit.problem
    over, none = fit.x.copy(), fit.x.copy()
    for k, p in enumerate(problem.parameters):
        if p.name == event.key(event.instant):
            # beyond how far a fit moves it, and before it has gone on for as long as it takes
            over[k] = (before_all(problem) - course_of(fit, event).lasts_s) / p.scale
        elif p.name == event.key(event.amount.name):
            none[k] = p.x(event.amount.neutral)
    try:
        does, does_not = problem.misfits(over), problem.misfits(none)
    except InputError:
        return []
    return list(from_each(problem, does, does_not, instants_of(problem, LIMITS.steps)).T)


def _usual(problem: Problem) -> list[FloatArray]:
    """What the joint is known to leave of its angle, as curves by what that goes by: hats over the motor's angle and
    over the load, each direction its own, as high as what it leaves."""
    height, follows = usual_of(problem.config, JOINT), set(problem.config.remainder.follows)
    if JOINT not in problem.channels or not height:
        return []
    courses = [_course(problem, e) for e in problem.evidence]
    load, angle, _, loading, speed = np.concatenate(courses, axis=1)
    curves = []
    if "load" in follows:
        curves.append(_hats(load, loading, LIMITS.usual_by_load))
    if follows & {"motor_angle", "joint_angle"}:
        curves.append(_hats(angle, speed, LIMITS.usual_by_angle))
    if not curves:
        return []
    ends = np.cumsum([c.shape[1] for c in courses])
    hats = np.split(height * np.hstack(curves), ends[:-1])
    none = {c: [np.zeros_like(h) for h in hats] for c in problem.channels}
    return list(problem.rows({**none, JOINT: hats}).T)


def _hats(x: FloatArray, rate: FloatArray, count: int) -> FloatArray:
    """So many piecewise linear hats over the range of x, once for each direction (rows x 2 count)."""
    knots = np.linspace(np.nanmin(x), np.nanmax(x), count)
    hats = np.stack([np.interp(x, knots, one) for one in np.eye(count)], axis=1)
    return np.hstack((hats * (rate > 0.0)[:, None], hats * (rate <= 0.0)[:, None]))


def _law_of(parameter: str) -> str:
    """The id of the effect that a parameter belongs to; none for the drive's own."""
    head, _, rest = parameter.partition(".")
    return rest.partition(".")[0] if head == "effect" else ""


def _forms(problem: Problem) -> list[FloatArray]:
    """phi_j on the rows of a residual, none on penalty rows: Legendre's first two polynomials of load, motor angle and
    time over their ranges, tanh of the rates of load and motor, and of the motor's amount, over their medians."""
    load, angle, time, loading, speed = _on_rows(problem, lambda e: _course(problem, e))
    forms: list[FloatArray] = []
    for course in (load, angle, time):
        low, high = np.nanmin(course), np.nanmax(course)
        if high > low:
            u = 2.0 * (course - low) / (high - low) - 1.0
            forms += [u, 1.5 * u**2 - 0.5]
    for rate in (loading, speed, np.abs(speed)):
        moving = np.abs(rate[np.isfinite(rate) & (rate != 0.0)])
        if len(moving):
            forms.append(np.tanh(rate / np.median(moving)))
    return [np.nan_to_num(f) for f in forms]


def _on_rows(problem: Problem, of: Callable[[Evidence], FloatArray]) -> FloatArray:
    """Courses (each a row) of the recordings on the rows of a residual, NaN on penalty rows."""
    parts: list[FloatArray] = []
    for c in problem.channels:
        mine = [of(e)[:, e.counted[c]] for e in problem.evidence if c in e.counted]
        parts += [*mine, np.full((len(mine[0]), problem.bases[c].penalty_rows), np.nan)]
    return np.concatenate(parts, axis=1)


def _course(problem: Problem, e: Evidence) -> FloatArray:
    """Load, motor angle, time, their rates on a recording's judged rows (5 x rows)."""
    time, angle = e.at_rows("time_s"), e.at_rows("motor_position_rad")
    load = np.broadcast_to(load_of(problem.config, e.columns), e.columns["time_s"].shape)[e.rows]
    return np.stack((load, angle, time, np.gradient(load, time), np.gradient(angle, time)))
