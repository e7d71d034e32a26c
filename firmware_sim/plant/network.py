"""Compiled balance of the whole joint: surroundings, winding, torques of cables, shafts and couplings."""

from __future__ import annotations

import math
from typing import Any

from firmware_sim.plant.columns import (
    BEARING_TORQUE,
    JOINT_TORQUE,
    LEAN,
    MOTOR_TORQUE,
    MU_DRUMS,
    MU_GUIDE,
    OTHER,
    PRETENSION_H,
    PRETENSION_L,
    RELEASED_H,
    RELEASED_L,
    SOFTENED_H,
    SOFTENED_L,
    TEMPERATURE,
    TILT,
    TIME,
    UNSEEN_TORQUE,
)
from firmware_sim.plant.jit import part
from firmware_sim.plant.records import Drive, Floats
from firmware_sim.plant.shafts import (
    bearing_slope,
    bearing_torque,
    coupling_slope,
    coupling_torque,
    set_rates,
    shaft_slope,
    shaft_torque,
)
from firmware_sim.plant.tension import lumped_extension, lumped_slope


def winding_out_of(c: Any, q: float) -> float:
    """Arc on the output drum, m: R w + s (R q + e (sin(n q + φ) − sin φ) + g q²/2), the last of
    the angle beyond a flange's foot where there is one."""
    turned = c.runout_order * q + c.runout_phase
    wound = c.R * q + c.runout_m * (math.sin(turned) - math.sin(c.runout_phase))
    if c.climb_m_per_rad != 0.0:
        beyond = max(q - c.climb_from, 0.0) if c.climb_beyond == 1.0 else q
        wound += 0.5 * c.climb_m_per_rad * beyond * beyond
    arc: float = c.R * c.wrap_out + c.sign * wound
    return arc


def winding_in_of(c: Any, q: float) -> float:
    """Arc on the input drum, m: r w − s (r q + e (sin(q + φ) − sin φ))."""
    wound = c.r * q + c.in_runout_m * (math.sin(q + c.in_runout_phase) - math.sin(c.in_runout_phase))
    arc: float = c.r * c.wrap_in - c.sign * wound
    return arc


winding_out = part(winding_out_of)
winding_in = part(winding_in_of)


@part
def clear(row: Floats) -> None:
    """Set a row to zero."""
    for k in range(len(row)):
        row[k] = 0.0


@part
def place_cable(c: Any, q_out: float, q_in: float) -> None:
    """Set arc, path length and lever arms of a cable from the angles of its shafts."""
    c.A = winding_out(c, q_out)
    c.Y = c.A + c.free_m + c.guide_arc_m - c.ext + winding_in(c, q_in)
    swing = c.runout_order * c.runout_m * math.cos(c.runout_order * q_out + c.runout_phase)
    beyond = max(q_out - c.climb_from, 0.0) if c.climb_beyond == 1.0 else q_out
    c.lead_out = c.sign * (c.R + swing + c.climb_m_per_rad * beyond)
    c.lead_in = -c.sign * (c.r + c.in_runout_m * math.cos(q_in + c.in_runout_phase))


@part
def pretension_factor(surround: Any, u: Floats) -> float:
    """T0(t)/T0 = 1 − a ln(1 + t/t_c) + k (ϑ − ϑ_ref)."""
    factor: float = 1.0 + surround.thermal_per_K * (u[TEMPERATURE] - surround.thermal_ref)
    elapsed = max(u[TIME] - surround.start_s, 0.0)
    if surround.relax_fraction != 0.0:
        factor -= surround.relax_fraction * math.log1p(elapsed / surround.relax_time_s)
    return factor


@part
def apply_surroundings(drive: Drive, u: Floats) -> float:
    """Let time, temperature and other channels act; returns the factor of the preload (open circuit)."""
    p = drive.surround[0]
    factor = pretension_factor(p, u)
    mu = 1.0 + u[MU_DRUMS] + p.mu_per_K * (u[TEMPERATURE] - p.mu_ref)
    if p.ageing_gain != 0.0:
        mu *= 1.0 + p.ageing_gain * (1.0 - math.exp(-p.reversals / p.ageing_count))
    for k in range(len(drive.cables)):
        c = drive.cables[k]
        c.mu_scale, c.guide_scale = max(mu, 0.0), max(mu + u[MU_GUIDE], 0.0)
        change_cable(p, c, drive.nodes.y, drive.cables[0].shaft_out, u, factor)
    drive.shafts[p.load_shaft].external_Nm = u[JOINT_TORQUE]
    drive.shafts[p.output_shaft].external_Nm = p.crosstalk * u[OTHER] + u[UNSEEN_TORQUE]
    drive.shafts[p.output_shaft].tilt = u[TILT]
    drive.shafts[p.output_shaft].lean = u[LEAN]
    drive.shafts[p.output_shaft].coulomb_more_Nm = u[BEARING_TORQUE]
    if p.load_shaft == p.output_shaft:
        drive.shafts[p.load_shaft].external_Nm += u[JOINT_TORQUE]
    if drive.shafts[0].prescribed == 0:
        drive.shafts[0].external_Nm = u[MOTOR_TORQUE]
    preload: float = factor + u[PRETENSION_H]
    return preload


@part
def change_cable(p: Any, c: Any, y: Floats, output: int, u: Floats, factor: float) -> None:
    """Pretension, wires and clamps of one cable at this time; events concern the output stage."""
    if p.is_open == 0:
        c.eigenstrain = (1.0 - factor - u[PRETENSION_H if c.side == 0 else PRETENSION_L]) * c.T0 / c.EA_whole
    if c.shaft_out != output:
        return
    c.released_m = u[RELEASED_H if c.side == 0 else RELEASED_L] + c.crept_m
    lost = u[SOFTENED_H if c.side == 0 else SOFTENED_L]
    if c.side == 0:
        if p.slip_m != 0.0 and u[TIME] >= p.slip_time_s:
            if p.slip_behind_wrap > 0.0:
                c.end_shift_m = p.slip_m
                y[c.first] = p.slip_m
            else:
                c.released_m += p.slip_m
        if u[TIME] >= p.break_time_s:
            lost += p.break_fraction
    c.EA = c.EA_whole * (1.0 - lost)


@part
def assemble(drive: Drive, h: float, b0: float, b1: float, b2: float, factor: float) -> None:
    """Torque balance of every shaft and its derivatives, cables condensed to their end forces."""
    J, g = drive.matrix, drive.rhs
    for k in range(len(g)):
        clear(J[k])
    rate = b0 / h
    for k in range(len(drive.shafts)):
        s = drive.shafts[k]
        set_rates(s, h, b0, b1, b2)
        g[k] = shaft_torque(s, factor) + bearing_torque(s, h)
        J[k, k] = shaft_slope(s, rate) + bearing_slope(s, h) + 1e-9
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
        add_cable(drive.cables[k], drive.shafts, drive.plays, J, g, h)


@part
def add_cable(c: Any, shafts: Any, plays: Any, J: Floats, g: Floats, h: float) -> None:
    """Add one cable's end forces, linear in the angles, to the balance of its two shafts."""
    o, i = c.shaft_out, c.shaft_in
    excess = lumped_extension(c, plays, c.T_out, h) - c.ext
    slope = lumped_slope(c, plays, c.T_out, h)
    soft = 1.0 / (1.0 + c.dT_out_dY * slope)
    # change of T_out: by itself, per rad of q_out, per rad of q_in
    out_0 = (c.dT_out - c.dT_out_dY * excess) * soft
    out_o = (c.dT_out_dY + c.dT_out_dA) * c.lead_out * soft
    out_i = c.dT_out_dY * c.lead_in * soft
    dY_0, dY_o, dY_i = (
        -excess - slope * out_0,
        c.lead_out - slope * out_o,
        c.lead_in - slope * out_i,
    )
    in_0 = c.dT_in + c.dT_in_dY * dY_0
    in_o = c.dT_in_dY * dY_o + c.dT_in_dA * c.lead_out
    in_i = c.dT_in_dY * dY_i
    shafts[o].cable_Nm -= c.lead_out * c.T_out
    shafts[i].cable_Nm -= c.lead_in * c.T_in
    shafts[o].radial_Nm += abs(c.lead_out) * c.T_out
    shafts[i].radial_Nm += abs(c.lead_in) * c.T_in
    g[o] -= c.lead_out * (c.T_out + out_0)
    g[i] -= c.lead_in * (c.T_in + in_0)
    J[o, o] += c.lead_out * out_o
    J[o, i] += c.lead_out * out_i
    J[i, o] += c.lead_in * in_o
    J[i, i] += c.lead_in * in_i


@part
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
