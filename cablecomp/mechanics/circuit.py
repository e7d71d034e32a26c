"""One circuit: a chain of cables (open), or two antagonistic chains (closed), solved for its tensions and its deflection.

Closed: the two chains' stretches cancel, theta_h(T_h) + theta_l(T_l) = 0 (4-1), and T_h - T_l = M/R (4-4); every stretch
rises with its tension, so one safeguarded Newton iteration on T_l finds both. The wraps turn with the unknown joint
angle; that coupling is weak (strain, about 1e-3), so the angle is updated in the same iteration.
"""

from __future__ import annotations

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.cable import cable_commit, cable_eval
from cablecomp.mechanics.jit import inlined_kernel, kernel
from cablecomp.mechanics.nudge import SMALL, cable_nudge
from cablecomp.mechanics.profile import Floats, Ints


@inlined_kernel
def chain_eval(
    P: Floats,
    I: Ints,
    S: Floats,
    J: Ints,
    L: Floats,
    G: Floats,
    first: int,
    count: int,
    tension: float,
    x_in: float,
    x_out: float,
) -> tuple[float, float, float]:
    """Rotation [rad] of the chain's output shaft out of its stretch, and its derivatives by the output cable's tension and by
    that shaft's angle.

    The cables of a chain hang one behind the other: T_i = scale_i T (thesis 5-1, 5-9), rotations add with their ratios (5-2).
    """
    theta = 0.0
    compliance = 0.0
    turn = 0.0
    x = x_in
    for j in range(count):
        c = first + j
        p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
        q = I[o.S_CABLE] + o.CABLE_STATE * c
        scale = P[p + o.SCALE]
        shaft = x_out if j == count - 1 else S[q + o.Q_SHAFT]
        stretch, slope, by_angle = cable_eval(P, I, S, J, L, G, c, tension * scale, x, shaft)
        stretch -= S[q + o.Q_OFFSET]
        theta += P[p + o.WEIGHT] * stretch
        turn = P[p + o.WEIGHT] * by_angle
        compliance += P[p + o.WEIGHT] * slope * scale
        x = P[p + o.RATIO] * x + P[p + o.SIGN] * stretch / P[p + o.R_OUT]
        S[q + o.Q_SHAFT] = x
    return theta, compliance, turn


@kernel
def circuit_solve(
    P: Floats,
    I: Ints,
    S: Floats,
    J: Ints,
    L: Floats,
    G: Floats,
    ic: int,
    moment: float,
    x_in: float,
    x_guess: float,
) -> tuple[float, float, int]:
    """Output angle [rad] of circuit `ic` under `moment` [N m] at input angle x_in, its compliance [rad/(N m)], and a status."""
    h = o.HEADER + o.CIRCUIT * ic
    j = o.JOINT * ic
    first_h, count, closed, first_l = I[h], I[h + o.C_COUNT], I[h + o.C_CLOSED], I[h + o.C_FIRST_L]
    radius = P[j + o.J_RADIUS]
    rigid = P[j + o.J_RATIO] * x_in
    floor = P[j + o.J_SLACK]
    pull = moment / radius
    x = x_guess
    last_h = I[o.S_CABLE] + o.CABLE_STATE * (first_h + count - 1)
    last_l = I[o.S_CABLE] + o.CABLE_STATE * (first_l + count - 1)
    unit = P[o.JOINT * I[o.N_CIRCUITS] + o.CABLE * (first_l + count - 1) + o.T0]
    lowest = floor if pull >= 0.0 else floor - pull
    if closed == 1:
        guess = S[last_l + o.Q_KEPT] - S[last_l + o.Q_REFERENCE] * pull + S[last_l + o.Q_MISS]
        tension = max(guess, lowest)
    else:
        tension = S[last_h + o.Q_REFERENCE] * S[last_h + o.Q_T0]
        if tension + pull <= floor:
            return x, 0.0, o.STATUS_SLACK
    low, high = lowest, 1e300
    theta_h = theta_l = a_h = a_l = b_h = b_l = 0.0
    for iteration in range(80):
        for chain in range(1 + closed):
            first, here = (first_h, tension + pull) if chain == 0 else (first_l, tension)
            theta, a, b = chain_eval(P, I, S, J, L, G, first, count, here, x_in, x)
            if chain == 0:
                theta_h, a_h, b_h = theta, a, b
            else:
                theta_l, a_l, b_l = theta, a, b
        off = rigid + theta_h - x
        if closed == 0:
            turn = off / (1.0 - b_h)
            if (
                L is None
                and count == 1
                and abs(turn) <= SMALL
                and cable_nudge(P, I, S, J, G, first_h, 0.0, turn)
            ):
                return x + turn, a_h / radius, o.STATUS_OK
            if abs(turn) <= (1e-11 if iteration < 12 else 1e-9):
                return x + turn, a_h / radius, o.STATUS_OK
            x += turn if iteration < 12 else off
            continue
        gap = theta_h + theta_l
        if tension <= lowest and gap >= 0.0:  # one side is slack: the other alone carries and positions
            new = rigid + theta_h if pull >= 0.0 else rigid - theta_l
            if abs(new - x) <= 1e-11:
                return new, (a_h if pull >= 0.0 else a_l) / radius, o.STATUS_OK
            x = new
            continue
        # Newton in (T_l, x) on gap = 0 and off = 0
        scale = 1.0 / ((a_h + a_l) * (b_h - 1.0) - a_h * (b_h + b_l))
        step = (off * (b_h + b_l) - gap * (b_h - 1.0)) * scale
        turn = (gap * a_h - off * (a_h + a_l)) * scale
        if abs(step) <= (1e-13 if iteration < 8 else 1e-11) * unit and abs(turn) <= 1e-11:
            return x + turn, a_h * a_l / (a_h + a_l) / radius, o.STATUS_OK
        if L is None and count == 1 and abs(turn) <= SMALL and tension + step > lowest:
            if abs(step) <= SMALL * min(tension, tension + pull):
                done = cable_nudge(P, I, S, J, G, first_h, step, turn)
                if done and cable_nudge(P, I, S, J, G, first_l, step, turn):
                    return x + turn, a_h * a_l / (a_h + a_l) / radius, o.STATUS_OK
        x += turn
        if gap > 0.0:
            high = tension
        else:
            low = tension
        tension += step
        if tension < lowest:
            tension = lowest
        elif iteration > 8 and high < 1e299:
            if high - low <= 1e-11 * unit:
                return x, a_h * a_l / (a_h + a_l) / radius, o.STATUS_OK
            if not low < tension < high:
                tension = 0.5 * (low + high)
    return x, 0.0, o.STATUS_DIVERGED


@kernel
def circuit_commit(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats, ic: int) -> None:
    """Make the last solution of circuit `ic` its state."""
    h = o.HEADER + o.CIRCUIT * ic
    first_h, count, closed, first_l = I[h], I[h + o.C_COUNT], I[h + o.C_CLOSED], I[h + o.C_FIRST_L]
    if closed == 1:
        # warm start of the next solution: T_l moves against M by h's share of the compliance
        a_h = a_l = 0.0
        for j in range(count):
            p = o.JOINT * I[o.N_CIRCUITS] + o.CABLE * (first_h + j)
            gain = P[p + o.WEIGHT] * P[p + o.SCALE]
            a_h += gain * S[I[o.S_CABLE] + o.CABLE_STATE * (first_h + j) + o.Q_COMPLIANCE]
            a_l += gain * S[I[o.S_CABLE] + o.CABLE_STATE * (first_l + j) + o.Q_COMPLIANCE]
        last_h = I[o.S_CABLE] + o.CABLE_STATE * (first_h + count - 1)
        last_l = I[o.S_CABLE] + o.CABLE_STATE * (first_l + count - 1)
        share = a_h / (a_h + a_l)
        pull = S[last_h + o.Q_TENSION] - S[last_l + o.Q_TENSION]
        miss = S[last_l + o.Q_TENSION] - (S[last_l + o.Q_KEPT] - S[last_l + o.Q_REFERENCE] * pull)
        before = S[last_l + o.Q_MISS_OLD]
        S[last_l + o.Q_MISS_OLD] = miss
        # what the last two guesses missed in one direction, the next will miss too
        S[last_l + o.Q_MISS] = 0.0 if miss * before <= 0.0 else (miss if abs(miss) < abs(before) else before)
        S[last_l + o.Q_KEPT] = S[last_l + o.Q_TENSION] + share * pull
        S[last_l + o.Q_REFERENCE] = share
    for j in range(count):
        cable_commit(P, I, S, J, L, G, first_h + j)
        if closed == 1:
            cable_commit(P, I, S, J, L, G, first_l + j)
