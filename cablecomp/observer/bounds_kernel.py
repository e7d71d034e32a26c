"""Guaranteed bounds, compiled: the states of the lowest and the highest history on one chain of cables.

Two profiles L <= true <= U are kept on every wrap; both see the nominal shaft angles. The true joint angle lies within
eps of the nominal one and turns the wraps by as much, so L and U get their end values moved outward by mu eps.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.cable import law_of, stacks
from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.pretension import retension
from cablecomp.mechanics.profile import LEAST_WRAP, B, Floats, Ints, Y, wrap_commit, wrap_eval, wrap_fill
from cablecomp.mechanics.tables import TABLED, dv_dtau, strain_of_tau, tau_of_v, v_of_tau

Side: TypeAlias = tuple[Floats, Ints, Floats, float]
"""State, stack heights, profiles of one bound, and +1 for the upper, -1 for the lower one."""

# the bounds' own numbers W start with: greatest factor by which a law table steepens mu; least and greatest ln(T/T0) that
# any cable may have borne before
W_STEEP, W_PAST_LOW, W_PAST_HIGH, W_HEAD = range(4)
# one circuit: surplus and deficit of stretch [rad], tensions of cable l, the same pending; pull and input angle of the
# last step, 1 before the first
W_UP, W_LOW, W_T_LOW, W_T_HIGH, W_PENDING, W_PULL, W_X_IN, W_FIRST, W_CIRCUIT = (0, 1, 2, 3, 4, 8, 9, 10, 11)
# one cable: half width of its output shaft's angle; the same of the last and for the next step, factors and shaft angle of the last step
W_EPS, W_EPS_OLD, W_NEXT, W_T0, W_EA, W_TURN, W_CABLE = range(7)
MERGE = 1e-13  # error of v below which neighbours are merged; more only where memory runs out
EPS_START = 1e-4  # first guess of the half width of a shaft's angle


@kernel
def bounds_size(I: Ints) -> int:
    """Number of floats in W."""
    return int(W_HEAD + W_CIRCUIT * I[o.N_CIRCUITS] + W_CABLE * I[o.N_CABLES])


@kernel
def cable_block(I: Ints, c: int) -> int:
    """Where cable c's numbers lie in W."""
    return W_HEAD + W_CIRCUIT * I[o.N_CIRCUITS] + W_CABLE * c


def steepest(L: Floats | None) -> float:
    """Greatest factor by which a law table (None = plain) raises friction over mu, by place and by tension (e^-2..e^2)."""
    if L is None or L[0, 0, 0] != TABLED:
        return 1.0
    place = float(np.max(np.diff(L[:, 2]) / L[:, 0, 5:6]))
    u = L[0, 1]
    tension = float(np.max((np.diff(u) / L[0, 0, 2])[np.abs(u[1:]) < 2.0]))
    return max(place, 1.0) * max(tension, 1.0)


@kernel
def sides_start(P: Floats, I: Ints, L: Floats, W: Floats, SL: Floats, JL: Ints, SU: Floats, JU: Ints) -> None:
    """Fill all wraps of two started joints with the least and the greatest tension of the past; the first step cuts them
    to what friction admits."""
    W[W_HEAD:] = 0.0
    for c in range(I[o.N_CABLES]):
        W[cable_block(I, c) + W_EPS] = EPS_START
        p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
        for end in range(2):
            wrap, law = 2 * c + end, law_of(P, p, end)
            w = stacks(I, SL)[wrap, Y, JL[wrap] - 1]
            JL[wrap] = wrap_fill(
                stacks(I, SL), L, law, wrap, w, v_of_tau(L, law, math.exp(W[W_PAST_LOW])), 0.0
            )
            JU[wrap] = wrap_fill(
                stacks(I, SU), L, law, wrap, w, v_of_tau(L, law, math.exp(W[W_PAST_HIGH])), 0.0
            )
    for ic in range(I[o.N_CIRCUITS]):
        W[W_HEAD + W_CIRCUIT * ic + W_FIRST] = 1.0


@kernel
def side_follow(I: Ints, N: Floats, S: Floats, first: bool) -> None:
    """Take over stiffness factors and lengths of the nominal state N, at the first step its pretension factors too."""
    for c in range(I[o.N_CABLES]):
        q = I[o.S_CABLE] + o.CABLE_STATE * c
        S[q + o.Q_EA], S[q + o.Q_OFFSET] = N[q + o.Q_EA], N[q + o.Q_OFFSET]
        if first:
            S[q + o.Q_T0] = N[q + o.Q_T0]


@kernel
def side_retension(P: Floats, I: Ints, N: Floats, L: Floats, side: Side) -> None:
    """Bring one bound to the pretension that the nominal state N took on when it committed."""
    S, J, G, _ = side
    for c in range(I[o.N_CABLES]):
        retension(P, I, S, J, L, G, c, N[I[o.S_CABLE] + o.CABLE_STATE * c + o.Q_T0])


@kernel
def _cable(
    P: Floats,
    I: Ints,
    L: Floats,
    W: Floats,
    side: Side,
    c: int,
    tension: float,
    x_in: float,
    x_out: float,
    eps_in: float,
) -> tuple[float, float, float]:
    """Stretch [m] of cable c and its derivative by the tension, kept as pending; and the margin [m] that covers the cable
    between the possible departure points and what merging of pieces did."""
    S, J, G, sign = side
    p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
    q = I[o.S_CABLE] + o.CABLE_STATE * c
    t0 = P[p + o.T0] * S[q + o.Q_T0] * S[q + o.Q_EA]
    tau = tension / t0
    v = v_of_tau(L, 2, tau)
    e, a = strain_of_tau(L, 2, tau)
    dv = dv_dtau(L, 2, tau, v)
    total = P[p + o.LENGTH] * e
    slope = P[p + o.LENGTH] * a
    margin = 0.0
    for end in range(2):
        wrap = 2 * c + end
        mu = P[p + o.MU_OUT + end]
        w = P[p + o.W_OUT + end] + (P[p + o.SIGN] * x_out if end == 0 else -P[p + o.SIGN] * x_in)
        w = max(w, LEAST_WRAP)
        eps = W[cable_block(I, c) + W_EPS] if end == 0 else eps_in
        shift = mu * eps * W[W_STEEP]
        end_v = v + sign * shift
        end_tau = tau_of_v(L, 2, end_v)
        e_wrap, a_wrap, k, ym, vm, cm, bm, tm = wrap_eval(
            G, L, law_of(P, p, end), wrap, J[wrap], w, end_v, end_tau, mu
        )
        m = I[o.S_MEET] + o.MEET * wrap
        S[m + o.M_TOTAL], S[m + o.M_K], S[m + o.M_Y], S[m + o.M_V] = e_wrap, k, ym, vm
        S[m + o.M_C], S[m + o.M_B], S[m + o.M_E] = cm, bm, tm
        S[m + o.M_W], S[m + o.M_END], S[m + o.M_TAU] = w, end_v, end_tau
        radius = P[p + o.R_OUT + end]
        total += radius * e_wrap
        slope += radius * a_wrap * dv
        margin += radius * (eps * (abs(e) + 4.0 * shift * (1.0 + abs(e))) + 1.05 * G[wrap, B, J[wrap] - 1])
    unit = P[p + o.T0] * S[q + o.Q_T0] / P[p + o.EA]
    return total * unit - S[q + o.Q_OFFSET], slope * unit / t0, margin * unit


@kernel
def chain_bound(
    P: Floats, I: Ints, N: Floats, L: Floats, W: Floats, side: Side, first: int, count: int, tension: float, x_in: float,
    x_out: float, eps_in: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Rotation [rad] of a chain's output shaft in one bound's state, its derivative by the output tension, its margin.

    All wraps stand at the nominal state's shaft angles (N); S[Q_SHAFT] gets what this state adds to each shaft's angle.
    """
    S, _, _, _ = side
    theta = slope = margin = own = 0.0
    x, eps = x_in, eps_in
    for j in range(count):
        c = first + j
        p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
        q = I[o.S_CABLE] + o.CABLE_STATE * c
        shaft = x_out if j == count - 1 else N[q + o.Q_SHAFT]
        scale = P[p + o.SCALE]
        stretch, a, more = _cable(P, I, L, W, side, c, tension * scale, x, shaft, eps)
        theta += P[p + o.WEIGHT] * stretch
        slope += P[p + o.WEIGHT] * scale * a
        margin += P[p + o.WEIGHT] * more
        own = P[p + o.RATIO] * own + P[p + o.SIGN] * stretch / P[p + o.R_OUT]
        S[q + o.Q_SHAFT] = own
        x, eps = shaft, W[cable_block(I, c) + W_EPS]
    return theta, slope, margin


@kernel
def chain_turning(
    P: Floats, I: Ints, S: Floats, L: Floats, W: Floats, first: int, count: int
) -> tuple[float, float, float]:
    """Out of a state's pending evaluation: rotation [rad] of the chain's output per rad by which output wraps are turned,
    at most; the same for a shift of all end values by mu per rad; and its greatest compliance [rad/N]."""
    turning = shifting = compliance = 0.0
    for j in range(count):
        c = first + j
        p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
        q = I[o.S_CABLE] + o.CABLE_STATE * c
        unit = P[p + o.T0] * S[q + o.Q_T0] / P[p + o.EA] * P[p + o.WEIGHT]
        soft = P[p + o.LENGTH]
        for end in range(2):
            m = I[o.S_MEET] + o.MEET * (2 * c + end)
            mu = P[p + o.MU_OUT + end] * W[W_STEEP]
            radius = P[p + o.R_OUT + end]
            slid = unit * radius * mu * (S[m + o.M_TOTAL] + S[m + o.M_W])
            shifting += slid
            turning += slid + unit * radius * abs(S[m + o.M_TAU] - 1.0)
            soft += radius * W[W_STEEP] * math.expm1(mu * S[m + o.M_W]) / mu
        compliance += soft * unit / (P[p + o.T0] * S[q + o.Q_T0] * S[q + o.Q_EA]) * P[p + o.SCALE]
    return turning, shifting, compliance


@kernel
def chain_commit(P: Floats, I: Ints, L: Floats, side: Side, first: int, count: int) -> None:
    """Make the last evaluation of a chain its bound's state."""
    S, J, G, _ = side
    for c in range(first, first + count):
        p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
        for end in range(2):
            wrap = 2 * c + end
            m = I[o.S_MEET] + o.MEET * wrap
            meet = (
                S[m + o.M_TOTAL], 0.0, int(S[m + o.M_K]), S[m + o.M_Y], S[m + o.M_V], S[m + o.M_C], S[m + o.M_B],
                S[m + o.M_E],
            )  # fmt: skip
            J[wrap] = wrap_commit(
                G,
                L,
                law_of(P, p, end),
                wrap,
                J[wrap],
                meet,
                S[m + o.M_W],
                S[m + o.M_END],
                S[m + o.M_TAU],
                MERGE,
            )
