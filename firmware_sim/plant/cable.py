"""Compiled mechanics of one cable: which of its material points stick, and one linear solve.

The cable is a row of material points with unstressed lengths between them; `tension.py` says what its elements pull,
`contact.py` at what force its points slide. Which points stick is found by an active-set iteration around a
tridiagonal solve.
"""

from __future__ import annotations

import math
from typing import Any

from firmware_sim.plant.contact import pressure_slope, viscous_force
from firmware_sim.plant.jit import part
from firmware_sim.plant.records import FREE, GUIDE, IN, OUT, Nodes


@part
def solve_cable(c: Any, nodes: Nodes, h: float) -> float:
    """Linear solve under the present sticking set; returns the largest unbalanced force over T0, or 0 where friction
    and cable are linear, so that one solve balances it.

    Unknown is the change of every y: alpha (by itself) + beta dY (path length) + gamma dA (arc on the
    output drum). A sticking node keeps its place on what it touches: 0 on the output drum, dY on the input
    drum, dA on a guide.
    """
    y, old, tension, slope = nodes.y, nodes.old, nodes.tension, nodes.slope
    al, be, ga, up = nodes.alpha, nodes.beta, nodes.gamma, nodes.upper
    first, last = c.first, c.first + c.count - 1
    shift_Y, shift_A = c.Y - c.Y_old, c.A - c.A_old
    special = c.grain != 0.0 or c.strengthening > 0.0 or c.pressure_exponent != 0.0 or c.drag_exponent != 1.0
    al[first], be[first], ga[first], up[first] = 0.0, 0.0, 0.0, 0.0
    worst = 0.0
    for i in range(first + 1, last):
        where, mode = nodes.where[i], nodes.mode[i]
        on_in = 1.0 if where == IN else 0.0
        on_guide = 1.0 if where == GUIDE else 0.0
        if where != FREE and mode == 0:
            moved = y[i] - old[i] - on_in * shift_Y - on_guide * shift_A
            al[i], be[i], ga[i], up[i] = -moved, on_in, on_guide, 0.0
            continue
        grip = mode * nodes.grip[i] if where != FREE else 0.0
        low, high = tension[i - 1], tension[i]
        mean = 0.5 * (low + high)
        slip = y[i] - old[i] - on_in * shift_Y - on_guide * shift_A
        drag = nodes.drag[i]
        viscous, steep = drag * slip, 1.0
        if special:
            if drag > 0.0:
                viscous, drag = viscous_force(c, drag, slip, h)
            grip *= 1.0 + mode * nodes.burr[i]
            if c.strengthening > 0.0 and mean > 0.0 and where != GUIDE and grip != 0.0:
                width = h * c.drag_speed
                drag += abs(grip) * mean * c.strengthening / math.sqrt(slip * slip + width * width)
                grip *= 1.0 + c.strengthening * math.asinh(abs(slip) / width)
            if c.pressure_exponent != 0.0:
                steep += pressure_slope(c, max(mean / c.T0, 1e-3))
        force = (grip * mean if mean > 0.0 else 0.0) + mode * nodes.hold[i]
        half = 0.5 * grip * steep if mean > 0.0 else 0.0
        residual = high - low - force - viscous
        worst = max(worst, abs(residual))
        below = slope[i - 1] * (1.0 + half)
        above = slope[i] * (1.0 - half)
        pivot = -slope[i] * (1.0 - half) - slope[i - 1] * (1.0 + half) - drag
        scale = 1.0 / (pivot - below * up[i - 1])
        up[i] = above * scale
        al[i] = (-residual - below * al[i - 1]) * scale
        be[i] = (-drag * on_in - below * be[i - 1]) * scale
        ga[i] = (-drag * on_guide - below * ga[i - 1]) * scale
    al[last], be[last], ga[last] = 0.0, 1.0, 0.0
    for i in range(last - 1, first, -1):
        al[i] -= up[i] * al[i + 1]
        be[i] -= up[i] * be[i + 1]
        ga[i] -= up[i] * ga[i + 1]
    e, k = c.i_out, c.i_in - 1
    c.T_out, c.T_in = tension[e], tension[k]
    c.dT_out = slope[e] * (al[e + 1] - al[e])
    c.dT_out_dY = slope[e] * (be[e + 1] - be[e])
    c.dT_out_dA = slope[e] * (ga[e + 1] - ga[e])
    c.dT_in = slope[k] * (al[k + 1] - al[k])
    c.dT_in_dY = slope[k] * (be[k + 1] - be[k])
    c.dT_in_dA = slope[k] * (ga[k + 1] - ga[k])
    return worst / c.T0 if special or c.stiffening != 0.0 or c.tabled != 0 else 0.0


@part
def move_nodes(c: Any, nodes: Nodes, dY: float, dA: float, share: float) -> None:
    """Apply the solved change, or a share of it, for given changes of path length and of arc on the output
    drum."""
    y, al, be, ga = nodes.y, nodes.alpha, nodes.beta, nodes.gamma
    for i in range(c.first + 1, c.first + c.count):
        y[i] += share * al[i] + be[i] * dY + ga[i] * dA


@part
def carry_along(c: Any, nodes: Nodes, dY: float, dA: float) -> None:
    """First guess of a step: each node moves with what it touches, those between in proportion."""
    y = nodes.y
    span = max(c.Y - c.A, 1e-12)
    for i in range(c.first + 1, c.first + c.count):
        if nodes.where[i] == IN or i == c.first + c.count - 1:
            y[i] += dY
        elif nodes.where[i] != OUT:
            share = min(max((y[i] - c.A) / span, 0.0), 1.0)
            y[i] += share * dY


@part
def update_modes(c: Any, nodes: Nodes, tolerance: float, rush: bool) -> int:
    """Let overloaded nodes slide and nodes that slide backwards stick; returns how many changed.

    With `rush`, a node set free hands the tension it would leave behind on to its inner neighbour, so that
    a slip front passes many nodes in one iteration.
    """
    changed = 0
    shift_Y, shift_A = c.Y - c.Y_old, c.A - c.A_old
    first, last = c.first, c.first + c.count - 1
    changed += _sweep(nodes, c.i_out, first, -1, 0.0, tolerance, rush)
    changed += _sweep(nodes, c.i_in, last, 1, shift_Y, tolerance, rush)
    if c.guide_mu_per_m > 0.0:
        low = c.i_out + 1
        while low < c.i_in:
            if nodes.where[low] == GUIDE:
                high = low
                while high + 1 < c.i_in and nodes.where[high + 1] == GUIDE:
                    high += 1
                middle = (low + high) // 2
                changed += _sweep(nodes, low, middle + 1, 1, shift_A, tolerance, rush)
                changed += _sweep(nodes, high, middle, -1, shift_A, tolerance, rush)
                low = high
            low += 1
    return changed


@part
def _sweep(nodes: Nodes, start: int, end: int, step: int, shift: float, tolerance: float, rush: bool) -> int:
    """Modes from a free end inwards: a drum from its departure point, a guide from either end to its
    middle."""
    changed = 0
    carrying = False
    carried = 0.0
    i = start
    while i != end:
        low, high = nodes.tension[i - 1], nodes.tension[i]
        if carrying and step < 0:
            high = carried
        if carrying and step > 0:
            low = carried
        was = nodes.mode[i]
        count = _set_mode(nodes, i, low, high, shift, tolerance)
        changed += count
        now = nodes.mode[i]
        carrying = rush and count > 0 and was == 0
        if carrying:
            half = 0.5 * now * nodes.grip[i] * (1.0 + now * nodes.burr[i])
            carried = high * (1.0 - half) / (1.0 + half) if step < 0 else low * (1.0 + half) / (1.0 - half)
        i += step
    return changed


@part
def _set_mode(nodes: Nodes, i: int, low: float, high: float, shift: float, tolerance: float) -> int:
    mode = nodes.mode[i]
    if mode == 0:
        pull = high - low
        bound = nodes.grip[i] * max(0.5 * (low + high), 0.0)
        burr = bound * nodes.burr[i]
        bound += nodes.hold[i] + tolerance
        if pull > bound + burr:
            nodes.mode[i] = 1
            return 1
        if pull < burr - bound:
            nodes.mode[i] = -1
            return 1
        return 0
    if mode * (nodes.y[i] - nodes.old[i] - shift) < -1e-13:
        nodes.mode[i] = 0
        return 1
    return 0
