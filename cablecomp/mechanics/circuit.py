"""One circuit: a chain of cables (open), or two antagonistic chains (closed), solved for its tensions and its
deflection.

Closed: the two chains' stretches cancel, theta_h(T_h) + theta_l(T_l) = 0 (4-1), and T_h - T_l = M/R (4-4);
every stretch rises with its tension, so one safeguarded Newton iteration on T_l finds both. The wraps turn with
the unknown joint angle; that coupling is weak (strain, about 1e-3), so the angle is updated in the same iteration.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cablecomp.mechanics.cable import cable_commit, cable_eval
from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inlined_kernel, inner_kernel, leaf_kernel
from cablecomp.mechanics.nudge import SMALL, cable_nudge
from cablecomp.mechanics.profile import Floats
from cablecomp.mechanics.records import OUT
from cablecomp.mechanics.stages import SWEEPS, Turn, balance_cable, foresee, raise_chain, seat, step_pulls
from cablecomp.mechanics.status import STATUS_DIVERGED, STATUS_OK, STATUS_SLACK

SETTLED, SETTLED_VISCOUS = 1e-9, 1e-11
"""A last step so small, as a share of T0 and in rad, is taken without evaluating the cables once more.

Angle and tensions are right to its square; the profiles end off by it, which later steps take off or cut away and never
add up, as a profile follows its end without stretching any error. A viscous one balances the nearer to its rounding the
smaller the step."""


class Chain(NamedTuple):
    """What a chain's stretch does to its output shaft."""

    theta: float  # rotation, rad
    compliance: float  # its derivative by the output cable's tension, rad/N
    by_shaft: float  # by the shaft's angle


class Solved(NamedTuple):
    """A circuit under its load."""

    angle: float  # of the output pulley, rad
    compliance: float  # rad/(N m)
    status: int
    by_h: float  # turn of the output pulley per length of cable h wound up between its drums, rad/m
    by_l: float  # of cable l


@inlined_kernel
def chain_eval(
    d: Drive, laws: Floats, first: int, count: int, tension: float, x_in: float, x_out: float
) -> Chain:
    """Rotation of the chain's output shaft at this tension [N] of its output cable and these shaft angles [rad].

    The cables of a chain hang one behind the other: T_i = scale_i T (thesis 5-1, 5-9) or what their guides leave of it
    (`stages.py`), rotations add with their ratios (5-2).
    """
    theta = compliance = by_shaft = 0.0
    shared = False
    if laws is not None:
        shared = count > 1 and d.size.guides > 0
        if shared:
            foresee(d, first + count - 1, 1, count, tension - d.states[first + count - 1].tension)
    for sweep in range(SWEEPS):
        theta = compliance = by_shaft = 0.0
        turn = Turn(0.0, 0.0)
        x = x_in
        for j in range(count):
            cable, state = d.cables[first + j], d.states[first + j]
            shaft = x_out if j == count - 1 else state.shaft
            pull = tension * cable.scale
            if laws is not None:
                if shared and j < count - 1:
                    pull = d.guides[first + j].pull
            stretch = cable_eval(d, laws, first + j, pull, x, shaft)
            longer = stretch.length - state.offset
            theta += cable.weight * longer
            by_shaft = cable.weight * stretch.by_shaft
            compliance += cable.weight * stretch.compliance * cable.scale
            if laws is not None:
                if shared:
                    turn = balance_cable(d, first + j, j > 0, turn)
            x = cable.ratio * x + cable.sign * longer / cable.radius[OUT]
            state.shaft = x
        if not shared:
            break
        if laws is not None:
            theta += d.cables[first].sign * turn.owed
            compliance = d.cables[first].sign * turn.by_pull
            if step_pulls(d, first + count - 1, 1, count, sweep, settled_at(d)):
                seat(d, first, count)
                break
            if sweep == SWEEPS - 1:
                theta = math.nan
    return Chain(theta, compliance, by_shaft)


@leaf_kernel
def settled_at(d: Drive) -> float:
    """The last step that is taken without a further look."""
    return SETTLED if d.size.grids == 0 else SETTLED_VISCOUS


@inner_kernel
def pass_on(d: Drive, laws: Floats, first: int, count: int, step: float) -> None:
    """Raise the pending tensions of a chain by what its output cable's rises by at the last, `step` [N]."""
    if laws is not None:
        if count > 1 and d.size.guides > 0:
            raise_chain(d, first, count, step)
            return
    for c in range(first, first + count):
        rise = step * d.cables[c].scale
        d.states[c].tension += rise
        d.states[c].tension_in += rise


@inner_kernel
def circuit_solve(
    d: Drive, laws: Floats, ic: int, moment: float, x_in: float, x_guess: float, again: bool
) -> Solved:
    """Circuit `ic` under `moment` [N m] at input angle x_in [rad]; `again`: near its pending solution."""
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
    weight_h, weight_l = d.cables[first_h + count - 1].weight, d.cables[first_l + count - 1].weight
    by_h = by_l = 0.0
    lowest = floor if pull >= 0.0 else floor - pull
    if closed:
        guess = last_l.unloaded - last_l.share * pull + last_l.miss
        if again:
            last_h = d.states[first_h + count - 1]
            share = last_l.share
            if count == 1:
                share = last_h.compliance / (last_h.compliance + last_l.compliance)
            guess = last_l.tension - share * (pull - (last_h.tension - last_l.tension))
        tension = max(guess, lowest)
    else:
        tension = unit * last_l.pretension
        if tension + pull <= floor:
            return Solved(x, 0.0, STATUS_SLACK, by_h, by_l)
    settled = settled_at(d)
    low, high = lowest, 1e300
    on_h = on_l = Chain(0.0, 0.0, 0.0)
    for iteration in range(80):
        for chain in range(circuit.chains):
            first, here = (first_h, tension + pull) if chain == 0 else (first_l, tension)
            evaluated = chain_eval(d, laws, first, count, here, x_in, x)
            if chain == 0:
                on_h = evaluated
            else:
                on_l = evaluated
            if laws is not None:
                if math.isnan(evaluated.theta):  # shafts within the chain found no balance
                    return Solved(x, 0.0, STATUS_DIVERGED, by_h, by_l)
        off = rigid + on_h.theta - x
        if not closed:
            turn = off / (1.0 - on_h.by_shaft)
            by_h = -weight_h / (1.0 - on_h.by_shaft)
            if laws is None and count == 1 and abs(turn) <= SMALL and cable_nudge(d, first_h, 0.0, turn):
                return Solved(x + turn, on_h.compliance / radius, STATUS_OK, by_h, by_l)
            if abs(turn) <= (1e-11 if iteration < 12 else 1e-9):
                return Solved(x + turn, on_h.compliance / radius, STATUS_OK, by_h, by_l)
            x += turn if iteration < 12 else off
            continue
        gap = on_h.theta + on_l.theta
        if tension <= lowest and gap >= 0.0:  # one side is slack: the other alone carries and positions
            new = rigid + on_h.theta if pull >= 0.0 else rigid - on_l.theta
            if abs(new - x) <= 1e-11:
                by_h = -weight_h / (1.0 - on_h.by_shaft) if pull >= 0.0 else 0.0
                by_l = weight_l / (1.0 + on_l.by_shaft) if pull < 0.0 else 0.0
                compliance = (on_h.compliance if pull >= 0.0 else on_l.compliance) / radius
                return Solved(new, compliance, STATUS_OK, by_h, by_l)
            x = new
            continue
        # Newton in (T_l, x) on gap = 0 and off = 0
        by_tension, by_shaft = on_h.compliance + on_l.compliance, on_h.by_shaft + on_l.by_shaft
        compliance = on_h.compliance * on_l.compliance / by_tension / radius
        scale = 1.0 / (by_tension * (on_h.by_shaft - 1.0) - on_h.compliance * by_shaft)
        step = (off * by_shaft - gap * (on_h.by_shaft - 1.0)) * scale
        turn = (gap * on_h.compliance - off * by_tension) * scale
        by_h, by_l = weight_h * on_l.compliance * scale, -weight_l * on_h.compliance * scale
        if abs(step) <= settled * unit and abs(turn) <= settled:
            pass_on(d, laws, first_h, count, step)
            pass_on(d, laws, first_l, count, step)
            return Solved(x + turn, compliance, STATUS_OK, by_h, by_l)
        if laws is None and count == 1 and abs(turn) <= SMALL and tension + step > lowest:
            if abs(step) <= SMALL * min(tension, tension + pull):
                done = cable_nudge(d, first_h, step, turn)
                if done and cable_nudge(d, first_l, step, turn):
                    return Solved(x + turn, compliance, STATUS_OK, by_h, by_l)
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
                return Solved(x, compliance, STATUS_OK, by_h, by_l)
            if not low < tension < high:
                tension = 0.5 * (low + high)
    return Solved(x, 0.0, STATUS_DIVERGED, by_h, by_l)


@inlined_kernel
def circuit_commit(d: Drive, laws: Floats, ic: int) -> None:
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
        miss = last_l.tension - (last_l.unloaded - last_l.share * pull)
        before = last_l.miss_old
        last_l.miss_old = miss
        # what the last two guesses missed in one direction, the next will miss too
        last_l.miss = 0.0 if miss * before <= 0.0 else (miss if abs(miss) < abs(before) else before)
        last_l.unloaded = last_l.tension + share * pull
        last_l.share = share
    for chain in range(circuit.chains):
        for j in range(count):
            cable_commit(d, laws, circuit.first[chain] + j)
