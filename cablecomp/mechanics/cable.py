"""One cable of a stage: output drum, free span (with a guide, if any), input drum; stretch as a function of its
tension."""

from __future__ import annotations

from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.guide import guide_commit, guide_split
from cablecomp.mechanics.jit import inlined_kernel, inner_kernel, kernel
from cablecomp.mechanics.profile import LEAST_WRAP, B, Floats, set_pending, wrap_commit, wrap_eval
from cablecomp.mechanics.records import IN, OUT
from cablecomp.mechanics.tables import dv_dtau, strain_of_tau, v_of_tau
from cablecomp.mechanics.viscous import viscous_commit, viscous_eval


@inlined_kernel
def drum_eval(
    d: Drive, L: Floats, c: int, end: int, tau: float, v: float, w: float
) -> tuple[float, float, float]:
    """Integral of strain * EA/T0 over one drum's wrap at end value v, its derivatives by v and by the wrap
    angle; kept as pending.

    A solver's trial may unwind the drum: it is then taken to keep `LEAST_WRAP`, and `joint_ready` refuses it.
    """
    cable = d.cables[c]
    wrap = 2 * c + end
    mu = cable.mu[end]
    step = d.steps[wrap]
    step.w, step.end, step.tau = w, v, tau
    w = w if w > LEAST_WRAP else LEAST_WRAP
    if L is not None:
        if cable.viscous > 0.0:
            return viscous_eval(d, c, end, w, tau, mu)
    meet = wrap_eval(d.profiles, L, cable.law[end], wrap, d.heights[wrap], w, v, tau, mu)
    set_pending(step, meet)
    slope = meet.slope
    # where the cone cuts, turning by dw lowers the slipped part by mu dw
    turn = tau - 1.0 - (mu * slope if v > meet.v else -mu * slope) if slope > 0.0 else tau - 1.0
    return meet.total, slope, turn


@inlined_kernel
def cable_eval(
    d: Drive, L: Floats, c: int, tension: float, x_in: float, x_out: float
) -> tuple[float, float, float]:
    """Stretch [m] of cable c at output-side tension [N] and shaft angles [rad] beyond its stretch at T0, and
    its derivatives by the tension [m/N] and by the output shaft's angle [m/rad].

    With a guide in the path the input-side tension follows from the guide's friction and the material passed over it.
    """
    cable, state = d.cables[c], d.states[c]
    t0 = cable.T0 * state.pretension * state.stiffness
    unit = cable.T0 * state.pretension / cable.EA
    tau = tension / t0
    v = v_of_tau(L, 2, tau)
    dv = dv_dtau(L, 2, tau, v)
    e_span, a_span = strain_of_tau(L, 2, tau)
    length = cable.length
    total = turn = slope = 0.0
    ends = 2
    state.tension = state.tension_in = tension
    if L is not None:
        if cable.guide > 0.0:
            w_in = cable.wrap[IN] - cable.sign * x_in
            total, slope, tau_in = guide_split(d, L, c, v, x_in, w_in)
            slope *= dv
            state.tension_in = tau_in * t0
            length *= 0.5
            ends = 1
        else:
            play, d_play = span_play(cable.play_yield, state.play, tension - t0)
            state.play_try = play
            total = length * cable.play_share * play / t0
            slope = length * cable.play_share * d_play
    total += length * e_span
    slope += length * a_span
    angle = cable.sign * x_out
    for end in range(ends):
        radius = cable.radius[end]
        e, a, by_angle = drum_eval(d, L, c, end, tau, v, cable.wrap[end] + angle)
        total += radius * e
        slope += radius * a * dv
        if end == OUT:
            turn = radius * by_angle
        angle = -cable.sign * x_in
    state.stretch = total * unit
    state.compliance = slope * unit / t0
    return total * unit, slope * unit / t0, cable.sign * turn * unit


@kernel
def span_play(radius: float, z: float, x: float) -> tuple[float, float]:
    """Play operator of the given radius: output follows the input x once it leaves the play; (output,
    derivative by x)."""
    if radius <= 0.0:
        return 0.0, 0.0
    if x - radius > z:
        return x - radius, 1.0
    if x + radius < z:
        return x + radius, 1.0
    return z, 0.0


@inner_kernel
def cable_commit(d: Drive, L: Floats, c: int) -> None:
    """Make the last evaluation of cable c its state, and renew the bound on what merging has done to its stretch.

    In a closed circuit an error of the stretch moves the tensions against it, so the errors of later cable do
    not add to it.
    """
    cable, state = d.cables[c], d.states[c]
    first = OUT
    if L is not None:
        state.play = state.play_try
        if cable.guide > 0.0:
            guide_commit(d, c)
        if cable.viscous > 0.0:
            viscous_commit(d.grids[2 * c])
            if cable.guide == 0.0:
                viscous_commit(d.grids[2 * c + 1])
                return
            first = IN  # behind a guide the input drum slips without viscosity
    error = 0.0
    for end in range(first, 2):
        wrap = 2 * c + end
        d.heights[wrap] = wrap_commit(
            d.profiles, L, cable.law[end], wrap, d.heights[wrap], d.steps[wrap], cable.merge
        )
        error += cable.radius[end] * d.profiles[wrap, B, d.heights[wrap] - 1]
    state.error = error * cable.T0 / cable.EA
