"""One cable of a stage: output drum, free span (with a guide, if any), input drum; stretch as a function of its tension."""

from __future__ import annotations

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.guide import guide_commit, guide_split
from cablecomp.mechanics.jit import inlined_kernel, kernel, leaf_kernel
from cablecomp.mechanics.profile import LEAST_WRAP, ROWS, B, Floats, Ints, wrap_commit, wrap_eval
from cablecomp.mechanics.tables import dv_dtau, strain_of_tau, v_of_tau
from cablecomp.mechanics.viscous import viscous_commit, viscous_eval


@inlined_kernel
def stacks(I: Ints, S: Floats) -> Floats:
    """All profiles as an array [stack, row, point]: 2c is cable c's output drum, 2c + 1 its input drum, guides follow."""
    wraps = I[o.N_STACKS]
    first = I[o.S_PROFILE]
    size = wraps * ROWS * I[o.CAPACITY]
    return S[first : first + size].reshape((wraps, ROWS, I[o.CAPACITY]))


@leaf_kernel
def law_of(P: Floats, p: int, end: int) -> int:
    """Which law table a wrap uses: 0, 1 = the joint's own drum in chain h, l; 2 = everything else."""
    if end == 1 or P[p + o.JOINT_DRUM] == 0.0:
        return 2
    return 0 if P[p + o.SIGN] > 0.0 else 1


@inlined_kernel
def drum_eval(
    P: Floats,
    I: Ints,
    S: Floats,
    J: Ints,
    L: Floats,
    G: Floats,
    c: int,
    end: int,
    tau: float,
    v: float,
    w: float,
) -> tuple[float, float, float]:
    """Integral of strain * EA/T0 over one drum's wrap at end value v, its derivatives by v and by the wrap angle; kept as pending.

    A solver's trial may unwind the drum: it is then taken to keep `LEAST_WRAP`, and `joint_ready` refuses it.
    """
    p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
    wrap = 2 * c + end
    mu = P[p + o.MU_OUT + end]
    m = I[o.S_MEET] + o.MEET * wrap
    S[m + o.M_W], S[m + o.M_END], S[m + o.M_TAU] = w, v, tau
    w = w if w > LEAST_WRAP else LEAST_WRAP
    if L is not None:
        if P[p + o.VISCOUS] > 0.0:
            return viscous_eval(P, I, S, c, end, w, tau, mu)
    total, slope, k, ym, vm, cm, bm, tm = wrap_eval(G, L, law_of(P, p, end), wrap, J[wrap], w, v, tau, mu)
    S[m + o.M_TOTAL], S[m + o.M_K], S[m + o.M_Y], S[m + o.M_V] = total, k, ym, vm
    S[m + o.M_C], S[m + o.M_B], S[m + o.M_E] = cm, bm, tm
    # where the cone cuts, turning by dw lowers the slipped part by mu dw
    turn = tau - 1.0 - (mu * slope if v > vm else -mu * slope) if slope > 0.0 else tau - 1.0
    return total, slope, turn


@inlined_kernel
def cable_eval(
    P: Floats,
    I: Ints,
    S: Floats,
    J: Ints,
    L: Floats,
    G: Floats,
    c: int,
    tension: float,
    x_in: float,
    x_out: float,
) -> tuple[float, float, float]:
    """Stretch [m] of cable c at output-side tension [N] and shaft angles [rad] beyond its stretch at T0, and its derivatives
    by the tension [m/N] and by the output shaft's angle [m/rad].

    With a guide in the path the input-side tension follows from the guide's friction and the material passed over it.
    """
    p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
    q = I[o.S_CABLE] + o.CABLE_STATE * c
    t0 = P[p + o.T0] * S[q + o.Q_T0] * S[q + o.Q_EA]
    unit = P[p + o.T0] * S[q + o.Q_T0] / P[p + o.EA]
    tau = tension / t0
    v = v_of_tau(L, 2, tau)
    dv = dv_dtau(L, 2, tau, v)
    e_span, a_span = strain_of_tau(L, 2, tau)
    length = P[p + o.LENGTH]
    total = turn = slope = 0.0
    ends = 2
    S[q + o.Q_TENSION] = S[q + o.Q_TENSION_IN] = tension
    if L is not None:
        if P[p + o.GUIDE] > 0.0:
            w_in = P[p + o.W_IN] - P[p + o.SIGN] * x_in
            total, slope, tau_in = guide_split(P, I, S, J, L, G, c, v, x_in, w_in)
            slope *= dv
            S[q + o.Q_TENSION_IN] = tau_in * t0
            length *= 0.5
            ends = 1
        else:
            play, d_play = span_play(P[p + o.PLAY_YIELD], S[q + o.Q_PLAY], tension - t0)
            S[q + o.Q_PLAY_TRY] = play
            total = length * P[p + o.PLAY_SHARE] * play / t0
            slope = length * P[p + o.PLAY_SHARE] * d_play
    total += length * e_span
    slope += length * a_span
    angle = P[p + o.SIGN] * x_out
    for end in range(ends):
        radius = P[p + o.R_OUT + end]
        e, a, by_angle = drum_eval(P, I, S, J, L, G, c, end, tau, v, P[p + o.W_OUT + end] + angle)
        total += radius * e
        slope += radius * a * dv
        if end == 0:
            turn = radius * by_angle
        angle = -P[p + o.SIGN] * x_in
    S[q + o.Q_STRETCH] = total * unit
    S[q + o.Q_COMPLIANCE] = slope * unit / t0
    return total * unit, slope * unit / t0, P[p + o.SIGN] * turn * unit


@kernel
def span_play(radius: float, z: float, x: float) -> tuple[float, float]:
    """Play operator of the given radius: output follows the input x once it leaves the play; (output, derivative by x)."""
    if radius <= 0.0:
        return 0.0, 0.0
    if x - radius > z:
        return x - radius, 1.0
    if x + radius < z:
        return x + radius, 1.0
    return z, 0.0


@kernel
def cable_commit(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats, c: int) -> None:
    """Make the last evaluation of cable c its state, and renew the bound on what merging has done to its stretch.

    In a closed circuit an error of the stretch moves the tensions against it, so the errors of later cable do not add to it.
    """
    p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
    q = I[o.S_CABLE] + o.CABLE_STATE * c
    first = 0
    if L is not None:
        S[q + o.Q_PLAY] = S[q + o.Q_PLAY_TRY]
        if P[p + o.GUIDE] > 0.0:
            guide_commit(I, S, J, G, c)
        if P[p + o.VISCOUS] > 0.0:
            viscous_commit(I, S, 2 * c)
            if P[p + o.GUIDE] == 0.0:
                viscous_commit(I, S, 2 * c + 1)
                return
            first = 1  # behind a guide the input drum slips without viscosity
    error = 0.0
    for end in range(first, 2):
        wrap = 2 * c + end
        m = I[o.S_MEET] + o.MEET * wrap
        meet = (
            S[m + o.M_TOTAL], 0.0, int(S[m + o.M_K]), S[m + o.M_Y], S[m + o.M_V], S[m + o.M_C], S[m + o.M_B],
            S[m + o.M_E],
        )  # fmt: skip
        w, v, tau = S[m + o.M_W], S[m + o.M_END], S[m + o.M_TAU]
        J[wrap] = wrap_commit(G, L, law_of(P, p, end), wrap, J[wrap], meet, w, v, tau, P[p + o.MERGE])
        error += P[p + (o.R_OUT if end == 0 else o.R_IN)] * G[wrap, B, J[wrap] - 1]
    S[q + o.Q_ERROR] = error * P[p + o.T0] / P[p + o.EA]
