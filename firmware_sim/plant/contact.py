"""Compiled laws of friction: what each material point lies on, and at what force it slides there.

A point on a drum or guide sticks to it while the net pull of its two elements stays within `2 tanh(mu dθ/2)` of
their mean tension (over a point of contact angle dθ that is the capstan ratio e^(mu dθ), exactly), plus what a guide
holds by itself, and slides at that force otherwise, plus `c v dθ` where viscous.
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
    Floats,
    Nodes,
)


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
    τ = 1 + n, or (1 + n)/(1 + n τ), or 1 + n (1/τ − 1) + floor (τ − 1)."""
    n, floor = c.pressure_exponent, c.pressure_floor
    if c.pressure_kind == 1:
        mixed: float = floor + (1.0 - floor) * tau**-n
        return mixed
    if c.pressure_kind == 2:
        return math.exp(-n * (tau - 1.0))
    if c.pressure_kind == 3:
        worn: float = floor + (1.0 - floor) * 0.5 * (1.0 - math.tanh((tau - 1.0 - n) / 0.15))
        return worn
    if c.pressure_kind == 4:
        flat: float = (1.0 + n) / (1.0 + n * tau)
        return flat
    if c.pressure_kind == 5:
        ploughed: float = 1.0 + n * (1.0 / tau - 1.0) + floor * (tau - 1.0)
        return ploughed
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
    if c.pressure_kind == 4:
        flat: float = -n * tau / (1.0 + n * tau)
        return flat
    if c.pressure_kind == 5:
        ploughed: float = (floor * tau - n / tau) / pressure_factor(c, tau)
        return ploughed
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
    """Lay each node's share of the cable on what it touches; sets `where`, `grip`, `burr`, `hold` and
    `drag`."""
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
        drag[i] = nodes.hold[i] = 0.0
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
                    nodes.hold[i] = c.guide_hold_N * arc / c.guide_arc_m
        if pressed and x > 0.0:
            mean = max(0.5 * (tension[i - 1] + tension[i]) / c.T0, 1e-3)
            x *= pressure_factor(c, mean)
        grip[i] = _grip(x)


@part
def viscous_force(c: Any, drag: float, slip: float, h: float) -> tuple[float, float]:
    """Force of a viscous film on a sliding node and its derivative by the slip of this step: drag · slip, or with
    the power p of the slip speed v: drag · slip (v/v0)^(p − 1); p = 0 stands for drag · h v0 arsinh(v/v0)."""
    if c.drag_exponent == 1.0:
        return drag * slip, drag
    p, x = c.drag_exponent, slip / (h * c.drag_speed)
    if p == 0.0:
        return drag * h * c.drag_speed * math.asinh(x), drag / math.sqrt(1.0 + x * x)
    size = x * x + 4e-4  # a film is no singularity at rest
    force: float = drag * slip * size ** (0.5 * (p - 1.0))
    return force, drag * size ** (0.5 * (p - 3.0)) * (p * x * x + 4e-4)
