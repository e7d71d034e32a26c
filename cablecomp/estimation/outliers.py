"""Readings that no joint gave: single ones far off their neighbours, runs that lie nowhere near the rest."""

from __future__ import annotations

from typing import Final

import numpy as np

from cablecomp.signal.smoothing import BoolArray, FloatArray

ABSURD: Final = 20.0
"""Ranges (2 to 98 %) from the middle beyond which no joint has been: counters that overflow, words for "no reading"."""
SPIKE: Final = 8.0
"""Deviations (scaled median) from the neighbours beyond which a reading is an outlier."""


def outliers(values: FloatArray, good: BoolArray) -> BoolArray:
    """Single readings far off the line through their neighbours, and off what differences usually are; runs of them
    that lie nowhere near the rest."""
    found = np.zeros(len(values), dtype=np.bool_)
    place = np.flatnonzero(good)
    v = values[place]
    absurd = _absurd(v)
    found[place[absurd]] = True
    place, v = place[~absurd], v[~absurd]
    before, after = v[1:-1] - v[:-2], v[1:-1] - v[2:]
    both = np.where(before * after > 0.0, np.minimum(np.abs(before), np.abs(after)), 0.0)
    usual = float(np.median(np.abs(np.diff(v, 2)))) / 0.6745 + 1e-300
    found[place[1:-1]] |= (both > SPIKE * usual) & (both > SPIKE * float(np.quantile(both, 0.97)) / 2.0)
    return found


def _absurd(v: FloatArray) -> BoolArray:
    """Runs of readings far outside of where all others lie, into which and out of which the channel leaps in one
    sample: a quick motion after a long rest does not leap."""
    low, high = np.quantile(v, (0.02, 0.98))
    away = np.abs(v - 0.5 * (low + high))
    far = (away > ABSURD * (high - low)) & (high > low)
    edges = np.flatnonzero(np.diff(far.astype(np.int8), prepend=0, append=0))
    leap = np.concatenate(([np.inf], np.abs(np.diff(v)), [np.inf]))
    found = np.zeros(len(v), dtype=np.bool_)
    for first, end in edges.reshape(-1, 2):
        found[first:end] = min(leap[first], leap[end]) > 0.5 * away[first:end].max()
    return found
