"""Rows beside a leap of the model: the joint falls through its clearance between two samples, and a model that knows
the load a little late, or its zero by a little, has it fall one sample sooner or later. Such a row's misfit is as large
as the clearance, and says of all else what the clock says."""

from __future__ import annotations

from typing import Final

import numpy as np

from cablecomp.effects import catalogue
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import BoolArray, FloatArray

FAR: Final = 6.0
"""Deviations (scaled median) of what is left by which a row, or two, stand off the rows on both sides."""
LEAP: Final = 6.0
"""Times the usual step from row to row (median of those about it) that the model's deflection takes at once there."""
OF_MISFIT: Final = 0.5
"""Least size of that step, in how far the misfit stands off."""
NEAR: Final = 2
"""Rows from the misfit within which the model leaps."""
ABOUT: Final = 8
"""Rows on either side whose steps say what is usual."""
KEPT: Final = 0.1
"""Part of its weight that such a row keeps."""


def beside_leaps(problem: Problem, x: FloatArray) -> dict[str, FloatArray]:
    """What part of its weight every row of a recording keeps, by recording; recordings without such rows are left
    out. None of a joint without a clearance: where it moves quickest a late channel shows."""
    found: dict[str, FloatArray] = {}
    if not any(catalogue()[entry.id].leaps for entry in problem.config.effect):
        return found
    for e, misfit in zip(problem.evidence, problem.misfits(x)[JOINT], strict=True):
        if JOINT not in e.counted:
            continue
        rows = np.flatnonzero(e.counted[JOINT])
        if len(rows) <= 2 * ABOUT:
            continue
        deflection = e.at_rows(JOINT) - misfit - problem.config.drive.ratio * e.at_rows("motor_position_rad")
        off = stands_off(misfit[rows])
        beside = _of_a_leap(deflection[rows], off)
        if beside.any():
            kept = np.ones(len(e.rows))
            kept[rows[beside]] = KEPT
            found[e.name] = kept
    return found


def stands_off(misfit: FloatArray) -> FloatArray:
    """By how much one row, or two in turn, stand off the rows on both sides, 0 where less than `FAR` deviations."""
    size = FAR * float(np.median(np.abs(misfit - np.median(misfit)))) / 0.6745
    found = np.zeros(len(misfit))
    for length in (1, 2):
        before = misfit[1 : len(misfit) - length] - misfit[: len(misfit) - length - 1]
        after = misfit[length : len(misfit) - 1] - misfit[length + 1 :]
        off = np.where(before * after > 0.0, np.minimum(np.abs(before), np.abs(after)), 0.0)
        off[off <= size] = 0.0
        for k in range(length):
            own = slice(1 + k, 1 + k + len(off))
            found[own] = np.maximum(found[own], off)
    return found


def _of_a_leap(deflection: FloatArray, off: FloatArray) -> BoolArray:
    """Rows that stand off beside a step of the deflection at once, large against the steps about it."""
    step = np.abs(np.diff(deflection))
    found = np.zeros(len(deflection), dtype=np.bool_)
    for k in np.flatnonzero(off):
        here = step[max(k - NEAR, 0) : k + NEAR]
        usual = float(np.median(step[max(k - ABOUT, 0) : k + ABOUT]))
        found[k] = float(here.max()) >= max(OF_MISFIT * off[k], LEAP * usual)
    return found
