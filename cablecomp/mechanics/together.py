"""A circuit and the terms beside it solved together, where nothing but the terms' moment follows the joint's angle.

What a term takes out of the load path turns with the angle that the cables come to: an inertia, a weight, a bearing.
Newton's method on all three balances at once (T_l, the joint's angle, the moment on the drum) evaluates the cables once
a step; to settle them anew for every trial moment, as is done where lengths or stiffness follow the angle as well
(`joint.py`), takes about twice as many evaluations.
"""

from __future__ import annotations

from cablecomp.mechanics.circuit import Chain, Solved, chain_eval, pass_on, settled_at
from cablecomp.mechanics.drive import Drive, Terms
from cablecomp.mechanics.jit import inner_kernel
from cablecomp.mechanics.nudge import SMALL, cable_nudge
from cablecomp.mechanics.profile import Floats
from cablecomp.mechanics.status import STATUS_DIVERGED, STATUS_OK
from cablecomp.mechanics.terms import balance, run_terms, show_tensions

MOST = 10  # steps; where a kink keeps them from settling, the bracketed way does


@inner_kernel
def solve_together(d: Drive, terms: Terms, laws: Floats) -> Solved:
    """The joint's only circuit under the context's load, from the context's angle and with the terms run there.

    STATUS_DIVERGED: not found this way, and nothing said of whether there is a solution.
    """
    x = d.context
    circuit = d.circuits[0]
    first_h, first_l, count = circuit.first[0], circuit.first[1], circuit.count
    closed = circuit.chains == 2
    radius, floor = circuit.radius, circuit.slack
    rigid = circuit.ratio * x.motor
    angle = x.joint
    moment = x.load - x.moment
    length_h, length_l, stiffness_h, stiffness_l = x.length_h, x.length_l, x.stiffness_h, x.stiffness_l
    last_l = d.states[first_l + count - 1]
    unit = d.cables[first_l + count - 1].T0
    if x.moment_slope * x.compliance > 1.0:
        # what a first guess of the angle makes of the terms is far off: as it was, and what came on
        before = last_l.tension if closed else unit * last_l.pretension
        moment = radius * (d.states[first_h + count - 1].tension - before) + x.load - x.load_old
    pull = moment / radius
    tension = unit * last_l.pretension
    if closed:
        tension = last_l.unloaded - last_l.share * pull + last_l.miss
    settled = settled_at(d)
    on_h = on_l = Chain(0.0, 0.0, 0.0)
    nowhere = Solved(angle, 0.0, STATUS_DIVERGED, 0.0, 0.0)
    for _ in range(MOST):
        if not (tension > floor and tension + pull > floor):
            return nowhere
        for chain in range(circuit.chains):
            first, here = (first_h, tension + pull) if chain == 0 else (first_l, tension)
            evaluated = chain_eval(d, laws, first, count, here, x.motor, angle)
            if chain == 0:
                on_h = evaluated
            else:
                on_l = evaluated
        x.joint = angle
        if x.moment_slope != 0.0:
            x.moment_follows = 1.0
        follows = x.moment_follows != 0.0  # else the terms are looked at again at the end alone
        if follows:
            show_tensions(d)
            run_terms(d, terms)
        excess = moment - (x.load - x.moment)
        slope = x.moment_slope
        # off: the cables' turn less the angle; gap: between the two chains. The moment's step is put in
        eased, softer = on_h.compliance * excess / radius, on_h.compliance * slope / radius
        off = rigid + on_h.theta - angle - eased
        by_angle = on_h.by_shaft - 1.0 - softer
        step, turn, compliance = 0.0, -off / by_angle, on_h.compliance / radius
        if closed:
            gap = on_h.theta + on_l.theta - eased
            by_tension, by_shaft = on_h.compliance + on_l.compliance, on_h.by_shaft + on_l.by_shaft - softer
            scale = 1.0 / (by_tension * by_angle - on_h.compliance * by_shaft)
            step = (off * by_shaft - gap * by_angle) * scale
            turn = (gap * on_h.compliance - off * by_tension) * scale
            compliance = on_h.compliance * on_l.compliance / by_tension / radius
        raised = -(excess + slope * turn)
        pulled = step + raised / radius
        near = max(balance(d, moment), settled * unit * radius)
        small = abs(step) <= settled * unit and abs(turn) <= settled
        done = small and abs(raised) <= near
        nudged = False
        if not done and laws is None and count == 1 and abs(turn) <= SMALL:
            if abs(step) <= SMALL * tension and abs(pulled) <= SMALL * (tension + pull):
                nudged = cable_nudge(d, first_h, pulled, turn)
                nudged = nudged and (not closed or cable_nudge(d, first_l, step, turn))
        if done:
            pass_on(d, laws, first_h, count, pulled)
            if closed:
                pass_on(d, laws, first_l, count, step)
        angle += turn
        tension += step
        moment += raised
        pull = moment / radius
        if nudged or (done and not follows):
            x.joint = angle
            show_tensions(d)
            run_terms(d, terms)
            done = abs(moment - (x.load - x.moment)) <= near
        if done or follows or nudged:
            same = x.length_h == length_h and x.length_l == length_l
            if not (same and x.stiffness_h == stiffness_h and x.stiffness_l == stiffness_l):
                x.lengths_follow = 1.0
                return nowhere
        if done:
            return Solved(angle, compliance, STATUS_OK, 0.0, 0.0)
    return nowhere
