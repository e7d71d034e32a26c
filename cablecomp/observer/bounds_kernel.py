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
from cablecomp.mechanics.flat import records
from cablecomp.mechanics.jit import inlined_kernel, inner_kernel, kernel
from cablecomp.mechanics.pretension import retension
from cablecomp.mechanics.profile import (
    LEAST_WRAP,
    Floats,
    Ints,
    set_pending,
    wrap_commit,
    wrap_eval,
    wrap_fill,
)
from cablecomp.mechanics.records import OUT, floats, record
from cablecomp.mechanics.tables import (
    BY_TENSION,
    ELSEWHERE,
    G_OF_Y,
    GROOVED,
    HEAD,
    U_OF_V,
    V_PER,
    Y_PER,
    dv_dtau,
    strain_of_tau,
    tau_of_v,
    v_of_tau,
)

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


class Bound(NamedTuple):
    """What one bound's state makes of a stretch or a rotation."""

    value: float
    slope: float  # its derivative by the tension
    margin: float  # what the truth may lie beyond it


class Turning(NamedTuple):
    """The greatest rotation of a chain's output [rad]: per rad by which output wraps are turned, per rad of a shift
    of all end values by mu per rad, per N."""

    turning: float
    shifting: float
    compliance: float


def named_bounds(circuits: int, cables: int, numbers: Floats) -> Bounds:
    """The records in the flat array of the bounds of a joint with this many circuits and cables."""
    return Bounds(
        records(numbers, 0, (1,), BOUNDS)[0],
        records(numbers, N_BOUNDS, (circuits,), BOUNDS_CIRCUIT),
        records(numbers, N_BOUNDS + circuits * N_CIRCUIT, (cables,), BOUNDS_CABLE),
    )


bounds_of = inlined_kernel(named_bounds)


def bounds_numbers(model: Model, past_low: float, past_high: float) -> Floats:
    """The bounds' flat array before their start; past = least and greatest ln(T/T0) that any cable has borne."""
    size = model.named(model.memory, model.heights).size
    numbers = np.zeros(N_BOUNDS + size.circuits * N_CIRCUIT + size.cables * N_CABLE)
    whole = named_bounds(size.circuits, size.cables, numbers).whole
    whole.steepest, whole.past_low, whole.past_high = steepest(model.laws), past_low, past_high
    return numbers


def steepest(laws: Floats | None) -> float:
    """Greatest factor by which a law table (None = plain) raises friction over mu, by place and by tension
    (e^-2..e^2)."""
    if laws is None:
        return 1.0
    place = tension = 1.0
    for law in laws:
        head = law[HEAD]
        if head[GROOVED]:
            place = max(place, float(np.max(np.diff(law[G_OF_Y]) * head[Y_PER])))
        if head[BY_TENSION]:
            u = law[U_OF_V]
            steep = (np.diff(u) * head[V_PER])[np.abs(u[1:]) < 2.0]
            tension = max(tension, float(np.max(steep)))
    return place * tension


@kernel
def sides_start(
    fixed: Floats,
    layout: Ints,
    laws: Floats,
    numbers: Floats,
    memory_low: Floats,
    heights_low: Ints,
    memory_up: Floats,
    heights_up: Ints,
) -> None:
    """Fill all wraps of two started joints with the least and the greatest tension of the past; the first step
    cuts them to what friction admits."""
    low, up = drive(fixed, layout, memory_low, heights_low), drive(fixed, layout, memory_up, heights_up)
    b = bounds_of(low.size.circuits, low.size.cables, numbers)
    numbers[N_BOUNDS:] = 0.0
    _fill(low, laws, b.whole.past_low)
    _fill(up, laws, b.whole.past_high)
    for c in range(low.size.cables):
        b.cables[c].eps = EPS_START
    for ic in range(low.size.circuits):
        b.circuits[ic].first = 1.0


@inner_kernel
def _fill(d: Drive, laws: Floats, past: float) -> None:
    for c in range(d.size.cables):
        for end in range(2):
            wrap, law = 2 * c + end, d.cables[c].law[end]
            w = d.profiles[wrap, d.heights[wrap] - 1].y
            d.heights[wrap] = wrap_fill(
                d.profiles[wrap], laws, law, w, v_of_tau(laws, law, math.exp(past)), 0.0
            )


@inner_kernel
def side_follow(d: Drive, nominal: Drive, first: bool) -> None:
    """Take over stiffness factors and lengths of the nominal state, at the first step its pretension factors too."""
    for c in range(d.size.cables):
        state, its = d.states[c], nominal.states[c]
        state.stiffness, state.offset = its.stiffness, its.offset
        if first:
            state.pretension = its.pretension


@inner_kernel
def side_retension(d: Drive, nominal: Drive, laws: Floats) -> None:
    """Bring one bound to the pretension that the nominal state took on when it committed."""
    for c in range(d.size.cables):
        retension(d, laws, c, nominal.states[c].pretension)


@inlined_kernel
def _cable(
    b: Bounds, laws: Floats, side: Side, c: int, tension: float, x_in: float, x_out: float, eps_in: float
) -> Bound:
    """Stretch [m] of cable c, kept as pending; the margin covers the cable between the possible departure points
    and what merging of pieces did."""
    d, sign = side.drive, side.sign
    cable, state = d.cables[c], d.states[c]
    t0 = cable.T0 * state.pretension * state.stiffness
    tau = tension / t0
    v = v_of_tau(laws, ELSEWHERE, tau)
    e, a = strain_of_tau(laws, ELSEWHERE, tau)
    dv = dv_dtau(laws, ELSEWHERE, tau, v)
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
        end_tau = tau_of_v(laws, ELSEWHERE, end_v)
        meet = wrap_eval(d.profiles[wrap], laws, cable.law[end], d.heights[wrap], w, end_v, end_tau, mu)
        step = d.steps[wrap]
        set_pending(step, meet)
        step.w, step.end_v, step.end_tau = w, end_v, end_tau
        radius = cable.radius[end]
        total += radius * meet.total
        slope += radius * meet.slope * dv
        merged = d.profiles[wrap, d.heights[wrap] - 1].stretch_error
        margin += radius * (eps * (abs(e) + 4.0 * shift * (1.0 + abs(e))) + 1.05 * merged)
    unit = cable.T0 * state.pretension / cable.EA
    return Bound(total * unit - state.offset, slope * unit / t0, margin * unit)


@inner_kernel
def chain_bound(
    b: Bounds, nominal: Drive, laws: Floats, side: Side, first: int, count: int, tension: float, x_in: float,
    x_out: float, eps_in: float,
) -> Bound:  # fmt: skip
    """Rotation [rad] of a chain's output shaft in one bound's state.

    All wraps stand at the nominal state's shaft angles; the side's `shaft` gets what its state adds to each
    shaft's angle.
    """
    theta = slope = margin = own = 0.0
    x, eps = x_in, eps_in
    for c in range(first, first + count):
        cable = side.drive.cables[c]
        shaft = x_out if c == first + count - 1 else nominal.states[c].shaft
        stretch = _cable(b, laws, side, c, tension * cable.scale, x, shaft, eps)
        theta += cable.weight * stretch.value
        slope += cable.weight * cable.scale * stretch.slope
        margin += cable.weight * stretch.margin
        own = cable.ratio * own + cable.sign * stretch.value / cable.radius[OUT]
        side.drive.states[c].shaft = own
        x, eps = shaft, b.cables[c].eps
    return Bound(theta, slope, margin)


@inner_kernel
def chain_turning(b: Bounds, d: Drive, first: int, count: int) -> Turning:
    """What a chain's pending evaluation can give way at most."""
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
            turning += slid + unit * radius * abs(step.end_tau - 1.0)
            soft += radius * b.whole.steepest * math.expm1(mu * step.w) / mu
        compliance += soft * unit / (cable.T0 * state.pretension * state.stiffness) * cable.scale
    return Turning(turning, shifting, compliance)


@inner_kernel
def chain_commit(d: Drive, laws: Floats, first: int, count: int) -> None:
    """Make the last evaluation of a chain its bound's state."""
    for c in range(first, first + count):
        for end in range(2):
            wrap, law = 2 * c + end, d.cables[c].law[end]
            d.heights[wrap] = wrap_commit(d.profiles[wrap], laws, law, d.heights[wrap], d.steps[wrap], MERGE)
