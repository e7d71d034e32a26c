"""A fixed guide, idler row or sheath in the middle of the free span: its cable rubs on both sides of what sticks.

While part of the cable on the guide sticks, it parts the cable into two sides that do not know of each other: the input
side's stretch follows the input drum alone. When the whole guide slides, the end tensions stand at the capstan ratio,
ln(T_out/T_in) = -+ mu Theta, and cable passes from one side to the other.
"""

from __future__ import annotations

import math

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.arc import arc_commit, arc_eval
from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.profile import LEAST_WRAP, Floats, Ints, wrap_eval
from cablecomp.mechanics.tables import strain_of_tau, tau_of_v


@kernel
def guide_split(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats, c: int, v2: float, x_in: float, w_in: float
) -> tuple[float, float, float]:
    """Input side of cable c when the guide's output end stands at v2 = ln(T/T0).

    Returns (stretch of guide, input half of the free span and input drum [m at strain T0/EA], its derivative by v2,
    tension ratio at the input drum). The input drum's pending step is kept.
    """
    p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
    q = I[o.S_CABLE] + o.CABLE_STATE * c
    width = P[p + o.GUIDE]
    per_turn = P[p + o.GUIDE_LENGTH] / width
    span = 0.5 * P[p + o.LENGTH]
    arc = 2 * I[o.N_CABLES] + c
    wrap = 2 * c + 1
    unit = P[p + o.T0] * S[q + o.Q_T0] / P[p + o.EA]
    target = (S[q + o.Q_SIDE] - P[p + o.SIGN] * P[p + o.R_IN] * (x_in - S[q + o.Q_SHAFT_IN])) / unit
    low, high = v2 - width, v2 + width
    least, most = low, high
    v1 = min(max(S[q + o.Q_GUIDE_END], low), high)
    side = a_side = e_arc = g1 = g2 = swap = 0.0
    slides = False
    m = I[o.S_MEET] + o.MEET * wrap
    S[m + o.M_W] = w_in
    w_in = w_in if w_in > LEAST_WRAP else LEAST_WRAP
    for iteration in range(60):
        tau1 = tau_of_v(L, 2, v1)
        e_in, a_in, k, ym, vm, cm, bm, tm = wrap_eval(G, L, 2, wrap, J[wrap], w_in, v1, tau1, P[p + o.MU_IN])
        S[m + o.M_TOTAL], S[m + o.M_K], S[m + o.M_Y], S[m + o.M_V] = e_in, k, ym, vm
        S[m + o.M_C], S[m + o.M_B], S[m + o.M_E] = cm, bm, tm
        S[m + o.M_END], S[m + o.M_TAU] = v1, tau1
        e_arc, change, g1, g2, _, _, swap = arc_eval(G, arc, J[arc], v1, v2, 1.0)
        e_span, a_span = strain_of_tau(L, 2, tau1)
        side = P[p + o.R_IN] * e_in + span * e_span
        a_side = P[p + o.R_IN] * a_in + span * a_span * tau1
        miss = side + per_turn * change - target
        slides = (v1 >= high and miss < 0.0) or (v1 <= low and miss > 0.0)
        if slides:
            break
        step = -miss / (a_side + per_turn * (g1 + swap))
        if abs(step) <= 1e-14:
            break
        if miss > 0.0:
            most = min(most, v1)
        else:
            least = max(least, v1)
        new = min(max(v1 + step, low), high)
        if iteration > 6 and not least < new < most:
            new = 0.5 * (least + most)
        v1 = new
    S[q + o.Q_SIDE_TRY] = side * unit
    S[q + o.Q_GUIDE_TRY] = v1
    S[q + o.Q_GUIDE_FAR] = v2
    S[q + o.Q_SHAFT_IN_TRY] = x_in
    # how far the near end follows the far end: wholly while sliding, through the touching slip zones otherwise
    follow = 1.0 if slides else per_turn * swap / (a_side + per_turn * (g1 + swap))
    slope = per_turn * g2 + follow * (a_side + per_turn * g1)
    return side + per_turn * e_arc, slope, math.exp(v1)


@kernel
def guide_commit(I: Ints, S: Floats, J: Ints, G: Floats, c: int) -> None:
    """Make the last split the state of cable c's guide."""
    q = I[o.S_CABLE] + o.CABLE_STATE * c
    arc = 2 * I[o.N_CABLES] + c
    S[q + o.Q_SIDE] = S[q + o.Q_SIDE_TRY]
    S[q + o.Q_GUIDE_END] = S[q + o.Q_GUIDE_TRY]
    S[q + o.Q_SHAFT_IN] = S[q + o.Q_SHAFT_IN_TRY]
    J[arc] = arc_commit(G, arc, J[arc], S[q + o.Q_GUIDE_TRY], S[q + o.Q_GUIDE_FAR], 1.0)
