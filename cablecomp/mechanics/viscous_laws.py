"""Viscous slip where friction goes by tension or place, or where the cable's stiffness does.

As `viscous.py`, with friction mu m(T/T0) m_g(y) T per radian and the cable's strain law e(T/T0), e' = 1 at T0 (both by
`tables.py`): (R T0/EA) de/dt = dv/dy, c v = shrink(dT/dy, mu m m_g T). Between two nodes m T is that of their mean
tension, m_g the mean over the groove there. Strain is what a node stores, so that none is lost however far Newton's
method has got; slip at a face goes by tension alone. A step is solved once its conservation laws hold: the equations
are no longer linear where the faces that slip are known.
"""

from __future__ import annotations

from typing import NamedTuple

from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.jit import inner_kernel
from cablecomp.mechanics.profile import Floats, Wound, copy_floats
from cablecomp.mechanics.records import WET_NODES
from cablecomp.mechanics.tables import (
    GROOVED,
    HEAD,
    dv_dtau,
    friction_of_tau,
    groove,
    strain_of_tau,
    v_of_tau,
)
from cablecomp.mechanics.viscous import EVEN, Slide, arrive, diffusion, free_nodes, share_of

TURNS = 9  # steps of Newton's method after which it may be going round in a circle,
UNEVEN = 5  # steps then, of which each goes less far than the one before,
PATIENCE = 30  # and after which less will do, as far as a stiff step's own digits go
ROUNDED = 3e-16  # of the tension: what rounding leaves of a difference between nodes
OVER = 1e-2  # of that, by which what is held to slip may lie beyond the limit of friction


@inner_kernel
def lawful_eval(d: Drive, laws: Floats, c: int, end: int, w: float, tau: float, mu: float) -> Wound:
    """The cable on a drum at wrap angle w and end tension T/T0 = tau; kept as pending."""
    grid, law = d.grids[2 * c + end], d.cables[c].law[end]
    old, new, h = grid.tau, grid.tau_try, grid.step
    count, before = free_nodes(w, h), int(grid.count)
    again = grid.time_try == d.context.time and int(grid.count_try) == count
    arrive(grid, count, w, tau)
    last = count - 1
    s = Slide(old, new, grid.upper, grid.right, count, h, w - last * h, tau, mu, diffusion(d, c, end))
    if not again:
        copy_floats(old, 0, new, 0, count)
    if not again or count > before:
        grid.total_try = _stretch(s, laws, law)  # of what has not moved yet
    # what lies deeper than what moved by an evaluation within this step still sticks as it did
    start = max(min(int(grid.first_try), before) - 1, 0) if again else 0
    even = EVEN * max(1.0, s.rate / (1e4 * h * h))  # rounding grows with what is weighed up
    slope, gained = 0.0, 0.0
    for j in range(start, count):
        grid.upper[j] = 0.0
    for k in range(2 * WET_NODES):  # each sets one further node free
        weighed = _eliminate(s, laws, law, start)
        grid.first_try, gained, slope = weighed.first, weighed.gained, 0.0
        if weighed.first == count:
            break
        # by conservation all of the stretch comes in at the departure point
        slope = s.rate * (weighed.by_tau - weighed.by_last * grid.upper[last])
        # faces that begin and cease to slip in turn, on and on, are met part of the way
        _substitute(s, weighed.first, 1.0 / (1 + k % UNEVEN) if k >= TURNS else 1.0)
        enough = EVEN if k < PATIENCE else even
        if weighed.off <= enough and weighed.over <= OVER * enough:
            break
        start = max(weighed.first - 1, 0)
    grid.time_try, grid.rate_try = d.context.time, s.rate
    grid.count_try, grid.angle_try, grid.end_try = count, w, tau
    e, de = strain_of_tau(laws, law, tau)
    held, _ = strain_of_tau(laws, law, old[last])
    total = grid.total_try + gained + 0.5 * s.gap * (held + e)
    by_v = (slope + 0.5 * s.gap * de) / dv_dtau(laws, law, tau, v_of_tau(laws, law, tau))
    return Wound(total, by_v, e)


@inner_kernel
def _stretch(s: Slide, laws: Floats, law: int) -> float:
    """Integral of e over the nodes as they were before the step."""
    before, _ = strain_of_tau(laws, law, s.old[0])
    total = 0.0
    for j in range(1, s.nodes):
        e, _ = strain_of_tau(laws, law, s.old[j])
        total += 0.5 * s.h * (before + e)
        before = e
    return total


class Drag(NamedTuple):
    """What drives slip between two neighbouring nodes a (inward) and b."""

    slip: float
    by_a: float  # its derivatives
    by_b: float
    over: float  # distance beyond the limit of friction of what is held to slip


@inner_kernel
def _drag(
    laws: Floats, law: int, a: float, b: float, per_distance: float, hold: float, slipped: bool, gained: float
) -> Drag:
    """Slip between two neighbours, b outside of a: shrink((b - a)/distance, hold m(t) t), t their mean; what `slipped`
    is held to the equation of slip within the limit, too, while stretch has come through: `gained` inside, this step.

    Newton's method goes beyond the limit of friction by its bend: what stuck there went back to where it was before
    the step, and so to and fro for ever. At the limit to the last digits, which tell nothing of how a stiff step slips,
    what has come through tells it alone.
    """
    steep = (b - a) * per_distance
    friction, rises = friction_of_tau(laws, law, 0.5 * (a + b))
    side = 1.0 if steep > 0.0 else -1.0
    over = hold * friction - side * steep
    beyond = over / per_distance
    if abs(beyond) <= ROUNDED * (a + b):
        beyond, slipped = 0.0, True
    if beyond >= 0.0 and (over >= 0.0 if gained == 0.0 else not slipped or side * gained < 0.0):
        return Drag(0.0, 0.0, 0.0, 0.0)
    by_either = 0.5 * side * hold * rises
    return Drag(-side * over, -per_distance - by_either, per_distance - by_either, max(beyond, 0.0))


class Weighed(NamedTuple):
    """A step's equations where Newton's method stands: what is left of them, and what it does next."""

    first: int  # the deepest node that moves, or their number if none does
    off: float  # the largest residual, as a change of its node
    over: float  # the most by which a node lies beyond the limit of friction where it is held to slip
    gained: float  # integral of e over the nodes, by this step
    by_last: float  # derivative of slip at the departure point by the last node,
    by_tau: float  # and by the end value


@inner_kernel
def _eliminate(s: Slide, laws: Floats, law: int, start: int) -> Weighed:
    """The equations of the nodes from `start` on, inside of which all sticks: their elimination goes to `upper` and
    `right` (Thomas algorithm); `upper` is not 0 where the outer face slips, and tells the next one so."""
    per_h, per_gap, last = 1.0 / s.h, 1.0 / s.gap, s.nodes - 1
    grooved = laws[law, HEAD, GROOVED] != 0.0
    inner, first = Drag(0.0, 0.0, 0.0, 0.0), s.nodes
    off = over = gained = g_out = 0.0
    if grooved:
        g_out = groove(laws, law, start * s.h)
    for j in range(start, s.nodes):
        here, beyond, per, hold = s.new[j], s.tau, per_gap, s.mu
        if j < last:
            beyond, per = s.new[j + 1], per_h
        if grooved:
            g_in, g_out = g_out, groove(laws, law, (j + 1) * s.h if j < last else last * s.h + s.gap)
            hold *= (g_out - g_in) * per
        share, gain = share_of(s, j), 0.0
        e, de = strain_of_tau(laws, law, here)
        if here != s.old[j]:
            gain = e - strain_of_tau(laws, law, s.old[j])[0]
            gained += s.rate / share * gain
        outer = _drag(laws, law, here, beyond, per, hold, s.upper[j] < 0.0, gained)
        if first == s.nodes:
            if outer.slip == 0.0 and here == s.old[j]:
                continue
            first = j
        over = max(over, outer.over)
        target = share * (outer.slip - inner.slip) - gain
        own = de - share * (outer.by_a - inner.by_b)
        off = max(off, abs(target) / own)
        if j > first:
            below = share * inner.by_a
            own -= below * s.upper[j - 1]
            target -= below * s.right[j - 1]
        s.upper[j] = -share * outer.by_b / own
        s.right[j] = target / own
        inner = outer
    return Weighed(first, off, over, gained, inner.by_a, inner.by_b)


@inner_kernel
def _substitute(s: Slide, first: int, part: float) -> None:
    """Move the nodes from `first` on by that part of what the elimination in `upper` and `right` says."""
    change = 0.0
    for j in range(s.nodes - 1, first - 1, -1):
        change = s.right[j] - (s.upper[j] * change if j < s.nodes - 1 else 0.0)
        s.new[j] = max(s.new[j] + part * change, 1e-9)
