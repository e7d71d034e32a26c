"""Pretension that changes with time or temperature: what that does to the cable already on the drums.

Where cable sticks, a uniform strain (creep, thermal expansion) adds the same tension dT = T0 (f_new - f_old)
everywhere: slopes dT/dy stay, and with them the moment. In units of the new T0 a point goes from tau to 1 +
(tau - 1)/g, g = f_new/f_old. When tensions fall, friction mu T no longer holds the steepest slopes: those
zones slide until their slopes are mu again. A zone that slides inside keeps its stretch, so it turns about
its middle and grows into both neighbours; one at the free end is set right by the next solution, which pulls
on in the direction of sliding.
"""

from __future__ import annotations

import math

from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inner_kernel, kernel
from cablecomp.mechanics.profile import D, Floats, Ints, V, Y, accumulate
from cablecomp.mechanics.records import IN, WET_NODES
from cablecomp.mechanics.tables import between, groove, tau_of_v, v_of_tau

LEAST_TAU = 1e-6
FOLLOWED = (
    1e-4  # share of the pretension up to which a change waits: far below what any tolerance knows of it
)
LONGEST = 0.06  # rise of a straight piece that still stays straight enough when a tension is added
TOUCH = 1e-12


@inner_kernel
def retension(d: Drive, L: Floats, c: int, factor: float) -> None:
    """Bring cable c's profiles to pretension T0 * factor."""
    cable, state, G = d.cables[c], d.states[c], d.profiles
    g = factor / state.pretension
    if abs(g - 1.0) < FOLLOWED:
        return
    state.pretension = factor
    if d.size.grids > 0:
        for end in range(2):
            grid = d.grids[2 * c + end]
            grid.end = _moved(grid.end, g)
            for k in range(WET_NODES):
                grid.tau[k] = _moved(grid.tau[k], g)
                grid.tau_try[k] = _moved(grid.tau_try[k], g)
    for end in range(2):
        _shift(G, d.heights, L, cable.law[end], 2 * c + end, cable.mu[end], g)
    if d.size.stacks > 2 * d.size.cables:
        arc = 2 * d.size.cables + c
        _shift(G, d.heights, L, cable.law[IN], arc, 1.0, g)  # the law of what is no output drum
        state.guide_end = G[arc, V, 0]


@kernel
def _moved(tau: float, g: float) -> float:
    return max(1.0 + (tau - 1.0) / g, LEAST_TAU)


@kernel
def _shift(G: Floats, J: Ints, L: Floats, law: int, stack: int, mu: float, g: float) -> None:
    n = _split(G, L, law, stack, J[stack])
    J[stack] = n
    for k in range(n):
        G[stack, V, k] = v_of_tau(L, law, _moved(tau_of_v(L, law, G[stack, V, k]), g))
    _let_slip(G, L, law, stack, n, mu)
    accumulate(G, L, law, stack, n)


@kernel
def _split(G: Floats, L: Floats, law: int, i: int, n: int) -> int:
    """Divide long pieces, which would not stay straight; returns the new number of points."""
    k = n - 1
    while k > 0:
        rise = G[i, V, k] - G[i, V, k - 1]
        parts = int(abs(rise) / LONGEST) + 1
        if parts > 1 and n + parts < G.shape[2] - 4:
            y1, v1, y2, error = G[i, Y, k - 1], G[i, V, k - 1], G[i, Y, k], G[i, D, k]
            for j in range(n - 1, k - 1, -1):
                to = j + parts - 1
                G[i, Y, to], G[i, V, to], G[i, D, to] = G[i, Y, j], G[i, V, j], G[i, D, j]
            for j in range(1, parts):
                share = j / parts
                G[i, Y, k - 1 + j] = between(L, law, y1, y2, share)
                G[i, V, k - 1 + j] = v1 + share * rise
                G[i, D, k - 1 + j] = error
            n += parts - 1
        k -= 1
    return n


@kernel
def _let_slip(G: Floats, L: Floats, law: int, i: int, n: int, mu: float) -> None:
    """Let every zone slide that is steeper than friction holds."""
    k = 0
    while k < n - 1:
        k += 1
        rise = G[i, V, k] - G[i, V, k - 1]
        hold = mu * (groove(L, law, G[i, Y, k]) - groove(L, law, G[i, Y, k - 1]))
        if abs(rise) - hold > TOUCH:
            k = _slide(G, L, law, i, k, n, mu if rise > 0.0 else -mu)


@kernel
def _slide(G: Floats, L: Floats, law: int, i: int, k: int, n: int, steep: float) -> int:
    """Give the zone around piece k the slope `steep`, as wide as its stretch asks for; returns its outer
    point.
    """
    a, b = k - 1, k
    g_in = g_out = level = 0.0
    while True:
        while b < n - 1 and _over(G, L, law, i, b + 1, steep) > -TOUCH:
            b += 1
        while a > 0 and _over(G, L, law, i, a, steep) > -TOUCH:
            a -= 1
        level = _level(G, L, law, i, a, b, steep)
        if a > 0:
            g_in = _crossing(G, L, law, i, a - 1, a, level, steep)
            if g_in <= groove(L, law, G[i, Y, a - 1]):
                a -= 1
                continue
        if b < n - 1:
            g_out = _crossing(G, L, law, i, b, b + 1, level, steep)
            if g_out >= groove(L, law, G[i, Y, b + 1]):
                b += 1
                continue
        break
    y_a, y_b = G[i, Y, a], G[i, Y, b]
    if a > 0:
        y_a = _place(L, law, min(g_in, groove(L, law, y_a)), G[i, Y, a - 1], y_a)
    if b < n - 1:
        y_b = _place(L, law, max(g_out, groove(L, law, y_b)), y_b, G[i, Y, b + 1])
    G[i, Y, a], G[i, Y, b] = y_a, y_b
    for j in range(a, b + 1):
        G[i, V, j] = level + steep * groove(L, law, G[i, Y, j])
    return b


@kernel
def _over(G: Floats, L: Floats, law: int, i: int, k: int, steep: float) -> float:
    """By how much piece k is steeper than `steep`, in its direction."""
    rise = G[i, V, k] - G[i, V, k - 1]
    held = steep * (groove(L, law, G[i, Y, k]) - groove(L, law, G[i, Y, k - 1]))
    return rise - held if steep > 0.0 else held - rise


@kernel
def _level(G: Floats, L: Floats, law: int, i: int, a: int, b: int, steep: float) -> float:
    """Height at groove coordinate 0 of the line of slope `steep` that keeps the stretch of points a..b."""
    total = weights = 0.0
    for j in range(a, b + 1):
        weight = math.exp(G[i, V, j]) * (G[i, Y, min(j + 1, b)] - G[i, Y, max(j - 1, a)])
        total += weight * (G[i, V, j] - steep * groove(L, law, G[i, Y, j]))
        weights += weight
    if weights <= 0.0:
        return G[i, V, a] - steep * groove(L, law, G[i, Y, a])
    return total / weights


@kernel
def _crossing(G: Floats, L: Floats, law: int, i: int, j: int, k: int, level: float, steep: float) -> float:
    """Groove coordinate at which the zone's line meets the piece from j to k."""
    g1, g2 = groove(L, law, G[i, Y, j]), groove(L, law, G[i, Y, k])
    if g2 - g1 < 1e-13:
        return 0.5 * (g1 + g2)
    slope = (G[i, V, k] - G[i, V, j]) / (g2 - g1)
    return (level - G[i, V, j] + slope * g1) / (slope - steep)


@kernel
def _place(L: Floats, law: int, g: float, y_low: float, y_high: float) -> float:
    low, high = groove(L, law, y_low), groove(L, law, y_high)
    if high <= low:
        return y_low
    return between(L, law, y_low, y_high, (g - low) / (high - low))
