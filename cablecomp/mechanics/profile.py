"""The general history law of a wrapped cable: the tension profile is the state.

A wrap is a list of points (y, v) from the termination (y = 0) to the departure point (y = wrap angle), straight in
between: y [rad] is fixed to the drum, v = ln(T/T0) is the logarithmic tension. Coulomb friction bounds the slope,
|dv/dy| <= mu (thesis 2-11). One step with new wrap angle w and new end value v_a:

1. rotate: winding on appends cable, unwinding drops it;
2. clamp into the friction cone of the end:  v(y) <- min(max(v(y), v_a - mu (w - y)), v_a + mu (w - y)).

The clamp touches one contiguous piece at the departure point, so the list works as a stack: exact, amortised O(1).
Where friction depends on tension or on the place in the groove, the law is the same in the coordinates
v = int dT/(T m(T)) and sigma = mu int g(y) dy (table mode, see `tables.py`).

A profile is an array `p` of records `POINT`, whose first n are in use.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cablecomp.mechanics.jit import constant, inner_kernel, kernel, leaf_kernel
from cablecomp.mechanics.piece import piece
from cablecomp.mechanics.tables import between, groove

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Points: TypeAlias = Any
"""An array of records `POINT`."""

LEAST_WRAP = 1e-3  # [rad] of cable that a drum has to keep
STRAIGHT = constant(2)  # points of a straight profile: its ends


class Meet(NamedTuple):
    """A step of a wrap, evaluated: what it would hold, and where the cone of its end meets the old profile."""

    total: float  # integral of e
    slope: float  # its derivative by the end value
    kept: int  # last point kept
    y: float  # the meeting point, as a `POINT`
    v: float
    stretch: float
    stretch_error: float
    tau: float


class Wound(NamedTuple):
    """The cable on one drum."""

    total: float  # integral of strain EA/T0 over the wrap
    by_v: float  # its derivative by the end value ln(T/T0)
    by_wrap: float  # by the wrap angle


@kernel
def copy_floats(source: Floats, i: int, target: Floats, j: int, n: int) -> None:
    """target[j : j + n] = source[i : i + n], forwards and in place."""
    for k in range(n):
        target[j + k] = source[i + k]


@leaf_kernel
def set_pending(step: Any, meet: Meet) -> None:
    """Write an evaluated step into a wrap's record `STEP`."""
    step.total, step.kept = meet.total, meet.kept
    step.y, step.v, step.tau = meet.y, meet.v, meet.tau
    step.stretch, step.stretch_error = meet.stretch, meet.stretch_error


@leaf_kernel
def wrap_eval(p: Points, laws: Floats, law: int, n: int, w: float, v: float, tau: float, mu: float) -> Meet:
    """What the wrap would hold at wrap angle w and end value v, without committing it.

    `w` is above 0; `tau` is exp(v). `g_` are groove coordinates (y itself for the plain law).
    """
    top = n - 1
    k = top
    y_old, v_old, tau_old = p[top].y, p[top].v, p[top].tau
    if w < y_old:
        k -= 1
        while p[k].y > w:  # ends at the termination, y = 0, at the latest
            k -= 1
        y1, v1 = p[k].y, p[k].v
        g1 = groove(laws, law, y1)
        share = (groove(laws, law, w) - g1) / (groove(laws, law, p[k + 1].y) - g1)
        y_old = w
        v_old = v1 + share * (p[k + 1].v - v1)
        tau_old = math.exp(v_old)
    g_end = groove(laws, law, w)
    if abs(v - v_old) <= mu * (g_end - groove(laws, law, y_old)):
        # cable wound on, or nothing at all happened: no slip
        stretch, error = _running(p, laws, law, k, n, y_old, v_old, tau_old)
        if w == y_old:
            return Meet(stretch, 0.0, k, y_old, v_old, stretch, error, tau_old)
        integral, slope = piece(laws, law, y_old, v_old, tau_old, w, v, tau)
        # its derivative by the new end alone: about half of the whole shift's, enough for Newton's method
        return Meet(stretch + integral, 0.5 * slope, k, y_old, v_old, stretch, error, tau_old)
    # the cone of the new end cuts into the profile: walk inward to where they meet
    s = 1.0 if v > v_old else -1.0
    steep = s * mu
    over_upper = v - steep * (g_end - groove(laws, law, y_old)) - v_old
    y_upper = y_old
    over = 0.0
    while k >= 0:
        over = v - steep * (g_end - groove(laws, law, p[k].y)) - p[k].v
        if over * s <= 0.0:
            break
        over_upper = over
        y_upper = p[k].y
        k -= 1
    if k < 0:  # the whole wrap slips, down to the termination
        y_meet = 0.0
    else:
        # both differences vanish together where the new end lies on the old profile to the last bit
        share = over / (over - over_upper) if over != over_upper else 1.0
        y_meet = between(laws, law, p[k].y, y_upper, share)
    v_meet = v - steep * (g_end - groove(laws, law, y_meet))
    tau_meet = math.exp(v_meet)
    stretch = error = 0.0
    if k >= 0:
        stretch, error = _running(p, laws, law, k, n, y_meet, v_meet, tau_meet)
    integral, slope = piece(laws, law, y_meet, v_meet, tau_meet, w, v, tau)
    return Meet(stretch + integral, slope, k, y_meet, v_meet, stretch, error, tau_meet)


@leaf_kernel
def _running(
    p: Points, laws: Floats, law: int, k: int, n: int, y: float, v: float, t: float
) -> tuple[float, float]:
    """`stretch` and `stretch_error` at a point (y, v) of the profile on the piece above point k."""
    if k == n - 1 or y == p[k].y:
        return p[k].stretch, p[k].stretch_error
    integral, _ = piece(laws, law, p[k].y, p[k].v, p[k].tau, y, v, t)
    error = p[k + 1].merged
    return p[k].stretch + integral, p[k].stretch_error + error * (integral + y - p[k].y)


@kernel
def wrap_commit(p: Points, laws: Floats, law: int, n: int, step: Any, tolerance: float) -> int:
    """Make an evaluated step, a record `STEP`, the state; returns the new number of points.

    `tolerance` bounds the error of v that merging of neighbours may leave in a piece; a merged piece's integral is that
    of the straight piece, so that the stretch stays a continuous function of the tension. The stack never
    outgrows its array.
    """
    total, k, w, v, tau = step.total, int(step.kept), step.w, step.end_v, step.end_tau
    below = p[k + 1].merged if 0 <= k < n - 1 else 0.0
    kept = k == n - 1  # nothing was cut off: cable was wound on, and may continue the piece below
    n = k + 1
    if n == 0 or step.y > p[n - 1].y:
        p[n].y, p[n].v, p[n].stretch = step.y, step.v, step.stretch
        p[n].merged, p[n].stretch_error, p[n].tau = below, step.stretch_error, step.tau
        n += 1
        kept = False
    last = n - 1
    if w > p[last].y:
        error = 0.0
        if kept and last >= 1:
            merged = p[last].merged + _merge_error(p, laws, law, n, w, v)
            if merged <= tolerance:
                error = merged
                last -= 1
                straight, _ = piece(laws, law, p[last].y, p[last].v, p[last].tau, w, v, tau)
                total = p[last].stretch + straight
        n = last + 2
        p[n - 1].y, p[n - 1].v, p[n - 1].merged = w, v, error
        p[n - 1].stretch, p[n - 1].tau = total, tau
        p[n - 1].stretch_error = p[last].stretch_error + error * (total - p[last].stretch + w - p[last].y)
    if n >= p.shape[0] - 3:
        n = compact(p, laws, law, n)
    return n


@inner_kernel
def _merge_error(p: Points, laws: Floats, law: int, n: int, w: float, v: float) -> float:
    """Distance in v of the last point from the straight piece that would replace it."""
    y0, y1 = p[n - 2].y, p[n - 1].y
    g0 = groove(laws, law, y0)
    share = (groove(laws, law, y1) - g0) / (groove(laws, law, w) - g0)
    return abs(p[n - 2].v + share * (v - p[n - 2].v) - p[n - 1].v)


@inner_kernel
def compact(p: Points, laws: Floats, law: int, n: int) -> int:
    """Halve the list by dropping the points that a straight piece replaces best; the error made is kept in
    `merged` and `stretch_error`.

    A chord of a mu-Lipschitz profile is mu-Lipschitz, so the friction bound survives.
    """
    # error made here, by the piece below each point, kept in the field tau (renewed at the end): the limit is on
    # this alone
    for k in range(n):
        p[k].tau = 0.0
    limit = 1e-12
    while n > p.shape[0] // 2:
        m = 1
        for k in range(1, n - 1):
            y0, v0 = p[m - 1].y, p[m - 1].v
            y1, v1 = p[k].y, p[k].v
            y2, v2 = p[k + 1].y, p[k + 1].v
            g0 = groove(laws, law, y0)
            off = abs(v0 + (groove(laws, law, y1) - g0) / (groove(laws, law, y2) - g0) * (v2 - v0) - v1)
            error = max(p[k].tau, p[k + 1].tau) + off
            if error <= limit:
                p[k + 1].tau = error
                p[k + 1].merged = max(p[k].merged, p[k + 1].merged) + off
            else:
                p[m].y, p[m].v, p[m].merged, p[m].tau = y1, v1, p[k].merged, p[k].tau
                m += 1
        p[m].y, p[m].v, p[m].merged, p[m].tau = (
            p[n - 1].y, p[n - 1].v, p[n - 1].merged, p[n - 1].tau
        )  # fmt: skip
        n = m + 1
        limit *= 4.0
    accumulate(p, laws, law, n)
    return n


@inner_kernel
def accumulate(p: Points, laws: Floats, law: int, n: int) -> None:
    """Recompute the running integrals `stretch` and `stretch_error`."""
    p[0].stretch = 0.0
    p[0].stretch_error = 0.0
    p[0].tau = math.exp(p[0].v)
    for k in range(1, n):
        dy = p[k].y - p[k - 1].y
        p[k].tau = math.exp(p[k].v)
        integral, _ = piece(laws, law, p[k - 1].y, p[k - 1].v, p[k - 1].tau, p[k].y, p[k].v, p[k].tau)
        p[k].stretch = p[k - 1].stretch + integral
        p[k].stretch_error = p[k - 1].stretch_error + p[k].merged * (integral + dy)


@kernel
def clear(p: Points) -> None:
    """Set every point to zero."""
    for k in range(p.shape[0]):
        p[k].y = p[k].v = p[k].stretch = 0.0
        p[k].merged = p[k].stretch_error = p[k].tau = 0.0


@kernel
def wrap_fill(p: Points, laws: Floats, law: int, w: float, v: float, slope: float) -> int:
    """Start the wrap straight: v at the departure point, falling inward by `slope` per sigma (0 = uniform)."""
    clear(p)
    p[0].v = v - slope * (groove(laws, law, w) - groove(laws, law, 0.0))
    p[1].y, p[1].v = w, v
    accumulate(p, laws, law, STRAIGHT)
    return STRAIGHT
