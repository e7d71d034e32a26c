"""Compiled steps of the observer: readings in, solved joint out; the same code for one sample and for a block."""

from __future__ import annotations

import math

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.cable import stacks
from cablecomp.mechanics.jit import inlined_kernel, kernel, leaf_kernel
from cablecomp.mechanics.joint import (
    advance,
    joint_commit,
    joint_ready,
    joint_solve,
    strength_used,
    terms_sane,
)
from cablecomp.mechanics.profile import Floats, Ints, copy_floats

# one row of inputs
IN_TIME, IN_MOTOR, IN_LOAD, IN_JOINT, IN_TEMPERATURE, IN_OTHER = range(6)
# one row of outputs
(
    OUT_JOINT, OUT_DRIVE, OUT_LOAD, OUT_T_H, OUT_T_L, OUT_COMPLIANCE, OUT_T_H_IN, OUT_T_L_IN, OUT_MOTOR_TORQUE,
    OUT_STRENGTH, OUT_WIDTH,
) = range(11)  # fmt: skip


@leaf_kernel
def smooth(P: Floats, I: Ints, S: Floats, dt: float, motor: float, load: float) -> tuple[float, float]:
    """Causal input filter: an alpha-beta tracker of value and slope, critically damped; it follows ramps without lag.

    Uneven steps are exact in the gains; off at cutoff 0.
    """
    cutoff = P[I[o.P_SENSOR] + o.CUTOFF]
    f = I[o.S_FILTER]
    if cutoff <= 0.0:
        return motor, load
    if S[f + o.STARTED] == 0.0:
        S[f + o.STARTED] = 1.0
        S[f + o.MOTOR_1], S[f + o.LOAD_1] = motor, load
        S[f + o.MOTOR_2] = S[f + o.LOAD_2] = 0.0
        return motor, load
    if dt <= 0.0:
        return S[f + o.MOTOR_1], S[f + o.LOAD_1]
    keep = math.exp(-cutoff * dt)
    follow, turn = 1.0 - keep * keep, (1.0 - keep) * (1.0 - keep) / dt
    miss = motor - (S[f + o.MOTOR_1] + S[f + o.MOTOR_2] * dt)
    S[f + o.MOTOR_1], S[f + o.MOTOR_2] = motor - (1.0 - follow) * miss, S[f + o.MOTOR_2] + turn * miss
    miss = load - (S[f + o.LOAD_1] + S[f + o.LOAD_2] * dt)
    S[f + o.LOAD_1], S[f + o.LOAD_2] = load - (1.0 - follow) * miss, S[f + o.LOAD_2] + turn * miss
    return S[f + o.MOTOR_1], S[f + o.LOAD_1]


@leaf_kernel
def admissible(I: Ints, S: Floats, J: Ints, row: Floats) -> int:
    """Whether a row of readings can be taken at all: started state, finite readings, time that does not run backwards."""
    if J[0] < 2:
        return o.STATUS_UNKNOWN
    if not (math.isfinite(row[IN_MOTOR]) and math.isfinite(row[IN_LOAD]) and math.isfinite(row[IN_TIME])):
        return o.STATUS_NAN
    for j in range(IN_TEMPERATURE, row.shape[0]):
        if math.isinf(row[j]):
            return o.STATUS_NAN
    return o.STATUS_OK if row[IN_TIME] >= S[I[o.S_CONTEXT] + o.X_TIME] else o.STATUS_BACKWARD


@inlined_kernel
def motor_side(P: Floats, I: Ints, S: Floats, out: Floats) -> None:
    """Tensions at the input pulley (NaN for a cable that is not there) and the torque that turns it.

    tau_motor = -r (T_h - T_l) + what friction before the cable takes, both tensions at the input pulley.
    """
    h = o.HEADER
    first = I[h + o.C_FIRST_H]
    q = I[o.S_CABLE] + o.CABLE_STATE * first
    pull = S[q + o.Q_TENSION_IN]
    out[OUT_T_H_IN] = pull
    out[OUT_T_L_IN] = math.nan
    if I[h + o.C_CLOSED] == 1:
        q = I[o.S_CABLE] + o.CABLE_STATE * I[h + o.C_FIRST_L]
        out[OUT_T_L_IN] = S[q + o.Q_TENSION_IN]
        pull -= S[q + o.Q_TENSION_IN]
    radius = P[o.JOINT * I[o.N_CIRCUITS] + o.CABLE * first + o.R_IN]
    out[OUT_MOTOR_TORQUE] = -radius * pull + S[I[o.S_CONTEXT] + o.X_MOTOR_MOMENT]


@inlined_kernel
def predict(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats, row: Floats, out: Floats) -> int:
    """Solve the joint for one row of readings without committing it; `out` gets the outputs. Returns a status.

    The scalar state is left pending in any case: whoever commits nothing puts it back (`keep`, `put_back`).
    """
    status = admissible(I, S, J, row)
    if status != o.STATUS_OK:
        return status
    x = I[o.S_CONTEXT]
    raw = (row[IN_LOAD] - P[I[o.P_SENSOR] + o.OFFSET]) / P[I[o.P_SENSOR] + o.GAIN]
    dt = row[IN_TIME] - S[x + o.X_TIME]
    motor, load = smooth(P, I, S, dt, row[IN_MOTOR], raw)
    advance(P, I, S, row[IN_TIME], motor, load, row[IN_TEMPERATURE])
    for j in range(row.shape[0] - IN_OTHER):
        S[x + o.X_OTHER + j] = row[IN_OTHER + j]
    status = joint_solve(P, I, S, J, L, G)
    ready = joint_ready(I, S)
    if status == o.STATUS_OK or (status == o.STATUS_DIVERGED and ready == o.STATUS_UNWOUND):
        status = ready
    if I[o.N_TERMS] > 0 and not terms_sane(I, S):
        status = o.STATUS_EFFECT
    drive = S[x + o.X_JOINT] + S[x + o.X_RIGID] * (row[IN_MOTOR] - motor)
    out[OUT_DRIVE] = drive
    out[OUT_JOINT] = drive + S[x + o.X_READING]
    out[OUT_LOAD] = row[IN_LOAD]
    out[OUT_T_H] = S[x + o.X_TENSION_H]
    out[OUT_T_L] = S[x + o.X_TENSION_L]
    out[OUT_COMPLIANCE] = S[x + o.X_COMPLIANCE]
    motor_side(P, I, S, out)
    out[OUT_STRENGTH] = 0.0
    return status


@kernel
def keep(I: Ints, S: Floats) -> None:
    """Copy everything but the profiles (which nothing but a commit touches) aside."""
    copy_floats(S, 0, S, I[o.S_SPARE], I[o.S_MEET])


@kernel
def put_back(I: Ints, S: Floats) -> None:
    """Undo what happened since `keep`, bit for bit."""
    copy_floats(S, I[o.S_SPARE], S, 0, I[o.S_MEET])


@inlined_kernel
def take(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats, row: Floats, out: Floats) -> int:
    """One sample, committed; or refused (the status says why), and the state is what it was, bit for bit."""
    keep(I, S)
    status = predict(P, I, S, J, L, G, row, out)
    if status == o.STATUS_OK:
        out[OUT_STRENGTH] = strength_used(P, I, S)
        status = joint_commit(P, I, S, J, L, G) if out[OUT_STRENGTH] <= 1.0 else o.STATUS_BREAKS
    if status != o.STATUS_OK:
        put_back(I, S)
    return status


@kernel
def step_one(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, row: Floats, out: Floats) -> int:
    """One sample, committed or refused."""
    return take(P, I, S, J, L, stacks(I, S), row, out)


@kernel
def peek_one(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, row: Floats, out: Floats) -> int:
    """One sample, nothing committed. A cable that would break is no reason to refuse a prediction."""
    keep(I, S)
    status = predict(P, I, S, J, L, stacks(I, S), row, out)
    put_back(I, S)
    return status


@kernel
def run_block(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, rows: Floats, outs: Floats
) -> tuple[int, int]:
    """Step through a block of rows; returns how many were done and the status of the row that stopped it."""
    G = stacks(I, S)
    for k in range(rows.shape[0]):
        status = take(P, I, S, J, L, G, rows[k], outs[k])
        if status != o.STATUS_OK:
            return k, status
    return rows.shape[0], o.STATUS_OK


@kernel
def find_load(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, row: Floats, out: Floats) -> int:
    """The load [N m] under which the joint encoder would read row[IN_JOINT], by Newton's method; written to row[IN_LOAD].

    Nothing is committed. The deflection rises with the load, so a bracket keeps the iteration safe; where both cables
    are slack every load near zero fits, and the nearest is taken. An end of the bracket may be a load that the joint
    cannot take (an open circuit's cable slack, a drum unwound): if that is what the angle asks for, it is refused.
    """
    if not math.isfinite(row[IN_JOINT]):
        return o.STATUS_NAN
    x = I[o.S_CONTEXT]
    low, high = -1e300, 1e300
    below = above = o.STATUS_OK  # what is wrong with the loads at the ends of the bracket
    load = S[x + o.X_LOAD] * P[I[o.P_SENSOR] + o.GAIN] + P[I[o.P_SENSOR] + o.OFFSET]
    reach = P[o.J_RADIUS] * P[o.JOINT * I[o.N_CIRCUITS] + o.T0]
    taken = 0.0  # the last load that the joint could take
    for _ in range(200):
        row[IN_LOAD] = load
        status = peek_one(P, I, S, J, L, row, out)
        if status == o.STATUS_SLACK or status == o.STATUS_UNWOUND or status == o.STATUS_DIVERGED:
            reach *= 2.0
            if status == o.STATUS_SLACK or load < taken:
                low, below = load, status
                new = low + reach
            else:
                high, above = load, status
                new = high - reach
        elif status != o.STATUS_OK:
            return status
        else:
            miss = out[OUT_JOINT] - row[IN_JOINT]
            taken = load
            if abs(miss) < 1e-13:
                return o.STATUS_OK
            if miss > 0.0:
                high, above = load, o.STATUS_OK
            else:
                low, below = load, o.STATUS_OK
            new = load - miss / max(out[OUT_COMPLIANCE], 1e-12)
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - load) <= 1e-14 + 1e-13 * abs(load):
            if below == above == o.STATUS_OK:
                return o.STATUS_OK
            return o.STATUS_UNREACHABLE
        load = new
    return o.STATUS_UNREACHABLE


@kernel
def run_inverse(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, rows: Floats, outs: Floats
) -> tuple[int, int]:
    """As `run_block`, with every row's load found from both encoders."""
    for k in range(rows.shape[0]):
        status = find_load(P, I, S, J, L, rows[k], outs[k])
        if status == o.STATUS_OK:
            status = step_one(P, I, S, J, L, rows[k], outs[k])
        if status != o.STATUS_OK:
            return k, status
    return rows.shape[0], o.STATUS_OK
