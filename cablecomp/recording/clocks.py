"""Several clocks to one: a sender's time stamps brought to the clock that logged them.

A message is logged after it was stamped, by a delay that is never negative and often near its least. The line
under all points (stamp, logged) therefore tells the clocks' offset and drift; what lies above it is delay.
Source: S. B. Moon, P. Skelly, D. Towsley, "Estimation and removal of clock skew from network delay measurements",
IEEE INFOCOM 1999 (there a linear program; its solution is an edge of the lower convex hull).
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from cablecomp.recording.table import FloatArray


class ClockLine(NamedTuple):
    """Logger's time [s] = `offset_s` + `rate` x sender's time [s], both counted from `origin_ns`.

    `delay_s` is the median of what messages took beyond the quickest.
    """

    rate: float
    offset_s: float
    delay_s: float

    def logged(self, stamp_s: float) -> float:
        """The logger's time at which the sender's clock read `stamp_s`."""
        return self.offset_s + self.rate * stamp_s


def clock_line(stamp_s: FloatArray, logged_s: FloatArray) -> ClockLine:
    """The line under the points (n >= 1 each, finite): the edge of their lower hull at the mean stamp.

    Over less than 10 s, or where the clocks drift by more than 1 % (one of them was set meanwhile), the offset
    alone is taken, and the rate is 1.
    """
    wait = logged_s - stamp_s
    span = float(np.ptp(stamp_s))
    rate = 1.0
    if span >= 10.0:
        slope = _hull_slope(stamp_s, wait)
        rate = 1.0 + slope if abs(slope) < 0.01 else 1.0
    over = logged_s - rate * stamp_s
    offset = float(over.min())
    return ClockLine(rate, offset, float(np.median(over - offset)))


def _hull_slope(x: FloatArray, y: FloatArray) -> float:
    """Slope of the lower hull's edge over the mean of x (Andrew's monotone chain)."""
    order = np.lexsort((y, x))
    hull: list[tuple[float, float]] = []
    for point in zip(x[order].tolist(), y[order].tolist(), strict=True):
        while len(hull) > 1 and _turn(hull[-2], hull[-1], point) <= 0.0:
            hull.pop()
        hull.append(point)
    mean = float(x.mean())
    for left, right in pairwise(hull):
        if left[0] <= mean <= right[0] and right[0] > left[0]:
            return (right[1] - left[1]) / (right[0] - left[0])
    return 0.0


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
