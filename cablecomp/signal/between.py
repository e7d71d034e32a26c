"""What was read, between its rows: how fast it changes, and its values at other times."""

from __future__ import annotations

from typing import Final

import numpy as np

from cablecomp.mechanics.jit import njit
from cablecomp.signal.smoothing import FloatArray

EVENLY: Final = 0.2
"""Of what a rate changes by from row to row, how far off its mean may be where it bends evenly; twice as far off it
counts as straight, and in between as partly bent (at a corner it is off by half)."""
LEAST: Final = 1e-300
"""So that a rate that does not change at all divides nothing by zero."""


@njit
def rate_of(values: FloatArray, time: FloatArray) -> FloatArray:
    """By how much values change in a second, of second order in uneven steps (one step's at either end); NaN where two
    of them have one time, or there is but one."""
    n = len(values)
    rate = np.full(n, np.nan)
    for k in range(n):
        a, b = max(k - 1, 0), min(k + 1, n - 1)
        before, after = time[k] - time[a], time[b] - time[k]
        if k == 0 or k == n - 1:
            if time[b] > time[a]:
                rate[k] = (values[b] - values[a]) / (time[b] - time[a])
        elif before > 0.0 and after > 0.0:
            rising, falling = (values[b] - values[k]) / after, (values[k] - values[a]) / before
            rate[k] = (before * rising + after * falling) / (before + after)
    return rate


@njit
def read_at(wanted: FloatArray, time: FloatArray, values: FloatArray, rate: FloatArray) -> FloatArray:
    """Values at other times: between two of them by a cubic where their `rate` (NaN: unknown) bends evenly and straight
    at corners, the first before all, and on beyond the last as over the last so much time.

    Straight throughout, a step h of the time hides h^2/8 of an acceleration, which seems an inertia.
    """
    found = np.empty(len(wanted))
    last = len(time) - 1
    slope, most = 0.0, wanted.max() - time[last] if len(wanted) else 0.0
    if most > 0.0 and time[last] > time[0]:
        back = min(max(most, time[last] - time[last - 1]), time[last] - time[0])
        slope = (values[last] - np.interp(time[last] - back, time, values)) / back
    k = 0
    for i in range(len(wanted)):
        at = wanted[i]
        if at <= time[0]:
            found[i] = values[0]
            continue
        if at >= time[last]:
            found[i] = values[last] + slope * (at - time[last])
            continue
        if not time[k] <= at:
            k = 0
        while time[k + 1] <= at:
            k += 1
        length = time[k + 1] - time[k]
        part = (at - time[k]) / length
        straight = (values[k + 1] - values[k]) / length
        begins, ends = rate[k] - straight, rate[k + 1] - straight
        even = 2.0 - abs(begins + ends) / (EVENLY * abs(ends - begins) + LEAST)
        if even > 0.0:  # no corner, and known
            straight += min(even, 1.0) * (1.0 - part) * ((1.0 - part) * begins - part * ends)
        found[i] = values[k] + length * part * straight
    return found
