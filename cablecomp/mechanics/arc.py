"""An arc with two free ends: belt pulley, idler, fixed guide or a stretch of sheath.

The same profile law as a drum's wrap, clamped by a friction cone from either end: v(y) on 0 <= y <= width, y = 0 the
near end. When the cones exclude each other the whole arc slides, and |v_1 - v_2| = mu width.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.profile import B, C, D, E, Floats, V, Y, piece_plain

ArcMeet: TypeAlias = tuple[float, float, float, float, float, float, float]


@kernel
def line(y1: float, v1: float, y2: float, v2: float) -> tuple[float, float]:
    """Integral of exp(v) - 1, and of exp(v), over a straight piece."""
    return piece_plain(y2 - y1, v2 - v1, math.exp(v1), math.exp(v2))


@kernel
def integral_to(G: Floats, i: int, n: int, y: float) -> float:
    """Integral of exp(v) - 1 from the near end to y, over the committed profile."""
    for k in range(n - 1):
        if y <= G[i, Y, k + 1]:
            share = (y - G[i, Y, k]) / (G[i, Y, k + 1] - G[i, Y, k])
            v = G[i, V, k] + share * (G[i, V, k + 1] - G[i, V, k])
            part, _ = line(G[i, Y, k], G[i, V, k], y, v)
            return G[i, C, k] + part
    return G[i, C, n - 1]


@kernel
def _value(G: Floats, i: int, n: int, y: float) -> float:
    """v of the committed profile at y."""
    k = 0
    while k < n - 2 and G[i, Y, k + 1] < y:
        k += 1
    share = (y - G[i, Y, k]) / (G[i, Y, k + 1] - G[i, Y, k])
    return G[i, V, k] + share * (G[i, V, k + 1] - G[i, V, k])


@kernel
def _near_meet(G: Floats, i: int, n: int, v: float, steep: float, s: float) -> float:
    """Where the cone from the near end meets the profile; beyond the far end if nowhere."""
    y_before, over_before = 0.0, v - G[i, V, 0]
    for k in range(1, n):
        over = v - steep * G[i, Y, k] - G[i, V, k]
        if over * s <= 0.0:
            return y_before + (G[i, Y, k] - y_before) * over_before / (over_before - over)
        y_before, over_before = G[i, Y, k], over
    return 1e300


@kernel
def _far_meet(G: Floats, i: int, n: int, v: float, steep: float, s: float) -> float:
    """Where the cone from the far end meets the profile; below zero if nowhere."""
    width = G[i, Y, n - 1]
    y_before, over_before = width, v - G[i, V, n - 1]
    for k in range(n - 2, -1, -1):
        over = v - steep * (width - G[i, Y, k]) - G[i, V, k]
        if over * s <= 0.0:
            return y_before + (G[i, Y, k] - y_before) * over_before / (over_before - over)
        y_before, over_before = G[i, Y, k], over
    return -1e300


@kernel
def arc_eval(G: Floats, i: int, n: int, v1: float, v2: float, mu: float) -> ArcMeet:
    """The arc at end values v1 (near) and v2 (far), |v1 - v2| <= mu width, without committing it.

    Returns (integral of exp(v) - 1, its change between the near end and the point that does not slip, its
    derivatives by v1 and v2, near and far meeting points (equal where the slip zones touch), and what a unit
    rise of v1 or fall of v2 adds to that change by moving the point where they touch).
    """
    width = G[i, Y, n - 1]
    s1 = 0.0 if v1 == G[i, V, 0] else (1.0 if v1 > G[i, V, 0] else -1.0)
    s2 = 0.0 if v2 == G[i, V, n - 1] else (1.0 if v2 > G[i, V, n - 1] else -1.0)
    near = 0.0 if s1 == 0.0 else _near_meet(G, i, n, v1, s1 * mu, s1)
    far = width if s2 == 0.0 else _far_meet(G, i, n, v2, s2 * mu, s2)
    swap = 0.0
    if near > far:
        if s1 * s2 > 0.0:  # both cones from the same side: they form a tent (or a valley)
            near = min(max(0.5 * (width + (v1 - v2) / (s1 * mu)), 0.0), width)
            swap = (math.exp(v1 - s1 * mu * near) - math.exp(_value(G, i, n, near))) / (2.0 * s1 * mu)
        else:  # the whole arc slides one way
            near = width if abs(v1 - G[i, V, 0]) > abs(v2 - G[i, V, n - 1]) else 0.0
        far = near
    old_near = integral_to(G, i, n, near)
    grown1 = grown2 = 0.0
    total = 0.0
    if near > 0.0:
        total, grown1 = line(0.0, v1, near, v1 - s1 * mu * near)
    change = total - old_near
    total += integral_to(G, i, n, far) - old_near
    if far < width:
        part, grown2 = line(far, v2 - s2 * mu * (width - far), width, v2)
        total += part
    return total, change, grown1, grown2, near, far, swap


@kernel
def arc_commit(G: Floats, i: int, n: int, v1: float, v2: float, mu: float) -> int:
    """Clamp the arc's profile to its new end values; returns the new number of points."""
    width = G[i, Y, n - 1]
    _, _, _, _, near, far, _ = arc_eval(G, i, n, v1, v2, mu)
    s1 = 1.0 if v1 > G[i, V, 0] else -1.0
    s2 = 1.0 if v2 > G[i, V, n - 1] else -1.0
    keep_from, keep_to = n, -1
    for k in range(1, n - 1):
        if near < G[i, Y, k] < far:
            keep_from = min(keep_from, k)
            keep_to = k
    tail = max(keep_to - keep_from + 1, 0)
    lead = 1 + (1 if near > 0.0 else 0)
    shift = lead - keep_from
    if tail > 0 and shift <= 0:
        for k in range(keep_from, keep_to + 1):
            _copy(G, i, k, k + shift)
    elif tail > 0:
        for k in range(keep_to, keep_from - 1, -1):
            _copy(G, i, k, k + shift)
    _put(G, i, 0, 0.0, v1)
    if near > 0.0:
        _put(G, i, 1, near, v1 - s1 * mu * near)
    m = lead + tail
    if far < width and (far > near or near == 0.0):
        if far > G[i, Y, m - 1]:
            _put(G, i, m, far, v2 - s2 * mu * (width - far))
            m += 1
    if near < width:
        _put(G, i, m, width, v2)
        m += 1
    return _tidy(G, i, m)


@kernel
def arc_fill(G: Floats, i: int, width: float, v: float) -> int:
    """Start an arc at uniform tension."""
    G[i, :, :] = 0.0
    _put(G, i, 0, 0.0, v)
    _put(G, i, 1, width, v)
    return _tidy(G, i, 2)


@kernel
def _put(G: Floats, i: int, k: int, y: float, v: float) -> None:
    G[i, Y, k] = y
    G[i, V, k] = v


@kernel
def _copy(G: Floats, i: int, source: int, target: int) -> None:
    G[i, Y, target] = G[i, Y, source]
    G[i, V, target] = G[i, V, source]


@kernel
def _tidy(G: Floats, i: int, n: int) -> int:
    """Join pieces that lie on one line (and, when memory runs out, those that nearly do); renew the running
    integrals."""
    limit = 1e-13
    while True:
        m = 1
        for k in range(1, n - 1):
            y0, v0 = G[i, Y, m - 1], G[i, V, m - 1]
            share = (G[i, Y, k] - y0) / (G[i, Y, k + 1] - y0)
            if abs(v0 + share * (G[i, V, k + 1] - v0) - G[i, V, k]) > limit:
                _copy(G, i, k, m)
                m += 1
        _copy(G, i, n - 1, m)
        n = m + 1
        if n < G.shape[2] - 4:
            break
        limit *= 10.0
    G[i, C, 0] = 0.0
    G[i, D, 0] = G[i, B, 0] = 0.0
    G[i, E, 0] = math.exp(G[i, V, 0])
    for k in range(1, n):
        G[i, E, k] = math.exp(G[i, V, k])
        part, _ = piece_plain(
            G[i, Y, k] - G[i, Y, k - 1], G[i, V, k] - G[i, V, k - 1], G[i, E, k - 1], G[i, E, k]
        )
        G[i, C, k] = G[i, C, k - 1] + part
        G[i, D, k] = G[i, B, k] = 0.0
    return n
