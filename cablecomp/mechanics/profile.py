"""The general history law of a wrapped cable: the tension profile is the state.

A wrap is a list of points (y, v) from the termination (y = 0) to the departure point (y = wrap angle), straight in
between: y [rad] is fixed to the drum, v = ln(T/T0) is the logarithmic tension. Coulomb friction bounds the slope,
|dv/dy| <= mu (thesis 2-11). One step with new wrap angle w and new end value v_a:

1. rotate: winding on appends cable, unwinding drops it;
2. clamp into the friction cone of the end:  v(y) <- min(max(v(y), v_a - mu (w - y)), v_a + mu (w - y)).

The clamp touches one contiguous piece at the departure point, so the list works as a stack: exact, amortised O(1).
Where friction depends on tension or on the place in the groove, the law is the same in the coordinates
v = int dT/(T m(T)) and sigma = mu int g(y) dy (table mode, see `tables.py`).

Rows of `G[i]`: Y angle, V logarithmic tension, C integral of strain * EA/T0 from the termination, D bound on the error
of v that merging left in the piece below a point, B integral of D * tau: the bound on the error of C, E = exp(V).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cablecomp.mechanics.jit import kernel, leaf_kernel
from cablecomp.mechanics.tables import (
    GROOVED,
    PLAIN,
    STIFF,
    STIFFENING,
    between,
    groove,
    stiffening_strain,
    strain,
)

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]

Y, V, C, D, B, E = 0, 1, 2, 3, 4, 5
ROWS = 6
LEAST_WRAP = 1e-3  # [rad] of cable that a drum has to keep

# 8-point Gauss-Legendre on [0, 1]
_x, _w = np.polynomial.legendre.leggauss(8)
GAUSS_X = (_x + 1.0) / 2.0
GAUSS_W = _w / 2.0
_x, _w = np.polynomial.legendre.leggauss(3)
SHORT_X = (_x + 1.0) / 2.0
SHORT_W = _w / 2.0
F2, F3, F4, F5, F6, F7, F8 = (1.0 / math.factorial(_n) for _n in range(2, 9))


class Meet(NamedTuple):
    """A step of a wrap, evaluated: what it would hold, and where the cone of its end meets the old profile."""

    total: float  # integral of e
    slope: float  # its derivative by the end value
    k: int  # last point kept
    y: float  # the meeting point
    v: float
    c: float
    b: float
    e: float


@kernel
def copy_floats(source: Floats, i: int, target: Floats, j: int, n: int) -> None:
    """target[j : j + n] = source[i : i + n], forwards and in place."""
    for k in range(n):
        target[j + k] = source[i + k]


@leaf_kernel
def piece(
    L: Floats, law: int, y1: float, v1: float, t1: float, y2: float, v2: float, t2: float
) -> tuple[float, float]:
    """Integral of e(v) over y1..y2 and of de/dv; e = strain * EA/T0 = tau - 1 for the plain cable, whose tau
    are t1, t2."""
    dy = y2 - y1
    d = v2 - v1
    if L is None:
        return piece_plain(dy, d, t1, t2)
    if L[0, 0, 0] == PLAIN:
        return piece_plain(dy, d, t1, t2)
    if L[0, 0, 0] == STIFF:
        return _piece_stiff(L[law, 0, STIFFENING], dy, v1, d)
    return piece_table(L, law, y1, v1, y2, v2)


@leaf_kernel
def piece_plain(dy: float, d: float, t1: float, t2: float) -> tuple[float, float]:
    """`piece` in closed form: exp(v) over a straight piece that rises by d."""
    if abs(d) > 0.1:
        grown = dy * (t2 - t1) / d
    else:  # (1 - exp(-d))/d as a series: the difference of the exponentials would cancel
        grown = dy * t2 * (1.0 - d * (F2 - d * (F3 - d * (F4 - d * (F5 - d * (F6 - d * (F7 - d * F8)))))))
    return grown - dy, grown


@kernel
def _piece_stiff(b: float, dy: float, v1: float, d: float) -> tuple[float, float]:
    """`piece` for a cable that stiffens under plain friction: Gauss-Legendre quadrature, 3 points on short pieces."""
    total = slope = 0.0
    if abs(d) < 0.05:  # its error there is below 1e-13 of the strain
        for j in range(3):
            tau = math.exp(v1 + d * SHORT_X[j])
            e, de = stiffening_strain(b, tau)
            total += SHORT_W[j] * e
            slope += SHORT_W[j] * de * tau
    else:
        for j in range(8):
            tau = math.exp(v1 + d * GAUSS_X[j])
            e, de = stiffening_strain(b, tau)
            total += GAUSS_W[j] * e
            slope += GAUSS_W[j] * de * tau
    return total * dy, slope * dy


@kernel
def piece_table(L: Floats, law: int, y1: float, v1: float, y2: float, v2: float) -> tuple[float, float]:
    """`piece` by Gauss-Legendre quadrature, for tabulated laws; 3 points on short pieces where friction has no
    place."""
    dy = y2 - y1
    d = v2 - v1
    total = 0.0
    slope = 0.0
    if L[law, 0, GROOVED] == 0.0:
        if abs(d) < 0.05:
            for j in range(3):
                e, de = strain(L, law, v1 + d * SHORT_X[j])
                total += SHORT_W[j] * e
                slope += SHORT_W[j] * de
        else:
            for j in range(8):
                e, de = strain(L, law, v1 + d * GAUSS_X[j])
                total += GAUSS_W[j] * e
                slope += GAUSS_W[j] * de
        return total * dy, slope * dy
    s1 = groove(L, law, y1)
    span = groove(L, law, y2) - s1
    for j in range(8):
        y = y1 + dy * GAUSS_X[j]
        share = (groove(L, law, y) - s1) / span if span > 0.0 else 0.0
        e, de = strain(L, law, v1 + d * share)
        total += GAUSS_W[j] * e
        slope += GAUSS_W[j] * de
    return total * dy, slope * dy


@leaf_kernel
def set_pending(step: Any, meet: Meet) -> None:
    """Write an evaluated step into a wrap's record `STEP`."""
    step.total, step.k = meet.total, meet.k
    step.y, step.v, step.c, step.b, step.e = meet.y, meet.v, meet.c, meet.b, meet.e


@leaf_kernel
def wrap_eval(
    G: Floats, L: Floats, law: int, i: int, n: int, w: float, v: float, tau: float, mu: float
) -> Meet:
    """What wrap i would hold at wrap angle w and end value v, without committing it.

    `w` is above 0; `tau` is exp(v).
    """
    top = n - 1
    k = top
    yp, vp, tp = G[i, Y, top], G[i, V, top], G[i, E, top]
    if w < yp:
        k -= 1
        while G[i, Y, k] > w:  # ends at the termination, y = 0, at the latest
            k -= 1
        y1, v1 = G[i, Y, k], G[i, V, k]
        s1 = groove(L, law, y1)
        share = (groove(L, law, w) - s1) / (groove(L, law, G[i, Y, k + 1]) - s1)
        yp = w
        vp = v1 + share * (G[i, V, k + 1] - v1)
        tp = math.exp(vp)
    sw = groove(L, law, w)
    if abs(v - vp) <= mu * (sw - groove(L, law, yp)):
        # cable wound on, or nothing at all happened: no slip
        cp, bp = _running(G, L, law, i, k, n, yp, vp, tp)
        if w == yp:
            return Meet(cp, 0.0, k, yp, vp, cp, bp, tp)
        integral, slope = piece(L, law, yp, vp, tp, w, v, tau)
        # its derivative by the new end alone: about half of the whole shift's, enough for Newton's method
        return Meet(cp + integral, 0.5 * slope, k, yp, vp, cp, bp, tp)
    # the cone of the new end cuts into the profile: walk inward to where they meet
    s = 1.0 if v > vp else -1.0
    steep = s * mu
    over_upper = v - steep * (sw - groove(L, law, yp)) - vp
    y_upper = yp
    over = 0.0
    while k >= 0:
        over = v - steep * (sw - groove(L, law, G[i, Y, k])) - G[i, V, k]
        if over * s <= 0.0:
            break
        over_upper = over
        y_upper = G[i, Y, k]
        k -= 1
    if k < 0:  # the whole wrap slips, down to the termination
        ym = 0.0
    else:
        # both differences vanish together where the new end lies on the old profile to the last bit
        share = over / (over - over_upper) if over != over_upper else 1.0
        ym = between(L, law, G[i, Y, k], y_upper, share)
    vm = v - steep * (sw - groove(L, law, ym))
    tm = math.exp(vm)
    cm = bm = 0.0
    if k >= 0:
        cm, bm = _running(G, L, law, i, k, n, ym, vm, tm)
    integral, slope = piece(L, law, ym, vm, tm, w, v, tau)
    return Meet(cm + integral, slope, k, ym, vm, cm, bm, tm)


@leaf_kernel
def _running(
    G: Floats, L: Floats, law: int, i: int, k: int, n: int, y: float, v: float, t: float
) -> tuple[float, float]:
    """C and B at a point (y, v) of the profile on the piece above point k."""
    if k == n - 1 or y == G[i, Y, k]:
        return G[i, C, k], G[i, B, k]
    integral, _ = piece(L, law, G[i, Y, k], G[i, V, k], G[i, E, k], y, v, t)
    error = G[i, D, k + 1]
    return G[i, C, k] + integral, G[i, B, k] + error * (integral + y - G[i, Y, k])


@kernel
def wrap_commit(G: Floats, L: Floats, law: int, i: int, n: int, step: Any, tolerance: float) -> int:
    """Make an evaluated step, a record `STEP`, the state; returns the new number of points.

    `tolerance` bounds the error of v that merging of neighbours may leave in a piece; a merged piece's integral is that
    of the straight piece, so that the stretch stays a continuous function of the tension. The stack never
    outgrows its array.
    """
    total, k, w, v, tau = step.total, int(step.k), step.w, step.end, step.tau
    below = G[i, D, k + 1] if 0 <= k < n - 1 else 0.0
    kept = k == n - 1  # nothing was cut off: cable was wound on, and may continue the piece below
    n = k + 1
    if n == 0 or step.y > G[i, Y, n - 1]:
        G[i, Y, n], G[i, V, n], G[i, C, n] = step.y, step.v, step.c
        G[i, D, n], G[i, B, n], G[i, E, n] = below, step.b, step.e
        n += 1
        kept = False
    last = n - 1
    if w > G[i, Y, last]:
        error = 0.0
        if kept and last >= 1:
            merged = G[i, D, last] + _merge_error(G, L, law, i, n, w, v)
            if merged <= tolerance:
                error = merged
                last -= 1
                straight, _ = piece(L, law, G[i, Y, last], G[i, V, last], G[i, E, last], w, v, tau)
                total = G[i, C, last] + straight
        n = last + 2
        G[i, Y, n - 1], G[i, V, n - 1], G[i, D, n - 1] = w, v, error
        G[i, C, n - 1], G[i, E, n - 1] = total, tau
        G[i, B, n - 1] = G[i, B, last] + error * (total - G[i, C, last] + w - G[i, Y, last])
    if n >= G.shape[2] - 3:
        n = compact(G, L, law, i, n)
    return n


@kernel
def _merge_error(G: Floats, L: Floats, law: int, i: int, n: int, w: float, v: float) -> float:
    """Distance in v of the last point from the straight piece that would replace it."""
    y0, y1 = G[i, Y, n - 2], G[i, Y, n - 1]
    s0 = groove(L, law, y0)
    share = (groove(L, law, y1) - s0) / (groove(L, law, w) - s0)
    return abs(G[i, V, n - 2] + share * (v - G[i, V, n - 2]) - G[i, V, n - 1])


@kernel
def compact(G: Floats, L: Floats, law: int, i: int, n: int) -> int:
    """Halve the list by dropping the points that a straight piece replaces best; the error made is kept in D and B.

    A chord of a mu-Lipschitz profile is mu-Lipschitz, so the friction bound survives.
    """
    # error made here, by the piece below each point, kept in the row E (renewed at the end); the limit is on this alone
    for k in range(n):
        G[i, E, k] = 0.0
    limit = 1e-12
    while n > G.shape[2] // 2:
        m = 1
        for k in range(1, n - 1):
            y0, v0 = G[i, Y, m - 1], G[i, V, m - 1]
            y1, v1 = G[i, Y, k], G[i, V, k]
            y2, v2 = G[i, Y, k + 1], G[i, V, k + 1]
            s0 = groove(L, law, y0)
            off = abs(v0 + (groove(L, law, y1) - s0) / (groove(L, law, y2) - s0) * (v2 - v0) - v1)
            error = max(G[i, E, k], G[i, E, k + 1]) + off
            if error <= limit:
                G[i, E, k + 1] = error
                G[i, D, k + 1] = max(G[i, D, k], G[i, D, k + 1]) + off
            else:
                G[i, Y, m], G[i, V, m], G[i, D, m], G[i, E, m] = y1, v1, G[i, D, k], G[i, E, k]
                m += 1
        G[i, Y, m], G[i, V, m], G[i, D, m], G[i, E, m] = (
            G[i, Y, n - 1], G[i, V, n - 1], G[i, D, n - 1], G[i, E, n - 1]
        )  # fmt: skip
        n = m + 1
        limit *= 4.0
    accumulate(G, L, law, i, n)
    return n


@kernel
def accumulate(G: Floats, L: Floats, law: int, i: int, n: int) -> None:
    """Recompute the running integrals C and B of wrap i."""
    G[i, C, 0] = 0.0
    G[i, B, 0] = 0.0
    G[i, E, 0] = math.exp(G[i, V, 0])
    for k in range(1, n):
        dy = G[i, Y, k] - G[i, Y, k - 1]
        G[i, E, k] = math.exp(G[i, V, k])
        integral, _ = piece(
            L, law, G[i, Y, k - 1], G[i, V, k - 1], G[i, E, k - 1], G[i, Y, k], G[i, V, k], G[i, E, k]
        )
        G[i, C, k] = G[i, C, k - 1] + integral
        G[i, B, k] = G[i, B, k - 1] + G[i, D, k] * (integral + dy)


@kernel
def wrap_fill(G: Floats, L: Floats, law: int, i: int, w: float, v: float, slope: float) -> int:
    """Start wrap i straight: v at the departure point, falling inward by `slope` per sigma (0 = uniform)."""
    G[i, :, :] = 0.0
    G[i, V, 0] = v - slope * (groove(L, law, w) - groove(L, law, 0.0))
    G[i, Y, 1], G[i, V, 1] = w, v
    accumulate(G, L, law, i, 2)
    return 2
