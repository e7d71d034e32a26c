"""One cable of a stage: output drum, free span (with a guide, if any), input drum; stretch as a function of its
tension."""

from __future__ import annotations

import math
from typing import NamedTuple

from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.guide import guide_commit, guide_split
from cablecomp.mechanics.jit import inlined_kernel, kernel
from cablecomp.mechanics.profile import LEAST_WRAP, Floats, Wound, set_pending, wrap_commit, wrap_eval
from cablecomp.mechanics.records import IN, OUT, PLAYS
from cablecomp.mechanics.tables import (
    ELSEWHERE,
    HEAD,
    MODE,
    PLAIN,
    dv_dtau,
    groove_slope,
    strain_of_tau,
    v_of_tau,
)
from cablecomp.mechanics.viscous import viscous_commit, viscous_eval
from cablecomp.mechanics.viscous_laws import lawful_eval

STEEPEST_PLAY = 0.95  # growth of a play's radius with its input, at most: the output follows it still


class Stretch(NamedTuple):
    """How much longer a cable is than at T0."""

    length: float  # m
    compliance: float  # its derivative by the tension, m/N
    by_shaft: float  # by the output shaft's angle, m/rad


@inlined_kernel
def drum_eval(d: Drive, laws: Floats, c: int, end: int, tau: float, v: float, w: float) -> Wound:
    """The cable on one drum at wrap angle w and end value v, T/T0 = tau; kept as pending.

    A solver's trial may unwind the drum: it is then taken to keep `LEAST_WRAP`, and `joint_ready` refuses it.
    """
    cable = d.cables[c]
    wrap = 2 * c + end
    mu = cable.mu[end]
    step = d.steps[wrap]
    step.w, step.end_v, step.end_tau = w, v, tau
    w = w if w > LEAST_WRAP else LEAST_WRAP
    if laws is not None:
        if cable.viscous > 0.0:
            if laws[cable.law[end], HEAD, MODE] == PLAIN:
                return viscous_eval(d, c, end, w, tau, mu)
            return lawful_eval(d, laws, c, end, w, tau, mu)
    meet = wrap_eval(d.profiles[wrap], laws, cable.law[end], d.heights[wrap], w, v, tau, mu)
    set_pending(step, meet)
    slope = meet.slope
    turn = tau - 1.0
    if slope > 0.0:  # where the cone cuts, turning by dw lowers the slipped part as the cone falls there
        falls = mu * groove_slope(laws, cable.law[end], w)
        turn -= falls * slope if v > meet.v else -falls * slope
    return Wound(meet.total, slope, turn)


@inlined_kernel
def cable_eval(d: Drive, laws: Floats, c: int, tension: float, x_in: float, x_out: float) -> Stretch:
    """Stretch of cable c at output-side tension [N] and shaft angles [rad].

    With a guide in the path the input-side tension follows from the guide's friction and the material passed over it.
    """
    cable, state = d.cables[c], d.states[c]
    t0 = cable.T0 * state.pretension * state.stiffness
    unit = cable.T0 * state.pretension / cable.EA
    tau = tension / t0
    v = v_of_tau(laws, ELSEWHERE, tau)
    dv = dv_dtau(laws, ELSEWHERE, tau, v)
    strain, strain_slope = strain_of_tau(laws, ELSEWHERE, tau)
    length = cable.length
    total = by_shaft = by_shaft_in = slope = 0.0
    ends = 2
    state.tension = state.tension_in = tension
    if laws is not None:
        if cable.guide > 0.0:
            w_in = cable.wrap[IN] - cable.sign * x_in
            split = guide_split(d, laws, c, v, tau, x_in, w_in)
            total, slope, by_shaft_in = split.stretch, split.slope * dv, split.by_shaft
            state.tension_in = split.tau_in * t0
            d.guides[c].by_tension, d.guides[c].by_in = split.tau_by_end * dv, split.tau_by_shaft * t0
            length *= cable.guide_place
            ends = 1
        else:
            play, d_play = span_plays(d, c, tension - t0, t0)
            total = length * cable.play_share * play / t0
            slope = length * cable.play_share * d_play
    total += length * strain
    slope += length * strain_slope
    angle = cable.sign * x_out
    for end in range(ends):
        radius = cable.radius[end]
        wound = drum_eval(d, laws, c, end, tau, v, cable.wrap[end] + angle)
        total += radius * wound.total
        slope += radius * wound.by_v * dv
        if end == OUT:
            by_shaft = radius * wound.by_wrap
        angle = -cable.sign * x_in
    state.stretch = total * unit
    state.compliance = slope * unit / t0
    if laws is not None:
        if cable.guide > 0.0:
            d.guides[c].stretch_by_in, d.guides[c].stretch_by_out = by_shaft_in, cable.sign * by_shaft * unit
    return Stretch(total * unit, slope * unit / t0, cable.sign * by_shaft * unit)


@inlined_kernel
def span_plays(d: Drive, c: int, x: float, t0: float) -> tuple[float, float]:
    """What the free span's play, or the mean of its plays, passes on at the change of tension x from t0 [N]; its
    derivative by x."""
    cable, state = d.cables[c], d.states[c]
    # so much of the way to where it would rest, within a sample
    slow = cable.play_time > 0.0 and not d.context.first
    part = -math.expm1(-d.context.dt / cable.play_time) if slow else 1.0
    pressed = cable.play_pressed / t0
    if cable.play_spread <= 0.0:
        play, slope = span_play(cable.play_yield, pressed, state.play, x)
        if slow:
            play, slope = state.play + part * (play - state.play), part * slope
        state.play_try = play
        return play, slope
    play = slope = 0.0
    for k in range(PLAYS):
        of_it = d.plays[c, k]
        place = (k + 0.5) / PLAYS
        if cable.play_grading != 1.0:
            place **= cable.play_grading
        radius = cable.play_yield * (1.0 + cable.play_spread * (2.0 * place - 1.0))
        one, by_x = span_play(radius, pressed, of_it.rest, x)
        of_it.rest_try = of_it.rest + part * (one - of_it.rest) if slow else one
        play += of_it.rest_try / PLAYS
        slope += part * by_x / PLAYS
    return play, slope


@kernel
def span_play(radius: float, pressed: float, z: float, x: float) -> tuple[float, float]:
    """Play operator of the given radius, which grows by the share `pressed` per unit of its input x: output follows x
    once it leaves the play; (output, derivative by x)."""
    if radius <= 0.0:
        return 0.0, 0.0
    growth = min(radius * pressed, STEEPEST_PLAY)
    holds = radius + growth * x
    if x - holds > z:
        return x - holds, 1.0 - growth
    if x + holds < z:
        return x + holds, 1.0 + growth
    return z, 0.0


@inlined_kernel
def cable_commit(d: Drive, laws: Floats, c: int) -> None:
    """Make the last evaluation of cable c its state, and renew the bound on what merging has done to its stretch.

    In a closed circuit an error of the stretch moves the tensions against it, so the errors of later cable do
    not add to it.
    """
    cable, state = d.cables[c], d.states[c]
    first = OUT
    if laws is not None:
        state.play = state.play_try
        if cable.play_spread > 0.0:
            for k in range(PLAYS):
                d.plays[c, k].rest = d.plays[c, k].rest_try
        if cable.guide > 0.0:
            guide_commit(d, laws, c)
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
            d.profiles[wrap], laws, cable.law[end], d.heights[wrap], d.steps[wrap], cable.merge
        )
        error += cable.radius[end] * d.profiles[wrap, d.heights[wrap] - 1].stretch_error
    state.error = error * cable.T0 / cable.EA
