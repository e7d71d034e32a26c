"""The whole joint: circuits in series, terms of further physics, one step per sample."""

from __future__ import annotations

import math

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.circuit import circuit_commit, circuit_solve
from cablecomp.mechanics.jit import inlined_kernel, kernel, leaf_kernel
from cablecomp.mechanics.pointer import call_term
from cablecomp.mechanics.pretension import retension
from cablecomp.mechanics.profile import LEAST_WRAP, Floats, Ints


@kernel
def run_terms(P: Floats, I: Ints, S: Floats) -> None:
    """Let every term add its part to the context."""
    x = I[o.S_CONTEXT]
    S[x + o.X_MOMENT : x + o.X_LENGTH_L + 1] = 0.0
    S[x + o.X_PRETENSION_H : x + o.X_STIFFNESS_L + 1] = 1.0
    S[x + o.X_READING] = 0.0
    S[x + o.X_MOTOR_MOMENT] = 0.0
    context = S[x : x + o.CONTEXT]
    for k in range(I[o.N_TERMS]):
        t = o.HEADER + o.CIRCUIT * I[o.N_CIRCUITS] + o.TERM * k
        call_term(I[t], context, P[I[t + o.T_PARAMETER] :], S[I[t + o.T_STATE] :])


@kernel
def _distribute(I: Ints, S: Floats) -> None:
    """Hand the terms' lengths and stiffness factors to the cables at the joint (pretension factors: at commits)."""
    x = I[o.S_CONTEXT]
    last = I[o.N_CIRCUITS] - 1
    for ic in range(last + 1):
        h = o.HEADER + o.CIRCUIT * ic
        count = I[h + o.C_COUNT]
        for chain in range(1 + I[h + o.C_CLOSED]):
            first = I[h] if chain == 0 else I[h + o.C_FIRST_L]
            for j in range(count):
                q = I[o.S_CABLE] + o.CABLE_STATE * (first + j)
                if S[x + o.X_FIRST] != 0.0:
                    S[q + o.Q_T0] = S[x + o.X_PRETENSION_H + chain]
                if ic == last and j == count - 1:
                    S[q + o.Q_EA] = S[x + o.X_STIFFNESS_H + chain]
                    S[q + o.Q_OFFSET] = S[x + o.X_LENGTH_H + chain]


@inlined_kernel
def _solve_all(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats, moment: float
) -> tuple[float, float, int]:
    """Joint angle and compliance with `moment` on the output pulley, through all circuits from the motor outward."""
    x_context = I[o.S_CONTEXT]
    x = S[x_context + o.X_MOTOR]
    total = 0.0
    for ic in range(I[o.N_CIRCUITS]):
        j = o.JOINT * ic
        h = o.HEADER + o.CIRCUIT * ic
        q = I[o.S_CABLE] + o.CABLE_STATE * (I[h] + I[h + o.C_COUNT] - 1)
        guess = S[q + o.Q_SHAFT] if ic < I[o.N_CIRCUITS] - 1 else S[x_context + o.X_JOINT]
        n = P[j + o.J_MOMENT]
        x_out, compliance, status = circuit_solve(P, I, S, J, L, G, ic, moment * n, x, guess)
        if status != o.STATUS_OK:
            return x_out, total, status
        total = total * P[j + o.J_RATIO] * P[j + o.J_RATIO] + compliance
        x = x_out
    return x, total, o.STATUS_OK


@inlined_kernel
def joint_solve(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats) -> int:
    """Joint angle under the context's load: with terms, the moment they take and the angle they see are solved together."""
    x = I[o.S_CONTEXT]
    load = S[x + o.X_LOAD]
    h = o.HEADER + o.CIRCUIT * (I[o.N_CIRCUITS] - 1)
    qh = I[o.S_CABLE] + o.CABLE_STATE * (I[h] + I[h + o.C_COUNT] - 1)
    ql = I[o.S_CABLE] + o.CABLE_STATE * (I[h + o.C_FIRST_L] + I[h + o.C_COUNT] - 1)
    if I[o.N_TERMS] == 0:
        joint, compliance, status = _solve_all(P, I, S, J, L, G, load)
    else:
        moment = load
        joint = S[x + o.X_JOINT]
        compliance = 0.0
        status = o.STATUS_DIVERGED
        low, high = -1e300, 1e300
        run_terms(P, I, S)
        moment = load - S[x + o.X_MOMENT]
        for _ in range(60):
            _distribute(I, S)
            before_slope, before_h, before_l = (
                S[x + o.X_MOMENT_SLOPE], S[x + o.X_LENGTH_H], S[x + o.X_LENGTH_L]
            )  # fmt: skip
            joint, compliance, status = _solve_all(P, I, S, J, L, G, moment)
            if status == o.STATUS_SLACK and load > moment:
                # a trial moment that no open circuit can take (a first guess of the acceleration): nearer to the load
                low = max(low, moment)
                moment = 0.5 * (moment + load)
                continue
            if status != o.STATUS_OK:
                break
            moved = abs(joint - S[x + o.X_JOINT])
            S[x + o.X_JOINT] = joint
            S[x + o.X_TENSION_H] = S[qh + o.Q_TENSION]
            S[x + o.X_TENSION_L] = S[ql + o.Q_TENSION] if I[h + o.C_CLOSED] == 1 else math.nan
            run_terms(P, I, S)
            excess = moment - (load - S[x + o.X_MOMENT])
            scale = 1e-12 * (abs(load) + abs(moment)) + 1e-15
            # settled, or nothing that the solve depends on has followed the angle
            same = S[x + o.X_LENGTH_H] == before_h and S[x + o.X_LENGTH_L] == before_l
            if abs(excess) <= scale and (moved <= 1e-12 or (same and before_slope == 0.0)):
                break
            if excess > 0.0:
                high = min(high, moment)
            else:
                low = max(low, moment)
            moment -= excess / (1.0 + S[x + o.X_MOMENT_SLOPE] * compliance)
            if not low < moment < high and abs(excess) > 1e-9 * (abs(load) + 1e-9) and high - low < 1e299:
                moment = 0.5 * (low + high)
    S[x + o.X_JOINT] = joint
    S[x + o.X_COMPLIANCE] = compliance
    S[x + o.X_TENSION_H] = S[qh + o.Q_TENSION]
    S[x + o.X_TENSION_L] = S[ql + o.Q_TENSION] if I[h + o.C_CLOSED] == 1 else math.nan
    return status


@kernel
def advance(
    P: Floats, I: Ints, S: Floats, time: float, motor: float, load: float, temperature: float
) -> None:
    """Write one sample's readings into the context."""
    x = I[o.S_CONTEXT]
    # first guess of the angle: along the last compliance
    S[x + o.X_JOINT] += S[x + o.X_COMPLIANCE] * (load - S[x + o.X_LOAD]) + S[x + o.X_RIGID] * (
        motor - S[x + o.X_MOTOR]
    )
    S[x + o.X_DT] = time - S[x + o.X_TIME]
    S[x + o.X_TIME] = time
    S[x + o.X_MOTOR] = motor
    S[x + o.X_LOAD] = load
    S[x + o.X_TEMPERATURE] = temperature
    S[x + o.X_COMMIT] = 0.0


@kernel
def _follow_pretension(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats) -> None:
    """Let the pretension of all cables follow the terms' factors; the next sample finds it."""
    x = I[o.S_CONTEXT]
    for ic in range(I[o.N_CIRCUITS]):
        h = o.HEADER + o.CIRCUIT * ic
        for chain in range(1 + I[h + o.C_CLOSED]):
            first = I[h] if chain == 0 else I[h + o.C_FIRST_L]
            for j in range(I[h + o.C_COUNT]):
                retension(P, I, S, J, L, G, first + j, S[x + o.X_PRETENSION_H + chain])


@kernel
def terms_sane(I: Ints, S: Floats) -> bool:
    """True if the terms' answers are finite and all factors positive."""
    x = I[o.S_CONTEXT]
    total = S[x + o.X_MOMENT] + S[x + o.X_LENGTH_H] + S[x + o.X_LENGTH_L] + S[x + o.X_READING]
    total += S[x + o.X_MOTOR_MOMENT]
    for k in range(x + o.X_PRETENSION_H, x + o.X_STIFFNESS_L + 1):
        total += S[k]
        if not S[k] > 0.0:
            return False
    return math.isfinite(total)


@leaf_kernel
def joint_ready(I: Ints, S: Floats) -> int:
    """Whether the pending solution may become the state: cable left on every drum, every number finite, tensions positive.

    What commits write through (places along the profiles) is bounded by just these.
    """
    m = I[o.S_MEET]
    for _ in range(2 * I[o.N_CABLES]):
        if not S[m + o.M_W] > LEAST_WRAP:
            return o.STATUS_UNWOUND
        if not (0.0 < S[m + o.M_TAU] < 1e300 and abs(S[m + o.M_TOTAL]) < 1e300):
            return o.STATUS_DIVERGED
        m += o.MEET
    return o.STATUS_OK if abs(S[I[o.S_CONTEXT] + o.X_JOINT]) < 1e300 else o.STATUS_DIVERGED


@leaf_kernel
def strength_used(P: Floats, I: Ints, S: Floats) -> float:
    """Greatest share of its breaking force that any cable bears in the pending solution; 0 where none is stated."""
    worst = 0.0
    for c in range(I[o.N_CABLES]):
        per_breaking = P[o.JOINT * I[o.N_CIRCUITS] + o.CABLE * c + o.PER_BREAKING]
        q = I[o.S_CABLE] + o.CABLE_STATE * c
        worst = max(worst, per_breaking * max(S[q + o.Q_TENSION], S[q + o.Q_TENSION_IN]))
    return worst


@kernel
def joint_commit(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats) -> int:
    """Make the solved sample the state, unless a term's last word forbids it (the status says so)."""
    x = I[o.S_CONTEXT]
    if I[o.N_TERMS] > 0:
        S[x + o.X_COMMIT] = 1.0
        run_terms(P, I, S)
        S[x + o.X_COMMIT] = 0.0
        if not terms_sane(I, S):
            return o.STATUS_EFFECT
    for ic in range(I[o.N_CIRCUITS]):
        circuit_commit(P, I, S, J, L, G, ic)
    if I[o.N_TERMS] > 0:
        _follow_pretension(P, I, S, J, L, G)
    S[x + o.X_MOTOR_OLD] = S[x + o.X_MOTOR]
    S[x + o.X_LOAD_OLD] = S[x + o.X_LOAD]
    S[x + o.X_JOINT_OLDER] = S[x + o.X_JOINT_OLD]
    S[x + o.X_JOINT_OLD] = S[x + o.X_JOINT]
    S[x + o.X_FIRST] = 0.0
    return o.STATUS_OK
