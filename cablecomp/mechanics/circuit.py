"""One circuit: a chain of cables (open), or two antagonistic chains (closed), solved for its tensions and its
deflection.

Closed: the two chains' stretches cancel, theta_h(T_h) + theta_l(T_l) = 0 (4-1), and T_h - T_l = M/R (4-4);
every stretch rises with its tension, so one safeguarded Newton iteration on T_l finds both. The wraps turn with
the unknown joint angle; that coupling is weak (strain, about 1e-3), so the angle is updated in the same iteration.
"""

from __future__ import annotations

from cablecomp.mechanics.cable import cable_commit, cable_eval
from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inlined_kernel, inner_kernel
from cablecomp.mechanics.nudge import SMALL, cable_nudge
from cablecomp.mechanics.profile import Floats
from cablecomp.mechanics.records import OUT
from cablecomp.mechanics.status import STATUS_DIVERGED, STATUS_OK, STATUS_SLACK


@inlined_kernel
def chain_eval(
    d: Drive, L: Floats, first: int, count: int, tension: float, x_in: float, x_out: float
) -> tuple[float, float, float]:
    """Rotation [rad] of the chain's output shaft out of its stretch, and its derivatives by the output cable's
    tension and by that shaft's angle.

    The cables of a chain hang one behind the other: T_i = scale_i T (thesis 5-1, 5-9), rotations add with their
    ratios (5-2).
    """
    theta = 0.0
    compliance = 0.0
    turn = 0.0
    x = x_in
    for j in range(count):
        cable, state = d.cables[first + j], d.states[first + j]
        shaft = x_out if j == count - 1 else state.shaft
        stretch, slope, by_angle = cable_eval(d, L, first + j, tension * cable.scale, x, shaft)
        stretch -= state.offset
        theta += cable.weight * stretch
        turn = cable.weight * by_angle
        compliance += cable.weight * slope * cable.scale
        x = cable.ratio * x + cable.sign * stretch / cable.radius[OUT]
        state.shaft = x
    return theta, compliance, turn


@inner_kernel
def circuit_solve(
    d: Drive, L: Floats, ic: int, moment: float, x_in: float, x_guess: float
) -> tuple[float, float, int]:
    """Output angle [rad] of circuit `ic` under `moment` [N m] at input angle x_in, its compliance [rad/(N m)],
    and a status."""
    circuit = d.circuits[ic]
    first_h, first_l, count = circuit.first[0], circuit.first[1], circuit.count
    closed = circuit.chains == 2
    radius = circuit.radius
    rigid = circuit.ratio * x_in
    floor = circuit.slack
    pull = moment / radius
    x = x_guess
    last_l = d.states[first_l + count - 1]
    unit = d.cables[first_l + count - 1].T0
    lowest = floor if pull >= 0.0 else floor - pull
    if closed:
        guess = last_l.kept - last_l.reference * pull + last_l.miss
        tension = max(guess, lowest)
    else:
        tension = last_l.reference * last_l.pretension
        if tension + pull <= floor:
            return x, 0.0, STATUS_SLACK
    low, high = lowest, 1e300
    theta_h = theta_l = a_h = a_l = b_h = b_l = 0.0
    for iteration in range(80):
        for chain in range(circuit.chains):
            first, here = (first_h, tension + pull) if chain == 0 else (first_l, tension)
            theta, a, b = chain_eval(d, L, first, count, here, x_in, x)
            if chain == 0:
                theta_h, a_h, b_h = theta, a, b
            else:
                theta_l, a_l, b_l = theta, a, b
        off = rigid + theta_h - x
        if not closed:
            turn = off / (1.0 - b_h)
            if L is None and count == 1 and abs(turn) <= SMALL and cable_nudge(d, first_h, 0.0, turn):
                return x + turn, a_h / radius, STATUS_OK
            if abs(turn) <= (1e-11 if iteration < 12 else 1e-9):
                return x + turn, a_h / radius, STATUS_OK
            x += turn if iteration < 12 else off
            continue
        gap = theta_h + theta_l
        if tension <= lowest and gap >= 0.0:  # one side is slack: the other alone carries and positions
            new = rigid + theta_h if pull >= 0.0 else rigid - theta_l
            if abs(new - x) <= 1e-11:
                return new, (a_h if pull >= 0.0 else a_l) / radius, STATUS_OK
            x = new
            continue
        # Newton in (T_l, x) on gap = 0 and off = 0
        scale = 1.0 / ((a_h + a_l) * (b_h - 1.0) - a_h * (b_h + b_l))
        step = (off * (b_h + b_l) - gap * (b_h - 1.0)) * scale
        turn = (gap * a_h - off * (a_h + a_l)) * scale
        if abs(step) <= (1e-13 if iteration < 8 else 1e-11) * unit and abs(turn) <= 1e-11:
            return x + turn, a_h * a_l / (a_h + a_l) / radius, STATUS_OK
        if L is None and count == 1 and abs(turn) <= SMALL and tension + step > lowest:
            if abs(step) <= SMALL * min(tension, tension + pull):
                done = cable_nudge(d, first_h, step, turn)
                if done and cable_nudge(d, first_l, step, turn):
                    return x + turn, a_h * a_l / (a_h + a_l) / radius, STATUS_OK
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
                return x, a_h * a_l / (a_h + a_l) / radius, STATUS_OK
            if not low < tension < high:
                tension = 0.5 * (low + high)
    return x, 0.0, STATUS_DIVERGED


@inner_kernel
def circuit_commit(d: Drive, L: Floats, ic: int) -> None:
    """Make the last solution of circuit `ic` its state."""
    circuit = d.circuits[ic]
    first_h, first_l, count = circuit.first[0], circuit.first[1], circuit.count
    if circuit.chains == 2:
        # warm start of the next solution: T_l moves against M by h's share of the compliance
        a_h = a_l = 0.0
        for j in range(count):
            cable = d.cables[first_h + j]
            gain = cable.weight * cable.scale
            a_h += gain * d.states[first_h + j].compliance
            a_l += gain * d.states[first_l + j].compliance
        share = a_h / (a_h + a_l)
        last_h, last_l = d.states[first_h + count - 1], d.states[first_l + count - 1]
        pull = last_h.tension - last_l.tension
        miss = last_l.tension - (last_l.kept - last_l.reference * pull)
        before = last_l.miss_old
        last_l.miss_old = miss
        # what the last two guesses missed in one direction, the next will miss too
        last_l.miss = 0.0 if miss * before <= 0.0 else (miss if abs(miss) < abs(before) else before)
        last_l.kept = last_l.tension + share * pull
        last_l.reference = share
    for j in range(count):
        cable_commit(d, L, first_h + j)
        if circuit.chains == 2:
            cable_commit(d, L, first_l + j)
