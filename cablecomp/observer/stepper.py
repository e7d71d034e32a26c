"""Compiled steps of the observer: readings in, solved joint out; the same code for one sample and for a block."""

from __future__ import annotations

import math
from typing import Any

import numba

from cablecomp.mechanics.drive import Arrays, Drive, Terms, drive, terms_of
from cablecomp.mechanics.jit import inlined_kernel, inner_kernel, kernel, njit
from cablecomp.mechanics.joint import (
    advance,
    joint_commit,
    joint_ready,
    joint_solve,
    strength_used,
    terms_sane,
)
from cablecomp.mechanics.pointer import call_step_rows, floats_at, ints_at
from cablecomp.mechanics.profile import Floats, Ints, copy_floats
from cablecomp.mechanics.records import IN, OTHERS
from cablecomp.mechanics.status import (
    STATUS_BACKWARD,
    STATUS_BREAKS,
    STATUS_DIVERGED,
    STATUS_EFFECT,
    STATUS_NAN,
    STATUS_OK,
    STATUS_SLACK,
    STATUS_UNKNOWN,
    STATUS_UNREACHABLE,
    STATUS_UNWOUND,
)
from cablecomp.observer.rows import PLACES, answer_in, readings_in


@inner_kernel
def smooth(d: Drive, dt: float, motor: float, load: float) -> tuple[float, float]:
    """Causal input filter: an alpha-beta tracker of value and slope, critically damped; it follows ramps without lag.

    Uneven steps are exact in the gains; off at cutoff 0.
    """
    cutoff, f = d.sensor.cutoff, d.filter
    if cutoff <= 0.0:
        return motor, load
    if f.started == 0.0:
        f.started = 1.0
        f.motor, f.load = motor, load
        f.motor_slope = f.load_slope = 0.0
        return motor, load
    if dt <= 0.0:
        return f.motor, f.load
    keep = math.exp(-cutoff * dt)
    follow, turn = 1.0 - keep * keep, (1.0 - keep) * (1.0 - keep) / dt
    miss = motor - (f.motor + f.motor_slope * dt)
    f.motor, f.motor_slope = motor - (1.0 - follow) * miss, f.motor_slope + turn * miss
    miss = load - (f.load + f.load_slope * dt)
    f.load, f.load_slope = load - (1.0 - follow) * miss, f.load_slope + turn * miss
    return f.motor, f.load


@inner_kernel
def admissible(d: Drive, read: Any) -> int:
    """Whether a record of readings can be taken at all: started state, finite readings, time that does not run
    backwards."""
    if d.heights[0] < 2:
        return STATUS_UNKNOWN
    if not (math.isfinite(read.motor) and math.isfinite(read.load) and math.isfinite(read.time)):
        return STATUS_NAN
    if math.isinf(read.temperature):
        return STATUS_NAN
    for j in range(OTHERS):
        if math.isinf(read.other[j]):
            return STATUS_NAN
    return STATUS_OK if read.time >= d.context.time else STATUS_BACKWARD


@inlined_kernel
def motor_side(d: Drive, answer: Any) -> None:
    """Tensions at the input pulley (NaN for a cable that is not there) and the torque that turns it.

    tau_motor = -r (T_h - T_l) + what friction before the cable takes, both tensions at the input pulley.
    """
    circuit = d.circuits[0]
    pull = d.states[circuit.first[0]].tension_in
    answer.tension_h_in = pull
    answer.tension_l_in = math.nan
    if circuit.chains == 2:
        tension_l = d.states[circuit.first[1]].tension_in
        answer.tension_l_in = tension_l
        pull -= tension_l
    radius = d.cables[circuit.first[0]].radius[IN]
    answer.motor_torque = -radius * pull + d.context.motor_moment


@inlined_kernel
def predict(d: Drive, terms: Terms, laws: Floats, read: Any, answer: Any) -> int:
    """Solve the joint for one record of readings without committing it; `answer` gets what it says. Returns a status.

    The scalar state is left pending in any case: whoever commits nothing puts it back (`keep`, `put_back`).
    """
    status = admissible(d, read)
    if status != STATUS_OK:
        return status
    x = d.context
    raw = (read.load - d.sensor.offset) / d.sensor.gain
    motor, load = smooth(d, read.time - x.time, read.motor, raw)
    advance(d, read.time, motor, load, read.temperature)
    x.motor_rate = read.motor_rate
    for j in range(OTHERS):
        x.other[j] = read.other[j]
    status = joint_solve(d, terms, laws)
    ready = joint_ready(d)
    if status == STATUS_OK or (status == STATUS_DIVERGED and ready == STATUS_UNWOUND):
        status = ready
    if d.size.terms > 0 and not terms_sane(d, laws):
        status = STATUS_EFFECT
    answer.drive = x.joint + x.rigid * (read.motor - motor)
    answer.joint = answer.drive + x.reading
    answer.load = read.load
    answer.tension_h = x.tension_h
    answer.tension_l = x.tension_l
    answer.compliance = x.compliance
    motor_side(d, answer)
    answer.strength = 0.0
    return status


@inner_kernel
def keep(d: Drive, terms: Terms) -> None:
    """Copy everything but the profiles (which nothing but a commit touches) and the terms' rings aside."""
    _copy_all(d, terms, 0, d.size.spare_at)


@inner_kernel
def put_back(d: Drive, terms: Terms) -> None:
    """Undo what happened since `keep`, bit for bit."""
    _copy_all(d, terms, d.size.spare_at, 0)


@inlined_kernel
def _copy_all(d: Drive, terms: Terms, source: int, target: int) -> None:
    begin = 0
    for k in range(d.size.terms):
        call = terms.calls[k]
        if call.ring_at < call.end_at:
            copy_floats(terms.memory, source + begin, terms.memory, target + begin, call.ring_at - begin)
            begin = call.end_at
    copy_floats(terms.memory, source + begin, terms.memory, target + begin, d.size.steps_at - begin)


@kernel
def step_rows(
    fixed: Floats, layout: Ints, memory: Floats, heights: Ints, laws: Floats,
    rows: Floats, outs: Floats, commit: bool,
) -> tuple[int, int]:  # fmt: skip
    """Step through a block of rows; returns how many were done and the status of the row that stopped it.

    With `commit` every row becomes the state, or is refused, and the state is what it was before that row, bit for bit;
    without, nothing is kept of any (and a cable that would break is no reason to refuse a prediction). All that steps
    the observer goes through this one function, as it is long to compile. Its arrays stand one by one because a
    tuple of them costs each call from Python 1.5 us (`mechanics.drive.named`).
    """
    d, terms = drive(fixed, layout, memory, heights), terms_of(fixed, layout, memory)
    for k in range(rows.shape[0]):
        answer = answer_in(outs[k])
        keep(d, terms)
        status = predict(d, terms, laws, readings_in(rows[k]), answer)
        if commit and status == STATUS_OK:
            answer.strength = strength_used(d)
            status = joint_commit(d, terms, laws) if answer.strength <= 1.0 else STATUS_BREAKS
        if status != STATUS_OK or not commit:
            put_back(d, terms)
        if status != STATUS_OK:
            return k, status
    return rows.shape[0], STATUS_OK


@njit
def step_and_predict(places: Ints, laws: Floats) -> tuple[int, int]:
    """Commit the first of a joint's two rows, then predict the second, whose time, motor and load are given and all
    else is the first's; returns both statuses.

    One call for what a loop asks for in every cycle; `laws` as in `step_rows`.
    """
    at = places.view(PLACES)[0]
    joint = Arrays(
        numba.carray(floats_at(at.fixed[0]), (at.fixed[1],)),
        numba.carray(ints_at(at.layout[0]), (at.layout[1],)),
        numba.carray(floats_at(at.memory[0]), (at.memory[1],)),
        numba.carray(ints_at(at.heights[0]), (at.heights[1],)),
        laws,
    )
    rows = numba.carray(floats_at(at.rows[0]), (2, at.rows[1]))
    outs = numba.carray(floats_at(at.outs[0]), (2, at.outs[1]))
    _, status = call_step_rows(at.step_rows, (joint, rows[:1], outs[:1], True))
    if status != STATUS_OK:
        return status, status
    last, asked = readings_in(rows[0]), readings_in(rows[1])
    asked.joint, asked.temperature = last.joint, last.temperature
    for j in range(OTHERS):
        asked.other[j] = last.other[j]
    _, ahead = call_step_rows(at.step_rows, (joint, rows[1:], outs[1:], False))
    return status, ahead


@inner_kernel
def find_load(step_rows_at: int, joint: Arrays, rows: Floats, outs: Floats) -> int:
    """The load [N m] under which the joint encoder would read the only row's `joint`, by Newton's method;
    written to its `load`. `step_rows_at`: where the machine code of `step_rows` lies.

    Nothing is committed. The deflection rises with the load, so a bracket keeps the iteration safe. The solution's own
    compliance leaves out what readings add (a soft mount): where a step by it does not go far, the secant's counts.
    Where both cables are slack every load near zero fits, and the nearest is taken. An end of the bracket may be a
    load that the joint cannot take (an open circuit's cable slack, a drum unwound): if that is what the angle asks
    for, it is refused.
    """
    read, answer = readings_in(rows[0]), answer_in(outs[0])
    if not math.isfinite(read.joint):
        return STATUS_NAN
    d = drive(joint.fixed, joint.layout, joint.memory, joint.heights)
    low, high = -1e300, 1e300
    below = above = STATUS_OK  # what is wrong with the loads at the ends of the bracket
    load = d.context.load * d.sensor.gain + d.sensor.offset
    reach = d.circuits[0].radius * d.cables[0].T0
    taken = 0.0  # the last load that the joint could take
    missed = math.inf  # by how much the angle missed there
    for _ in range(200):
        read.load = load
        _, status = call_step_rows(step_rows_at, (joint, rows, outs, False))
        if status in (STATUS_SLACK, STATUS_UNWOUND, STATUS_DIVERGED):
            reach *= 2.0
            if status == STATUS_SLACK or load < taken:
                low, below = load, status
                new = low + reach
            else:
                high, above = load, status
                new = high - reach
        elif status != STATUS_OK:
            return status
        else:
            miss, compliance = answer.joint - read.joint, answer.compliance
            if load != taken and abs(miss) > 0.25 * abs(missed):
                compliance = max(compliance, (miss - missed) / (load - taken))
            taken, missed = load, miss
            if abs(miss) < 1e-13:
                return STATUS_OK
            if miss > 0.0:
                high, above = load, STATUS_OK
            else:
                low, below = load, STATUS_OK
            new = load - miss / max(compliance, 1e-12)
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - load) <= 1e-14 + 1e-13 * abs(load):
            if below == above == STATUS_OK:
                return STATUS_OK
            return STATUS_UNREACHABLE
        load = new
    return STATUS_UNREACHABLE


@kernel
def step_rows_inverse(
    step_rows_at: int, fixed: Floats, layout: Ints, memory: Floats, heights: Ints, laws: Floats,
    rows: Floats, outs: Floats, commit: bool,
) -> tuple[int, int]:  # fmt: skip
    """As `step_rows`, with every row's load found from both encoders."""
    joint = Arrays(fixed, layout, memory, heights, laws)
    for k in range(rows.shape[0]):
        row, out = rows[k : k + 1], outs[k : k + 1]
        status = find_load(step_rows_at, joint, row, out)
        if status == STATUS_OK:
            _, status = call_step_rows(step_rows_at, (joint, row, out, commit))
        if status != STATUS_OK:
            return k, status
    return rows.shape[0], STATUS_OK
