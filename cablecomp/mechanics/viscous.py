"""Viscous slip: where cable slides on a drum, friction takes mu T + c v per radian (v slip speed) instead of mu T.

The stretch then diffuses through the sliding zone: with displacement rate v(y), conservation gives
(R/EA) dT/dt = dv/dy and the slip law c v = shrink(dT/dy, mu T). Solved implicitly on a grid fixed to the drum
by Newton's method on a tridiagonal system; only the part that can move is solved. c = 0 is the plain law (other
code: `profile.py`). Friction by tension or place and a strain law: `viscous_laws.py`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inlined_kernel, inner_kernel
from cablecomp.mechanics.profile import Floats, Wound, copy_floats
from cablecomp.mechanics.records import WET_NODES

STIFFEST = 1e7  # diffusion number per step at which slip on a grid of WET_NODES is over within it
EVEN = 1e-13  # change of a node, over T0, up to which a step is balanced
FLICKER = 6  # steps of Newton's method after which less will do, as far as a stiff step's own digits go
VISCOUS_TRAVEL = 4.0  # rotation [rad] beyond the wrap that a grid covers when it is laid
LEAST_SHARE = 1e-9  # of the coefficient, on a drum that has none


@inner_kernel
def viscous_fill(grid: Any, w: float, reach: float) -> None:
    """Start a wrap, a record `GRID`, at uniform tension T0 with wrap angle w; the grid covers `reach` [rad]."""
    grid.step = reach / (WET_NODES - 1)
    grid.count = free_nodes(w, grid.step)
    grid.angle = w
    grid.end = 1.0
    grid.time_try = -1e300
    grid.tau[:] = 1.0
    grid.tau_try[:] = 1.0
    grid.upper[:] = 1.0
    grid.right[:] = 1.0


@inner_kernel
def free_nodes(w: float, h: float) -> int:
    """Number of grid nodes well inside the wrap; the departure point itself is one node more."""
    return min(max(int((w - 0.3 * h) / h) + 1, 1), WET_NODES)


class Slide(NamedTuple):
    """One implicit step of a wrap: its nodes, and what drives them."""

    old: Floats  # T/T0 at the nodes, before
    new: Floats  # and after
    upper: Floats  # elimination: upper diagonal,
    right: Floats  # right-hand side, then the solution
    nodes: int  # how many
    h: float  # rad between nodes
    gap: float  # rad from the last node to the departure point
    tau: float  # T/T0 there
    mu: float
    rate: float  # rad^2 that stretch diffuses in this step


@inlined_kernel
def diffusion(d: Drive, c: int, end: int) -> float:
    """What stretch diffuses by on a drum in this step [rad^2]: dt EA/(R c)."""
    cable, state, context = d.cables[c], d.states[c], d.context
    h = d.grids[2 * c + end].step
    dt = 1e9 if context.first else context.dt
    viscous = max(cable.viscous_on[end], LEAST_SHARE) * cable.viscous
    rate = dt * cable.EA * state.stiffness / (cable.radius[end] * viscous)
    return min(rate, STIFFEST * h * h)


@inlined_kernel
def arrive(grid: Any, count: int, w: float, tau: float) -> None:
    """Give the nodes whose cable has arrived since the last step its tension: linear in between."""
    old, h, before = grid.tau, grid.step, int(grid.count)
    y_last = (before - 1) * h
    for j in range(before, count):
        y = j * h
        w_old, t_old = grid.angle, grid.end
        if y <= w_old:
            old[j] = old[before - 1] + (y - y_last) / (w_old - y_last) * (t_old - old[before - 1])
        else:
            old[j] = t_old + (y - w_old) / (w - w_old) * (tau - t_old)


@inner_kernel
def viscous_eval(d: Drive, c: int, end: int, w: float, tau: float, mu: float) -> Wound:
    """The cable on a drum at wrap angle w and end tension T/T0 = tau; kept as pending."""
    context, grid = d.context, d.grids[2 * c + end]
    old, new = grid.tau, grid.tau_try
    h = grid.step
    count = free_nodes(w, h)
    before = int(grid.count)
    rate = diffusion(d, c, end)
    # a further evaluation within the same step starts from the last one's answer
    again = grid.time_try == context.time and int(grid.count_try) == count
    alike = again and abs(grid.rate_try) == rate and count - before <= 1
    sure = grid.rate_try > 0.0
    grid.time_try = context.time
    arrive(grid, count, w, tau)
    last = (count - 1) * h
    slide = Slide(old, new, grid.upper, grid.right, count, h, w - last, tau, mu, rate)
    moved, first = Moved(False, 0.0, 0.0), 0
    if alike:
        first = int(grid.first_try)
        moved = _follow(slide, first)
        grid.total_try += moved.change
    slope = moved.slope
    # what is not sure may have been the elimination of other faces: balance says
    solved = moved.done and (sure or _unbalanced(slide, max(first - 1, 0)) <= EVEN)
    if not solved:
        if not again:
            copy_floats(old, 0, new, 0, count)
        first, slope, sure = _relax(slide)
        grid.first_try = first
        grid.rate_try = rate if sure else -rate
        total = 0.0
        for j in range(count - 1):
            total += 0.5 * h * (new[j] + new[j + 1] - 2.0)
        grid.total_try = total
    grid.count_try, grid.angle_try, grid.end_try = count, w, tau
    total = grid.total_try + 0.5 * (w - last) * (new[count - 1] + tau - 2.0)
    return Wound(total, slope * tau, tau - 1.0)


class Moved(NamedTuple):
    """What a step of Newton's method did."""

    done: bool  # no face began or ceased to slip: the step is solved
    slope: float  # derivative of the integral by the end value
    change: float  # of the integral over the nodes


@inner_kernel
def _follow(s: Slide, first: int) -> Moved:
    """The solved step at another end value and wrap angle: but for the last node's equation all are as they were, so
    the elimination that `upper` keeps still holds, as long as no face begins or ceases to slip."""
    last = s.nodes - 1
    per_h, per_gap = 1.0 / s.h, 1.0 / s.gap
    if first > last:  # nothing moved
        at_end = _side(s.new[last], s.tau, per_gap, s.mu)
        return Moved(at_end == 0 and s.new[last] == s.old[last], 0.5 * s.gap, 0.0)
    share = share_of(s, last)
    outer = _face(s.new[last], s.tau, per_gap, s.mu)
    inner = Face(0.0, 0.0, 0.0)
    own = 1.0 - share * outer.by_a
    if last > 0:
        inner = _face(s.new[last - 1], s.new[last], per_h, s.mu)
        own += share * inner.by_b
    if last > first:
        own -= share * inner.by_a * s.upper[last - 1]
    s.right[last] = (share * (outer.slip - inner.slip) - (s.new[last] - s.old[last])) / own
    return _substitute(s, first, share * outer.by_b / own)


@inner_kernel
def _relax(s: Slide) -> tuple[int, float, bool]:
    """Implicit step of all nodes; returns the deepest that moved, the derivative of the integral by the end value, and
    whether the elimination that `upper` keeps is sure to be that of the faces which slip now.

    The equations are linear as long as no face begins or ceases to slip: Newton's method is there after one step once
    it knows which faces do. One that only rounding moves may change its side for ever, so it is balance that counts.
    """
    first, moved = s.nodes, Moved(False, 0.0, 0.0)
    even = EVEN * max(1.0, s.rate / (1e4 * s.h * s.h))  # rounding grows with what is weighed up
    for k in range(60):
        first = _front(s)
        if first == s.nodes:
            return first, 0.5 * s.gap, True
        moved = _newton(s, first)
        if moved.done or _unbalanced(s, max(first - 1, 0)) <= (EVEN if k < FLICKER else even):
            break
    return first, moved.slope, moved.done


@inner_kernel
def _front(s: Slide) -> int:
    """The deepest node that moves, or their number if none does; deep cable may still creep while the cable outside of
    it sticks.

    A face slips here as it does for `_side`, to the last bit: one that had just begun to there, and not yet here, went
    on slipping while the node inside of it stood still.
    """
    per_h = 1.0 / s.h
    for j in range(s.nodes - 1):
        if _side(s.new[j], s.new[j + 1], per_h, s.mu) != 0 or s.new[j] != s.old[j]:
            return j
    last = s.nodes - 1
    moves = _side(s.new[last], s.tau, 1.0 / s.gap, s.mu) != 0 or s.new[last] != s.old[last]
    return last if moves else s.nodes


class Face(NamedTuple):
    """What drives slip between two neighbouring nodes a (inward) and b."""

    slip: float  # shrink((b - a)/distance, mu (a + b)/2)
    by_a: float  # its derivatives
    by_b: float


@inner_kernel
def _face(a: float, b: float, per_distance: float, mu: float) -> Face:
    steep = (b - a) * per_distance
    limit = mu * 0.5 * (a + b)
    if steep > limit:
        return Face(steep - limit, -per_distance - 0.5 * mu, per_distance - 0.5 * mu)
    if steep < -limit:
        return Face(steep + limit, -per_distance + 0.5 * mu, per_distance + 0.5 * mu)
    return Face(0.0, 0.0, 0.0)


@inner_kernel
def _side(a: float, b: float, per_distance: float, mu: float) -> int:
    """Which way the cable slips between two neighbours, b outside of a: what `_face` takes it for, to the last bit."""
    steep = (b - a) * per_distance
    limit = mu * 0.5 * (a + b)
    return 1 if steep > limit else (-1 if steep < -limit else 0)


@inner_kernel
def _outward(s: Slide, j: int, per_h: float, per_gap: float) -> Face:
    """The face on the outer side of node j; beyond the last node lies the departure point."""
    if j == s.nodes - 1:
        return _face(s.new[j], s.tau, per_gap, s.mu)
    return _face(s.new[j], s.new[j + 1], per_h, s.mu)


@inner_kernel
def share_of(s: Slide, j: int) -> float:
    """What the slip's difference over node j changes there: diffusion in this step over the length it stands for."""
    if j < s.nodes - 1:
        return s.rate / (0.5 * s.h if j == 0 else s.h)
    return s.rate / ((0.0 if j == 0 else 0.5 * s.h) + 0.5 * s.gap)


@inner_kernel
def _newton(s: Slide, first: int) -> Moved:
    """One Newton step for the nodes from `first` on (Thomas algorithm); `upper` keeps the elimination."""
    per_h, per_gap = 1.0 / s.h, 1.0 / s.gap
    inside = s.rate * per_h
    inner = Face(0.0, 0.0, 0.0)
    if first > 0:
        inner = _face(s.new[first - 1], s.new[first], per_h, s.mu)
    for j in range(first, s.nodes):
        outer = _outward(s, j, per_h, per_gap)
        share = inside if 0 < j < s.nodes - 1 else share_of(s, j)
        own = 1.0 - share * (outer.by_a - inner.by_b)
        target = share * (outer.slip - inner.slip) - (s.new[j] - s.old[j])
        if j > first:
            below = share * inner.by_a
            own -= below * s.upper[j - 1]
            target -= below * s.right[j - 1]
        per_own = 1.0 / own
        s.upper[j] = -share * outer.by_b * per_own
        s.right[j] = target * per_own
        inner = outer
    return _substitute(s, first, -s.upper[s.nodes - 1])


@inner_kernel
def _substitute(s: Slide, first: int, by_end: float) -> Moved:
    """Move the nodes from `first` on by the elimination in `upper` and `right`, which is left at 0; `by_end`:
    derivative of the last node by the end value. That node alone feels the end, the others follow it."""
    per_h, last = 1.0 / s.h, s.nodes - 1
    per_gap = 1.0 / s.gap
    change = s.right[last]
    same = _side(s.new[last], s.tau, per_gap, s.mu) == _side(s.new[last] + change, s.tau, per_gap, s.mu)
    slope, whole = 0.5 * s.gap * (1.0 + by_end), 0.0
    for j in range(last, first - 1, -1):
        b = s.new[j]
        moved = max(b + change, 1e-9)
        inward = by_inward = 0.0
        if j > first:
            inward, by_inward = s.right[j - 1] - s.upper[j - 1] * change, -s.upper[j - 1] * by_end
        if j > 0:
            a = s.new[j - 1]
            same = same and _side(a, b, per_h, s.mu) == _side(a + inward, moved, per_h, s.mu)
            slope += 0.5 * s.h * (by_end + by_inward)
            whole += 0.5 * s.h * (change + inward)
        s.new[j], s.right[j] = moved, 0.0
        change, by_end = inward, by_inward
    return Moved(same, slope, whole)


@inner_kernel
def _unbalanced(s: Slide, first: int) -> float:
    """The largest residual of the conservation laws of the nodes from `first` on, as a change of the nodes."""
    per_h, per_gap = 1.0 / s.h, 1.0 / s.gap
    inside = s.rate * per_h
    inner = 0.0
    if first > 0:
        inner = _face(s.new[first - 1], s.new[first], per_h, s.mu).slip
    largest = 0.0
    for j in range(first, s.nodes):
        outer = _outward(s, j, per_h, per_gap).slip
        share = inside if 0 < j < s.nodes - 1 else share_of(s, j)
        own = 1.0 + share * (per_h + (per_gap if j == s.nodes - 1 else per_h))
        largest = max(largest, abs(s.new[j] - s.old[j] - share * (outer - inner)) / own)
        inner = outer
    return largest


@inner_kernel
def viscous_commit(grid: Any) -> None:
    """Make the pending profile of a wrap its state."""
    grid.count, grid.angle, grid.end = grid.count_try, grid.angle_try, grid.end_try
    copy_floats(grid.tau_try, 0, grid.tau, 0, int(grid.count))
    if grid.angle > WET_NODES * grid.step:
        _widen(grid)


@inner_kernel
def _widen(grid: Any) -> None:
    """Lay the grid anew over a wrap that has outgrown it: linear between the nodes that there were."""
    per_old, last = 1.0 / grid.step, int(grid.count) - 1
    y_last = last * grid.step
    grid.step = (grid.angle + VISCOUS_TRAVEL) / (WET_NODES - 1)
    grid.count = free_nodes(grid.angle, grid.step)
    grid.time_try = -1e300  # what is pending is of the old nodes
    for j in range(int(grid.count)):
        y = j * grid.step
        k = min(int(y * per_old), last)
        a = grid.tau[k]
        if k < last:
            grid.tau_try[j] = a + (y * per_old - k) * (grid.tau[k + 1] - a)
        else:
            grid.tau_try[j] = a + (y - y_last) / (grid.angle - y_last) * (grid.end - a)
    copy_floats(grid.tau_try, 0, grid.tau, 0, int(grid.count))
