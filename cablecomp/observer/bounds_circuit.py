"""Guaranteed bounds, compiled: one step of a circuit and of the joint.

Open circuit: the tension is known, the law preserves order. Closed circuit: with F(T_l; h, l) = theta_h(T_l + M/R; h) +
theta_l(T_l; l), rising in the tension and in both profiles, the true T_l lies between the roots of F(.; U, U) and
F(.; L, L): a mixed-monotone embedding. Alone it widens step by step where sliding wraps give more than the free span.
A second law holds it: displacements are monotone in the end values, so a drive that has more stretch in it,
F(T; U, U) = surplus >= 0, started above the true one and led by the same load, stays above it; likewise one with a
deficit below. The tighter of the two counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cablecomp.mechanics.drive import Drive, drive
from cablecomp.mechanics.jit import inlined_kernel, inner_kernel, kernel
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.records import OUT
from cablecomp.observer.bounds_kernel import (
    Bounds,
    Side,
    bounds_of,
    chain_bound,
    chain_commit,
    chain_turning,
    side_follow,
    side_retension,
    sides_start,
)

OUTWARD = 1e-11  # rounding of solved tensions, as a share of T0
# of solved angles [rad]: a solver's last steps, taken unseen, leave them off by 5e-11 at the most in 25 000 random
# histories of a joint with short wraps
ROUNDING = 1e-10


class Shafts(NamedTuple):
    """Where the nominal state's shafts stand [rad]: the input, the half width of what is known of it, the output."""

    x_in: float
    eps: float
    x_out: float


class Gap(NamedTuple):
    """Stretch of both chains together [rad]; they cancel where it is 0."""

    total: float
    slope: float  # its derivative by the tension
    theta_h: float  # either chain's part
    theta_l: float


@inner_kernel
def pair_gap(
    b: Bounds, nominal: Drive, laws: Floats, ic: int, high: Side, low: Side, tension: float, pull: float, x: Shafts,
    safe: float,
) -> Gap:  # fmt: skip
    """Both chains with chain h in state `high` and chain l in state `low`; margins count `safe` times, outward."""
    circuit = nominal.circuits[ic]
    count = circuit.count
    on_h = chain_bound(
        b, nominal, laws, high, circuit.first[0], count, tension + pull, x.x_in, x.x_out, x.eps
    )
    on_l = chain_bound(b, nominal, laws, low, circuit.first[1], count, tension, x.x_in, x.x_out, x.eps)
    theta_h = on_h.value + safe * high.sign * on_h.margin
    theta_l = on_l.value + safe * low.sign * on_l.margin
    return Gap(theta_h + theta_l, on_h.slope + on_l.slope, theta_h, theta_l)


@inner_kernel
def pair_root(
    b: Bounds, nominal: Drive, laws: Floats, ic: int, high: Side, low: Side, lowest: float, guess: float, pull: float,
    x: Shafts, safe: float, target: float,
) -> float:  # fmt: skip
    """The tension of cable l at which `pair_gap` is `target`, or the lowest one where it is more already."""
    circuit = nominal.circuits[ic]
    unit = nominal.cables[circuit.first[1] + circuit.count - 1].T0
    least, most = lowest, 1e300
    tension = max(guess, lowest)
    for iteration in range(100):
        gap = pair_gap(b, nominal, laws, ic, high, low, tension, pull, x, safe)
        over = gap.total - target
        if over >= 0.0:
            if tension <= lowest:
                return lowest
            most = tension
        else:
            least = tension
        step = -over / gap.slope
        if abs(step) <= 1e-13 * unit:
            return max(tension + step, lowest)
        tension += step
        if tension < lowest:
            tension = lowest
        elif not least <= tension <= most or iteration > 30:
            if most - least <= 1e-13 * unit:
                return tension
            if most < 1e299:
                tension = 0.5 * (least + most)
    return tension


@inlined_kernel
def tension_interval(
    b: Bounds,
    nominal: Drive,
    laws: Floats,
    ic: int,
    low: Side,
    up: Side,
    lowest: float,
    pull: float,
    x: Shafts,
) -> tuple[float, float]:
    """Lowest and highest possible tension of cable l."""
    circuit, its = nominal.circuits[ic], b.circuits[ic]
    first_h, first_l, count = circuit.first[0], circuit.first[1], circuit.count
    unit = nominal.cables[first_l + count - 1].T0
    first = its.first > 0.0
    moved_on = 0.0 if first else -0.5 * (pull - its.pull)  # by the load since the last step
    guess_low = unit if first else its.low + moved_on
    guess_high = unit if first else its.high + moved_on
    t_low = pair_root(b, nominal, laws, ic, up, up, lowest, guess_low, pull, x, 1.0, 0.0)
    t_high = pair_root(b, nominal, laws, ic, low, low, lowest, guess_high, pull, x, 1.0, 0.0)
    t_low = max(t_low - OUTWARD * unit, lowest)
    t_high += OUTWARD * unit
    if first or not _comparable(b, nominal, ic, low):
        return t_low, t_high
    growth = 0.0  # of the half widths
    for j in range(count):
        for c in (first_h + j, first_l + j):
            growth = max(growth, b.cables[c].eps - b.cables[c].eps_old)
    moved = 0.0
    for side in (up, low):
        on_h = chain_turning(b, side.drive, first_h, count)
        on_l = chain_turning(b, side.drive, first_l, count)
        turning, shifting = on_h.turning + on_l.turning, on_h.shifting + on_l.shifting
        drift = 0.5 * max(on_h.compliance, on_l.compliance) * abs(pull - its.pull) + 2.0 * turning * abs(
            x.x_in - its.x_in
        )
        moved = max(moved, turning * drift + shifting * growth)
    guess = min(guess_high, t_high)
    other = pair_root(b, nominal, laws, ic, up, up, lowest, guess, pull, x, 0.0, its.surplus + moved)
    t_high = min(t_high, other + OUTWARD * unit)
    # else a slack cable may have been taken up, and the deficit does not hold
    if its.low > floor_tension(nominal, ic, its.pull) * (1.0 + 1e-6):
        guess = max(guess_low, t_low)
        other = pair_root(b, nominal, laws, ic, low, low, lowest, guess, pull, x, 0.0, its.deficit - moved)
        t_low = max(t_low, other - OUTWARD * unit)
    return t_low, max(t_high, t_low)


@inner_kernel
def floor_tension(nominal: Drive, ic: int, pull: float) -> float:
    """The tension of cable l at which it, or cable h, is slack."""
    floor = nominal.circuits[ic].slack
    return floor if pull >= 0.0 else floor - pull


@inlined_kernel
def _comparable(b: Bounds, nominal: Drive, ic: int, low: Side) -> bool:
    """True where surplus and deficit carry over from the last step: same factors, less cable wound on than is free."""
    circuit = nominal.circuits[ic]
    for chain in range(2):
        first = circuit.first[chain]
        for c in range(first, first + circuit.count):
            cable, state, before = nominal.cables[c], nominal.states[c], b.cables[c]
            if before.pretension != low.drive.states[c].pretension or before.stiffness != state.stiffness:
                return False
            if abs(state.shaft - before.shaft) * cable.radius[OUT] > cable.length:
                return False
    return True


@inlined_kernel
def closed_interval(
    b: Bounds, nominal: Drive, laws: Floats, ic: int, low: Side, up: Side, pull: float, x: Shafts
) -> tuple[float, float]:
    """Lowest and highest possible deflection [rad] of a closed circuit; leaves the sides' next states pending."""
    its = b.circuits[ic]
    lowest = floor_tension(nominal, ic, pull)
    t_low, t_high = tension_interval(b, nominal, laws, ic, low, up, lowest, pull, x)
    # the deflection rises with chain h's profiles and falls with chain l's
    middle = 0.5 * (t_low + t_high)
    mixed = pair_root(b, nominal, laws, ic, up, low, lowest, middle, pull, x, 1.0, 0.0)
    clipped = min(max(mixed, t_low), t_high)
    gap = pair_gap(b, nominal, laws, ic, up, low, clipped, pull, x, 1.0)
    theta_high = _part(mixed, t_low, t_high, pull, gap.theta_h, -gap.theta_l)
    mixed = pair_root(b, nominal, laws, ic, low, up, lowest, middle, pull, x, 1.0, 0.0)
    clipped = min(max(mixed, t_low), t_high)
    gap = pair_gap(b, nominal, laws, ic, low, up, clipped, pull, x, 1.0)
    theta_low = _part(-mixed, -t_high, -t_low, pull, gap.theta_h, -gap.theta_l)
    its.surplus_try = pair_gap(b, nominal, laws, ic, up, up, t_high, pull, x, 0.0).total
    its.deficit_try = pair_gap(b, nominal, laws, ic, low, low, t_low, pull, x, 0.0).total
    its.low_try, its.high_try = t_low, t_high
    return theta_low, theta_high


@kernel
def _part(mixed: float, least: float, most: float, pull: float, by_h: float, by_l: float) -> float:
    """Which chain's stretch bounds the deflection; where the tension is none of the ends, either does unless
    one is slack."""
    if mixed < least:
        return by_l
    if mixed > most:
        return by_h
    return by_h if pull >= 0.0 else by_l


@inlined_kernel
def circuit_interval(
    b: Bounds, nominal: Drive, laws: Floats, ic: int, low: Side, up: Side, moment: float, x: Shafts
) -> tuple[float, float]:
    """Interval of a circuit's output angle [rad] at nominal input angle, its half width and nominal output angle `x`.

    The half widths eps that the evaluation assumes must hold what comes out; NaN if they find no rest.
    """
    circuit = nominal.circuits[ic]
    first_h, count = circuit.first[0], circuit.count
    pull = moment / circuit.radius
    for _ in range(12):
        if circuit.chains == 2:
            theta_low, theta_high = closed_interval(b, nominal, laws, ic, low, up, pull, x)
        else:
            last = first_h + count - 1
            tension = nominal.cables[last].T0 * low.drive.states[last].pretension + pull
            highest = chain_bound(b, nominal, laws, up, first_h, count, tension, x.x_in, x.x_out, x.eps)
            theta_high = highest.value + highest.margin
            lowest = chain_bound(b, nominal, laws, low, first_h, count, tension, x.x_in, x.x_out, x.eps)
            theta_low = lowest.value - lowest.margin
        if _eps_hold(b, nominal, ic, low, up, theta_low, theta_high, x):
            rigid = circuit.ratio
            rounding = ROUNDING * (1.0 + abs(x.x_out))
            least = rigid * (x.x_in - x.eps) + theta_low - rounding
            return least, rigid * (x.x_in + x.eps) + theta_high + rounding
    return math.nan, math.nan


@inlined_kernel
def _eps_hold(
    b: Bounds, nominal: Drive, ic: int, low: Side, up: Side, theta_low: float, theta_high: float, x: Shafts
) -> bool:
    """True if every shaft's assumed half width holds what came out; too narrow ones are widened, too wide ones narrowed
    for the next step."""
    circuit = nominal.circuits[ic]
    count = circuit.count
    held = True
    for chain in range(circuit.chains):
        first = circuit.first[chain]
        rigid = 1.0
        for c in range(first, first + count):
            rigid *= nominal.cables[c].ratio
            if c == first + count - 1:
                own, least, most = x.x_out - rigid * x.x_in, theta_low, theta_high
            else:
                own = nominal.states[c].shaft - rigid * x.x_in
                one, other = low.drive.states[c].shaft, up.drive.states[c].shaft
                least, most = min(one, other), max(one, other)
            needed = 1.001 * (max(most - own, own - least, 0.0) + abs(rigid) * x.eps) + 1e-15
            width = b.cables[c]
            if not needed <= width.eps:
                width.eps = 1.2 * needed
                held = False
            elif needed < 0.5 * width.eps:
                width.eps_next = 1.2 * needed
            else:
                width.eps_next = width.eps
    return held


@inlined_kernel
def circuit_keep(
    b: Bounds, nominal: Drive, laws: Floats, ic: int, low: Side, up: Side, pull: float, x_in: float
) -> None:
    """Make the pending states of a circuit's bounds their states."""
    circuit, its = nominal.circuits[ic], b.circuits[ic]
    for chain in range(circuit.chains):
        first = circuit.first[chain]
        chain_commit(low.drive, laws, first, circuit.count)
        chain_commit(up.drive, laws, first, circuit.count)
        for c in range(first, first + circuit.count):
            cable, state = b.cables[c], nominal.states[c]
            cable.pretension, cable.stiffness = low.drive.states[c].pretension, state.stiffness
            cable.shaft = state.shaft
            cable.eps_old = cable.eps
            cable.eps = cable.eps_next
    its.surplus, its.deficit = its.surplus_try, its.deficit_try
    its.low, its.high = its.low_try, its.high_try
    its.pull, its.x_in, its.first = pull, x_in, 0.0


@kernel
def bounds_step(
    fixed: Floats, layout: Ints, memory: Floats, heights: Ints, laws: Floats, numbers: Floats,
    memory_low: Floats, heights_low: Ints, memory_up: Floats, heights_up: Ints,
) -> tuple[float, float]:  # fmt: skip
    """Follow the last committed step of the nominal state `memory`; lowest and highest possible joint angle [rad] of
    the drive."""
    nominal = drive(fixed, layout, memory, heights)
    low, up = (
        Side(drive(fixed, layout, memory_low, heights_low), -1.0),
        Side(drive(fixed, layout, memory_up, heights_up), 1.0),
    )
    b = bounds_of(nominal.size.circuits, nominal.size.cables, numbers)
    first = b.circuits[0].first > 0.0
    side_follow(low.drive, nominal, first)
    side_follow(up.drive, nominal, first)
    moment = nominal.context.load - nominal.context.moment
    x_in, eps = nominal.context.motor, 0.0
    least = most = x_in
    for ic in range(nominal.size.circuits):
        circuit = nominal.circuits[ic]
        share = moment * circuit.share
        last = circuit.first[0 if share >= 0.0 else 1] + circuit.count - 1
        x_out = nominal.states[last].shaft
        least, most = circuit_interval(b, nominal, laws, ic, low, up, share, Shafts(x_in, eps, x_out))
        if math.isnan(least):  # nothing is known any more: start anew
            sides_start(fixed, layout, laws, numbers, memory_low, heights_low, memory_up, heights_up)
            return least, most
        circuit_keep(b, nominal, laws, ic, low, up, share / circuit.radius, x_in)
        x_in, eps = x_out, max(most - x_out, x_out - least)
    if laws is not None:
        side_retension(low.drive, nominal, laws)
        side_retension(up.drive, nominal, laws)
    return least, most
