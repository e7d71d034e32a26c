"""Compiled time stepping: the iteration of one step, its commitment, and second tries with shorter steps."""

from __future__ import annotations

from typing import Any

import numpy as np

from firmware_sim.plant.cable import carry_along, move_nodes, solve_cable, update_modes
from firmware_sim.plant.columns import MOTOR_ANGLE, PRETENSION_H
from firmware_sim.plant.contact import find_contacts
from firmware_sim.plant.jit import njit, part
from firmware_sim.plant.network import (
    apply_surroundings,
    assemble,
    clear,
    place_cable,
    pretension_factor,
    solve_small,
)
from firmware_sim.plant.records import Drive, Floats, Nodes
from firmware_sim.plant.shafts import bdf, settle_bearing, update_bearing
from firmware_sim.plant.tension import (
    guess_tension,
    lumped_extension,
    lumped_slope,
    refresh_tension,
    settle_cable,
)

MAX_ITERATIONS = 400
RUSH_ITERATIONS = 12  # so many with the rush of `update_modes`, so many without, and so on
WHOLE_ITERATIONS = 50  # so many whole steps, then so many shortened ones, which end going to and fro
CONTACT_ITERATIONS = 25  # then contacts are kept until all else has settled, and found anew
TRIES = 6
LOOSE = 1e-3
SAME_GRIP = 1e-5  # of the tension, by which kept contacts may grip otherwise than those found anew
UNBALANCED = 1e-6  # of T0, what a law of friction that is not linear may leave at a node


@part
def copy(source: Any, target: Any) -> None:
    """Copy an array into another of its length."""
    for k in range(len(source)):
        target[k] = source[k]


@part
def begin_step(drive: Drive, u: Floats, h: float) -> None:
    """Shift the histories, predict the free shafts, and carry the cables along."""
    nodes = drive.nodes
    copy(nodes.y, nodes.old)
    for k in range(len(drive.shafts)):
        s = drive.shafts[k]
        s.q_2, s.q_1, s.v_2, s.v_1 = s.q_1, s.q, s.v_1, s.v
        s.q += s.v * h
    predict_turn(drive, u)
    for k in range(len(drive.cables)):
        c = drive.cables[k]
        c.A_old, c.Y_old = c.A, c.Y
        place_cable(c, drive.shafts[c.shaft_out].q, drive.shafts[c.shaft_in].q)
        carry_along(c, nodes, c.Y - c.Y_old, c.A - c.A_old)
        guess_tension(c, nodes, drive.tensile)


@part
def predict_turn(drive: Drive, u: Floats) -> None:
    """Where the motor's angle is given: hand its unforeseen turn on as if rigid, which keeps cables taut."""
    if drive.shafts[0].prescribed == 0:
        return
    ahead = drive.rhs
    clear(ahead)
    ahead[0] = u[MOTOR_ANGLE] - drive.shafts[0].q
    for k in range(len(drive.cables) - 1, -1, -1):
        c = drive.cables[k]
        ahead[c.shaft_out] = ahead[c.shaft_in] * c.r / c.R
    for k in range(len(drive.couplings)):
        ahead[drive.couplings[k].b] = ahead[drive.couplings[k].a]
    for k in range(len(drive.shafts)):
        drive.shafts[k].q += ahead[k]


@part
def all_finite(g: Floats, n: int) -> bool:
    """Whether the first n values are finite."""
    total = 0.0
    for k in range(n):
        total += abs(g[k])
    return total < 1e12


@part
def advance_cable(
    c: Any,
    shafts: Any,
    nodes: Nodes,
    plays: Any,
    tensile: Floats,
    step_out: float,
    step_in: float,
    share: float,
    rush: bool,
    h: float,
) -> tuple[float, int]:
    """Move one cable with its shafts; returns the change of its end forces over T0 and of its modes."""
    excess = lumped_extension(c, plays, c.T_out, h) - c.ext
    slope = lumped_slope(c, plays, c.T_out, h)
    turn = c.lead_out * step_out + c.lead_in * step_in
    dT = share * c.dT_out + c.dT_out_dY * (turn - share * excess) + c.dT_out_dA * c.lead_out * step_out
    dT /= 1.0 + c.dT_out_dY * slope
    c.ext += share * excess + slope * dT
    A, Y, T_out, T_in = c.A, c.Y, c.T_out, c.T_in
    place_cable(c, shafts[c.shaft_out].q, shafts[c.shaft_in].q)
    move_nodes(c, nodes, c.Y - Y, c.A - A, share)
    refresh_tension(c, nodes, tensile)
    c.T_out, c.T_in = nodes.tension[c.i_out], nodes.tension[c.i_in - 1]
    changed = update_modes(c, nodes, c.force_tol, rush)
    return max(abs(c.T_out - T_out), abs(c.T_in - T_in)) / (c.T0 * share), changed


@part
def solve_step(drive: Drive, u: Floats, h: float, loose: float) -> bool:
    """One implicit step of length h to the inputs u; False if the iteration did not settle.

    With `loose` > 0, end forces that still move by less than that share of T0 pass, and are counted: a
    point at the very edge of sliding may go to and fro without end.
    """
    p = drive.surround[0]
    b0, b1, b2 = bdf(h, p.h_prev)
    factor = apply_surroundings(drive, u)
    begin_step(drive, u, h)
    J, g, n = drive.matrix, drive.rhs, len(drive.shafts)
    moved = np.inf
    for iteration in range(MAX_ITERATIONS):
        p.iterations += 1
        unbalanced = 0.0
        for k in range(len(drive.cables)):
            if iteration < CONTACT_ITERATIONS:
                find_contacts(drive.cables[k], drive.nodes, drive.grooves, h)
            unbalanced = max(unbalanced, solve_cable(drive.cables[k], drive.nodes, h))
        assemble(drive, h, b0, b1, b2, factor)
        for k in range(n):
            if drive.shafts[k].prescribed == 1:
                clear(J[k])
                J[k, k], g[k] = 1.0, 0.0
        solve_small(J, g, n)
        share = 1.0 if (iteration // WHOLE_ITERATIONS) % 2 == 0 else 0.6
        rush = iteration % (2 * RUSH_ITERATIONS) < RUSH_ITERATIONS
        changed, moved = 0, 0.0
        for k in range(n):
            g[k] *= share
            drive.shafts[k].q += g[k]
            changed += update_bearing(drive.shafts[k])
        for k in range(len(drive.cables)):
            c = drive.cables[k]
            change, modes = advance_cable(
                c,
                drive.shafts,
                drive.nodes,
                drive.plays,
                drive.tensile,
                g[c.shaft_out],
                g[c.shaft_in],
                share,
                rush,
                h,
            )
            moved = max(moved, change)
            changed += modes
        if not (moved < 1e12 and all_finite(g, n)):
            return False
        settled = changed == 0 and moved < 1e-8 and unbalanced < UNBALANCED
        if settled and (iteration < CONTACT_ITERATIONS or contacts_hold(drive, h)):
            return True
    if moved < loose:
        p.failures += 1
        return True
    return False


@part
def contacts_hold(drive: Drive, h: float) -> bool:
    """Find all contacts anew; whether each cable touches its drums and guides, and grips, as the contacts that were
    kept had it: where an iteration has swung far they had friction where nothing is."""
    nodes = drive.nodes
    copy(nodes.where, nodes.kept)
    copy(nodes.grip, nodes.upper)
    for k in range(len(drive.cables)):
        c = drive.cables[k]
        find_contacts(c, nodes, drive.grooves, h)
        for i in range(c.first + 1, c.first + c.count - 1):
            if nodes.where[i] != nodes.kept[i] or abs(nodes.grip[i] - nodes.upper[i]) > SAME_GRIP:
                return False
    return True


@part
def finish_step(drive: Drive, u: Floats, h: float) -> None:
    """Commit what depends on the step's end: rates, bearing anchors, cable plays, count of load reversals."""
    p = drive.surround[0]
    b0, b1, b2 = bdf(h, p.h_prev)
    factor = pretension_factor(p, u) + u[PRETENSION_H]
    assemble(drive, h, b0, b1, b2, factor)
    for k in range(len(drive.shafts)):
        settle_bearing(drive.shafts[k])
    for k in range(len(drive.cables)):
        settle_cable(drive.cables[k], drive.plays, h)
    load = drive.shafts[p.load_shaft].external_Nm
    swing = 0.05 * drive.cables[0].T0 * drive.cables[0].R
    if (load - p.load_turn) * p.load_direction > 0.0:
        p.load_turn = load
    elif abs(load - p.load_turn) > swing:
        p.reversals += 1.0 if p.load_direction != 0.0 else 0.0
        p.load_direction = 1.0 if load > p.load_turn else -1.0
        p.load_turn = load
    p.h_prev = h


@part
def save_state(drive: Drive) -> None:
    """Keep the state for a second try."""
    copy(drive.nodes.mode, drive.nodes.saved_mode)
    for k in range(len(drive.words)):
        copy(drive.words[k], drive.saved[k])


@part
def restore_state(drive: Drive) -> None:
    """Back to what `save_state` kept, but for the counters."""
    iterations, failures = drive.surround[0].iterations, drive.surround[0].failures
    copy(drive.nodes.saved_mode, drive.nodes.mode)
    for k in range(len(drive.words)):
        copy(drive.saved[k], drive.words[k])
    drive.surround[0].iterations, drive.surround[0].failures = iterations, failures
    for k in range(len(drive.cables)):
        refresh_tension(drive.cables[k], drive.nodes, drive.tensile)


@njit
def advance(drive: Drive, u0: Floats, u1: Floats, h: float, parts: int, bend: float) -> bool:
    """Go from inputs u0 to u1 in `parts` equal steps, or in more where the iteration asks for it.

    In between, inputs are on a line, and the motor's angle on a parabola with second difference `bend`.
    """
    save_state(drive)
    u = drive.between
    pieces = max(parts, 1)
    for attempt in range(TRIES):
        loose = LOOSE if attempt == TRIES - 1 else 0.0
        done = True
        for j in range(pieces):
            share = (j + 1.0) / pieces
            for k in range(len(u)):
                u[k] = u0[k] + share * (u1[k] - u0[k])
            u[MOTOR_ANGLE] -= 0.5 * share * (1.0 - share) * bend
            done = solve_step(drive, u, h / pieces, loose)
            if not done:
                break
            finish_step(drive, u, h / pieces)
        if done:
            return True
        restore_state(drive)
        pieces *= 2
    return False
