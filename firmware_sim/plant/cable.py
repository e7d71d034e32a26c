"""Compiled mechanics of one cable: stretch, contact, friction at material points, and one linear solve.

The cable is a row of material points with unstressed lengths between them. A point on a drum or guide
sticks to it while the net pull of its two elements stays within `2 tanh(mu dθ/2)` of their mean tension
(over a point of contact angle dθ that is the capstan ratio e^(mu dθ), exactly), and slides at that force
otherwise, plus `c v dθ` where viscous. Which points stick is found by an active-set iteration around a
tridiagonal solve.
"""

from __future__ import annotations

import math
from typing import Any

from firmware_sim.plant.jit import part
from firmware_sim.plant.records import (
    FREE,
    GROOVE_LOW,
    GROOVE_POINTS,
    GROOVE_STEP,
    GUIDE,
    IN,
    OUT,
    TENSILE_LOW,
    TENSILE_POINTS,
    TENSILE_STEP,
    Floats,
    Nodes,
)

STIFFEST = math.log(6.0)  # a stiffening cable gets no stiffer than six times EA


@part
def guess_tension(c: Any, nodes: Nodes, tensile: Floats) -> None:
    """Tension at the first guess of a step: a taut element counts as taut even if the guess presses it
    together."""
    y, l0, tension, slope = nodes.y, nodes.l0, nodes.tension, nodes.slope
    if c.stiffening != 0.0 or c.tabled != 0:
        refresh_tension(c, nodes, tensile)
        return
    for e in range(c.first, c.first + c.count - 1):
        strain = (y[e + 1] - y[e]) / l0[e] - 1.0 - c.eigenstrain
        rate = c.EA if strain > 0.0 or slope[e] * l0[e] > 0.5 * c.EA else c.EA * c.slack_ratio
        tension[e] = rate * strain
        slope[e] = rate / l0[e]


@part
def refresh_tension(c: Any, nodes: Nodes, tensile: Floats) -> None:
    """Tension and tangent stiffness of every element: T = EA ε, or with stiffening b: dT/dε = EA (1 + b
    (T/T0 − 1)), or by a table.

    A slack element keeps the fraction `slack_ratio` of EA, so that positions stay determined.
    """
    if c.tabled != 0:
        look_up_tension(c, nodes, tensile)
        return
    y, l0, tension, slope = nodes.y, nodes.l0, nodes.tension, nodes.slope
    EA, b, T0 = c.EA, c.stiffening, c.T0
    weak = EA * c.slack_ratio
    if b == 0.0:
        for e in range(c.first, c.first + c.count - 1):
            strain = (y[e + 1] - y[e]) / l0[e] - 1.0 - c.eigenstrain
            rate = EA if strain > 0.0 else weak
            tension[e] = rate * strain
            slope[e] = rate / l0[e]
        return
    reach = -60.0 if b >= 1.0 else (math.log1p(-b) / b)
    zero = T0 / EA * (1.0 + reach)  # strain at which the stiffening cable goes slack
    for e in range(c.first, c.first + c.count - 1):
        strain = (y[e + 1] - y[e]) / l0[e] - 1.0 - c.eigenstrain
        if strain > zero:
            growth = b * (EA / T0 * strain - 1.0)
            beyond = max(growth - STIFFEST, 0.0)  # straight from there on
            growth -= beyond
            rate = math.exp(growth)
            tension[e] = T0 * (1.0 + math.expm1(growth) / b + rate * beyond / b)
            slope[e] = EA * rate / l0[e]
        else:
            tension[e] = weak * (strain - zero)
            slope[e] = weak / l0[e]


@part
def look_up_tension(c: Any, nodes: Nodes, tensile: Floats) -> None:
    """Tension and stiffness of every element out of a table over the strain: cubic between its points, straight
    beyond its end."""
    y, l0, tension, slope = nodes.y, nodes.l0, nodes.tension, nodes.slope
    stretch = c.EA / c.T0
    for e in range(c.first, c.first + c.count - 1):
        strain = (y[e + 1] - y[e]) / l0[e] - 1.0 - c.eigenstrain
        place = (stretch * strain - TENSILE_LOW) / TENSILE_STEP
        k = min(max(int(place), 0), TENSILE_POINTS - 2)
        x = place - k
        if x > 1.0 or x < 0.0:
            end = k + 1 if x > 1.0 else k
            value = tensile[0, end] + (x - (end - k)) * TENSILE_STEP * tensile[1, end]
            rate = tensile[1, end]
        else:
            d0, d1 = tensile[1, k] * TENSILE_STEP, tensile[1, k + 1] * TENSILE_STEP
            rise = tensile[0, k + 1] - tensile[0, k]
            b, a = 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise
            value = tensile[0, k] + x * (d0 + x * (b + x * a))
            rate = (d0 + x * (2.0 * b + 3.0 * a * x)) / TENSILE_STEP
        rate = max(rate, c.slack_ratio)
        tension[e] = c.T0 * value
        slope[e] = c.EA * rate / l0[e]


@part
def _grip(x: float) -> float:
    """2 tanh(x/2), to 1e-7 for x below 0.5."""
    if x > 0.5:
        return 2.0 * math.tanh(0.5 * x)
    s = x * x
    return x * (1.0 - s / 12.0 + s * s / 120.0)


@part
def pressure_factor(c: Any, tau: float) -> float:
    """mu/mu0 at T/T0: τ^−n, or floor + (1 − floor) τ^−n, or e^(−n (τ − 1)), or a fall from 1 to the floor around
    τ = 1 + n."""
    n, floor = c.pressure_exponent, c.pressure_floor
    if c.pressure_kind == 1:
        mixed: float = floor + (1.0 - floor) * tau**-n
        return mixed
    if c.pressure_kind == 2:
        return math.exp(-n * (tau - 1.0))
    if c.pressure_kind == 3:
        worn: float = floor + (1.0 - floor) * 0.5 * (1.0 - math.tanh((tau - 1.0 - n) / 0.15))
        return worn
    plain: float = tau**-n
    return plain


@part
def pressure_slope(c: Any, tau: float) -> float:
    """d ln(mu)/d ln(T) of `pressure_factor`."""
    n, floor = c.pressure_exponent, c.pressure_floor
    if c.pressure_kind == 1:
        part = (1.0 - floor) * tau**-n
        mixed: float = -n * part / (floor + part)
        return mixed
    if c.pressure_kind == 2:
        falling: float = -n * tau
        return falling
    if c.pressure_kind == 3:
        t = math.tanh((tau - 1.0 - n) / 0.15)
        worn: float = -tau * (1.0 - floor) * 0.5 * (1.0 - t * t) / 0.15 / pressure_factor(c, tau)
        return worn
    plain: float = -n
    return plain


@part
def groove_factor(table: Floats, angle: float) -> float:
    """Factor of mu at a place of the groove, by the angle at which the cable departs there."""
    place = min(max((angle - GROOVE_LOW) / GROOVE_STEP, 0.0), GROOVE_POINTS - 1.001)
    k = int(place)
    factor: float = table[k] + (place - k) * (table[k + 1] - table[k])
    return factor


@part
def guide_contact(c: Any, left: float, right: float) -> float:
    """Length of a node's share of the cable that lies on a guide, m.

    The guides are of one length each; `guide_first` of the free length lies before the first of them, equal shares
    of the rest after each.
    """
    n = c.guide_count
    arc = c.guide_arc_m / n
    pitch = arc + (1.0 - c.guide_first) * c.free_m / n
    start = c.A + c.guide_first * c.free_m
    k = min(max(int((right - start) / pitch), 0), n - 1)
    low = start + k * pitch
    touched: float = max(min(right, low + arc) - max(left, low), 0.0)
    if touched == 0.0 and k > 0:  # its right end has only just come past the next guide's beginning
        touched = max(min(right, low - pitch + arc) - max(left, low - pitch), 0.0)
    return touched


@part
def find_contacts(c: Any, nodes: Nodes, grooves: Floats, h: float) -> None:
    """Lay each node's share of the cable on what it touches; sets `where`, `grip`, `burr` and `drag`."""
    y, where, grip, drag, tension = nodes.y, nodes.where, nodes.grip, nodes.drag, nodes.tension
    first, last = c.first, c.first + c.count - 1
    A, B = c.A, c.A + c.free_m + c.guide_arc_m - c.ext  # departure points
    guided, grooved = c.guide_mu_per_m > 0.0, c.grooved != 0
    mu_out, mu_in = c.mu_out * c.mu_scale / c.R, c.mu_in * c.mu_scale / c.r
    groove = c.groove_amplitude != 0.0
    pressed = c.pressure_exponent != 0.0
    c.i_out, c.i_in = first, last
    right = 0.5 * (y[first] + y[first + 1])
    for i in range(first + 1, last):
        left = right
        right = 0.5 * (y[i] + y[i + 1])
        x = 0.0
        drag[i] = 0.0
        if left < A:
            where[i] = OUT
            c.i_out = i
            arc = min(right, A) - left
            x = mu_out * arc
            if groove:
                joint = c.sign * (y[i] / c.R - c.wrap_out)  # joint angle at which this groove point departs
                x *= max(0.0, 1.0 + c.groove_amplitude * math.cos(joint - c.groove_phase))
            if grooved:
                factor = groove_factor(grooves[2 * c.index], c.sign * (y[i] / c.R - c.wrap_out))
                x *= factor
                nodes.burr[i] = c.grain * (1.0 - 1.0 / factor)
            drag[i] = c.viscous_out * arc / h
        elif right > B:
            where[i] = IN
            if c.i_in == last:
                c.i_in = i
            arc = right - max(left, B)
            x = mu_in * arc
            drag[i] = c.viscous_in * arc / h
            if grooved:
                turned = c.sign * (c.wrap_in - (c.Y - y[i]) / c.r)
                factor = groove_factor(grooves[2 * c.index + 1], turned)
                x *= factor
                nodes.burr[i] = -c.grain * (1.0 - 1.0 / factor)
        else:
            where[i] = FREE
            if guided:
                arc = guide_contact(c, left, right)
                if arc > 0.0:
                    where[i] = GUIDE
                    x = c.guide_mu_per_m * c.guide_scale * arc
                    drag[i] = c.viscous_guide * arc / h
                    nodes.burr[i] = 0.0
        if pressed and x > 0.0:
            mean = max(0.5 * (tension[i - 1] + tension[i]) / c.T0, 1e-3)
            x *= pressure_factor(c, mean)
        grip[i] = _grip(x)


@part
def viscous_force(c: Any, drag: float, slip: float, h: float) -> tuple[float, float]:
    """Force of a viscous film on a sliding node and its derivative by the slip of this step: drag · slip, or with
    the power p of the slip speed v: drag · slip (v/v0)^(p − 1)."""
    if c.drag_exponent == 1.0:
        return drag * slip, drag
    p, x = c.drag_exponent, slip / (h * c.drag_speed)
    size = x * x + 4e-4  # a film is no singularity at rest
    force: float = drag * slip * size ** (0.5 * (p - 1.0))
    return force, drag * size ** (0.5 * (p - 3.0)) * (p * x * x + 4e-4)


@part
def solve_cable(c: Any, nodes: Nodes, h: float) -> float:
    """Linear solve under the present sticking set; returns the largest unbalanced force over T0, or 0 where friction
    is linear, so that one solve balances it.

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
        force = grip * mean if mean > 0.0 else 0.0
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
    return worst / c.T0 if special else 0.0


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
        bound += tolerance
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


@part
def play_at(p: Any, T: float, h: float) -> float:
    """Where a play stands at the end of a step that ends at tension T, N: within its radius, r + share · T, of T,
    or on its way there in its time."""
    low, high = T - p.radius - p.share * T, T + p.radius + p.share * T
    value: float = min(max(p.value, low), high)
    if p.time_s > 0.0:
        value = p.value + (value - p.value) * h / (h + p.time_s)
    return value


@part
def lumped_extension(c: Any, plays: Any, T: float, h: float) -> float:
    """Extra length of the free span at tension T: strand friction as plays in the tension, and what was let go.

    e = Σ compliance · (play(T) − zero) + released.
    """
    extension: float = c.released_m
    for k in range(c.plays):
        p = plays[c.index, k]
        extension += p.compliance * (play_at(p, T, h) - p.zero)
    return extension


@part
def lumped_slope(c: Any, plays: Any, T: float, h: float) -> float:
    """Derivative of `lumped_extension` by T, m/N."""
    slope = 0.0
    for k in range(c.plays):
        p = plays[c.index, k]
        part = 0.0
        if p.value < T - p.radius - p.share * T:
            part = 1.0 - p.share
        elif p.value > T + p.radius + p.share * T:
            part = 1.0 + p.share
        slope += p.compliance * part * h / (h + p.time_s)
    return slope


@part
def settle_cable(c: Any, plays: Any, h: float) -> None:
    """End of a step: plays stay where they came to, and a clamp under too much tension has crept."""
    for k in range(c.plays):
        p = plays[c.index, k]
        p.value = play_at(p, c.T_out, h)
    if c.overload_rate > 0.0:
        c.crept_m += h * c.overload_rate * max(c.T_out - c.overload_N, 0.0)
