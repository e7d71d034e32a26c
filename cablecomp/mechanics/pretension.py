"""Pretension that changes with time or temperature: what that does to the cable already on the drums.

Where cable sticks, a uniform strain (creep, thermal expansion) adds the same tension dT = T0 (f_new - f_old)
everywhere: slopes dT/dy stay, and with them the moment. In units of the new T0 a point goes from tau to 1 +
(tau - 1)/ratio, ratio = f_new/f_old. When tensions fall, friction mu T no longer holds the steepest slopes: those
zones slide until their slopes are mu again. A zone that slides inside keeps its stretch, so it turns about
its middle and grows into both neighbours; one at the free end is set right by the next solution, which pulls
on in the direction of sliding.
"""

from __future__ import annotations

import math

from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inlined_kernel, inner_kernel
from cablecomp.mechanics.profile import Floats, Points, accumulate
from cablecomp.mechanics.records import WET_NODES
from cablecomp.mechanics.tables import ELSEWHERE, between, groove, tau_of_v, v_of_tau

LEAST_TAU = 1e-6
FOLLOWED = (
    1e-4  # share of the pretension up to which a change waits: far below what any tolerance knows of it
)
LONGEST = 0.06  # rise of a straight piece that still stays straight enough when a tension is added
TOUCH = 1e-12


@inner_kernel
def retension(d: Drive, laws: Floats, c: int, factor: float) -> None:
    """Bring cable c's profiles to pretension T0 * factor."""
    cable, state = d.cables[c], d.states[c]
    ratio = factor / state.pretension
    if abs(ratio - 1.0) < FOLLOWED:
        return
    state.pretension = factor
    if d.size.grids > 0:
        for end in range(2):
            grid = d.grids[2 * c + end]
            grid.end = _moved(grid.end, ratio)
            for k in range(WET_NODES):
                grid.tau[k] = _moved(grid.tau[k], ratio)
                grid.tau_try[k] = _moved(grid.tau_try[k], ratio)
    for end in range(2):
        _shift(d, laws, cable.law[end], 2 * c + end, cable.mu[end], ratio)
    if d.size.stacks > 2 * d.size.cables:
        arc = 2 * d.size.cables + c
        _shift(d, laws, ELSEWHERE, arc, 1.0, ratio)
        state.guide_end = state.guide_try = d.profiles[arc, 0].v
        state.guide_follow = 0.0


@inner_kernel
def _moved(tau: float, ratio: float) -> float:
    return max(1.0 + (tau - 1.0) / ratio, LEAST_TAU)


@inner_kernel
def _shift(d: Drive, laws: Floats, law: int, stack: int, mu: float, ratio: float) -> None:
    p = d.profiles[stack]
    n = _split(p, laws, law, d.heights[stack])
    d.heights[stack] = n
    for k in range(n):
        p[k].v = v_of_tau(laws, law, _moved(tau_of_v(laws, law, p[k].v), ratio))
    _let_slip(p, laws, law, n, mu)
    accumulate(p, laws, law, n)


@inlined_kernel
def _split(p: Points, laws: Floats, law: int, n: int) -> int:
    """Divide long pieces, which would not stay straight; returns the new number of points."""
    k = n - 1
    while k > 0:
        rise = p[k].v - p[k - 1].v
        parts = int(abs(rise) / LONGEST) + 1
        if parts > 1 and n + parts < p.shape[0] - 4:
            y1, v1, y2, error = p[k - 1].y, p[k - 1].v, p[k].y, p[k].merged
            for j in range(n - 1, k - 1, -1):
                to = j + parts - 1
                p[to].y, p[to].v, p[to].merged = p[j].y, p[j].v, p[j].merged
            for j in range(1, parts):
                share = j / parts
                p[k - 1 + j].y = between(laws, law, y1, y2, share)
                p[k - 1 + j].v = v1 + share * rise
                p[k - 1 + j].merged = error
            n += parts - 1
        k -= 1
    return n


@inlined_kernel
def _let_slip(p: Points, laws: Floats, law: int, n: int, mu: float) -> None:
    """Let every zone slide that is steeper than friction holds."""
    k = 0
    while k < n - 1:
        k += 1
        rise = p[k].v - p[k - 1].v
        hold = mu * (groove(laws, law, p[k].y) - groove(laws, law, p[k - 1].y))
        if abs(rise) - hold > TOUCH:
            k = _slide(p, laws, law, k, n, mu if rise > 0.0 else -mu)


@inlined_kernel
def _slide(p: Points, laws: Floats, law: int, k: int, n: int, steep: float) -> int:
    """Give the zone around piece k the slope `steep`, as wide as its stretch asks for; returns its outer
    point.
    """
    a, b = k - 1, k
    g_in = g_out = level = 0.0
    while True:
        while b < n - 1 and _over(p, laws, law, b + 1, steep) > -TOUCH:
            b += 1
        while a > 0 and _over(p, laws, law, a, steep) > -TOUCH:
            a -= 1
        level = _level(p, laws, law, a, b, steep)
        if a > 0:
            g_in = _crossing(p, laws, law, a - 1, a, level, steep)
            if g_in <= groove(laws, law, p[a - 1].y):
                a -= 1
                continue
        if b < n - 1:
            g_out = _crossing(p, laws, law, b, b + 1, level, steep)
            if g_out >= groove(laws, law, p[b + 1].y):
                b += 1
                continue
        break
    y_a, y_b = p[a].y, p[b].y
    if a > 0:
        y_a = _place(laws, law, min(g_in, groove(laws, law, y_a)), p[a - 1].y, y_a)
    if b < n - 1:
        y_b = _place(laws, law, max(g_out, groove(laws, law, y_b)), y_b, p[b + 1].y)
    p[a].y, p[b].y = y_a, y_b
    for j in range(a, b + 1):
        p[j].v = level + steep * groove(laws, law, p[j].y)
    return b


@inner_kernel
def _over(p: Points, laws: Floats, law: int, k: int, steep: float) -> float:
    """By how much piece k is steeper than `steep`, in its direction."""
    rise = p[k].v - p[k - 1].v
    held = steep * (groove(laws, law, p[k].y) - groove(laws, law, p[k - 1].y))
    return rise - held if steep > 0.0 else held - rise


@inner_kernel
def _level(p: Points, laws: Floats, law: int, a: int, b: int, steep: float) -> float:
    """Height at groove coordinate 0 of the line of slope `steep` that keeps the stretch of points a..b."""
    total = weights = 0.0
    for j in range(a, b + 1):
        weight = math.exp(p[j].v) * (p[min(j + 1, b)].y - p[max(j - 1, a)].y)
        total += weight * (p[j].v - steep * groove(laws, law, p[j].y))
        weights += weight
    if weights <= 0.0:
        return p[a].v - steep * groove(laws, law, p[a].y)
    return total / weights


@inner_kernel
def _crossing(p: Points, laws: Floats, law: int, j: int, k: int, level: float, steep: float) -> float:
    """Groove coordinate at which the zone's line meets the piece from j to k."""
    g1, g2 = groove(laws, law, p[j].y), groove(laws, law, p[k].y)
    if g2 - g1 < 1e-13:
        return 0.5 * (g1 + g2)
    slope = (p[k].v - p[j].v) / (g2 - g1)
    return (level - p[j].v + slope * g1) / (slope - steep)


@inner_kernel
def _place(laws: Floats, law: int, g: float, y_low: float, y_high: float) -> float:
    low, high = groove(laws, law, y_low), groove(laws, law, y_high)
    if high <= low:
        return y_low
    return between(laws, law, y_low, y_high, (g - low) / (high - low))
