"""Viscous slip: where cable slides on a drum, friction takes mu T + c v per radian (v slip speed) instead of mu T.

The stretch then diffuses through the sliding zone: with displacement rate v(y), conservation gives
(R/EA) dT/dt = dv/dy and the slip law c v = shrink(dT/dy, mu T). Solved implicitly on a grid fixed to the drum
by Newton's method on a tridiagonal system; only the part that can move is solved. c = 0 is the plain law (other
code: `profile.py`).
"""

from __future__ import annotations

from typing import Any

from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inner_kernel, kernel
from cablecomp.mechanics.profile import Floats, copy_floats
from cablecomp.mechanics.records import WET_NODES

STIFFEST = 1e3  # diffusion number per step beyond which slip is as good as quasi-static


@inner_kernel
def viscous_fill(grid: Any, w: float, reach: float) -> None:
    """Start a wrap, a record `GRID`, at uniform tension T0 with wrap angle w; the grid covers `reach` [rad]."""
    grid.step = reach / (WET_NODES - 1)
    grid.count = _free_nodes(w, grid.step)
    grid.angle = w
    grid.end = 1.0
    grid.time_try = -1e300
    grid.tau[:] = 1.0
    grid.tau_try[:] = 1.0
    grid.upper[:] = 1.0
    grid.right[:] = 1.0


@kernel
def _free_nodes(w: float, h: float) -> int:
    """Number of grid nodes well inside the wrap; the departure point itself is one node more."""
    return min(max(int((w - 0.3 * h) / h) + 1, 1), WET_NODES)


@inner_kernel
def viscous_eval(d: Drive, c: int, end: int, w: float, tau: float, mu: float) -> tuple[float, float, float]:
    """Integral of tau - 1 over the wrap at end value tau, its derivatives by ln tau and by the wrap angle; kept
    as pending."""
    cable, state, context, grid = d.cables[c], d.states[c], d.context, d.grids[2 * c + end]
    old, new = grid.tau, grid.tau_try
    h = grid.step
    count = _free_nodes(w, h)
    before = int(grid.count)
    y_last = (before - 1) * h
    # a further evaluation within the same step starts from the last one's answer
    again = grid.time_try == context.time and int(grid.count_try) == count
    grid.time_try = context.time
    for j in range(count):  # cable that arrived since: linear in between
        if j >= before:
            y = j * h
            w_old, t_old = grid.angle, grid.end
            if y <= w_old:
                old[j] = old[before - 1] + (y - y_last) / (w_old - y_last) * (t_old - old[before - 1])
            else:
                old[j] = t_old + (y - w_old) / (w - w_old) * (tau - t_old)
        if not again:
            new[j] = old[j]
    dt = 1e9 if context.first else context.dt
    rate = dt * cable.EA * state.stiffness / (cable.radius[end] * cable.viscous)
    rate = min(rate, STIFFEST * h * h)
    slope = _relax(old, new, grid.upper, grid.right, count, h, w, tau, mu, rate)
    total = 0.0
    last = (count - 1) * h
    for j in range(count - 1):
        total += 0.5 * h * (new[j] + new[j + 1] - 2.0)
    total += 0.5 * (w - last) * (new[count - 1] + tau - 2.0)
    grid.count_try, grid.angle_try, grid.end_try = count, w, tau
    return total, slope * tau, tau - 1.0


@kernel
def _relax(
    old: Floats, new: Floats, upper: Floats, right: Floats, n: int, h: float, w: float, tau: float, mu: float, rate: float
) -> float:  # fmt: skip
    """Implicit step of nodes 0..n-1 by Newton's method; returns the derivative of the integral by the end value."""
    gap = w - (n - 1) * h
    first = n
    for _ in range(60):
        first = _front(old, new, n, h, gap, tau, mu)
        if first == n:
            return 0.5 * gap
        if _newton(old, new, upper, right, n, first, h, gap, tau, mu, rate, False) <= 1e-13:
            break
    # linear answer to a change of the end value
    _newton(old, new, upper, right, n, first, h, gap, tau, mu, rate, True)
    slope = 0.5 * gap * (1.0 + right[n - 1])
    for j in range(first, n - 1):
        slope += 0.5 * h * (right[j] + right[j + 1])
    if first > 0:
        slope += 0.5 * h * right[first]
    return slope


@kernel
def _front(old: Floats, new: Floats, n: int, h: float, gap: float, tau: float, mu: float) -> int:
    """The deepest node that moves, or n if none does; deep cable may still creep while the cable outside of it
    sticks."""
    for j in range(n):
        right = tau if j == n - 1 else new[j + 1]
        slip, _, _ = _face(new[j], right, gap if j == n - 1 else h, mu)
        if slip != 0.0 or new[j] != old[j]:
            return j
    return n


@kernel
def _face(a: float, b: float, d: float, mu: float) -> tuple[float, float, float]:
    """Slip drive shrink((b - a)/d, mu (a + b)/2) and its derivatives by a and b."""
    g = (b - a) / d
    limit = mu * 0.5 * (a + b)
    if g > limit:
        return g - limit, -1.0 / d - 0.5 * mu, 1.0 / d - 0.5 * mu
    if g < -limit:
        return g + limit, -1.0 / d + 0.5 * mu, 1.0 / d + 0.5 * mu
    return 0.0, 0.0, 0.0


@kernel
def _row(
    old: Floats, new: Floats, n: int, j: int, h: float, gap: float, tau: float, mu: float, rate: float
) -> tuple[float, float, float, float]:
    """Residual of node j and its derivatives by nodes j - 1, j, j + 1."""
    size = 0.5 * h if j == 0 else h
    if j == n - 1:
        size = (0.0 if j == 0 else 0.5 * h) + 0.5 * gap
    k = rate / size
    right = tau if j == n - 1 else new[j + 1]
    out, out_a, out_b = _face(new[j], right, gap if j == n - 1 else h, mu)
    inner = inner_a = inner_b = 0.0
    if j > 0:
        inner, inner_a, inner_b = _face(new[j - 1], new[j], h, mu)
    residual = new[j] - old[j] - k * (out - inner)
    return residual, k * inner_a, 1.0 - k * (out_a - inner_b), -k * out_b


@kernel
def _newton(
    old: Floats, new: Floats, upper: Floats, right: Floats, n: int, first: int, h: float, gap: float, tau: float,
    mu: float, rate: float, linear: bool,
) -> float:  # fmt: skip
    """One Newton step for nodes first..n-1 (Thomas algorithm), and its largest change.

    With `linear` nothing moves: `right` gets the nodes' derivatives by the end value instead.
    """
    for j in range(first, n):
        residual, below, own, above = _row(old, new, n, j, h, gap, tau, mu, rate)
        target = -residual
        if linear:
            target = -above if j == n - 1 else 0.0
        if j > first:
            own -= below * upper[j - 1]
            target -= below * right[j - 1]
        upper[j] = above / own
        right[j] = target / own
    largest = 0.0
    for j in range(n - 2, first - 1, -1):
        right[j] -= upper[j] * right[j + 1]
    if not linear:
        for j in range(first, n):
            largest = max(largest, abs(right[j]))
            new[j] = max(new[j] + right[j], 1e-9)
    return largest


@inner_kernel
def viscous_commit(grid: Any) -> None:
    """Make the pending profile of a wrap its state."""
    grid.count, grid.angle, grid.end = grid.count_try, grid.angle_try, grid.end_try
    copy_floats(grid.tau_try, 0, grid.tau, 0, int(grid.count))
