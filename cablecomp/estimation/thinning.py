"""Which rows of a recording are judged: even in travel, with every turning point and both sides of every gap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cablecomp.mechanics.jit import njit
from cablecomp.signal.smoothing import FloatArray, IntArray

APART: Final = 3.0
"""Times the usual span of the readings that make a fine row up to which they lie: what lies further apart lies on both
sides of a gap."""
TURN: Final = 0.02
"""Share of its range by which a driver has to go back to have turned round."""


def thinned(time: FloatArray, drivers: Sequence[FloatArray], joint: FloatArray, count: int) -> IntArray:
    """About `count` rows, even in travel (of drivers and joint over their ranges, and a share of time), every
    turning point of a driver in between, and both sides of every gap."""
    n = len(time)
    if n <= count:
        return np.arange(n)
    span = float(time[-1] - time[0]) or 1.0
    travel = np.gradient(time) / span
    for values in (*drivers, joint):
        width = float(np.ptp(values))
        if width > 0.0:
            step = np.abs(np.gradient(values)) / width
            travel = travel + step / max(float(step.sum()), 1e-12)
    total = np.cumsum(travel)
    even = np.searchsorted(total, np.linspace(total[0], total[-1], count))
    gaps = gaps_of(time)
    kept = [
        even,
        np.array([0, n - 1]),
        gaps,
        gaps + 1,
        *(turns(d, TURN * float(np.ptp(d))) for d in drivers),
    ]
    return np.unique(np.clip(np.concatenate(kept), 0, n - 1)).astype(np.int64)


def gaps_of(time: FloatArray) -> IntArray:
    """Rows after which nothing was recorded for more than `APART` usual steps."""
    steps = np.diff(time)
    return np.flatnonzero(steps > APART * np.median(steps)) if len(steps) else np.zeros(0, dtype=np.int64)


@njit
def turns(values: FloatArray, least: float) -> IntArray:
    """Indices at which the channel turned round by more than `least`."""
    found = np.zeros(len(values), dtype=np.int64)
    count, extreme, sign = 0, 0, 0.0
    for k in range(1, len(values)):
        move = values[k] - values[extreme]
        if sign == 0.0:
            if abs(move) > least:
                sign = 1.0 if move > 0.0 else -1.0
                extreme = k
        elif sign * move > 0.0:
            extreme = k
        elif -sign * move > least and least > 0.0:
            found[count] = extreme
            count += 1
            sign, extreme = -sign, k
    return found[:count]
