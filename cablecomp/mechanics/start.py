"""The first state of a joint: uniform pretension, or the extreme profiles that friction admits."""

from __future__ import annotations

import math

from cablecomp.mechanics.arc import arc_fill
from cablecomp.mechanics.drive import drive
from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.profile import LEAST_WRAP, Floats, Ints, wrap_fill
from cablecomp.mechanics.records import OUT
from cablecomp.mechanics.tables import v_of_tau
from cablecomp.mechanics.viscous import VISCOUS_TRAVEL, viscous_fill


@kernel
def joint_start(
    fixed: Floats,
    layout: Ints,
    memory: Floats,
    heights: Ints,
    laws: Floats,
    time: float,
    motor: float,
    slope: float,
) -> None:
    """Fill all wraps at the drive's position: u = 0 at every departure point, rising inward by `slope` * mu per radian.

    slope 0 = uniform T0; +1 and -1 = the highest and the lowest profile that friction admits at that end tension.
    """
    d = drive(fixed, layout, memory, heights)
    x = d.context
    x.time = time
    x.first = 1.0
    x.stiffness_follows = x.lengths_follow = x.moment_follows = 0.0
    x.motor = x.motor_old = motor
    angle = motor
    rigid = 1.0
    for ic in range(d.size.circuits):
        circuit = d.circuits[ic]
        for chain in range(circuit.chains):
            shaft = angle
            for c in range(circuit.first[chain], circuit.first[chain] + circuit.count):
                cable, state = d.cables[c], d.states[c]
                after = shaft * cable.ratio
                for end in range(2):
                    w = cable.wrap[end] + (cable.sign * after if end == OUT else -cable.sign * shaft)
                    wrap, law = 2 * c + end, cable.law[end]
                    w_kept, v = max(w, LEAST_WRAP), v_of_tau(laws, law, 1.0)
                    heights[wrap] = wrap_fill(d.profiles[wrap], laws, law, w_kept, v, -slope * cable.mu[end])
                    if d.size.grids > 0:
                        viscous_fill(d.grids[wrap], w_kept, max(cable.wrap[end] + VISCOUS_TRAVEL, w + 1.0))
                if d.size.stacks > 2 * d.size.cables:
                    arc = 2 * d.size.cables + c
                    heights[arc] = arc_fill(d.profiles[arc], laws, cable.guide, 0.0)
                state.shaft_in = shaft
                state.shaft = after
                state.pretension = state.stiffness = 1.0
                state.tension = state.tension_in = state.unloaded = cable.T0
                state.share = 0.5
                shaft = after
        angle *= circuit.ratio
        rigid *= circuit.ratio
    x.rigid = rigid
    x.joint = x.joint_old = x.joint_older = angle
    x.tension_h = x.tension_l = math.nan
