"""The whole joint: circuits in series, terms of further physics, one step per sample.

`joint_solve` finds the joint under a load, `joint_commit` makes the solution the state; `observer/stepper.py` calls
both. `d` holds the joint's records by name (`records.py`); `laws` is None for a plain drive.
"""

from __future__ import annotations

import math

from cablecomp.mechanics.circuit import Solved, circuit_commit, circuit_solve
from cablecomp.mechanics.drive import Drive, Terms
from cablecomp.mechanics.jit import constant, inlined_kernel, inner_kernel
from cablecomp.mechanics.pretension import retension
from cablecomp.mechanics.profile import LEAST_WRAP, Floats
from cablecomp.mechanics.stages import SWEEPS, Turn, balance_circuit, foresee, step_pulls
from cablecomp.mechanics.status import STATUS_DIVERGED, STATUS_EFFECT, STATUS_OK, STATUS_SLACK, STATUS_UNWOUND
from cablecomp.mechanics.terms import balance, run_terms, show_tensions
from cablecomp.mechanics.together import solve_together

UNSETTLED, UNSETTLED_RAD = 1e-6, 1e-8
"""Share of the moments by which a row may miss its balance after all iterations, and how far its angle may still turn:
laws in tables jump by some 1e-9 rad where a bump is erased, and their moments never meet. Farther off it is refused."""
MOST_STRAIN = 1.0
"""Strain under the pretension alone above which no cable is one any more: what no effect may make of it."""
SETTLED_PULL = 1e-11
"""Last step of the pulls between circuits in series, as a share of T0, that is taken without a further look."""
AFRESH = constant(False)
"""Nothing was solved just now that the next solution is near to (for a plain False circuits are compiled twice)."""


@inner_kernel
def _distribute(d: Drive) -> None:
    """Hand the terms' lengths and stiffness factors to the cables at the joint (pretension factors: at commits)."""
    x = d.context
    last = d.size.circuits - 1
    for ic in range(last + 1):
        circuit = d.circuits[ic]
        for chain in range(circuit.chains):
            for j in range(circuit.count):
                state = d.states[circuit.first[chain] + j]
                if x.first:
                    state.pretension = x.pretension_h if chain == 0 else x.pretension_l
                if ic == last and j == circuit.count - 1:
                    state.stiffness = x.stiffness_h if chain == 0 else x.stiffness_l
                    state.offset = x.length_h if chain == 0 else x.length_l


@inlined_kernel
def _solve_all(d: Drive, laws: Floats, moment: float, again: bool) -> Solved:
    """The joint with `moment` [N m] on its output pulley, through all circuits from the motor outward; `again`: it is
    near what was solved just now."""
    circuits = d.size.circuits
    last = d.circuits[circuits - 1]
    angle = d.context.motor
    compliance = by_h = by_l = 0.0
    shared = False
    if laws is not None:
        shared = circuits > 1 and d.size.guides > 0
        if shared:
            pulled = d.states[last.first[0]].tension - d.states[last.first[1]].tension
            foresee(d, last.first[0], 2, circuits, moment / last.radius - pulled)
    for sweep in range(SWEEPS):
        angle = d.context.motor
        compliance = by_h = by_l = 0.0
        turn = Turn(0.0, 0.0)
        for ic in range(circuits):
            circuit = d.circuits[ic]
            state = d.states[circuit.first[0] + circuit.count - 1]
            guess = state.shaft if ic < circuits - 1 else d.context.joint
            bears = moment * circuit.share
            if laws is not None:
                if shared and ic < circuits - 1:
                    bears = d.guides[circuit.first[0]].pull * circuit.radius
            solved = circuit_solve(d, laws, ic, bears, angle, guess, again)
            angle = solved.angle
            if solved.status != STATUS_OK:
                return Solved(angle, compliance, solved.status, by_h, by_l)
            compliance = compliance * circuit.ratio * circuit.ratio + solved.compliance
            by_h, by_l = solved.by_h, solved.by_l
            if laws is not None:
                if shared:
                    turn = balance_circuit(d, ic, turn)
        if not shared:
            return Solved(angle, compliance, STATUS_OK, by_h, by_l)
        if laws is not None:
            compliance = turn.by_pull / last.radius
            if step_pulls(d, last.first[0], 2, circuits, sweep, SETTLED_PULL):
                return Solved(angle + turn.owed, compliance, STATUS_OK, by_h, by_l)
        again = True
    return Solved(angle, compliance, STATUS_DIVERGED, by_h, by_l)


@inlined_kernel
def joint_solve(d: Drive, terms: Terms, laws: Floats) -> int:
    """Joint angle under the context's load: with terms, the moment they take and the angle they see are solved
    together."""
    x = d.context
    load = x.load
    if d.size.terms == 0:
        solved = _solve_all(d, laws, load, AFRESH)
    else:
        solved = Solved(x.joint, 0.0, STATUS_DIVERGED, 0.0, 0.0)
        low, high = -1e300, 1e300
        slack = -1e300  # the largest trial moment that no open circuit can take
        followed = False
        excess = moved = 0.0
        again, settled = AFRESH, False
        run_terms(d, terms)
        if d.size.circuits == 1 and x.stiffness_follows == 0.0:
            guess = x.joint
            _distribute(d)
            solved = solve_together(d, terms, laws)
            if solved.status == STATUS_OK:
                x.joint = solved.angle
                x.compliance = solved.compliance
                return STATUS_OK
            x.joint = guess
            run_terms(d, terms)
        moment = load - x.moment
        for _ in range(60):
            _distribute(d)
            before_h, before_l = x.length_h, x.length_l
            stiff_h, stiff_l = x.stiffness_h, x.stiffness_l
            solved = _solve_all(d, laws, moment, again)
            again = solved.status == STATUS_OK
            if solved.status == STATUS_SLACK and load > moment:
                # a trial moment that no open circuit can take (a first guess of the acceleration): nearer to the load
                slack = low = max(low, moment)
                moment = 0.5 * (moment + load)
                continue
            if solved.status != STATUS_OK:
                break
            moved = solved.angle - x.joint
            x.joint = solved.angle
            show_tensions(d)
            run_terms(d, terms)
            excess = moment - (load - x.moment)
            scale = balance(d, moment)
            # settled, or nothing that the solve depends on has followed the angle
            same = x.length_h == before_h and x.length_l == before_l
            same = same and x.stiffness_h == stiff_h and x.stiffness_l == stiff_l
            if abs(excess) <= scale and (abs(moved) <= 1e-12 or same):
                settled = True
                break
            # lengths that follow the angle turn it further: on to where that ends (Steffensen's step)
            turn = solved.by_h * (x.length_h - before_h) + solved.by_l * (x.length_l - before_l)
            reach = 1.0
            if turn != 0.0:
                followed = True
                if abs(turn) < 0.95 * abs(moved):
                    reach = 1.0 / (1.0 - turn / moved)
                    x.joint += reach * turn
                    run_terms(d, terms)
                    excess = moment - (load - x.moment)
            if excess > 0.0:
                high = min(high, moment)
            else:
                low = max(low, moment)
            step = excess / (1.0 + x.moment_slope * solved.compliance * reach)
            if followed and abs(step) > 1e5 * (high - low):
                low, high = -1e300, 1e300  # an end found while the angle was still far off
            moment -= step
            if not low < moment < high and abs(excess) > 1e-9 * (abs(load) + 1e-9) and high - low < 1e299:
                moment = 0.5 * (low + high)
        if solved.status == STATUS_OK and not settled:
            if abs(excess) > UNSETTLED * (abs(load) + abs(moment)) + 1e-9 or abs(moved) > UNSETTLED_RAD:
                status = STATUS_SLACK if low == slack > -1e300 else STATUS_DIVERGED
                solved = Solved(solved.angle, solved.compliance, status, 0.0, 0.0)
    x.joint = solved.angle
    x.compliance = solved.compliance
    show_tensions(d)
    return solved.status


@inner_kernel
def advance(d: Drive, time: float, motor: float, load: float, temperature: float) -> None:
    """Write one sample's readings into the context."""
    x = d.context
    # first guess of the angle: along the last compliance
    x.joint += x.compliance * (load - x.load) + x.rigid * (motor - x.motor)
    x.dt = time - x.time
    x.time = time
    x.motor = motor
    x.load = load
    x.temperature = temperature
    x.commit = 0.0


@inlined_kernel
def _follow_pretension(d: Drive, laws: Floats) -> None:
    """Let the pretension of all cables follow the terms' factors; the next sample finds it."""
    x = d.context
    for ic in range(d.size.circuits):
        circuit = d.circuits[ic]
        for chain in range(circuit.chains):
            for j in range(circuit.count):
                retension(d, laws, circuit.first[chain] + j, x.pretension_h if chain == 0 else x.pretension_l)


@inner_kernel
def terms_sane(d: Drive, laws: Floats) -> bool:
    """True if the terms' answers are finite and all factors positive, and no pretension strains its cable by more than
    `MOST_STRAIN`; a pretension that moves needs law tables."""
    x = d.context
    if laws is None:
        if x.pretension_h != 1.0 or x.pretension_l != 1.0:
            return False
    elif x.pretension_h > 1.0 or x.pretension_l > 1.0:
        for c in range(d.size.cables):
            cable = d.cables[c]
            if not cable.T0 * max(x.pretension_h, x.pretension_l) <= MOST_STRAIN * cable.EA:
                return False
    sums = x.moment + x.length_h + x.length_l + x.reading + x.motor_moment
    factors = x.pretension_h + x.pretension_l + x.stiffness_h + x.stiffness_l
    positive = x.pretension_h > 0.0 and x.pretension_l > 0.0 and x.stiffness_h > 0.0 and x.stiffness_l > 0.0
    return positive and math.isfinite(sums) and math.isfinite(factors)


@inner_kernel
def joint_ready(d: Drive) -> int:
    """Whether the pending solution may become the state: cable left on every drum, every number finite,
    tensions positive.

    What commits write through (places along the profiles) is bounded by just these.
    """
    for wrap in range(2 * d.size.cables):
        step = d.steps[wrap]
        if not step.w > LEAST_WRAP:
            return STATUS_UNWOUND
        if not (0.0 < step.end_tau < 1e300 and abs(step.total) < 1e300):
            return STATUS_DIVERGED
    return STATUS_OK if abs(d.context.joint) < 1e300 else STATUS_DIVERGED


@inner_kernel
def strength_used(d: Drive) -> float:
    """Greatest share of its breaking force that any cable bears in the pending solution, or will once its pretension
    follows the terms' factor, which a commit leaves to the next sample; 0 where none is stated."""
    x = d.context
    worst = 0.0
    for c in range(d.size.cables):
        cable, state = d.cables[c], d.states[c]
        tension = max(state.tension, state.tension_in)
        if d.size.terms > 0:
            factor = x.pretension_h if cable.sign > 0.0 else x.pretension_l
            tension += max(cable.T0 * (factor - state.pretension), 0.0)
        worst = max(worst, cable.per_breaking * tension)
    return worst


@inner_kernel
def joint_commit(d: Drive, terms: Terms, laws: Floats) -> int:
    """Make the solved sample the state, unless a term's last word forbids it (the status says so)."""
    x = d.context
    if d.size.terms > 0:
        x.commit = 1.0
        run_terms(d, terms)
        x.commit = 0.0
        if not terms_sane(d, laws):
            return STATUS_EFFECT
    for ic in range(d.size.circuits):
        circuit_commit(d, laws, ic)
    if laws is not None:
        if d.size.terms > 0:
            _follow_pretension(d, laws)
    x.motor_old = x.motor
    x.load_old = x.load
    x.joint_older = x.joint_old
    x.joint_old = x.joint
    x.first = 0.0
    return STATUS_OK
