"""An arc with two free ends: belt pulley, idler, fixed guide or a stretch of sheath.

The same profile law as a drum's wrap, clamped by a friction cone from either end: v(y) on 0 <= y <= width, y = 0 the
near end. When the cones exclude each other the whole arc slides, and |v_1 - v_2| = mu width. The cable's laws are those
of all places but the joint's own drums (`tables.ELSEWHERE`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cablecomp.mechanics.jit import inner_kernel, kernel
from cablecomp.mechanics.piece import piece
from cablecomp.mechanics.profile import STRAIGHT, Floats, Points, clear
from cablecomp.mechanics.tables import ELSEWHERE, strain_of_tau, tau_of_v


class ArcMeet(NamedTuple):
    """Where the slip zones of an arc at new end values end, and its near side evaluated."""

    change: float  # of the integral of the strain e(v) between the near end and the point that does not slip
    by_near: float  # derivative of the integral by the near end's value
    near: float  # where the cone of the near end meets the profile
    far: float  # that of the far end; the same where the slip zones touch
    swap: (
        float  # what a unit rise at the near end or fall at the far one adds to `change`, as that point moves
    )


@inner_kernel
def _strain(laws: Floats, v: float) -> float:
    return strain_of_tau(laws, ELSEWHERE, tau_of_v(laws, ELSEWHERE, v))[0]


@inner_kernel
def integral_to(p: Points, laws: Floats, n: int, y: float) -> float:
    """Integral of e(v) from the near end to y, over the committed profile."""
    for k in range(n - 1):
        if y < p[k + 1].y:
            if y <= p[k].y:
                return p[k].stretch
            share = (y - p[k].y) / (p[k + 1].y - p[k].y)
            v = p[k].v + share * (p[k + 1].v - p[k].v)
            part, _ = piece(laws, ELSEWHERE, p[k].y, p[k].v, p[k].tau, y, v, math.exp(v))
            return p[k].stretch + part
    return p[n - 1].stretch


@inner_kernel
def _value(p: Points, n: int, y: float) -> float:
    """v of the committed profile at y."""
    k = 0
    while k < n - 2 and p[k + 1].y < y:
        k += 1
    share = (y - p[k].y) / (p[k + 1].y - p[k].y)
    return p[k].v + share * (p[k + 1].v - p[k].v)


@inner_kernel
def _near_meet(p: Points, n: int, v: float, steep: float, s: float) -> float:
    """Where the cone from the near end meets the profile; beyond the far end if nowhere."""
    y_before, over_before = 0.0, v - p[0].v
    for k in range(1, n):
        over = v - steep * p[k].y - p[k].v
        if over * s <= 0.0:
            return y_before + (p[k].y - y_before) * over_before / (over_before - over)
        y_before, over_before = p[k].y, over
    return 1e300


@inner_kernel
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


@inner_kernel
def arc_meet(p: Points, laws: Floats, n: int, v1: float, tau1: float, v2: float, mu: float) -> ArcMeet:
    """The arc at end values v1 (near; T/T0 = tau1) and v2 (far), |v1 - v2| <= mu width, without committing it."""
    width = p[n - 1].y
    s1, s2 = _side(v1, p[0].v), _side(v2, p[n - 1].v)
    near = 0.0 if s1 == 0.0 else _near_meet(p, n, v1, s1 * mu, s1)
    far = width if s2 == 0.0 else _far_meet(p, n, v2, s2 * mu, s2)
    swap = 0.0
    if near > far:
        if s1 * s2 > 0.0:  # both cones from the same side: they form a tent (or a valley)
            near = min(max(0.5 * (width + (v1 - v2) / (s1 * mu)), 0.0), width)
            tent = v1 - s1 * mu * near
            swap = (_strain(laws, tent) - _strain(laws, _value(p, n, near))) / (2.0 * s1 * mu)
        elif near <= width and far >= 0.0:
            # about to slide as a whole: both cones meet the profile at one point
            near = 0.5 * (near + far)
        else:  # the whole arc slides one way
            near = width if abs(v1 - p[0].v) > abs(v2 - p[n - 1].v) else 0.0
        far = near
    slipped = by_near = 0.0
    if near > 0.0:
        v = v1 - s1 * mu * near
        slipped, by_near = piece(laws, ELSEWHERE, 0.0, v1, tau1, near, v, math.exp(v))
    return ArcMeet(slipped - integral_to(p, laws, n, near), by_near, near, far, swap)


@inner_kernel
def arc_total(
    p: Points, laws: Floats, n: int, v2: float, tau2: float, mu: float, meet: ArcMeet
) -> tuple[float, float]:
    """Integral of e(v) over the whole arc that has been met, and its derivative by the far end's value."""
    width, far = p[n - 1].y, meet.far
    total, by_far = meet.change + integral_to(p, laws, n, far), 0.0
    if far < width:
        v = v2 - _side(v2, p[n - 1].v) * mu * (width - far)
        slipped, by_far = piece(laws, ELSEWHERE, far, v, math.exp(v), width, v2, tau2)
        total += slipped
    return total, by_far


@inner_kernel
def _side(new: float, old: float) -> float:
    """On which side of the committed value an end stands: +1 above, -1 below, 0 on it."""
    return 0.0 if new == old else (1.0 if new > old else -1.0)


@kernel
def arc_commit(p: Points, laws: Floats, n: int, v1: float, v2: float, mu: float) -> int:
    """Clamp the arc's profile to its new end values; returns the new number of points."""
    width = p[n - 1].y
    meet = arc_meet(p, laws, n, v1, math.exp(v1), v2, mu)
    near, far = meet.near, meet.far
    s1 = 1.0 if v1 > p[0].v else -1.0
    s2 = 1.0 if v2 > p[n - 1].v else -1.0
    keep_from, keep_to = n, -1
    for k in range(1, n - 1):
        if near < p[k].y < far:
            keep_from = min(keep_from, k)
            keep_to = k
    kept = max(keep_to - keep_from + 1, 0)
    kept_at = 1 + (1 if near > 0.0 else 0)
    shift = kept_at - keep_from
    if kept > 0 and shift <= 0:
        for k in range(keep_from, keep_to + 1):
            _copy(p, k, k + shift)
    elif kept > 0:
        for k in range(keep_to, keep_from - 1, -1):
            _copy(p, k, k + shift)
    _put(p, 0, 0.0, v1)
    if near > 0.0:
        _put(p, 1, near, v1 - s1 * mu * near)
    m = kept_at + kept
    if far < width and (far > near or near == 0.0):
        if far > p[m - 1].y:
            _put(p, m, far, v2 - s2 * mu * (width - far))
            m += 1
    if near < width:
        _put(p, m, width, v2)
        m += 1
    return _tidy(p, laws, m)


@kernel
def arc_fill(p: Points, laws: Floats, width: float, v: float) -> int:
    """Start an arc at uniform tension."""
    clear(p)
    _put(p, 0, 0.0, v)
    _put(p, 1, width, v)
    return _tidy(p, laws, STRAIGHT)


@inner_kernel
def _put(p: Points, k: int, y: float, v: float) -> None:
    p[k].y = y
    p[k].v = v


@inner_kernel
def _copy(p: Points, source: int, target: int) -> None:
    p[target].y = p[source].y
    p[target].v = p[source].v


@inner_kernel
def _tidy(p: Points, laws: Floats, n: int) -> int:
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
        part, _ = piece(laws, ELSEWHERE, p[k - 1].y, p[k - 1].v, p[k - 1].tau, p[k].y, p[k].v, p[k].tau)
        p[k].stretch = p[k - 1].stretch + part
        p[k].merged = p[k].stretch_error = 0.0
    return n
