"""A circuit and the terms beside it solved together, where the terms' moment and lengths follow the joint's angle.

What a term takes out of the load path turns with the angle that the cables come to: an inertia, a weight, a bearing;
so does the cable that a pulley beside its centre winds up. Newton's method on all three balances at once (T_l, the
joint's angle, the moment on the drum) evaluates the cables once a step; to settle them anew for every trial moment, as
is done where a stiffness follows the angle as well (`joint.py`), takes about twice as many evaluations. The cables keep
the lengths that they were handed: what lengths grow by meanwhile turns the joint as it is, -weight times that.
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
TOLD = 1e-9  # turn [rad] from which on a length's growth with it is told from rounding


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
    # what the lengths grow by turns the chains, and that with the angle; the angle at which it was looked at
    turned_h = turned_l = by_angle_h = by_angle_l = 0.0
    looked = angle
    weight_h, weight_l = d.cables[first_h + count - 1].weight, d.cables[first_l + count - 1].weight
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
        # else the terms are looked at again at the end alone
        follows = x.moment_follows != 0.0 or x.lengths_follow != 0.0
        if follows:
            show_tensions(d)
            run_terms(d, terms)
            now_h, now_l = weight_h * (length_h - x.length_h), weight_l * (length_l - x.length_l)
            if abs(angle - looked) > TOLD:
                by_angle_h, by_angle_l = (
                    (now_h - turned_h) / (angle - looked),
                    (now_l - turned_l) / (angle - looked),
                )
                looked = angle
            turned_h, turned_l = now_h, now_l
        excess = moment - (x.load - x.moment)
        slope = x.moment_slope
        # off: the cables' turn less the angle; gap: between the two chains. The moment's step is put in
        eased, softer = on_h.compliance * excess / radius, on_h.compliance * slope / radius
        off = rigid + on_h.theta + turned_h - angle - eased
        by_angle = on_h.by_shaft + by_angle_h - 1.0 - softer
        step, turn, compliance = 0.0, -off / by_angle, on_h.compliance / radius
        if closed:
            gap = on_h.theta + turned_h + on_l.theta + turned_l - eased
            by_tension = on_h.compliance + on_l.compliance
            by_shaft = on_h.by_shaft + by_angle_h + on_l.by_shaft + by_angle_l - softer
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
            if not follows and (x.length_h != length_h or x.length_l != length_l):
                x.lengths_follow = 1.0
                done = False
            elif nudged:
                missed = weight_h * (length_h - x.length_h) - turned_h - by_angle_h * turn
                missed_l = weight_l * (length_l - x.length_l) - turned_l - by_angle_l * turn
                done = done and abs(missed) <= settled and abs(missed_l) <= settled
        if (done or follows or nudged) and not (
            x.stiffness_h == stiffness_h and x.stiffness_l == stiffness_l
        ):
            x.stiffness_follows = 1.0
            return nowhere
        if done:
            show_tensions(d)
            return Solved(angle, compliance, STATUS_OK, 0.0, 0.0)
    return nowhere
