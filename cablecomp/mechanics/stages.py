"""Stages behind guides: what a cable's guide holds back does not load the shaft before it.

Without guides a cable pulls alike at both its drums, and pulls stand to each other as the ratios do (thesis 5-1, 5-9,
5-30). With them the shaft between stage i and stage i + 1 balances with the tensions at the later stage's input drum:

    P_i = r_{i+1}/R_i W_{i+1}(P_{i+1}, x_i),    x_i = X_i(P_i, x_{i-1}),

P the pull of a stage at its output drum and W at its input drum: T of a chain's cable, T_h - T_l = M/R of a closed
circuit in series; x_i the shaft's angle. What sticks lets W follow x_i, which turns as stage i gives: more pull, more
turn, and less W, so there is one solution. Newton's method evaluates the stages at trial pulls from the motor outward;
each shaft's turn is then known by the pull behind it alone, and the pulls' steps follow from the joint inward.
"""

from __future__ import annotations

from typing import NamedTuple

from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inner_kernel, leaf_kernel
from cablecomp.mechanics.records import IN, OUT

SWEEPS = 1000  # evaluations of all stages for one solution, at most
TOGETHER = 12  # of them that step all pulls together
PATIENCE = 20  # after which a last step of ROUNDED will do: rounding may keep it from being smaller
ROUNDED = 1e-9  # of T0
FREE = 1e300  # no bound on a pull


class Turn(NamedTuple):
    """How far a shaft turns further once all shafts before it balance."""

    owed: float  # rad, at the present pull of its stage
    by_pull: float  # rad/N


class Slopes(NamedTuple):
    """Derivatives of a closed circuit's solution, by its pull T_h - T_l and by its input shaft's angle."""

    own: float  # of the output shaft's angle by the pull, rad/N
    carried: float  # by the input shaft's angle
    passes: float  # of T_h - T_l at the input drum by the pull
    holds: float  # less of it by the input shaft's angle, N/rad


@inner_kernel
def foresee(d: Drive, last: int, stride: int, count: int, change: float) -> None:
    """Set out the trial pulls before the last stage, whose pull changes by `change` [N]; its cables are `stride` apart:
    1 in a chain, 2 where closed circuits follow each other."""
    for place in range(1, count):
        at = last - place * stride
        guide, state = d.guides[at], d.states[at]
        pull = state.tension if stride == 1 else state.tension - d.states[at + 1].tension
        change *= state.share
        guide.low, guide.high = (0.0 if stride == 1 else -FREE), FREE
        guide.pull = pull + change if pull + change > guide.low else pull


@leaf_kernel
def balance_shaft(d: Drive, before: int, owed: float, passes: float, holds: float, turn: Turn) -> Turn:
    """Take the shaft behind cable `before` into its balance: W less P owed, dW = passes dP' - holds dx, P' the next
    stage's pull, by which the turn is returned."""
    part = 1.0 / (1.0 + turn.by_pull * holds)
    further, by_pull = (turn.owed + turn.by_pull * owed) * part, turn.by_pull * passes * part
    d.guides[before].step = owed - holds * further
    d.states[before].share = passes - holds * by_pull
    return Turn(further, by_pull)


@inner_kernel
def balance_cable(d: Drive, c: int, follows: bool, turn: Turn) -> Turn:
    """Take the shaft before cable c of a chain into its balance, if the cable follows another, and its own turn behind
    it: dx_i = (r/R + s dL/dx_{i-1}/R) dx_{i-1} + s dL/dP/R dP."""
    cable, state, guide = d.cables[c], d.states[c], d.guides[c]
    if follows:
        lever = d.cables[c - 1].scale / cable.scale  # r_i/R_{i-1}
        owed = lever * state.tension_in - d.guides[c - 1].pull
        turn = balance_shaft(d, c - 1, owed, lever * guide.by_tension, -lever * guide.by_in, turn)
    turns = cable.sign / cable.radius[OUT]
    carried = cable.ratio + turns * guide.stretch_by_in
    return Turn(carried * turn.owed, carried * turn.by_pull + turns * state.compliance)


@inner_kernel
def step_pulls(d: Drive, last: int, stride: int, count: int, sweep: int, settled: float) -> bool:
    """Newton's step of the trial pulls before the last stage; True if none goes farther than `settled`, a share of T0.

    All step together; if that does not end, or where there is but one, the first from the motor that is out of balance
    steps alone within its bracket, as one balance falls with its pull once all before it are met.
    """
    if count > 2 and sweep < TOGETHER:
        step = worst = 0.0
        for place in range(1, count):
            at = last - place * stride
            guide = d.guides[at]
            new = guide.pull + guide.step + d.states[at].share * step
            if stride == 1:
                new = max(new, 0.1 * guide.pull)  # a chain's cable is taut
            step = new - guide.pull
            guide.pull = new
            worst = max(worst, abs(step) / d.cables[at].T0)
        return worst <= settled
    lowest = 0.0 if stride == 1 else -FREE
    if sweep >= PATIENCE:
        settled = max(settled, ROUNDED)
    for place in range(count - 1, 0, -1):
        at = last - place * stride
        guide = d.guides[at]
        step, least = guide.step, settled * d.cables[at].T0
        new = guide.pull + step
        if step > 0.0:
            guide.low = guide.pull
        else:
            guide.high = guide.pull
        small = abs(step) <= least
        if not small and guide.low > -FREE and guide.high < FREE:
            if guide.high - guide.low <= least:  # an end was found while a drum's wrap was still off
                guide.low, guide.high = lowest, FREE
            elif not guide.low < new < guide.high or sweep % 4 == 3:
                new = 0.5 * (guide.low + guide.high)
        if stride == 1:
            new = max(new, 0.1 * guide.pull)  # a chain's cable is taut
        change = new - guide.pull
        for before in range(place, count):
            one = d.guides[last - before * stride]
            if before > place:
                change *= d.states[last - before * stride].share
                if not small:
                    one.low, one.high = lowest, FREE
            one.pull += change
        if not small:
            return False
    return True


@inner_kernel
def seat(d: Drive, first: int, count: int) -> None:
    """Take the trial pulls of a chain for its pending tensions."""
    for c in range(first, first + count - 1):
        d.states[c].tension = d.guides[c].pull
        d.states[c + 1].tension_in = d.guides[c].pull * d.cables[c + 1].scale / d.cables[c].scale


@inner_kernel
def raise_chain(d: Drive, first: int, count: int, step: float) -> None:
    """Raise the pending tensions of a chain behind guides as its output cable's rises by `step` [N] at the last."""
    for c in range(first + count - 1, first - 1, -1):
        state = d.states[c]
        state.tension += step
        if c > first:
            step *= d.states[c - 1].share
            state.tension_in += step * d.cables[c].scale / d.cables[c - 1].scale
        else:
            state.tension_in += step * d.guides[c].by_tension


@inner_kernel
def circuit_slopes(d: Drive, ic: int) -> Slopes:
    """Slopes of closed circuit `ic` of one stage at its pending solution.

    theta_h + theta_l = 0 and x = r/R x_in + theta_h (4-1), T_h = T_l + P (4-4), differentiated; where a cable is slack
    the other alone carries and positions.
    """
    circuit = d.circuits[ic]
    h, l_ = circuit.first[0], circuit.first[1]
    guide_h, guide_l = d.guides[h], d.guides[l_]
    weight_h, weight_l = d.cables[h].weight, d.cables[l_].weight
    ease_h, ease_l = weight_h * d.states[h].compliance, weight_l * d.states[l_].compliance
    in_h, in_l = weight_h * guide_h.stretch_by_in, weight_l * guide_l.stretch_by_in
    out_h, out_l = weight_h * guide_h.stretch_by_out, weight_l * guide_l.stretch_by_out
    h_by_pull, l_by_pull, h_by_in, l_by_in = 1.0, 0.0, 0.0, 0.0
    if d.states[l_].tension <= circuit.slack:
        own, carried = ease_h / (1.0 - out_h), (circuit.ratio + in_h) / (1.0 - out_h)
    elif d.states[h].tension <= circuit.slack:
        h_by_pull, l_by_pull = 0.0, -1.0
        own, carried = ease_l / (1.0 + out_l), (circuit.ratio - in_l) / (1.0 + out_l)
    else:
        ease, out = ease_h + ease_l, out_h + out_l
        scale = 1.0 / (ease * (out_h - 1.0) - ease_h * out)
        l_by_pull = ease_h * (out - (out_h - 1.0)) * scale
        own = ease_h * (ease_h - ease) * scale
        l_by_in = ((circuit.ratio + in_h) * out - (in_h + in_l) * (out_h - 1.0)) * scale
        carried = ((in_h + in_l) * ease_h - (circuit.ratio + in_h) * ease) * scale
        h_by_pull, h_by_in = 1.0 + l_by_pull, l_by_in
    passes = guide_h.by_tension * h_by_pull - guide_l.by_tension * l_by_pull
    holds = guide_l.by_tension * l_by_in + guide_l.by_in - guide_h.by_tension * h_by_in - guide_h.by_in
    return Slopes(own, carried, passes, holds)


@inner_kernel
def balance_circuit(d: Drive, ic: int, turn: Turn) -> Turn:
    """Take the shaft before closed circuit `ic` of one stage into its balance, and the circuit's own turn behind it."""
    slopes = circuit_slopes(d, ic)
    if ic > 0:
        h, l_ = d.circuits[ic].first[0], d.circuits[ic].first[1]
        before = d.circuits[ic - 1].first[0]
        lever = d.cables[h].radius[IN] / d.circuits[ic - 1].radius
        owed = lever * (d.states[h].tension_in - d.states[l_].tension_in) - d.guides[before].pull
        turn = balance_shaft(d, before, owed, lever * slopes.passes, lever * slopes.holds, turn)
    return Turn(slopes.carried * turn.owed, slopes.carried * turn.by_pull + slopes.own)
