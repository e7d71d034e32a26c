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


def outliers_in_motion(
    time: FloatArray, joint: FloatArray, driven: FloatArray, good: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Readings of the joint's angle, and of the motor's times the ratio, that are outliers of their difference: what
    quick motion, or stamps that come late, hide in either of them. Whose it is tells the line through its
    neighbours."""
    found = np.flatnonzero(outliers(joint - driven, good))
    off_joint, off_driven = _off_line(time, joint, good), _off_line(time, driven, good)
    of_joint, of_motor = np.zeros((2, len(joint)), dtype=np.bool_)
    of_joint[found] = off_joint[found] >= off_driven[found]
    of_motor[found] = ~of_joint[found]
    return of_joint, of_motor


def _off_line(time: FloatArray, values: FloatArray, good: BoolArray) -> FloatArray:
    """How far each good reading lies off the line through its two neighbours."""
    off = np.zeros(len(values))
    place = np.flatnonzero(good)
    t, v = time[place], values[place]
    line = v[:-2] + (v[2:] - v[:-2]) * (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
    off[place[1:-1]] = np.abs(v[1:-1] - line)
    return off


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
