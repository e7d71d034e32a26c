"""Changes of variable that keep the cone law exact: friction by tension, friction by place, stiffness by tension.

`laws[law]` is a table of 7 rows: the head, whose places have names below, and six curves.
Mode PLAIN is the plain cable: v = ln tau, e = tau - 1, groove coordinate y. `laws` is None for the plain drive without
any change: the compiler then leaves out all code that a plain drive does not need. Mode STIFF is the plain friction of
PLAIN with the stiffening law of the head. In mode TABLED row U_OF_V holds u = ln tau on an even grid of
v = int du/m(e^u), row G_OF_Y the groove coordinate g(y) = int m_g dy on an even grid of y, row V_OF_U v on an even grid
of u; e(tau) follows from u by the stiffening law in the head. Where friction goes by tension, row E_OF_V holds e and
row AREA_OF_V its integral on the grid of v, and row PULL_OF_ROOT tau m(tau) on an even grid of sqrt(tau).
Here m(tau) = mu/mu0 as it depends on tension, m_g(y) = mu/mu0 as it depends on the place in the groove.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from cablecomp.mechanics.jit import constant, inner_kernel, kernel, leaf_kernel
from cablecomp.mechanics.quadrature import panel

Floats: TypeAlias = NDArray[np.float64]

SIZE = 4096
LEAST_STIFFNESS = 0.05  # share of EA below which a cable does not soften further
KNEE_HALF = 0.25  # half the tension over which a knee rises, over that amid it
LN_TAU: Floats = np.linspace(-7.0, 2.5, SIZE)
TAU: Floats = np.exp(LN_TAU)
ROOT: Floats = np.linspace(0.0, math.sqrt(TAU[-1]), SIZE)
ROOT_PER = (SIZE - 1) / math.sqrt(TAU[-1])
ABOUT_T0 = slice(int(np.searchsorted(LN_TAU, 0.0)) - 1, int(np.searchsorted(LN_TAU, 0.0)) + 1)
PLAIN, TABLED, STIFF = 0.0, 1.0, 2.0  # modes
THIRD, SIXTH = 1.0 / 3.0, 1.0 / 6.0
# laws: of all places but those with a groove of their own, of the joint's own drum in chain h and l, of the motor's
ELSEWHERE, ON_H, ON_L, IN_H, IN_L = (constant(k) for k in range(5))
# rows
HEAD, U_OF_V, G_OF_Y, V_OF_U, E_OF_V, AREA_OF_V, PULL_OF_ROOT = (constant(k) for k in range(7))
ROWS = 7
(
    MODE,
    V_LOW, V_PER,  # grids: their first value, and how many there are per unit
    Y_LOW, Y_PER,
    U_LOW, U_PER,
    STIFFENING, STEADY,  # b and w in EA(T) = EA/(w + (1 - w)/(1 + b (tau - 1)))
    GROOVED,  # 0 = g(y) is y itself
    BY_TENSION,  # 0 = v is ln tau itself
    KNEE, AGAIN,  # u and u2 (0: none)
    KNEE_AREA, KNEE_RISE,  # integral of S up to T0, S at T0
    PANEL,  # arc [rad] over which eight points see how friction goes by place
    FIRST_BEND,  # v of the bends of S, ascending, infinite where there are none
) = range(17)  # fmt: skip
BENDS = constant(4)
HEAD_SIZE = FIRST_BEND + 4


def plain_law() -> Floats:
    """The law of the thesis (constant mu, constant EA) in the form of a table."""
    return np.zeros((ROWS, HEAD_SIZE))


def stiffening_law(stiffening: float, steady: float = 0.0, knee: float = 0.0, again: float = 0.0) -> Floats:
    """Constant mu with the tangent stiffness EA/(steady + (1 - steady) f(tau)), in the form of a table.

    f = 1/(1 + stiffening (tau - 1)); with a knee (1 - stiffening S(tau))/(1 - stiffening S(1)), where S rises from 0 to
    1 straight from 0.75 knee to 1.25 knee; with `again` above it S falls there, and rises so about `again`."""
    table = np.zeros((ROWS, HEAD_SIZE))
    table[HEAD, MODE] = STIFF
    _set_stiffness(table, stiffening, steady, knee, again)
    return table


def _set_stiffness(table: Floats, stiffening: float, steady: float, knee: float, again: float) -> None:
    head = table[HEAD]
    head[STIFFENING], head[STEADY], head[KNEE], head[AGAIN] = stiffening, steady, knee, again
    if knee > 0.0:
        head[KNEE_AREA], head[KNEE_RISE] = knee_area(knee, again, 1.0)
        places = sorted((1.0 + way * KNEE_HALF) * u for u in (knee, again) if u > 0.0 for way in (-1.0, 1.0))
        bends = [v_of_tau(table[None], 0, tau) for tau in places]
        head[FIRST_BEND:HEAD_SIZE] = [*bends, *[math.inf] * (BENDS - len(bends))]


def law_table(
    tension_factor: Callable[[Floats], Floats],
    groove_factor: Callable[[Floats], Floats] | None,
    wrap_max_rad: float,
    stiffening: float = 0.0,
    steady: float = 0.0,
    knee: float = 0.0,
    again: float = 0.0,
) -> Floats:
    """Tabulate mu(tension)/mu0 (argument tau = T/T0), mu(groove place)/mu0 (argument y [rad] from the
    termination; None: the same everywhere) and the tangent stiffness as `stiffening_law`; both factors are vectorised
    and positive."""
    table = np.zeros((ROWS, SIZE))
    head = table[HEAD]
    by_tension = tension_factor(TAU)
    if np.any(by_tension != 1.0):
        v = _integral(LN_TAU[1] - LN_TAU[0], 1.0 / by_tension)
        v -= CubicHermiteSpline(LN_TAU[ABOUT_T0], v[ABOUT_T0], 1.0 / by_tension[ABOUT_T0])(0.0)
        v_grid = np.linspace(v[0], v[-1], SIZE)
        table[U_OF_V] = CubicHermiteSpline(v, LN_TAU, by_tension)(v_grid)
        table[V_OF_U] = v
        head[BY_TENSION] = 1.0
        head[V_LOW], head[V_PER] = v[0], 1.0 / (v_grid[1] - v_grid[0])
        head[U_LOW], head[U_PER] = LN_TAU[0], 1.0 / (LN_TAU[1] - LN_TAU[0])
        table[PULL_OF_ROOT] = ROOT * ROOT * tension_factor(np.maximum(ROOT * ROOT, TAU[0]))
    by_place = None if groove_factor is None else groove_factor(np.linspace(0.0, wrap_max_rad, SIZE))
    if groove_factor is not None and by_place is not None and np.any(by_place != 1.0):
        step = wrap_max_rad / (SIZE - 1)
        table[G_OF_Y] = _integral(step, by_place)
        head[GROOVED] = 1.0
        head[Y_PER] = 1.0 / step
        head[PANEL] = panel(groove_factor, wrap_max_rad)
    if head[BY_TENSION] or head[GROOVED]:
        head[MODE] = TABLED
    else:
        head[MODE] = STIFF if stiffening != 0.0 else PLAIN
    _set_stiffness(table, stiffening, steady, knee, again)
    if head[BY_TENSION] and knee == 0.0:
        _fill_strains(table[None], 0)
        table[AREA_OF_V] = _integral(1.0 / head[V_PER], table[E_OF_V])
    return table


def _integral(h: float, f: Floats) -> Floats:
    """Running integral on a grid of step h by Simpson's rule on its midpoints (trapezoid corrected by end slopes)."""
    slope = np.gradient(f, h, edge_order=2)
    steps = h * (f[1:] + f[:-1]) / 2.0 - h * h * (slope[1:] - slope[:-1]) / 12.0
    return np.concatenate(([0.0], np.cumsum(steps)))


@inner_kernel
def look_up(laws: Floats, law: int, row: int, low: float, per: float, x: float) -> float:
    """Cubic interpolation on an even grid (Catmull-Rom); straight beyond its ends."""
    return look_up_slope(laws, law, row, low, per, x)[0]


@inner_kernel
def look_up_slope(laws: Floats, law: int, row: int, low: float, per: float, x: float) -> tuple[float, float]:
    """As `look_up`, with its derivative by x."""
    p = (x - low) * per
    k = min(max(int(p), 1), SIZE - 3)
    t = p - k
    if t < -1.0 or t > 2.0:
        edge = 0 if t < 0.0 else SIZE - 2
        rise = laws[law, row, edge + 1] - laws[law, row, edge]
        return laws[law, row, edge] + (p - edge) * rise, rise * per
    a, b, c, d = laws[law, row, k - 1], laws[law, row, k], laws[law, row, k + 1], laws[law, row, k + 2]
    # Lagrange cubic through the four neighbours, in powers of t
    first = c - 0.5 * b - THIRD * a - SIXTH * d
    second = 0.5 * (a + c) - b
    third = SIXTH * (d - a) + 0.5 * (b - c)
    value = b + t * (first + t * (second + t * third))
    return value, (first + t * (2.0 * second + t * 3.0 * third)) * per


@leaf_kernel
def groove(laws: Floats, law: int, y: float) -> float:
    """Friction-weighted angle g(y); y itself for the plain law."""
    if laws is None:
        return y
    if laws[law, HEAD, GROOVED] == 0.0:
        return y
    return look_up(laws, law, G_OF_Y, laws[law, HEAD, Y_LOW], laws[law, HEAD, Y_PER], y)


@leaf_kernel
def groove_slope(laws: Floats, law: int, y: float) -> float:
    """dg/dy, friction at the place over mu; 1 for the plain law."""
    if laws is None:
        return 1.0
    if laws[law, HEAD, GROOVED] == 0.0:
        return 1.0
    return look_up_slope(laws, law, G_OF_Y, laws[law, HEAD, Y_LOW], laws[law, HEAD, Y_PER], y)[1]


@leaf_kernel
def between(laws: Floats, law: int, y_low: float, y_high: float, share: float) -> float:
    """The angle whose groove coordinate lies by `share` between those of y_low and y_high."""
    if laws is None:
        return y_low + share * (y_high - y_low)
    if laws[law, HEAD, GROOVED] == 0.0:
        return y_low + share * (y_high - y_low)
    low = groove(laws, law, y_low)
    return groove_inverse(laws, law, low + share * (groove(laws, law, y_high) - low), y_low, y_high)


@inner_kernel
def groove_inverse(laws: Floats, law: int, g: float, y_low: float, y_high: float) -> float:
    """The y between y_low and y_high with groove coordinate g (Newton's method, or a bisection where that leaves the
    bracket)."""
    lo, hi = y_low, y_high
    low, per = laws[law, HEAD, Y_LOW], laws[law, HEAD, Y_PER]
    g_lo, g_hi = groove(laws, law, lo), groove(laws, law, hi)
    y = lo
    if g_hi - g_lo > 0.0:
        y = lo + (hi - lo) * (g - g_lo) / (g_hi - g_lo)
    for _ in range(60):
        found, slope = look_up_slope(laws, law, G_OF_Y, low, per, y)
        off = found - g
        if abs(off) < 1e-14 or hi - lo <= 0.0:
            return y
        if off < 0.0:
            lo = y
        else:
            hi = y
        nearer = y - off / slope
        if not lo < nearer < hi:
            nearer = 0.5 * (lo + hi)
            if nearer in (lo, hi):
                return y
        y = nearer
    return y


@leaf_kernel
def v_of_tau(laws: Floats, law: int, tau: float) -> float:
    """Profile variable of the tension ratio tau = T/T0: ln tau for the plain law."""
    u = math.log(tau)
    if laws is None:
        return u
    if laws[law, HEAD, BY_TENSION] == 0.0:
        return u
    return look_up(laws, law, V_OF_U, laws[law, HEAD, U_LOW], laws[law, HEAD, U_PER], u)


@leaf_kernel
def dv_dtau(laws: Floats, law: int, tau: float, v: float) -> float:
    """Derivative of `v_of_tau`; 1/tau for the plain law."""
    if laws is None:
        return 1.0 / tau
    if laws[law, HEAD, BY_TENSION] == 0.0:
        return 1.0 / tau
    return _slope_table(laws, law, tau, v)


@inner_kernel
def _slope_table(laws: Floats, law: int, tau: float, v: float) -> float:
    return 1.0 / (
        tau * look_up_slope(laws, law, U_OF_V, laws[law, HEAD, V_LOW], laws[law, HEAD, V_PER], v)[1]
    )


@leaf_kernel
def tau_of_v(laws: Floats, law: int, v: float) -> float:
    """Tension ratio of the profile variable."""
    if laws is None:
        return math.exp(v)
    if laws[law, HEAD, BY_TENSION] == 0.0:
        return math.exp(v)
    return math.exp(look_up(laws, law, U_OF_V, laws[law, HEAD, V_LOW], laws[law, HEAD, V_PER], v))


@inner_kernel
def friction_of_tau(laws: Floats, law: int, tau: float) -> tuple[float, float]:
    """tau m(tau), what friction takes per radian over mu0 T0, and its derivative; tau itself where m = 1."""
    if laws[law, HEAD, BY_TENSION] == 0.0:
        return tau, 1.0
    root = math.sqrt(tau)
    value, slope = look_up_slope(laws, law, PULL_OF_ROOT, 0.0, ROOT_PER, root)
    return value, 0.5 * slope / root


@leaf_kernel
def strain_of_tau(laws: Floats, law: int, tau: float) -> tuple[float, float]:
    """e(tau) = strain * EA/T0 beyond that at T0, and its derivative: int w + (1 - w) f d tau (`stiffening_law`)."""
    if laws is None:
        return tau - 1.0, 1.0
    if laws[law, HEAD, MODE] == PLAIN:
        return tau - 1.0, 1.0
    return _strain_in_part(laws, law, tau)


@kernel
def _fill_strains(laws: Floats, law: int) -> None:
    """Write e at every v of the grid into row E_OF_V."""
    for k in range(SIZE):
        laws[law, E_OF_V, k] = strain_of_tau(laws, law, math.exp(laws[law, U_OF_V, k]))[0]


@inner_kernel
def _strain_in_part(laws: Floats, law: int, tau: float) -> tuple[float, float]:
    """The same of a cable part of whose compliance is steady."""
    if laws[law, HEAD, KNEE] > 0.0:
        e, de = _knee_strain(laws, law, tau)
    else:
        e, de = stiffening_strain(laws[law, HEAD, STIFFENING], tau)
    steady = laws[law, HEAD, STEADY]
    return steady * (tau - 1.0) + (1.0 - steady) * e, steady + (1.0 - steady) * de


@leaf_kernel
def knee_area(knee: float, again: float, tau: float) -> tuple[float, float]:
    """Integral over tau, up to it, of S (`stiffening_law`) for a knee at u; and S."""
    area, rise = risen(knee, tau)
    if again == 0.0:
        return area, rise
    once_more, twice = risen(again, tau)
    return tau - area + once_more, 1.0 - rise + twice


@leaf_kernel
def risen(knee: float, tau: float) -> tuple[float, float]:
    """Integral over tau of what rises straight from 0 at 0.75 u to 1 at 1.25 u; and that."""
    beyond = tau - (1.0 - KNEE_HALF) * knee
    if beyond <= 0.0:
        return 0.0, 0.0
    width = 2.0 * KNEE_HALF * knee
    if beyond >= width:
        return tau - knee, 1.0
    return 0.5 * beyond * beyond / width, beyond / width


@inner_kernel
def _knee_strain(laws: Floats, law: int, tau: float) -> tuple[float, float]:
    """The same of a cable that gives by the share b less where S is 1."""
    b = laws[law, HEAD, STIFFENING]
    area, rise = knee_area(laws[law, HEAD, KNEE], laws[law, HEAD, AGAIN], tau)
    at_1 = 1.0 - b * laws[law, HEAD, KNEE_RISE]
    return (tau - 1.0 - b * (area - laws[law, HEAD, KNEE_AREA])) / at_1, (1.0 - b * rise) / at_1


@inner_kernel
def stiffening_strain(b: float, tau: float) -> tuple[float, float]:
    """The same for the stiffening coefficient b, of a cable all of which stiffens."""
    if b == 0.0:
        return tau - 1.0, 1.0
    stiffness = 1.0 + b * (tau - 1.0)
    if stiffness < LEAST_STIFFNESS:  # the law makes no sense beyond; stay finite and monotone
        edge = (LEAST_STIFFNESS - 1.0) / b
        return math.log(LEAST_STIFFNESS) / b + (tau - 1.0 - edge) / LEAST_STIFFNESS, 1.0 / LEAST_STIFFNESS
    return math.log1p(b * (tau - 1.0)) / b, 1.0 / stiffness


@inner_kernel
def strain(laws: Floats, law: int, v: float) -> tuple[float, float]:
    """e and de/dv at the profile variable v (table mode)."""
    head = laws[law, HEAD]
    u, du = v, 1.0
    if head[BY_TENSION] != 0.0:
        if head[KNEE] == 0.0:
            return look_up_slope(laws, law, E_OF_V, head[V_LOW], head[V_PER], v)
        u, du = look_up_slope(laws, law, U_OF_V, head[V_LOW], head[V_PER], v)
    tau = math.exp(u)
    e, de = _strain_in_part(laws, law, tau)
    return e, de * tau * du
