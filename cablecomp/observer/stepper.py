"""Compiled steps of the observer: readings in, solved joint out; the same code for one sample and for a block."""

from __future__ import annotations

import math

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.cable import stacks
from cablecomp.mechanics.jit import inlined_kernel, kernel
from cablecomp.mechanics.joint import advance, joint_commit, joint_solve
from cablecomp.mechanics.profile import Floats, Ints, copy_floats

# options F: [torque gain, torque offset, filter angular frequency, 0]; filter state follows: value and slope of angle and load
GAIN, OFFSET, CUTOFF, STARTED, MOTOR_1, MOTOR_2, LOAD_1, LOAD_2, OPTIONS = range(9)
# one row of inputs
IN_TIME, IN_MOTOR, IN_LOAD, IN_JOINT, IN_TEMPERATURE, IN_OTHER = range(6)
# one row of outputs
(
    OUT_JOINT, OUT_DRIVE, OUT_LOAD, OUT_T_H, OUT_T_L, OUT_COMPLIANCE, OUT_T_H_IN, OUT_T_L_IN, OUT_MOTOR_TORQUE,
    OUT_WIDTH,
) = range(10)  # fmt: skip


@kernel
def smooth(F: Floats, dt: float, motor: float, load: float) -> tuple[float, float]:
    """Causal input filter: an alpha-beta tracker of value and slope, critically damped; it follows ramps without lag.

    Uneven steps are exact in the gains; off at cutoff 0.
    """
    if F[CUTOFF] <= 0.0:
        return motor, load
    if F[STARTED] == 0.0:
        F[STARTED] = 1.0
        F[MOTOR_1], F[LOAD_1] = motor, load
        F[MOTOR_2] = F[LOAD_2] = 0.0
        return motor, load
    if dt <= 0.0:
        return F[MOTOR_1], F[LOAD_1]
    keep = math.exp(-F[CUTOFF] * dt)
    follow, turn = 1.0 - keep * keep, (1.0 - keep) * (1.0 - keep) / dt
    miss = motor - (F[MOTOR_1] + F[MOTOR_2] * dt)
    F[MOTOR_1], F[MOTOR_2] = motor - (1.0 - follow) * miss, F[MOTOR_2] + turn * miss
    miss = load - (F[LOAD_1] + F[LOAD_2] * dt)
    F[LOAD_1], F[LOAD_2] = load - (1.0 - follow) * miss, F[LOAD_2] + turn * miss
    return F[MOTOR_1], F[LOAD_1]


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
def predict(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats, F: Floats, row: Floats, out: Floats
) -> int:
    """Solve the joint for one row of readings without committing it; `out` gets the outputs. Returns a status."""
    if not (math.isfinite(row[IN_MOTOR]) and math.isfinite(row[IN_LOAD]) and math.isfinite(row[IN_TIME])):
        return o.STATUS_NAN
    x = I[o.S_CONTEXT]
    raw = (row[IN_LOAD] - F[OFFSET]) / F[GAIN]
    dt = row[IN_TIME] - S[x + o.X_TIME]
    motor, load = smooth(F, dt, row[IN_MOTOR], raw)
    advance(P, I, S, row[IN_TIME], motor, load, row[IN_TEMPERATURE])
    for j in range(row.shape[0] - IN_OTHER):
        S[x + o.X_OTHER + j] = row[IN_OTHER + j]
    status = joint_solve(P, I, S, J, L, G)
    drive = S[x + o.X_JOINT] + S[x + o.X_RIGID] * (row[IN_MOTOR] - motor)
    out[OUT_DRIVE] = drive
    out[OUT_JOINT] = drive + S[x + o.X_READING]
    out[OUT_LOAD] = row[IN_LOAD]
    out[OUT_T_H] = S[x + o.X_TENSION_H]
    out[OUT_T_L] = S[x + o.X_TENSION_L]
    out[OUT_COMPLIANCE] = S[x + o.X_COMPLIANCE]
    motor_side(P, I, S, out)
    return status


@kernel
def step_one(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, F: Floats, row: Floats, out: Floats) -> int:
    """One sample, committed."""
    G = stacks(I, S)
    status = predict(P, I, S, J, L, G, F, row, out)
    if status == o.STATUS_OK:
        joint_commit(P, I, S, J, L, G)
    return status


@kernel
def peek_one(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, F: Floats, row: Floats, out: Floats, spare: Floats
) -> int:
    """One sample, nothing committed: everything but the profiles (which a prediction never touches) is put back."""
    small = I[o.S_PROFILE]
    copy_floats(S, 0, spare, 0, small)
    copy_floats(F, 0, spare, small, OPTIONS)
    status = predict(P, I, S, J, L, stacks(I, S), F, row, out)
    copy_floats(spare, 0, S, 0, small)
    copy_floats(spare, small, F, 0, OPTIONS)
    return status


@kernel
def run_block(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, F: Floats, rows: Floats, outs: Floats
) -> tuple[int, int]:
    """Step through a block of rows; returns how many were done and the status of the row that stopped it."""
    G = stacks(I, S)
    for k in range(rows.shape[0]):
        status = predict(P, I, S, J, L, G, F, rows[k], outs[k])
        if status != o.STATUS_OK:
            return k, status
        joint_commit(P, I, S, J, L, G)
    return rows.shape[0], o.STATUS_OK


@kernel
def find_load(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, F: Floats, row: Floats, out: Floats, spare: Floats
) -> int:
    """The load [N m] under which the joint encoder would read row[IN_JOINT], by Newton's method; written to row[IN_LOAD].

    Nothing is committed. The deflection rises with the load, so a bracket keeps the iteration safe; where both cables
    are slack every load near zero fits, and the nearest is taken.
    """
    x = I[o.S_CONTEXT]
    low, high = -1e300, 1e300
    load = S[x + o.X_LOAD] * F[GAIN] + F[OFFSET]
    for _ in range(60):
        row[IN_LOAD] = load
        status = peek_one(P, I, S, J, L, F, row, out, spare)
        if status != o.STATUS_OK and status != o.STATUS_SLACK:
            return status
        if status == o.STATUS_SLACK:  # an open circuit's cable would go slack: more load is needed
            low = max(low, load)
            load = 0.5 * (load + high) if high < 1e299 else 0.5 * load
            continue
        miss = out[OUT_JOINT] - row[IN_JOINT]
        if abs(miss) < 1e-13:
            return o.STATUS_OK
        if miss > 0.0:
            high = load
        else:
            low = load
        step = -miss / max(out[OUT_COMPLIANCE], 1e-12)
        new = load + step
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - load) <= 1e-14 + 1e-13 * abs(load):
            return o.STATUS_OK
        load = new
    return o.STATUS_OK


@kernel
def run_inverse(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, F: Floats, rows: Floats, outs: Floats, spare: Floats
) -> tuple[int, int]:
    """As `run_block`, with every row's load found from both encoders."""
    for k in range(rows.shape[0]):
        status = find_load(P, I, S, J, L, F, rows[k], outs[k], spare)
        if status == o.STATUS_OK:
            status = step_one(P, I, S, J, L, F, rows[k], outs[k])
        if status != o.STATUS_OK:
            return k, status
    return rows.shape[0], o.STATUS_OK
