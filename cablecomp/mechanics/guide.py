"""A fixed guide, idler row or sheath in the free span: its cable rubs on both sides of what sticks.

While part of the cable on the guide sticks, it parts the cable into two sides that do not know of each other: the input
side's stretch follows the input drum alone. When the whole guide slides, v_out - v_in = -+ mu Theta (the capstan ratio
of the end tensions; v as in `profile.py`), and cable passes from one side to the other.
"""

from __future__ import annotations

from typing import NamedTuple

from cablecomp.mechanics.arc import ArcMeet, arc_commit, arc_meet, arc_total
from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inlined_kernel, inner_kernel
from cablecomp.mechanics.profile import LEAST_WRAP, Floats, set_pending, wrap_eval
from cablecomp.mechanics.records import IN
from cablecomp.mechanics.tables import ELSEWHERE, dv_dtau, strain_of_tau, tau_of_v


class Split(NamedTuple):
    """The cable from the guide's output end to the input drum."""

    stretch: float  # of guide, input side of the free span and input drum, m at strain T0/EA
    slope: float  # its derivative by the end value
    by_shaft: float  # by the input shaft's angle, m/rad: what sticks keeps the input drum's turn from the output side
    tau_in: float  # T/T0 at the input drum,
    tau_by_end: float  # its derivative by the end value,
    tau_by_shaft: float  # by the input shaft's angle


@inner_kernel
def guide_split(
    d: Drive, laws: Floats, c: int, v_out: float, tau_out: float, x_in: float, w_in: float
) -> Split:
    """Input side of cable c when the guide's output end stands at v_out (ln(T/T0) for the plain cable), T/T0 = tau_out.

    The input drum's pending step is kept.
    """
    cable, state = d.cables[c], d.states[c]
    width = cable.guide
    per_turn = cable.guide_length / width
    span = (1.0 - cable.guide_place) * cable.length
    radius = cable.radius[IN]
    arc = 2 * d.size.cables + c
    wrap = 2 * c + 1
    unit = cable.T0 * state.pretension / cable.EA
    target = (state.side - cable.sign * radius * (x_in - state.shaft_in)) / unit
    low, high = v_out - width, v_out + width
    least, most = low, high
    v_in = min(max(state.guide_try + state.guide_follow * (v_out - state.guide_far), low), high)
    side = by_v = 0.0
    on_guide = ArcMeet(0.0, 0.0, 0.0, 0.0, 0.0)
    slides = False
    step = d.steps[wrap]
    step.w = w_in
    w_in = w_in if w_in > LEAST_WRAP else LEAST_WRAP
    for iteration in range(60):
        tau_in = tau_of_v(laws, ELSEWHERE, v_in)
        on_drum = wrap_eval(
            d.profiles[wrap], laws, cable.law[IN], d.heights[wrap], w_in, v_in, tau_in, cable.mu[IN]
        )
        set_pending(step, on_drum)
        step.end_v, step.end_tau = v_in, tau_in
        on_guide = arc_meet(d.profiles[arc], laws, d.heights[arc], v_in, tau_in, v_out, 1.0)
        strain, strain_slope = strain_of_tau(laws, ELSEWHERE, tau_in)
        side = radius * on_drum.total + span * strain
        by_v = radius * on_drum.slope + span * strain_slope / dv_dtau(laws, ELSEWHERE, tau_in, v_in)
        miss = side + per_turn * on_guide.change - target
        slides = (v_in >= high and miss < 0.0) or (v_in <= low and miss > 0.0)
        if slides:
            break
        newton = -miss / (by_v + per_turn * (on_guide.by_near + on_guide.swap))
        if abs(newton) <= 1e-14:
            break
        if miss > 0.0:
            most = min(most, v_in)
        else:
            least = max(least, v_in)
        new = min(max(v_in + newton, low), high)
        if iteration > 6 and not least < new < most:
            new = 0.5 * (least + most)
        v_in = new
    state.side_try = side * unit
    state.guide_try = v_in
    state.guide_far = v_out
    state.shaft_in_try = x_in
    # how far the near end follows the far end: wholly while sliding, through the touching slip zones otherwise
    follow, by_shaft, end_by_shaft = 1.0, 0.0, 0.0
    near_side = by_v + per_turn * on_guide.by_near
    if not slides:
        follow = per_turn * on_guide.swap / (near_side + per_turn * on_guide.swap)
        by_shaft = -cable.sign * radius * near_side / (near_side + per_turn * on_guide.swap)
        end_by_shaft = -cable.sign * radius / unit / (near_side + per_turn * on_guide.swap)
    state.guide_follow = follow
    total, by_far = arc_total(d.profiles[arc], laws, d.heights[arc], v_out, tau_out, 1.0, on_guide)
    slope = per_turn * by_far + follow * near_side
    tau_in = tau_of_v(laws, ELSEWHERE, v_in)
    rise = 1.0 / dv_dtau(laws, ELSEWHERE, tau_in, v_in)
    return Split(side + per_turn * total, slope, by_shaft, tau_in, follow * rise, end_by_shaft * rise)


@inlined_kernel
def guide_commit(d: Drive, laws: Floats, c: int) -> None:
    """Make the last split the state of cable c's guide."""
    state = d.states[c]
    arc = 2 * d.size.cables + c
    state.side = state.side_try
    state.guide_end = state.guide_try
    state.shaft_in = state.shaft_in_try
    d.heights[arc] = arc_commit(d.profiles[arc], laws, d.heights[arc], state.guide_try, state.guide_far, 1.0)
