"""The last step of Newton's method, applied to a pending evaluation instead of evaluating once more.

A step that is small (1e-7 of the tension) changes a wrap's pending profile in a way that is known to second order: the
cone's edge moves in parallel and meets the same piece of the old profile a little further in or out. What is left is
of the order of the step's square, 1e-14. Where the edge would leave its piece, or the piece is nearly as steep as the
edge itself, so that they meet far from where they met, the answer is no.
"""

from __future__ import annotations

from typing import Any

from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inner_kernel, leaf_kernel
from cablecomp.mechanics.piece import piece_plain
from cablecomp.mechanics.profile import Points
from cablecomp.mechanics.records import IN, OUT

SMALL = 1e-7  # greatest step, as a share of the tension and in rad
NEAR = 1e-5  # greatest way of the meeting point, in v: what is left out is of its third order


@leaf_kernel
def grown(value: float, d: float) -> float:
    """value * exp(d) for a small d."""
    return value * (1.0 + d * (1.0 + 0.5 * d))


@inner_kernel
def wrap_nudge(step: Any, p: Points, n: int, mu: float, dv: float, dw: float) -> bool:
    """Shift the pending step of plain wrap i by dv in its end value and dw in its wrap angle, if that is simple."""
    k = int(step.kept)
    w, v, end_tau = step.w + dw, step.end_v + dv, grown(step.end_tau, dv)
    y, tau, stretch = step.y, step.tau, step.stretch
    before = step.v
    if k == n - 1:  # cable was wound on and nothing slips
        if not abs(v - before) <= mu * (w - y):
            return False
        total, _ = piece_plain(w - y, v - before, tau, end_tau)
        step.total = stretch + total
    else:
        steep = mu if v > before else -mu
        if y == step.w or (step.end_v - before) * steep <= 0.0:  # no edge, or one that turns about
            return False
        if k >= 0:
            y0, y1 = p[k].y, p[k + 1].y
            slope = (p[k + 1].v - p[k].v) / (y1 - y0)
            dy = (dv - steep * dw) / (slope - steep)
            y += dy
            if not (y0 <= y <= y1 and y < w and abs(steep * dy) <= NEAR):
                return False
            stretch += dy * (grown(tau, 0.5 * slope * dy) - 1.0)
            step.stretch_error += p[k + 1].merged * dy * tau
        here = v - steep * (w - y)
        if k < 0 and (here - p[0].v) * steep < 0.0:
            return False
        tau = grown(tau, here - before)
        total, _ = piece_plain(w - y, v - here, tau, end_tau)
        step.total = stretch + total
        step.y, step.v, step.stretch, step.tau = y, here, stretch, tau
    step.w, step.end_v, step.end_tau = w, v, end_tau
    return True


@inner_kernel
def cable_nudge(d: Drive, c: int, change: float, turn: float) -> bool:
    """Shift the pending evaluation of plain cable c by `change` [N] of tension and `turn` [rad] of its output shaft."""
    cable, state = d.cables[c], d.states[c]
    r = change / state.tension
    dv = r * (1.0 - 0.5 * r)
    out, into = 2 * c, 2 * c + 1
    if not wrap_nudge(d.steps[out], d.profiles[out], d.heights[out], cable.mu[OUT], dv, cable.sign * turn):
        return False
    if not wrap_nudge(d.steps[into], d.profiles[into], d.heights[into], cable.mu[IN], dv, 0.0):
        return False
    stretched = state.compliance * change
    state.tension += change
    state.tension_in += change
    state.stretch += stretched
    state.shaft += cable.sign * stretched / cable.radius[OUT]
    return True
