"""Guaranteed bounds, compiled: the states of the lowest and the highest history on one chain of cables.

Two profiles L <= true <= U are kept on every wrap; both see the nominal shaft angles. The true joint angle lies within
eps of the nominal one and turns the wraps by as much, so L and U get their end values moved outward by mu eps.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from cablecomp.mechanics.assemble import Model
from cablecomp.mechanics.drive import Drive, drive
from cablecomp.mechanics.jit import inlined_kernel, inner_kernel, kernel
from cablecomp.mechanics.pretension import retension
from cablecomp.mechanics.profile import (
    LEAST_WRAP,
    B,
    Floats,
    Ints,
    Y,
    set_pending,
    wrap_commit,
    wrap_eval,
    wrap_fill,
)
from cablecomp.mechanics.records import OUT, floats, record
from cablecomp.mechanics.tables import TABLED, dv_dtau, strain_of_tau, tau_of_v, v_of_tau

# What is said of the drive as a whole.
BOUNDS = record(
    [
        ("steepest", "f8"),  # greatest factor by which a law table raises mu
        ("past_low", "f8"),  # least and greatest ln(T/T0) that any cable may have borne before
        ("past_high", "f8"),
    ]
)

# One circuit; `_try`: pending.
BOUNDS_CIRCUIT = record(
    [
        ("surplus", "f8"),  # of stretch with both chains at their upper bounds, rad
        ("deficit", "f8"),
        ("low", "f8"),  # tension of cable l
        ("high", "f8"),
        ("surplus_try", "f8"),
        ("deficit_try", "f8"),
        ("low_try", "f8"),
        ("high_try", "f8"),
        ("pull", "f8"),  # M/R of the last step
        ("x_in", "f8"),  # input angle of the last step
        ("first", "f8"),  # 1 before the first step
    ]
)

# One cable.
BOUNDS_CABLE = record(
    [
        ("eps", "f8"),  # half width of its output shaft's angle,
        ("eps_old", "f8"),  # in the last step,
        ("eps_next", "f8"),  # for the next
        ("pretension", "f8"),  # factors and shaft angle of the last step
        ("stiffness", "f8"),
        ("shaft", "f8"),
    ]
)
N_BOUNDS, N_CIRCUIT, N_CABLE = floats(BOUNDS), floats(BOUNDS_CIRCUIT), floats(BOUNDS_CABLE)

MERGE = 1e-13  # error of v below which neighbours are merged; more only where memory runs out
EPS_START = 1e-4  # first guess of the half width of a shaft's angle


class Bounds(NamedTuple):
    """The bounds' own numbers, by name."""

    whole: Any
    circuits: Any
    cables: Any


class Side(NamedTuple):
    """The joint in the state of one bound; sign +1 for the upper, -1 for the lower one."""

    drive: Drive
    sign: float


def named_bounds(circuits: int, W: Floats) -> Bounds:
    """The records in the flat array W of the bounds of a joint with this many circuits."""
    cables_at = N_BOUNDS + circuits * N_CIRCUIT
    return Bounds(
        W[:N_BOUNDS].view(BOUNDS)[0],
        W[N_BOUNDS:cables_at].view(BOUNDS_CIRCUIT),
        W[cables_at:].view(BOUNDS_CABLE),
    )


bounds_of = inlined_kernel(named_bounds)


def bounds_numbers(model: Model, past_low: float, past_high: float) -> Floats:
    """The bounds' flat array before their start; past = least and greatest ln(T/T0) that any cable has borne."""
    size = model.named(model.S, model.J).size
    W = np.zeros(N_BOUNDS + size.circuits * N_CIRCUIT + size.cables * N_CABLE)
    whole = named_bounds(size.circuits, W).whole
    whole.steepest, whole.past_low, whole.past_high = steepest(model.L), past_low, past_high
    return W


def steepest(L: Floats | None) -> float:
    """Greatest factor by which a law table (None = plain) raises friction over mu, by place and by tension
    (e^-2..e^2)."""
    if L is None or L[0, 0, 0] != TABLED:
        return 1.0
    place = float(np.max(np.diff(L[:, 2]) / L[:, 0, 5:6]))
    u = L[0, 1]
    tension = float(np.max((np.diff(u) / L[0, 0, 2])[np.abs(u[1:]) < 2.0]))
    return max(place, 1.0) * max(tension, 1.0)


@kernel
def sides_start(P: Floats, I: Ints, L: Floats, W: Floats, SL: Floats, JL: Ints, SU: Floats, JU: Ints) -> None:
    """Fill all wraps of two started joints with the least and the greatest tension of the past; the first step
    cuts them to what friction admits."""
    low, up = drive(P, I, SL, JL), drive(P, I, SU, JU)
    b = bounds_of(low.size.circuits, W)
    W[N_BOUNDS:] = 0.0
    _fill(low, L, b.whole.past_low)
    _fill(up, L, b.whole.past_high)
    for c in range(low.size.cables):
        b.cables[c].eps = EPS_START
    for ic in range(low.size.circuits):
        b.circuits[ic].first = 1.0


@inner_kernel
def _fill(d: Drive, L: Floats, past: float) -> None:
    G = d.profiles
    for c in range(d.size.cables):
        for end in range(2):
            wrap, law = 2 * c + end, d.cables[c].law[end]
            w = G[wrap, Y, d.heights[wrap] - 1]
            d.heights[wrap] = wrap_fill(G, L, law, wrap, w, v_of_tau(L, law, math.exp(past)), 0.0)


@inner_kernel
def side_follow(d: Drive, nominal: Drive, first: bool) -> None:
    """Take over stiffness factors and lengths of the nominal state, at the first step its pretension factors too."""
    for c in range(d.size.cables):
        state, its = d.states[c], nominal.states[c]
        state.stiffness, state.offset = its.stiffness, its.offset
        if first:
            state.pretension = its.pretension


@inner_kernel
def side_retension(d: Drive, nominal: Drive, L: Floats) -> None:
    """Bring one bound to the pretension that the nominal state took on when it committed."""
    for c in range(d.size.cables):
        retension(d, L, c, nominal.states[c].pretension)


@inner_kernel
def _cable(
    b: Bounds, L: Floats, side: Side, c: int, tension: float, x_in: float, x_out: float, eps_in: float
) -> tuple[float, float, float]:
    """Stretch [m] of cable c and its derivative by the tension, kept as pending; and the margin [m] that covers
    the cable between the possible departure points and what merging of pieces did."""
    d, sign = side.drive, side.sign
    cable, state, G = d.cables[c], d.states[c], d.profiles
    t0 = cable.T0 * state.pretension * state.stiffness
    tau = tension / t0
    v = v_of_tau(L, 2, tau)
    e, a = strain_of_tau(L, 2, tau)
    dv = dv_dtau(L, 2, tau, v)
    total = cable.length * e
    slope = cable.length * a
    margin = 0.0
    for end in range(2):
        wrap = 2 * c + end
        mu = cable.mu[end]
        w = cable.wrap[end] + (cable.sign * x_out if end == OUT else -cable.sign * x_in)
        w = max(w, LEAST_WRAP)
        eps = b.cables[c].eps if end == OUT else eps_in
        shift = mu * eps * b.whole.steepest
        end_v = v + sign * shift
        end_tau = tau_of_v(L, 2, end_v)
        meet = wrap_eval(G, L, cable.law[end], wrap, d.heights[wrap], w, end_v, end_tau, mu)
        step = d.steps[wrap]
        set_pending(step, meet)
        step.w, step.end, step.tau = w, end_v, end_tau
        radius = cable.radius[end]
        total += radius * meet.total
        slope += radius * meet.slope * dv
        merged = G[wrap, B, d.heights[wrap] - 1]
        margin += radius * (eps * (abs(e) + 4.0 * shift * (1.0 + abs(e))) + 1.05 * merged)
    unit = cable.T0 * state.pretension / cable.EA
    return total * unit - state.offset, slope * unit / t0, margin * unit


@inner_kernel
def chain_bound(
    b: Bounds, nominal: Drive, L: Floats, side: Side, first: int, count: int, tension: float, x_in: float, x_out: float,
    eps_in: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Rotation [rad] of a chain's output shaft in one bound's state, its derivative by the output tension, its margin.

    All wraps stand at the nominal state's shaft angles; the side's `shaft` gets what its state adds to each
    shaft's angle.
    """
    theta = slope = margin = own = 0.0
    x, eps = x_in, eps_in
    for c in range(first, first + count):
        cable = side.drive.cables[c]
        shaft = x_out if c == first + count - 1 else nominal.states[c].shaft
        stretch, a, more = _cable(b, L, side, c, tension * cable.scale, x, shaft, eps)
        theta += cable.weight * stretch
        slope += cable.weight * cable.scale * a
        margin += cable.weight * more
        own = cable.ratio * own + cable.sign * stretch / cable.radius[OUT]
        side.drive.states[c].shaft = own
        x, eps = shaft, b.cables[c].eps
    return theta, slope, margin


@inner_kernel
def chain_turning(b: Bounds, d: Drive, first: int, count: int) -> tuple[float, float, float]:
    """Out of a state's pending evaluation: rotation [rad] of the chain's output per rad by which output wraps
    are turned, at most; the same for a shift of all end values by mu per rad; and its greatest compliance [rad/N]."""
    turning = shifting = compliance = 0.0
    for c in range(first, first + count):
        cable, state = d.cables[c], d.states[c]
        unit = cable.T0 * state.pretension / cable.EA * cable.weight
        soft = cable.length
        for end in range(2):
            step = d.steps[2 * c + end]
            mu = cable.mu[end] * b.whole.steepest
            radius = cable.radius[end]
            slid = unit * radius * mu * (step.total + step.w)
            shifting += slid
            turning += slid + unit * radius * abs(step.tau - 1.0)
            soft += radius * b.whole.steepest * math.expm1(mu * step.w) / mu
        compliance += soft * unit / (cable.T0 * state.pretension * state.stiffness) * cable.scale
    return turning, shifting, compliance


@inner_kernel
def chain_commit(d: Drive, L: Floats, first: int, count: int) -> None:
    """Make the last evaluation of a chain its bound's state."""
    for c in range(first, first + count):
        for end in range(2):
            wrap, law = 2 * c + end, d.cables[c].law[end]
            d.heights[wrap] = wrap_commit(d.profiles, L, law, wrap, d.heights[wrap], d.steps[wrap], MERGE)
