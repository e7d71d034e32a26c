"""The last step of Newton's method, applied to a pending evaluation instead of evaluating once more.

A step that is small (1e-7 of the tension) changes a wrap's pending profile in a way that is known to second order: the
cone's edge moves in parallel and meets the same piece of the old profile a little further in or out. What is left is
of the order of the step's square, 1e-14. Where the edge would leave its piece, the answer is no.
"""

from __future__ import annotations

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.jit import kernel, leaf_kernel
from cablecomp.mechanics.profile import D, Floats, Ints, V, Y, _piece_plain

SMALL = 1e-7  # greatest step, as a share of the tension and in rad


@leaf_kernel
def grown(value: float, d: float) -> float:
    """value * exp(d) for a small d."""
    return value * (1.0 + d * (1.0 + 0.5 * d))


@kernel
def wrap_nudge(S: Floats, G: Floats, m: int, i: int, n: int, mu: float, dv: float, dw: float) -> bool:
    """Shift the pending step at S[m] of plain wrap i by dv in its end value and dw in its wrap angle, if that is simple."""
    k = int(S[m + o.M_K])
    w, v, tau = S[m + o.M_W] + dw, S[m + o.M_END] + dv, grown(S[m + o.M_TAU], dv)
    y, t, c = S[m + o.M_Y], S[m + o.M_E], S[m + o.M_C]
    before = S[m + o.M_V]
    if k == n - 1:  # cable was wound on and nothing slips
        if not abs(v - before) <= mu * (w - y):
            return False
        total, _ = _piece_plain(w - y, v - before, t, tau)
        S[m + o.M_TOTAL] = c + total
    else:
        steep = mu if v > before else -mu
        if y == S[m + o.M_W]:
            return False
        if k >= 0:
            y0, y1 = G[i, Y, k], G[i, Y, k + 1]
            slope = (G[i, V, k + 1] - G[i, V, k]) / (y1 - y0)
            dy = (dv - steep * dw) / (slope - steep)
            y += dy
            if not (y0 <= y <= y1 and y < w):
                return False
            c += dy * (grown(t, 0.5 * slope * dy) - 1.0)
            S[m + o.M_B] += G[i, D, k + 1] * dy * t
        here = v - steep * (w - y)
        if k < 0 and (here - G[i, V, 0]) * steep < 0.0:
            return False
        t = grown(t, here - before)
        total, _ = _piece_plain(w - y, v - here, t, tau)
        S[m + o.M_TOTAL] = c + total
        S[m + o.M_Y], S[m + o.M_V], S[m + o.M_C], S[m + o.M_E] = y, here, c, t
    S[m + o.M_W], S[m + o.M_END], S[m + o.M_TAU] = w, v, tau
    return True


@kernel
def cable_nudge(P: Floats, I: Ints, S: Floats, J: Ints, G: Floats, c: int, step: float, turn: float) -> bool:
    """Shift the pending evaluation of plain cable c by `step` [N] of tension and `turn` [rad] of its output shaft."""
    p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
    q = I[o.S_CABLE] + o.CABLE_STATE * c
    r = step / S[q + o.Q_TENSION]
    dv = r * (1.0 - 0.5 * r)
    m = I[o.S_MEET] + o.MEET * 2 * c
    if not wrap_nudge(S, G, m, 2 * c, J[2 * c], P[p + o.MU_OUT], dv, P[p + o.SIGN] * turn):
        return False
    if not wrap_nudge(S, G, m + o.MEET, 2 * c + 1, J[2 * c + 1], P[p + o.MU_IN], dv, 0.0):
        return False
    stretched = S[q + o.Q_COMPLIANCE] * step
    S[q + o.Q_TENSION] += step
    S[q + o.Q_TENSION_IN] += step
    S[q + o.Q_STRETCH] += stretched
    S[q + o.Q_SHAFT] += P[p + o.SIGN] * stretched / P[p + o.R_OUT]
    return True
