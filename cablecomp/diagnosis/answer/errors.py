"""Errors of a model in the joint angle: on what it was fitted to, on what was left out in turn, on what nobody had seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cablecomp.diagnosis.result import Errors
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.parallel import side_by_side
from cablecomp.signal.smoothing import FloatArray

FOLDS = 5
BLOCKS = 20


def errors_of(fit: Fit, final: Sequence[Evidence], by: str) -> Errors:
    """The three errors; zeros are the sessions', as `replay` takes them."""
    inside = _rms(_left(fit, fit.problem.evidence))
    folds = _folds(fit.problem.evidence, by)

    def left_out(k: int) -> list[FloatArray]:
        train, test = folds[k]
        return _left(solve(fit.problem.with_evidence(train), fit.x, 3), test)

    parts = [p for found in side_by_side(left_out, range(len(folds))) for p in found]
    return Errors(inside, _rms(parts), _rms(_left(fit, final)))


def _folds(evidence: Sequence[Evidence], by: str) -> list[tuple[list[Evidence], list[Evidence]]]:
    if by == "recording":
        return [
            (
                [e for k, e in enumerate(evidence) if k % FOLDS != f],
                [e for k, e in enumerate(evidence) if k % FOLDS == f],
            )
            for f in range(min(FOLDS, len(evidence)))
        ]
    found = []
    for f in range(FOLDS):
        train, test = [], []
        for e in evidence:
            held = (np.arange(len(e.rows)) * BLOCKS // len(e.rows)) % FOLDS == f
            train.append(replace(e, counted={k: v & ~held for k, v in e.counted.items()}))
            test.append(replace(e, counted={k: v & held for k, v in e.counted.items()}))
        found.append((train, test))
    return found


def _left(fit: Fit, evidence: Sequence[Evidence]) -> list[FloatArray]:
    """Weighted misfit of the joint angle [rad] on counted rows, the session's zero (the mean of what is there, for a session
    that the fit has not seen) taken off."""
    problem = fit.problem
    zeros = problem.zeros(fit.x)[JOINT]
    try:
        misfits = problem.with_evidence(evidence).misfits(fit.x)[JOINT]
    except InputError:
        return [np.full(1, np.nan)]
    parts = []
    for e, m in zip(evidence, misfits, strict=True):
        kept = e.counted[JOINT]
        if not kept.any():
            continue
        zero = zeros[e.session][0] if e.session in zeros else float(np.mean(m[kept]))
        parts.append(e.weight[kept] * (m[kept] - zero))
    return parts


def _rms(parts: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(list(parts)) ** 2))) if parts else float("nan")
