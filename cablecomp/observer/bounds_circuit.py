"""Guaranteed bounds, compiled: one step of a circuit and of the joint.

Open circuit: the tension is known, the law preserves order. Closed circuit: with F(T_l; h, l) = theta_h(T_l + M/R; h) +
theta_l(T_l; l), rising in the tension and in both profiles, the true T_l lies between the roots of F(.; U, U) and
F(.; L, L): a mixed-monotone embedding. Alone it widens step by step where sliding wraps give more than the free span.
A second law holds it: displacements are monotone in the end values, so a drive that has more stretch in it,
F(T; U, U) = surplus >= 0, started above the true one and led by the same load, stays above it; likewise one with a
deficit below. The tighter of the two counts.
"""

from __future__ import annotations

import math

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.cable import stacks
from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.profile import Floats, Ints, copy_floats
from cablecomp.observer.bounds_kernel import (
    W_CIRCUIT,
    W_EA,
    W_EPS,
    W_EPS_OLD,
    W_FIRST,
    W_HEAD,
    W_LOW,
    W_NEXT,
    W_PENDING,
    W_PULL,
    W_T0,
    W_T_HIGH,
    W_T_LOW,
    W_TURN,
    W_UP,
    W_X_IN,
    Side,
    cable_block,
    chain_bound,
    chain_commit,
    chain_turning,
    side_follow,
    side_retension,
    sides_start,
)

OUTWARD = 1e-11  # rounding of solved tensions, as a share of T0
ROUNDING = 1e-11  # of solved angles [rad], as the solver stops there


@kernel
def pair_gap(
    P: Floats, I: Ints, N: Floats, L: Floats, W: Floats, ic: int, high: Side, low: Side, tension: float, pull: float,
    x: tuple[float, float, float], safe: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Stretch of both chains together [rad] with chain h in state `high` and chain l in state `low`, its slope, and either
    chain's part. `x` = input angle, its half width, output angle; margins count `safe` times, outward."""
    h = o.HEADER + o.CIRCUIT * ic
    count = I[h + o.C_COUNT]
    theta_h, a_h, m_h = chain_bound(P, I, N, L, W, high, I[h], count, tension + pull, x[0], x[2], x[1])
    theta_l, a_l, m_l = chain_bound(P, I, N, L, W, low, I[h + o.C_FIRST_L], count, tension, x[0], x[2], x[1])
    theta_h += safe * high[3] * m_h
    theta_l += safe * low[3] * m_l
    return theta_h + theta_l, a_h + a_l, theta_h, theta_l


@kernel
def pair_root(
    P: Floats, I: Ints, N: Floats, L: Floats, W: Floats, ic: int, high: Side, low: Side, lowest: float, guess: float,
    pull: float, x: tuple[float, float, float], safe: float, target: float,
) -> float:  # fmt: skip
    """The tension of cable l at which `pair_gap` is `target`, or the lowest one where it is more already."""
    h = o.HEADER + o.CIRCUIT * ic
    unit = P[o.JOINT * I[o.N_CIRCUITS] + o.CABLE * (I[h + o.C_FIRST_L] + I[h + o.C_COUNT] - 1) + o.T0]
    least, most = lowest, 1e300
    tension = max(guess, lowest)
    for iteration in range(100):
        gap, slope, _, _ = pair_gap(P, I, N, L, W, ic, high, low, tension, pull, x, safe)
        gap -= target
        if gap >= 0.0:
            if tension <= lowest:
                return lowest
            most = tension
        else:
            least = tension
        step = -gap / slope
        if abs(step) <= 1e-13 * unit:
            return max(tension + step, lowest)
        tension += step
        if tension < lowest:
            tension = lowest
        elif not least <= tension <= most or iteration > 30:
            if most - least <= 1e-13 * unit:
                return tension
            if most < 1e299:
                tension = 0.5 * (least + most)
    return tension


@kernel
def tension_interval(
    P: Floats, I: Ints, N: Floats, L: Floats, W: Floats, ic: int, low: Side, up: Side, lowest: float, pull: float,
    x: tuple[float, float, float], x_in: float,
) -> tuple[float, float]:  # fmt: skip
    """Lowest and highest possible tension of cable l."""
    h = o.HEADER + o.CIRCUIT * ic
    first_h, count, first_l = I[h], I[h + o.C_COUNT], I[h + o.C_FIRST_L]
    b = W_HEAD + W_CIRCUIT * ic
    unit = P[o.JOINT * I[o.N_CIRCUITS] + o.CABLE * (first_l + count - 1) + o.T0]
    first = W[b + W_FIRST] > 0.0
    lead = 0.0 if first else -0.5 * (pull - W[b + W_PULL])
    guess_low = unit if first else W[b + W_T_LOW] + lead
    guess_high = unit if first else W[b + W_T_HIGH] + lead
    t_low = pair_root(P, I, N, L, W, ic, up, up, lowest, guess_low, pull, x, 1.0, 0.0)
    t_high = pair_root(P, I, N, L, W, ic, low, low, lowest, guess_high, pull, x, 1.0, 0.0)
    t_low = max(t_low - OUTWARD * unit, lowest)
    t_high += OUTWARD * unit
    if first or not _comparable(P, I, N, W, ic, low):
        return t_low, t_high
    growth = 0.0  # of the half widths
    for j in range(count):
        for c in (first_h + j, first_l + j):
            k = cable_block(I, c)
            growth = max(growth, W[k + W_EPS] - W[k + W_EPS_OLD])
    moved = 0.0
    for side in (up, low):
        turn_h, shift_h, soft_h = chain_turning(P, I, side[0], L, W, first_h, count)
        turn_l, shift_l, soft_l = chain_turning(P, I, side[0], L, W, first_l, count)
        turning, shifting = turn_h + turn_l, shift_h + shift_l
        drift = 0.5 * max(soft_h, soft_l) * abs(pull - W[b + W_PULL]) + 2.0 * turning * abs(
            x_in - W[b + W_X_IN]
        )
        moved = max(moved, turning * drift + shifting * growth)
    other = pair_root(
        P, I, N, L, W, ic, up, up, lowest, min(guess_high, t_high), pull, x, 0.0, W[b + W_UP] + moved
    )
    t_high = min(t_high, other + OUTWARD * unit)
    before = floor_tension(P, ic, W[b + W_PULL])
    if W[b + W_T_LOW] > before * (
        1.0 + 1e-6
    ):  # else a slack cable may have been taken up, and the deficit does not hold
        other = pair_root(
            P, I, N, L, W, ic, low, low, lowest, max(guess_low, t_low), pull, x, 0.0, W[b + W_LOW] - moved
        )
        t_low = max(t_low, other - OUTWARD * unit)
    return t_low, max(t_high, t_low)


@kernel
def floor_tension(P: Floats, ic: int, pull: float) -> float:
    """The tension of cable l at which it, or cable h, is slack."""
    floor = P[o.JOINT * ic + o.J_SLACK]
    return floor if pull >= 0.0 else floor - pull


@kernel
def _comparable(P: Floats, I: Ints, N: Floats, W: Floats, ic: int, low: Side) -> bool:
    """True where surplus and deficit carry over from the last step: same factors, less cable wound on than is free."""
    h = o.HEADER + o.CIRCUIT * ic
    for chain in range(2):
        first = I[h] if chain == 0 else I[h + o.C_FIRST_L]
        for c in range(first, first + I[h + o.C_COUNT]):
            p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
            q = I[o.S_CABLE] + o.CABLE_STATE * c
            k = cable_block(I, c)
            if W[k + W_T0] != low[0][q + o.Q_T0] or W[k + W_EA] != N[q + o.Q_EA]:
                return False
            if abs(N[q + o.Q_SHAFT] - W[k + W_TURN]) * P[p + o.R_OUT] > P[p + o.LENGTH]:
                return False
    return True


@kernel
def closed_interval(
    P: Floats, I: Ints, N: Floats, L: Floats, W: Floats, ic: int, low: Side, up: Side, pull: float,
    x: tuple[float, float, float], x_in: float,
) -> tuple[float, float]:  # fmt: skip
    """Lowest and highest possible deflection [rad] of a closed circuit; leaves the sides' next states pending."""
    b = W_HEAD + W_CIRCUIT * ic
    lowest = floor_tension(P, ic, pull)
    t_low, t_high = tension_interval(P, I, N, L, W, ic, low, up, lowest, pull, x, x_in)
    # the deflection rises with chain h's profiles and falls with chain l's
    middle = 0.5 * (t_low + t_high)
    mixed = pair_root(P, I, N, L, W, ic, up, low, lowest, middle, pull, x, 1.0, 0.0)
    clipped = min(max(mixed, t_low), t_high)
    _, _, theta_h, theta_l = pair_gap(P, I, N, L, W, ic, up, low, clipped, pull, x, 1.0)
    theta_high = _part(mixed, t_low, t_high, pull, theta_h, -theta_l)
    mixed = pair_root(P, I, N, L, W, ic, low, up, lowest, middle, pull, x, 1.0, 0.0)
    clipped = min(max(mixed, t_low), t_high)
    _, _, theta_h, theta_l = pair_gap(P, I, N, L, W, ic, low, up, clipped, pull, x, 1.0)
    theta_low = _part(-mixed, -t_high, -t_low, pull, theta_h, -theta_l)
    t = b + W_PENDING
    W[t + W_UP], _, _, _ = pair_gap(P, I, N, L, W, ic, up, up, t_high, pull, x, 0.0)
    W[t + W_LOW], _, _, _ = pair_gap(P, I, N, L, W, ic, low, low, t_low, pull, x, 0.0)
    W[t + W_T_LOW], W[t + W_T_HIGH] = t_low, t_high
    return theta_low, theta_high


@kernel
def _part(mixed: float, least: float, most: float, pull: float, by_h: float, by_l: float) -> float:
    """Which chain's stretch bounds the deflection; where the tension is none of the ends, either does unless one is slack."""
    if mixed < least:
        return by_l
    if mixed > most:
        return by_h
    return by_h if pull >= 0.0 else by_l


@kernel
def circuit_interval(
    P: Floats, I: Ints, N: Floats, L: Floats, W: Floats, ic: int, low: Side, up: Side, moment: float,
    x: tuple[float, float, float],
) -> tuple[float, float]:  # fmt: skip
    """Interval of a circuit's output angle [rad] at nominal input angle, its half width and nominal output angle `x`.

    The half widths eps that the evaluation assumes must hold what comes out; NaN if they find no rest.
    """
    h = o.HEADER + o.CIRCUIT * ic
    first_h, count = I[h], I[h + o.C_COUNT]
    pull = moment / P[o.JOINT * ic + o.J_RADIUS]
    for _ in range(12):
        if I[h + o.C_CLOSED] == 1:
            theta_low, theta_high = closed_interval(P, I, N, L, W, ic, low, up, pull, x, x[0])
        else:
            q = I[o.S_CABLE] + o.CABLE_STATE * (first_h + count - 1)
            tension = N[q + o.Q_REFERENCE] * low[0][q + o.Q_T0] + pull
            theta, _, margin = chain_bound(P, I, N, L, W, up, first_h, count, tension, x[0], x[2], x[1])
            theta_high = theta + margin
            theta, _, margin = chain_bound(P, I, N, L, W, low, first_h, count, tension, x[0], x[2], x[1])
            theta_low = theta - margin
        if _eps_hold(P, I, N, W, ic, low, up, theta_low, theta_high, x):
            rigid = P[o.JOINT * ic + o.J_RATIO]
            rounding = ROUNDING * (1.0 + abs(x[2]))
            return rigid * (x[0] - x[1]) + theta_low - rounding, rigid * (x[0] + x[1]) + theta_high + rounding
    return math.nan, math.nan


@kernel
def _eps_hold(
    P: Floats, I: Ints, N: Floats, W: Floats, ic: int, low: Side, up: Side, theta_low: float, theta_high: float,
    x: tuple[float, float, float],
) -> bool:  # fmt: skip
    """True if every shaft's assumed half width holds what came out; too narrow ones are widened, too wide ones narrowed
    for the next step."""
    h = o.HEADER + o.CIRCUIT * ic
    count = I[h + o.C_COUNT]
    held = True
    for chain in range(1 + I[h + o.C_CLOSED]):
        first = I[h] if chain == 0 else I[h + o.C_FIRST_L]
        rigid = 1.0
        for c in range(first, first + count):
            rigid *= P[o.CABLE * c + o.JOINT * I[o.N_CIRCUITS] + o.RATIO]
            q = I[o.S_CABLE] + o.CABLE_STATE * c
            if c == first + count - 1:
                own, least, most = x[2] - rigid * x[0], theta_low, theta_high
            else:
                own = N[q + o.Q_SHAFT] - rigid * x[0]
                a, b = low[0][q + o.Q_SHAFT], up[0][q + o.Q_SHAFT]
                least, most = min(a, b), max(a, b)
            needed = 1.001 * (max(most - own, own - least, 0.0) + abs(rigid) * x[1]) + 1e-15
            k = cable_block(I, c)
            if not needed <= W[k + W_EPS]:
                W[k + W_EPS] = 1.2 * needed
                held = False
            elif needed < 0.5 * W[k + W_EPS]:
                W[k + W_NEXT] = 1.2 * needed
            else:
                W[k + W_NEXT] = W[k + W_EPS]
    return held


@kernel
def circuit_keep(
    P: Floats,
    I: Ints,
    N: Floats,
    L: Floats,
    W: Floats,
    ic: int,
    low: Side,
    up: Side,
    pull: float,
    x_in: float,
) -> None:
    """Make the pending states of a circuit's bounds their states."""
    h = o.HEADER + o.CIRCUIT * ic
    b = W_HEAD + W_CIRCUIT * ic
    for chain in range(1 + I[h + o.C_CLOSED]):
        first = I[h] if chain == 0 else I[h + o.C_FIRST_L]
        chain_commit(P, I, L, low, first, I[h + o.C_COUNT])
        chain_commit(P, I, L, up, first, I[h + o.C_COUNT])
        for c in range(first, first + I[h + o.C_COUNT]):
            q = I[o.S_CABLE] + o.CABLE_STATE * c
            k = cable_block(I, c)
            W[k + W_T0], W[k + W_EA], W[k + W_TURN] = low[0][q + o.Q_T0], N[q + o.Q_EA], N[q + o.Q_SHAFT]
            W[k + W_EPS_OLD] = W[k + W_EPS]
            W[k + W_EPS] = W[k + W_NEXT]
    copy_floats(W, b + W_PENDING, W, b, W_PENDING)
    W[b + W_PULL], W[b + W_X_IN], W[b + W_FIRST] = pull, x_in, 0.0


@kernel
def bounds_step(
    P: Floats, I: Ints, L: Floats, N: Floats, W: Floats, SL: Floats, JL: Ints, SU: Floats, JU: Ints
) -> tuple[float, float]:
    """Follow the nominal state's last committed step; lowest and highest possible joint angle [rad] of the drive."""
    low = (SL, JL, stacks(I, SL), -1.0)
    up = (SU, JU, stacks(I, SU), 1.0)
    first = W[W_HEAD + W_FIRST] > 0.0
    side_follow(I, N, SL, first)
    side_follow(I, N, SU, first)
    context = I[o.S_CONTEXT]
    moment = N[context + o.X_LOAD] - N[context + o.X_MOMENT]
    x_in, eps = N[context + o.X_MOTOR], 0.0
    least = most = x_in
    for ic in range(I[o.N_CIRCUITS]):
        h = o.HEADER + o.CIRCUIT * ic
        share = moment * P[o.JOINT * ic + o.J_MOMENT]
        last = I[h] if share >= 0.0 else I[h + o.C_FIRST_L]
        x_out = N[I[o.S_CABLE] + o.CABLE_STATE * (last + I[h + o.C_COUNT] - 1) + o.Q_SHAFT]
        least, most = circuit_interval(P, I, N, L, W, ic, low, up, share, (x_in, eps, x_out))
        if math.isnan(least):  # nothing is known any more: start anew
            sides_start(P, I, L, W, SL, JL, SU, JU)
            return least, most
        circuit_keep(P, I, N, L, W, ic, low, up, share / P[o.JOINT * ic + o.J_RADIUS], x_in)
        x_in, eps = x_out, max(most - x_out, x_out - least)
    side_retension(P, I, N, L, low)
    side_retension(P, I, N, L, up)
    return least, most
