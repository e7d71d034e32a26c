"""A fixed guide, idler row or sheath in the middle of the free span: its cable rubs on both sides of what sticks.

While part of the cable on the guide sticks, it parts the cable into two sides that do not know of each other: the input
side's stretch follows the input drum alone. When the whole guide slides, the end tensions stand at the capstan ratio,
ln(T_out/T_in) = -+ mu Theta, and cable passes from one side to the other.
"""

from __future__ import annotations

import math

from cablecomp.mechanics.arc import arc_commit, arc_eval
from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inner_kernel
from cablecomp.mechanics.profile import LEAST_WRAP, Floats, set_pending, wrap_eval
from cablecomp.mechanics.records import IN
from cablecomp.mechanics.tables import strain_of_tau, tau_of_v


@inner_kernel
def guide_split(
    d: Drive, L: Floats, c: int, v2: float, x_in: float, w_in: float
) -> tuple[float, float, float]:
    """Input side of cable c when the guide's output end stands at v2 = ln(T/T0).

    Returns (stretch of guide, input half of the free span and input drum [m at strain T0/EA], its derivative by v2,
    tension ratio at the input drum). The input drum's pending step is kept.
    """
    cable, state = d.cables[c], d.states[c]
    G, J = d.profiles, d.heights
    width = cable.guide
    per_turn = cable.guide_length / width
    span = 0.5 * cable.length
    radius = cable.radius[IN]
    arc = 2 * d.size.cables + c
    wrap = 2 * c + 1
    unit = cable.T0 * state.pretension / cable.EA
    target = (state.side - cable.sign * radius * (x_in - state.shaft_in)) / unit
    low, high = v2 - width, v2 + width
    least, most = low, high
    v1 = min(max(state.guide_end, low), high)
    side = a_side = e_arc = g1 = g2 = swap = 0.0
    slides = False
    step = d.steps[wrap]
    step.w = w_in
    w_in = w_in if w_in > LEAST_WRAP else LEAST_WRAP
    for iteration in range(60):
        tau1 = tau_of_v(L, 2, v1)
        meet = wrap_eval(G, L, 2, wrap, J[wrap], w_in, v1, tau1, cable.mu[IN])
        set_pending(step, meet)
        step.end, step.tau = v1, tau1
        e_arc, change, g1, g2, _, _, swap = arc_eval(G, arc, J[arc], v1, v2, 1.0)
        e_span, a_span = strain_of_tau(L, 2, tau1)
        side = radius * meet.total + span * e_span
        a_side = radius * meet.slope + span * a_span * tau1
        miss = side + per_turn * change - target
        slides = (v1 >= high and miss < 0.0) or (v1 <= low and miss > 0.0)
        if slides:
            break
        newton = -miss / (a_side + per_turn * (g1 + swap))
        if abs(newton) <= 1e-14:
            break
        if miss > 0.0:
            most = min(most, v1)
        else:
            least = max(least, v1)
        new = min(max(v1 + newton, low), high)
        if iteration > 6 and not least < new < most:
            new = 0.5 * (least + most)
        v1 = new
    state.side_try = side * unit
    state.guide_try = v1
    state.guide_far = v2
    state.shaft_in_try = x_in
    # how far the near end follows the far end: wholly while sliding, through the touching slip zones otherwise
    follow = 1.0 if slides else per_turn * swap / (a_side + per_turn * (g1 + swap))
    slope = per_turn * g2 + follow * (a_side + per_turn * g1)
    return side + per_turn * e_arc, slope, math.exp(v1)


@inner_kernel
def guide_commit(d: Drive, c: int) -> None:
    """Make the last split the state of cable c's guide."""
    state = d.states[c]
    arc = 2 * d.size.cables + c
    state.side = state.side_try
    state.guide_end = state.guide_try
    state.shaft_in = state.shaft_in_try
    d.heights[arc] = arc_commit(d.profiles, arc, d.heights[arc], state.guide_try, state.guide_far, 1.0)
