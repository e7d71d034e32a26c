"""Compiled laws of the cable by itself: what its elements pull at their strain, and what gives lumped in its free
span."""

from __future__ import annotations

import math
from typing import Any

from firmware_sim.plant.jit import part
from firmware_sim.plant.records import TENSILE_LOW, TENSILE_POINTS, TENSILE_STEP, Floats, Nodes

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
def rounded_play(p: Any, T: float) -> float:
    """Where a play that yields little by little stands, N: Z behind T, dZ/dT = 1 − |Z|/r away from zero and 1 towards
    it."""
    along = 1.0 if p.tension <= T else -1.0
    held, way = along * (p.tension - p.value), along * (T - p.tension)
    value: float = p.value
    if held + way > 0.0:
        if held < 0.0:  # back at zero, and on
            held, way = 0.0, held + way
        value = T - along * (p.radius + (held - p.radius) * math.exp(-way / p.radius))
    return value


@part
def play_at(p: Any, T: float, h: float) -> float:
    """Where a play stands at the end of a step that ends at tension T, N: within its radius, r + share · T, of T,
    or on its way there in its time."""
    if p.rounded != 0:
        return rounded_play(p, T)
    low, high = T - p.radius - p.share * T, T + p.radius + p.share * T
    value: float = min(max(p.value, low), high)
    if p.time_s > 0.0:
        value = p.value + (value - p.value) * h / (h + p.time_s)
    return value


@part
def lumped_extension(c: Any, plays: Any, T: float, h: float) -> float:
    """Extra length of the free span at tension T: strand friction as plays in the tension, and what was let go.

    e = Σ compliance · (play(T) − zero) + released; S tanh((play − zero)/S) in place of play − zero where it seats.
    """
    extension: float = c.released_m
    for k in range(c.plays):
        p = plays[c.index, k]
        way = play_at(p, T, h) - p.zero
        extension += p.compliance * (p.seats * math.tanh(way / p.seats) if p.seats > 0.0 else way)
    return extension


@part
def lumped_slope(c: Any, plays: Any, T: float, h: float) -> float:
    """Derivative of `lumped_extension` by T, m/N."""
    slope = 0.0
    for k in range(c.plays):
        p = plays[c.index, k]
        part = 0.0
        if p.rounded != 0:
            held = T - play_at(p, T, h)
            part = max(held if p.tension <= T else -held, 0.0) / p.radius
        elif p.value < T - p.radius - p.share * T:
            part = 1.0 - p.share
        elif p.value > T + p.radius + p.share * T:
            part = 1.0 + p.share
        if p.seats > 0.0:
            part /= math.cosh((play_at(p, T, h) - p.zero) / p.seats) ** 2
        slope += p.compliance * part * h / (h + p.time_s)
    return slope


@part
def settle_cable(c: Any, plays: Any, h: float) -> None:
    """End of a step: plays stay where they came to, and a clamp under too much tension has crept."""
    for k in range(c.plays):
        p = plays[c.index, k]
        p.value, p.tension = play_at(p, c.T_out, h), c.T_out
    if c.overload_rate > 0.0:
        c.crept_m += h * c.overload_rate * max(c.T_out - c.overload_N, 0.0)
