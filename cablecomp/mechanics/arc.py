"""An arc with two free ends: belt pulley, idler, fixed guide or a stretch of sheath.

The same profile law as a drum's wrap, clamped by a friction cone from either end: v(y) on 0 <= y <= width, y = 0 the
near end. When the cones exclude each other the whole arc slides, and |v_1 - v_2| = mu width.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.profile import Points, clear, piece_plain


class ArcMeet(NamedTuple):
    """An arc at new end values, evaluated."""

    total: float  # integral of exp(v) - 1
    change: float  # of that integral, between the near end and the point that does not slip
    by_near: float  # derivative of the integral by the near end's value
    by_far: float  # by the far end's
    near: float  # where the cone of the near end meets the profile
    far: float  # that of the far end; the same where the slip zones touch
    swap: (
        float  # what a unit rise at the near end or fall at the far one adds to `change`, as that point moves
    )


@kernel
def line(y1: float, v1: float, y2: float, v2: float) -> tuple[float, float]:
    """Integral of exp(v) - 1, and of exp(v), over a straight piece."""
    return piece_plain(y2 - y1, v2 - v1, math.exp(v1), math.exp(v2))


@kernel
def integral_to(p: Points, n: int, y: float) -> float:
    """Integral of exp(v) - 1 from the near end to y, over the committed profile."""
    for k in range(n - 1):
        if y <= p[k + 1].y:
            share = (y - p[k].y) / (p[k + 1].y - p[k].y)
            v = p[k].v + share * (p[k + 1].v - p[k].v)
            part, _ = line(p[k].y, p[k].v, y, v)
            return p[k].stretch + part
    return p[n - 1].stretch


@kernel
def _value(p: Points, n: int, y: float) -> float:
    """v of the committed profile at y."""
    k = 0
    while k < n - 2 and p[k + 1].y < y:
        k += 1
    share = (y - p[k].y) / (p[k + 1].y - p[k].y)
    return p[k].v + share * (p[k + 1].v - p[k].v)


@kernel
def _near_meet(p: Points, n: int, v: float, steep: float, s: float) -> float:
    """Where the cone from the near end meets the profile; beyond the far end if nowhere."""
    y_before, over_before = 0.0, v - p[0].v
    for k in range(1, n):
        over = v - steep * p[k].y - p[k].v
        if over * s <= 0.0:
            return y_before + (p[k].y - y_before) * over_before / (over_before - over)
        y_before, over_before = p[k].y, over
    return 1e300


@kernel
def _far_meet(p: Points, n: int, v: float, steep: float, s: float) -> float:
    """Where the cone from the far end meets the profile; below zero if nowhere."""
    width = p[n - 1].y
    y_before, over_before = width, v - p[n - 1].v
    for k in range(n - 2, -1, -1):
        over = v - steep * (width - p[k].y) - p[k].v
        if over * s <= 0.0:
            return y_before + (p[k].y - y_before) * over_before / (over_before - over)
        y_before, over_before = p[k].y, over
    return -1e300


@kernel
def arc_eval(p: Points, n: int, v1: float, v2: float, mu: float) -> ArcMeet:
    """The arc at end values v1 (near) and v2 (far), |v1 - v2| <= mu width, without committing it."""
    width = p[n - 1].y
    s1 = 0.0 if v1 == p[0].v else (1.0 if v1 > p[0].v else -1.0)
    s2 = 0.0 if v2 == p[n - 1].v else (1.0 if v2 > p[n - 1].v else -1.0)
    near = 0.0 if s1 == 0.0 else _near_meet(p, n, v1, s1 * mu, s1)
    far = width if s2 == 0.0 else _far_meet(p, n, v2, s2 * mu, s2)
    swap = 0.0
    if near > far:
        if s1 * s2 > 0.0:  # both cones from the same side: they form a tent (or a valley)
            near = min(max(0.5 * (width + (v1 - v2) / (s1 * mu)), 0.0), width)
            swap = (math.exp(v1 - s1 * mu * near) - math.exp(_value(p, n, near))) / (2.0 * s1 * mu)
        else:  # the whole arc slides one way
            near = width if abs(v1 - p[0].v) > abs(v2 - p[n - 1].v) else 0.0
        far = near
    old_near = integral_to(p, n, near)
    grown1 = grown2 = 0.0
    total = 0.0
    if near > 0.0:
        total, grown1 = line(0.0, v1, near, v1 - s1 * mu * near)
    change = total - old_near
    total += integral_to(p, n, far) - old_near
    if far < width:
        part, grown2 = line(far, v2 - s2 * mu * (width - far), width, v2)
        total += part
    return ArcMeet(total, change, grown1, grown2, near, far, swap)


@kernel
def arc_commit(p: Points, n: int, v1: float, v2: float, mu: float) -> int:
    """Clamp the arc's profile to its new end values; returns the new number of points."""
    width = p[n - 1].y
    meet = arc_eval(p, n, v1, v2, mu)
    near, far = meet.near, meet.far
    s1 = 1.0 if v1 > p[0].v else -1.0
    s2 = 1.0 if v2 > p[n - 1].v else -1.0
    keep_from, keep_to = n, -1
    for k in range(1, n - 1):
        if near < p[k].y < far:
            keep_from = min(keep_from, k)
            keep_to = k
    tail = max(keep_to - keep_from + 1, 0)
    lead = 1 + (1 if near > 0.0 else 0)
    shift = lead - keep_from
    if tail > 0 and shift <= 0:
        for k in range(keep_from, keep_to + 1):
            _copy(p, k, k + shift)
    elif tail > 0:
        for k in range(keep_to, keep_from - 1, -1):
            _copy(p, k, k + shift)
    _put(p, 0, 0.0, v1)
    if near > 0.0:
        _put(p, 1, near, v1 - s1 * mu * near)
    m = lead + tail
    if far < width and (far > near or near == 0.0):
        if far > p[m - 1].y:
            _put(p, m, far, v2 - s2 * mu * (width - far))
            m += 1
    if near < width:
        _put(p, m, width, v2)
        m += 1
    return _tidy(p, m)


@kernel
def arc_fill(p: Points, width: float, v: float) -> int:
    """Start an arc at uniform tension."""
    clear(p)
    _put(p, 0, 0.0, v)
    _put(p, 1, width, v)
    return _tidy(p, 2)


@kernel
def _put(p: Points, k: int, y: float, v: float) -> None:
    p[k].y = y
    p[k].v = v


@kernel
def _copy(p: Points, source: int, target: int) -> None:
    p[target].y = p[source].y
    p[target].v = p[source].v


@kernel
def _tidy(p: Points, n: int) -> int:
    """Join pieces that lie on one line (and, when memory runs out, those that nearly do); renew the running
    integrals."""
    limit = 1e-13
    while True:
        m = 1
        for k in range(1, n - 1):
            y0, v0 = p[m - 1].y, p[m - 1].v
            share = (p[k].y - y0) / (p[k + 1].y - y0)
            if abs(v0 + share * (p[k + 1].v - v0) - p[k].v) > limit:
                _copy(p, k, m)
                m += 1
        _copy(p, n - 1, m)
        n = m + 1
        if n < p.shape[0] - 4:
            break
        limit *= 10.0
    p[0].stretch = 0.0
    p[0].merged = p[0].stretch_error = 0.0
    p[0].tau = math.exp(p[0].v)
    for k in range(1, n):
        p[k].tau = math.exp(p[k].v)
        part, _ = piece_plain(p[k].y - p[k - 1].y, p[k].v - p[k - 1].v, p[k - 1].tau, p[k].tau)
        p[k].stretch = p[k - 1].stretch + part
        p[k].merged = p[k].stretch_error = 0.0
    return n
