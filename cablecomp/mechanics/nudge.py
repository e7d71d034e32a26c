"""The last step of Newton's method, applied to a pending evaluation instead of evaluating once more.

A step that is small (1e-7 of the tension) changes a wrap's pending profile in a way that is known to second order: the
cone's edge moves in parallel and meets the same piece of the old profile a little further in or out. What is left is
of the order of the step's square, 1e-14. Where the edge would leave its piece, the answer is no.
"""

from __future__ import annotations

from typing import Any

from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inner_kernel, leaf_kernel
from cablecomp.mechanics.profile import D, Floats, V, Y, piece_plain
from cablecomp.mechanics.records import IN, OUT

SMALL = 1e-7  # greatest step, as a share of the tension and in rad


@leaf_kernel
def grown(value: float, d: float) -> float:
    """value * exp(d) for a small d."""
    return value * (1.0 + d * (1.0 + 0.5 * d))


@inner_kernel
def wrap_nudge(step: Any, G: Floats, i: int, n: int, mu: float, dv: float, dw: float) -> bool:
    """Shift the pending step of plain wrap i by dv in its end value and dw in its wrap angle, if that is simple."""
    k = int(step.k)
    w, v, tau = step.w + dw, step.end + dv, grown(step.tau, dv)
    y, t, c = step.y, step.e, step.c
    before = step.v
    if k == n - 1:  # cable was wound on and nothing slips
        if not abs(v - before) <= mu * (w - y):
            return False
        total, _ = piece_plain(w - y, v - before, t, tau)
        step.total = c + total
    else:
        steep = mu if v > before else -mu
        if y == step.w:
            return False
        if k >= 0:
            y0, y1 = G[i, Y, k], G[i, Y, k + 1]
            slope = (G[i, V, k + 1] - G[i, V, k]) / (y1 - y0)
            dy = (dv - steep * dw) / (slope - steep)
            y += dy
            if not (y0 <= y <= y1 and y < w):
                return False
            c += dy * (grown(t, 0.5 * slope * dy) - 1.0)
            step.b += G[i, D, k + 1] * dy * t
        here = v - steep * (w - y)
        if k < 0 and (here - G[i, V, 0]) * steep < 0.0:
            return False
        t = grown(t, here - before)
        total, _ = piece_plain(w - y, v - here, t, tau)
        step.total = c + total
        step.y, step.v, step.c, step.e = y, here, c, t
    step.w, step.end, step.tau = w, v, tau
    return True


@inner_kernel
def cable_nudge(d: Drive, c: int, change: float, turn: float) -> bool:
    """Shift the pending evaluation of plain cable c by `change` [N] of tension and `turn` [rad] of its output shaft."""
    cable, state = d.cables[c], d.states[c]
    r = change / state.tension
    dv = r * (1.0 - 0.5 * r)
    G, out, into = d.profiles, 2 * c, 2 * c + 1
    if not wrap_nudge(d.steps[out], G, out, d.heights[out], cable.mu[OUT], dv, cable.sign * turn):
        return False
    if not wrap_nudge(d.steps[into], G, into, d.heights[into], cable.mu[IN], dv, 0.0):
        return False
    stretched = state.compliance * change
    state.tension += change
    state.tension_in += change
    state.stretch += stretched
    state.shaft += cable.sign * stretched / cable.radius[OUT]
    return True
