"""Compiled solution of one time step of the whole joint: cables, shafts and couplings together."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from firmware_sim.plant.cable import (
    carry_along,
    find_contacts,
    guess_tension,
    lumped_extension,
    lumped_slope,
    move_nodes,
    refresh_tension,
    solve_cable,
    update_modes,
)
from firmware_sim.plant.jit import njit
from firmware_sim.plant.records import Drive, Floats
from firmware_sim.plant.shafts import (
    bdf,
    bearing_slope,
    bearing_torque,
    coupling_slope,
    coupling_torque,
    set_rates,
    settle_bearing,
    shaft_slope,
    shaft_torque,
    update_bearing,
)

MAX_ITERATIONS = 400
RUSH_ITERATIONS = 12  # so many with the rush of `update_modes`, so many without, and so on
WHOLE_ITERATIONS = 50  # so many whole steps, then so many shortened ones, which end going to and fro
CONTACT_ITERATIONS = 25  # then contacts are kept: where slack cable leaves a drum may have no answer
TRIES = 4
LOOSE = 1e-3

# Inputs of a step, in this order.
TIME, MOTOR_ANGLE, MOTOR_TORQUE, JOINT_TORQUE, TEMPERATURE, OTHER = 0, 1, 2, 3, 4, 5
N_INPUTS = 6


def winding_out_of(c: Any, q: float) -> float:
    """Arc on the output drum, m: R w + s (R q + e (sin(q + φ) − sin φ) + g q²/2)."""
    wound = c.R * q + c.runout_m * (math.sin(q + c.runout_phase) - math.sin(c.runout_phase))
    wound += 0.5 * c.climb_m_per_rad * q * q
    arc: float = c.R * c.wrap_out + c.sign * wound
    return arc


def winding_in_of(c: Any, q: float) -> float:
    """Arc on the input drum, m: r w − s (r q + e (sin(q + φ) − sin φ))."""
    wound = c.r * q + c.in_runout_m * (math.sin(q + c.in_runout_phase) - math.sin(c.in_runout_phase))
    arc: float = c.r * c.wrap_in - c.sign * wound
    return arc


winding_out = njit(winding_out_of)
winding_in = njit(winding_in_of)


@njit
def place_cable(c: Any, q_out: float, q_in: float) -> None:
    """Set arc, path length and lever arms of a cable from the angles of its shafts."""
    c.A = winding_out(c, q_out)
    c.Y = c.A + c.free_m + c.guide_arc_m - c.ext + winding_in(c, q_in)
    c.lead_out = c.sign * (c.R + c.runout_m * math.cos(q_out + c.runout_phase) + c.climb_m_per_rad * q_out)
    c.lead_in = -c.sign * (c.r + c.in_runout_m * math.cos(q_in + c.in_runout_phase))


@njit
def pretension_factor(surround: Any, time: float, temperature: float) -> float:
    """T0(t)/T0 = 1 − a ln(1 + t/t_c) + k (ϑ − ϑ_ref)."""
    factor: float = 1.0 + surround.thermal_per_K * (temperature - surround.thermal_ref)
    elapsed = max(time - surround.start_s, 0.0)
    if surround.relax_fraction != 0.0:
        factor -= surround.relax_fraction * math.log1p(elapsed / surround.relax_time_s)
    return factor


@njit
def apply_surroundings(drive: Drive, u: Floats) -> float:
    """Let time, temperature and other channels act; returns the pretension factor."""
    p = drive.surround[0]
    factor = pretension_factor(p, u[TIME], u[TEMPERATURE])
    mu = 1.0 + p.mu_per_K * (u[TEMPERATURE] - p.mu_ref)
    if p.ageing_gain != 0.0:
        mu *= 1.0 + p.ageing_gain * (1.0 - math.exp(-p.reversals / p.ageing_count))
    for k in range(len(drive.cables)):
        c = drive.cables[k]
        c.mu_scale = max(mu, 0.0)
        if p.is_open == 0:
            c.eigenstrain = (1.0 - factor) * c.T0 / c.EA
        if c.side == 0 and c.shaft_out == drive.cables[0].shaft_out:
            if p.slip_m != 0.0 and u[TIME] >= p.slip_time_s:
                if p.slip_behind_wrap > 0.0:
                    c.end_shift_m = p.slip_m
                    drive.nodes.y[c.first] = p.slip_m
                else:
                    c.released_m = p.slip_m
            if p.break_fraction != 0.0 and u[TIME] >= p.break_time_s:
                c.EA = p.EA_whole * (1.0 - p.break_fraction)
    drive.shafts[p.load_shaft].external_Nm = u[JOINT_TORQUE]
    drive.shafts[p.output_shaft].external_Nm = p.crosstalk * u[OTHER]
    if p.load_shaft == p.output_shaft:
        drive.shafts[p.load_shaft].external_Nm += u[JOINT_TORQUE]
    if drive.shafts[0].prescribed == 0:
        drive.shafts[0].external_Nm = u[MOTOR_TORQUE]
    return factor


@njit
def begin_step(drive: Drive, u: Floats, h: float) -> None:
    """Shift the histories, predict the free shafts, and carry the cables along."""
    nodes = drive.nodes
    nodes.old[:] = nodes.y
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
        guess_tension(c, nodes)


@njit
def predict_turn(drive: Drive, u: Floats) -> None:
    """Where the motor's angle is given: hand its unforeseen turn on as if rigid, which keeps cables taut."""
    if drive.shafts[0].prescribed == 0:
        return
    ahead = drive.rhs
    ahead[:] = 0.0
    ahead[0] = u[MOTOR_ANGLE] - drive.shafts[0].q
    for k in range(len(drive.cables) - 1, -1, -1):
        c = drive.cables[k]
        ahead[c.shaft_out] = ahead[c.shaft_in] * c.r / c.R
    for k in range(len(drive.couplings)):
        ahead[drive.couplings[k].b] = ahead[drive.couplings[k].a]
    for k in range(len(drive.shafts)):
        drive.shafts[k].q += ahead[k]


@njit
def assemble(drive: Drive, h: float, b0: float, b1: float, b2: float, factor: float) -> None:
    """Torque balance of every shaft and its derivatives, cables condensed to their end forces."""
    J, g = drive.matrix, drive.rhs
    J[:, :] = 0.0
    rate = b0 / h
    for k in range(len(drive.shafts)):
        s = drive.shafts[k]
        set_rates(s, h, b0, b1, b2)
        g[k] = shaft_torque(s, factor) + bearing_torque(s)
        J[k, k] = shaft_slope(s, rate) + bearing_slope(s) + 1e-9
        s.cable_Nm, s.radial_Nm = 0.0, 0.0
    for k in range(len(drive.couplings)):
        w = drive.couplings[k]
        a, b = drive.shafts[w.a], drive.shafts[w.b]
        w.torque_Nm = coupling_torque(w, b.q - a.q, b.v - a.v)
        slope = coupling_slope(w, b.q - a.q, b.v - a.v, rate)
        g[w.a] += w.torque_Nm
        g[w.b] -= w.torque_Nm
        J[w.a, w.a] += slope
        J[w.b, w.b] += slope
        J[w.a, w.b] -= slope
        J[w.b, w.a] -= slope
    for k in range(len(drive.cables)):
        add_cable(drive.cables[k], drive, J, g)


@njit
def add_cable(c: Any, drive: Drive, J: Floats, g: Floats) -> None:
    """Add one cable's end forces, linear in the angles, to the balance of its two shafts."""
    o, i = c.shaft_out, c.shaft_in
    excess = lumped_extension(c, c.T_out) - c.ext
    soft = 1.0 / (1.0 + c.dT_out_dY * lumped_slope(c, c.T_out))
    # change of T_out: by itself, per rad of q_out, per rad of q_in
    out_0 = (c.dT_out - c.dT_out_dY * excess) * soft
    out_o = (c.dT_out_dY + c.dT_out_dA) * c.lead_out * soft
    out_i = c.dT_out_dY * c.lead_in * soft
    slope = lumped_slope(c, c.T_out)
    dY_0, dY_o, dY_i = (
        -excess - slope * out_0,
        c.lead_out - slope * out_o,
        c.lead_in - slope * out_i,
    )
    in_0 = c.dT_in + c.dT_in_dY * dY_0
    in_o = c.dT_in_dY * dY_o + c.dT_in_dA * c.lead_out
    in_i = c.dT_in_dY * dY_i
    drive.shafts[o].cable_Nm -= c.lead_out * c.T_out
    drive.shafts[i].cable_Nm -= c.lead_in * c.T_in
    drive.shafts[o].radial_Nm += abs(c.lead_out) * c.T_out
    drive.shafts[i].radial_Nm += abs(c.lead_in) * c.T_in
    g[o] -= c.lead_out * (c.T_out + out_0)
    g[i] -= c.lead_in * (c.T_in + in_0)
    J[o, o] += c.lead_out * out_o
    J[o, i] += c.lead_out * out_i
    J[i, o] += c.lead_in * in_o
    J[i, i] += c.lead_in * in_i


@njit
def solve_small(J: Floats, g: Floats, n: int) -> None:
    """Gaussian elimination with partial pivoting, in place; the solution is left in g."""
    for k in range(n):
        p = k
        for i in range(k + 1, n):
            if abs(J[i, k]) > abs(J[p, k]):
                p = i
        if p != k:
            for j in range(n):
                J[k, j], J[p, j] = J[p, j], J[k, j]
            g[k], g[p] = g[p], g[k]
        for i in range(k + 1, n):
            f = J[i, k] / J[k, k]
            for j in range(k, n):
                J[i, j] -= f * J[k, j]
            g[i] -= f * g[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            g[k] -= J[k, j] * g[j]
        g[k] /= J[k, k]


@njit
def all_finite(g: Floats, n: int) -> bool:
    """Whether the first n values are finite."""
    total = 0.0
    for k in range(n):
        total += abs(g[k])
    return total < 1e12


@njit
def advance_cable(
    c: Any, drive: Drive, step_out: float, step_in: float, share: float, rush: bool
) -> tuple[float, int]:
    """Move one cable with its shafts; returns the change of its end forces over T0 and of its modes."""
    excess = lumped_extension(c, c.T_out) - c.ext
    slope = lumped_slope(c, c.T_out)
    turn = c.lead_out * step_out + c.lead_in * step_in
    dT = share * c.dT_out + c.dT_out_dY * (turn - share * excess) + c.dT_out_dA * c.lead_out * step_out
    dT /= 1.0 + c.dT_out_dY * slope
    c.ext += share * excess + slope * dT
    A, Y, T_out, T_in = c.A, c.Y, c.T_out, c.T_in
    place_cable(c, drive.shafts[c.shaft_out].q, drive.shafts[c.shaft_in].q)
    move_nodes(c, drive.nodes, c.Y - Y, c.A - A, share)
    refresh_tension(c, drive.nodes)
    c.T_out, c.T_in = drive.nodes.tension[c.i_out], drive.nodes.tension[c.i_in - 1]
    changed = update_modes(c, drive.nodes, c.force_tol, rush)
    return max(abs(c.T_out - T_out), abs(c.T_in - T_in)) / (c.T0 * share), changed


@njit
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
        for k in range(len(drive.cables)):
            if iteration < CONTACT_ITERATIONS:
                find_contacts(drive.cables[k], drive.nodes, h)
            solve_cable(drive.cables[k], drive.nodes)
        assemble(drive, h, b0, b1, b2, factor)
        for k in range(n):
            if drive.shafts[k].prescribed == 1:
                J[k, :] = 0.0
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
            change, modes = advance_cable(c, drive, g[c.shaft_out], g[c.shaft_in], share, rush)
            moved = max(moved, change)
            changed += modes
        if not (moved < 1e12 and all_finite(g, n)):
            return False
        if changed == 0 and moved < 1e-8:
            return True
    if moved < loose:
        p.failures += 1
        return True
    return False


@njit
def finish_step(drive: Drive, u: Floats, h: float) -> None:
    """Commit what depends on the step's end: rates, bearing anchors, cable plays, count of load reversals."""
    p = drive.surround[0]
    b0, b1, b2 = bdf(h, p.h_prev)
    factor = pretension_factor(p, u[TIME], u[TEMPERATURE])
    assemble(drive, h, b0, b1, b2, factor)
    for k in range(len(drive.shafts)):
        settle_bearing(drive.shafts[k])
    for k in range(len(drive.cables)):
        c = drive.cables[k]
        c.play = min(max(c.play, c.T_out - c.play_yield), c.T_out + c.play_yield)
    load = drive.shafts[p.load_shaft].external_Nm
    swing = 0.05 * drive.cables[0].T0 * drive.cables[0].R
    if (load - p.load_turn) * p.load_direction > 0.0:
        p.load_turn = load
    elif abs(load - p.load_turn) > swing:
        p.reversals += 1.0 if p.load_direction != 0.0 else 0.0
        p.load_direction = 1.0 if load > p.load_turn else -1.0
        p.load_turn = load
    p.h_prev = h


@njit
def save_state(drive: Drive, nodes_y: Floats) -> None:
    """Keep the state for a second try."""
    nodes_y[:] = drive.nodes.y
    drive.nodes.saved_mode[:] = drive.nodes.mode
    drive.saved_cables[:] = drive.cables
    drive.saved_shafts[:] = drive.shafts
    drive.saved_couplings[:] = drive.couplings
    drive.saved_surround[:] = drive.surround


@njit
def restore_state(drive: Drive, nodes_y: Floats) -> None:
    """Back to what `save_state` kept, but for the counters."""
    iterations, failures = drive.surround[0].iterations, drive.surround[0].failures
    drive.nodes.y[:] = nodes_y
    drive.nodes.mode[:] = drive.nodes.saved_mode
    drive.cables[:] = drive.saved_cables
    drive.shafts[:] = drive.saved_shafts
    drive.couplings[:] = drive.saved_couplings
    drive.surround[:] = drive.saved_surround
    drive.surround[0].iterations, drive.surround[0].failures = iterations, failures
    for k in range(len(drive.cables)):
        refresh_tension(drive.cables[k], drive.nodes)


@njit
def advance(drive: Drive, u0: Floats, u1: Floats, h: float, parts: int) -> bool:
    """Go from inputs u0 to u1 in `parts` equal steps, or in more where the iteration asks for it."""
    y_kept = np.empty_like(drive.nodes.y)
    save_state(drive, y_kept)
    u = np.empty_like(u1)
    pieces = max(parts, 1)
    for attempt in range(TRIES):
        loose = LOOSE if attempt == TRIES - 1 else 0.0
        done = True
        for j in range(pieces):
            share = (j + 1.0) / pieces
            u[:] = u0 + share * (u1 - u0)
            done = solve_step(drive, u, h / pieces, loose)
            if not done:
                break
            finish_step(drive, u, h / pieces)
        if done:
            return True
        restore_state(drive, y_kept)
        pieces *= 2
    return False
