"""Errors of a model in the joint angle: on what it was fitted to, on what was left out in turn, on what nobody
had seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cablecomp.config import Empirical
from cablecomp.diagnosis.describe.empirical import refitted, value_of
from cablecomp.diagnosis.folds import Part, left_out_in_turn
from cablecomp.diagnosis.result import Errors
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import INPUT, JOINT, Evidence, rms_by_time
from cablecomp.estimation.least_squares import Fit, fitted_to_part, rms_left
from cablecomp.estimation.limits import CARRYOVER_SD
from cablecomp.estimation.parallel import in_processes
from cablecomp.signal.smoothing import BoolArray, FloatArray


class Left(NamedTuple):
    """Misfit of the joint angle [rad] on some rows of a recording, and their weights."""

    misfit: FloatArray
    weight: FloatArray

    def at(self, rows: BoolArray | slice) -> Left:
        """The same on some of these rows."""
        return Left(self.misfit[rows], self.weight[rows])

    @property
    def about_own_zero(self) -> Left:
        """The same about its mean by time."""
        return Left(self.misfit - np.average(self.misfit, weights=self.weight**2), self.weight)


def errors_of(fit: Fit, final: Sequence[Evidence], by: str, laws: Sequence[Empirical] = ()) -> Errors:
    """The three errors of a model and its laws without a name; zeros are the recordings' where the fit has seen them,
    as far as their prior lets these depart (a history that nobody recorded moves them), else the sessions'; a
    recording's carry-over is estimated and taken off."""
    inside = _rms(_left(fit, fit.problem.evidence, laws))

    def left_out(part: Part) -> list[Left]:
        again = fitted_to_part(fit, part.rest, 5)
        return _left(again, part.out, _again(again, laws))

    parts = [p for found in in_processes(left_out, left_out_in_turn(fit.problem.evidence, by)) for p in found]
    own_zero = _rms([p.about_own_zero for p in parts])
    return Errors(inside, _rms(parts), _rms(_left(fit, final, laws)), own_zero)


def _again(fit: Fit, laws: Sequence[Empirical]) -> list[Empirical]:
    """The laws fitted to what this fit leaves of its own recordings."""
    if not laws:
        return []
    kept = [e for e in fit.problem.evidence if e.counted[JOINT].any()]
    return refitted(laws, kept, [left.misfit for left in _left(fit, kept)])


def _left(fit: Fit, evidence: Sequence[Evidence], laws: Sequence[Empirical] = ()) -> list[Left]:
    """What is left of the joint's angle on counted rows; laws, the zero and the recording's carry-over taken off
    (where the fit has not seen the recording: the session's; nor the session: as these rows, or the first of them,
    tell), without rows at which a carry-over comes back that the rows seen have not told. Of recordings that the drive
    cannot follow with what the fit tells: what a rigid one leaves."""
    problem = fit.problem
    zeros, carryover = problem.aside(fit.x)
    parts = []
    try:
        misfits = problem.with_evidence(evidence).misfits(fit.x)[JOINT]
    except InputError:
        zeros, carryover = {}, {}
        misfits = [e.at_rows(JOINT) - problem.config.drive.ratio * e.at_rows(INPUT) for e in evidence]
    for e, m in zip(evidence, misfits, strict=True):
        kept = e.counted[JOINT]
        if not kept.any():
            continue
        left = (m - sum(value_of(law, e) for law in laws))[kept]
        own = e.name if e.name in zeros else e.session
        weight = e.weight[kept]
        left -= zeros[own][0] if own in zeros else float(np.average(left, weights=weight**2))
        if e.name in carryover:
            parts.append(Left(left - carryover[e.name][kept], weight).at(_forgotten(fit, e)))
        else:
            parts.append(_without_carryover(e, left, problem.weighing.sigma[JOINT]))
    return parts


def _forgotten(fit: Fit, e: Evidence) -> BoolArray:
    """Which counted rows of a recording the fit has seen, or are not moved, by more than a part of what is usually left
    over, by that of its carry-over which the rows seen have not told: where the load goes further than before, bumps
    from before the recording come back. All of them where that would leave none."""
    seen = next(s for s in fit.problem.evidence if s.name == e.name)
    kept = e.counted[JOINT]
    columns = seen.carryover.get(JOINT)
    if columns is None:
        return np.ones(int(kept.sum()), dtype=np.bool_)
    told = (seen.weight[:, None] * columns)[seen.counted[JOINT]] / fit.problem.weighing.sigma[JOINT]
    covariance = np.linalg.inv(told.T @ told + np.eye(columns.shape[1]) / CARRYOVER_SD**2)
    sd = np.sqrt(np.einsum("ij,jk,ik->i", columns[kept], covariance, columns[kept]))
    known = seen.counted[JOINT][kept] | (sd <= LIMITS.carried_over * rms_left(fit))
    return known if known.any() else np.ones_like(known)


def _without_carryover(e: Evidence, left: FloatArray, sigma: float) -> Left:
    """Misfit without the recording's carry-over, as its first rows and its prior tell it; these are not judged, or a
    law that is missing would be taken for a carry-over."""
    kept = e.counted[JOINT]
    weight = e.weight[kept]
    if JOINT not in e.carryover:
        return Left(left, weight)
    columns = e.carryover[JOINT][kept]
    first = int(LIMITS.telling * len(left))
    A = np.vstack([(weight[:, None] * columns)[:first] / sigma, np.eye(columns.shape[1]) / CARRYOVER_SD])
    b = np.concatenate([(weight * left)[:first] / sigma, np.zeros(columns.shape[1])])
    return Left(left - columns @ np.linalg.lstsq(A, b, rcond=None)[0], weight).at(slice(first, None))


def _rms(parts: Sequence[Left]) -> float:
    return rms_by_time(*map(np.concatenate, zip(*parts, strict=True))) if parts else float("nan")
