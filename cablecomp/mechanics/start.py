"""The first state of a joint: uniform pretension, or the extreme profiles that friction admits."""

from __future__ import annotations

import math

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.arc import arc_fill
from cablecomp.mechanics.cable import law_of, stacks
from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.profile import LEAST_WRAP, Floats, Ints, wrap_fill
from cablecomp.mechanics.tables import v_of_tau
from cablecomp.mechanics.viscous import viscous_fill

VISCOUS_TRAVEL = 4.0  # rotation [rad] beyond position zero that the viscous grid covers


@kernel
def joint_start(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, time: float, motor: float, slope: float
) -> None:
    """Fill all wraps at the drive's position: u = 0 at every departure point, rising inward by `slope` * mu per radian.

    slope 0 = uniform T0; +1 and -1 = the highest and the lowest profile that friction admits at that end tension.
    """
    x = I[o.S_CONTEXT]
    S[x + o.X_TIME] = time
    S[x + o.X_FIRST] = 1.0
    S[x + o.X_MOTOR] = motor
    S[x + o.X_MOTOR_OLD] = motor
    G = stacks(I, S)
    angle = motor
    rigid = 1.0
    for ic in range(I[o.N_CIRCUITS]):
        h = o.HEADER + o.CIRCUIT * ic
        count = I[h + o.C_COUNT]
        for chain in range(1 + I[h + o.C_CLOSED]):
            first = I[h] if chain == 0 else I[h + o.C_FIRST_L]
            shaft = angle
            for j in range(count):
                c = first + j
                p = o.JOINT * I[o.N_CIRCUITS] + o.CABLE * c
                q = I[o.S_CABLE] + o.CABLE_STATE * c
                after = shaft * P[p + o.RATIO]
                for end in range(2):
                    w = (
                        P[p + o.W_OUT] + P[p + o.SIGN] * after
                        if end == 0
                        else P[p + o.W_IN] - P[p + o.SIGN] * shaft
                    )
                    mu = P[p + o.MU_OUT] if end == 0 else P[p + o.MU_IN]
                    law = law_of(P, p, end)
                    v = v_of_tau(L, law, 1.0)
                    J[2 * c + end] = wrap_fill(G, L, law, 2 * c + end, max(w, LEAST_WRAP), v, -slope * mu)
                    if I[o.NODES] > 0:
                        reach = P[p + o.W_OUT + end] + VISCOUS_TRAVEL
                        viscous_fill(I, S, 2 * c + end, max(w, LEAST_WRAP), max(reach, w + 1.0))
                if I[o.N_STACKS] > 2 * I[o.N_CABLES]:
                    arc = 2 * I[o.N_CABLES] + c
                    J[arc] = arc_fill(G, arc, P[p + o.GUIDE], 0.0)
                S[q + o.Q_SHAFT_IN] = shaft
                S[q + o.Q_SHAFT] = after
                S[q + o.Q_T0] = 1.0
                S[q + o.Q_EA] = 1.0
                S[q + o.Q_TENSION] = P[p + o.T0]
                S[q + o.Q_TENSION_IN] = P[p + o.T0]
                S[q + o.Q_KEPT] = P[p + o.T0]
                S[q + o.Q_REFERENCE] = 0.5 if I[h + o.C_CLOSED] == 1 else P[p + o.T0]
                shaft = after
        angle *= P[o.JOINT * ic + o.J_RATIO]
        rigid *= P[o.JOINT * ic + o.J_RATIO]
    S[x + o.X_RIGID] = rigid
    S[x + o.X_JOINT] = angle
    S[x + o.X_JOINT_OLD] = angle
    S[x + o.X_JOINT_OLDER] = angle
    S[x + o.X_TENSION_H] = math.nan
    S[x + o.X_TENSION_L] = math.nan
