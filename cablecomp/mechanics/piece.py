"""A straight piece of a tension profile: the integral of its strain by every law of friction and stiffness.

`tables.py` has the laws; `profile.py` makes profiles of pieces.
"""

from __future__ import annotations

import math

from cablecomp.mechanics.jit import inner_kernel, leaf_kernel
from cablecomp.mechanics.quadrature import (
    LONG_W,
    LONG_X,
    MIDDLE_W,
    MIDDLE_X,
    MOST_PANELS,
    SHORT_W,
    SHORT_X,
)
from cablecomp.mechanics.tables import (
    AGAIN,
    AREA_OF_V,
    BENDS,
    E_OF_V,
    FIRST_BEND,
    GROOVED,
    HEAD,
    KNEE,
    KNEE_AREA,
    KNEE_HALF,
    KNEE_RISE,
    LEAST_STIFFNESS,
    MODE,
    PANEL,
    PLAIN,
    SIXTH,
    STEADY,
    STIFF,
    STIFFENING,
    TABLED,
    V_LOW,
    V_PER,
    Floats,
    between,
    groove,
    look_up,
    stiffening_strain,
    strain,
)

LEAST_TABLED = 0.2
"""Rise of a piece from which on the tabled integral of its strain is exact enough: its error is divided by the rise."""
SHORT_STIFF = 0.2
"""Rise up to which a piece of a cable that stiffens is done by a series: (0.1/pi)^10 is 1e-15."""
SHORT_GROOVE = 0.25
"""Arc [rad] on which five points lie no farther apart than eight do on longer pieces."""
LEAST_CLOSED = 1e-6
"""Stiffening coefficient from which on a piece is done in closed form."""
PI2_6 = math.pi**2 / 6.0
# Bernoulli's numbers over (2 k + 1)!
B2, B4, B6, B8, B10, B12, B14 = (
    numerator / (denominator * math.factorial(2 * _k + 1))
    for _k, (numerator, denominator) in enumerate(
        [(1.0, 6.0), (-1.0, 30.0), (1.0, 42.0), (-1.0, 30.0), (5.0, 66.0), (-691.0, 2730.0), (7.0, 6.0)],
        start=1,
    )
)
F2, F3, F4, F5, F6, F7, F8 = (1.0 / math.factorial(_n) for _n in range(2, 9))


@leaf_kernel
def piece(
    laws: Floats, law: int, y1: float, v1: float, tau1: float, y2: float, v2: float, tau2: float
) -> tuple[float, float]:
    """Integral of e(v) over y1..y2 and of de/dv; e = strain * EA/T0 = tau - 1 for the plain cable, whose tau
    are tau1, tau2 (exp(v) wherever friction is plain)."""
    dy = y2 - y1
    d = v2 - v1
    if laws is None:
        return piece_plain(dy, d, tau1, tau2)
    if laws[law, HEAD, MODE] == PLAIN:
        return piece_plain(dy, d, tau1, tau2)
    if laws[law, HEAD, MODE] == STIFF and laws[law, HEAD, KNEE] == 0.0:
        total, slope = _piece_stiff(laws[law, HEAD, STIFFENING], dy, v1, tau1, v2, tau2)
        steady = laws[law, HEAD, STEADY]
        if steady == 0.0:
            return total, slope
        plain, plain_slope = piece_plain(dy, d, tau1, tau2)
        return steady * plain + (1.0 - steady) * total, steady * plain_slope + (1.0 - steady) * slope
    if laws[law, HEAD, KNEE] > 0.0:
        return _piece_bent(laws, law, y1, v1, tau1, y2, v2, tau2)
    return piece_table(laws, law, y1, v1, y2, v2)


@leaf_kernel
def piece_plain(dy: float, d: float, tau1: float, tau2: float) -> tuple[float, float]:
    """`piece` in closed form: exp(v) over a straight piece that rises by d."""
    if abs(d) > 0.1:
        grown = dy * (tau2 - tau1) / d
    else:  # (1 - exp(-d))/d as a series: the difference of the exponentials would cancel
        grown = dy * tau2 * (1.0 - d * (F2 - d * (F3 - d * (F4 - d * (F5 - d * (F6 - d * (F7 - d * F8)))))))
    return grown - dy, grown


@inner_kernel
def _piece_stiff(b: float, dy: float, v1: float, tau1: float, v2: float, tau2: float) -> tuple[float, float]:
    """`piece` for a cable all of which stiffens, under plain friction: in closed form, but for short pieces, where
    differences would cancel, by a series, and by Gauss-Legendre quadrature where the cable softens.

    e(v) = (ln(1 - b) + ln(1 + c exp v))/b with c = b/(1 - b); int ln(1 + c exp v) dv = -Li2(-c exp v).
    """
    d = v2 - v1
    if 0.0 <= b <= 1.0 - LEAST_STIFFNESS and abs(d) < SHORT_STIFF:
        total, slope = _stiff_about(b, math.sqrt(tau1 * tau2), 0.25 * d * d)
    elif abs(d) < 0.05:
        total, slope = _stiff_sums(MIDDLE_X, MIDDLE_W, b, v1, d)
    elif abs(b) > LEAST_CLOSED and 1.0 + b * (max(tau1, tau2) - 1.0) > LEAST_STIFFNESS:
        c = b / (1.0 - b)
        area1, l1 = log_area(c * tau1)
        area2, l2 = log_area(c * tau2)
        total = (math.log1p(-b) + (area2 - area1) / d) / b
        slope = (l2 - l1) / (b * d)
    else:
        total, slope = _stiff_sums(LONG_X, LONG_W, b, v1, d)
    return total * dy, slope * dy


@leaf_kernel
def _stiff_about(b: float, tau: float, h2: float) -> tuple[float, float]:
    """Mean of e and of q = de/dv over a piece of half rise h = sqrt(h2) about T/T0 = tau, 0 <= b < 1: by the even
    derivatives there, which for p = b q follow from p' = p (1 - p).

    What is left out is of the size of (h/pi)^10: p has its poles off the real axis by pi."""
    e = math.log1p(b * (tau - 1.0)) / b if b > 0.0 else tau - 1.0
    q = tau / (1.0 + b * (tau - 1.0))
    p = b * q
    a = p * (1.0 - p)
    # h^2/6, then h^4/120, h^6/5040 and h^8/9! as shares of it
    bend, fourth = q * (1.0 - p) * h2 * SIXTH, 0.05 * h2
    sixth = fourth * h2 / 42.0
    eighth = sixth * h2 / 72.0
    rest = fourth * (1.0 - 6.0 * a) + sixth * (1.0 - a * (30.0 - 120.0 * a))
    e += bend * (1.0 + rest + eighth * (1.0 - a * (126.0 - a * (1680.0 - 5040.0 * a))))
    rest = fourth * (1.0 - 12.0 * a) + sixth * (1.0 - a * (60.0 - 360.0 * a))
    q += bend * (1.0 - 2.0 * p) * (1.0 + rest + eighth * (1.0 - a * (252.0 - a * (5040.0 - 20160.0 * a))))
    return e, q


@inner_kernel
def log_area(z: float) -> tuple[float, float]:
    """-Li2(-z), the integral of ln(1 + z)/z from 0 to z > -1, and ln(1 + z).

    By u = ln(1 + z) where |z| is small, u = ln(1 + 1/z) beyond 1, u = -ln(-z) below -1/2: by Li2's reflections a series
    in Bernoulli's numbers whose terms fall at least as (ln 2/2 pi)^2 (NIST Digital Library of Mathematical Functions,
    25.12).
    """
    grown = math.log1p(z)
    u, log_z = grown, 0.0
    if z > 1.0:
        log_z = math.log(z)
        u = grown - log_z
    elif z < -0.5:
        log_z = math.log(-z)
        u = -log_z
    w = u * u
    odd = u * (1.0 + w * (B2 + w * (B4 + w * (B6 + w * (B8 + w * (B10 + w * (B12 + w * B14)))))))
    if z > 1.0:
        return PI2_6 - grown * (0.5 * grown - log_z) - odd + 0.25 * w, grown
    if z < -0.5:
        return odd - 0.25 * w + log_z * grown - PI2_6, grown
    return odd + 0.25 * w, grown


@inner_kernel
def _stiff_sums(x: Floats, weights: Floats, b: float, v1: float, d: float) -> tuple[float, float]:
    """Weighted sums of e(v1 + d x) and of its derivative for the stiffening coefficient b."""
    total = slope = 0.0
    for j in range(len(x)):
        tau = math.exp(v1 + d * x[j])
        e, de = stiffening_strain(b, tau)
        total += weights[j] * e
        slope += weights[j] * de * tau
    return total, slope


@inner_kernel
def _strain_sums(
    x: Floats, weights: Floats, laws: Floats, law: int, v1: float, dy: float, d: float
) -> tuple[float, float]:
    """Weighted sums of e(v1 + d x) and of its derivative, times dy."""
    total = slope = 0.0
    for j in range(len(x)):
        e, de = strain(laws, law, v1 + d * x[j])
        total += weights[j] * e
        slope += weights[j] * de
    return total * dy, slope * dy


@inner_kernel
def _piece_bent(
    laws: Floats, law: int, y1: float, v1: float, tau1: float, y2: float, v2: float, tau2: float
) -> tuple[float, float]:
    """`piece` for a cable with a knee: in parts between the bends of its compliance."""
    tabled = laws[law, HEAD, MODE] == TABLED
    total = slope = 0.0
    y, v, tau = y1, v1, tau1
    for k in range(BENDS + 1):
        y_to, v_to, tau_to = y2, v2, tau2
        if k < BENDS:
            bend = laws[law, HEAD, FIRST_BEND + (k if v2 > v1 else BENDS - 1 - k)]
            share = (bend - v1) / (v2 - v1) if v2 != v1 else 2.0
            if not 0.0 < share < 1.0:
                continue
            v_to, tau_to = bend, math.exp(bend)
            y_to = between(laws, law, y1, y2, share) if tabled else y1 + share * (y2 - y1)
        if tabled:
            part, part_slope = piece_table(laws, law, y, v, y_to, v_to)
        else:
            part, part_slope = _piece_of_line(laws, law, y_to - y, v, tau, v_to, tau_to)
        total += part
        slope += part_slope
        y, v, tau = y_to, v_to, tau_to
    return total, slope


@inner_kernel
def _piece_of_line(
    laws: Floats, law: int, dy: float, v1: float, tau1: float, v2: float, tau2: float
) -> tuple[float, float]:
    """`piece` under plain friction where the compliance is a straight line over the tension, beside a knee or in it:
    e is a parabola of exp(v), done in closed form; on short pieces, where differences would cancel, by Gauss-Legendre
    quadrature."""
    d = v2 - v1
    if abs(d) < 0.05:
        return _strain_sums(MIDDLE_X, MIDDLE_W, laws, law, v1, dy, d)
    head = laws[law, HEAD]
    steady = head[STEADY]
    at_1 = 1.0 - head[STIFFENING] * head[KNEE_RISE]
    middle, grown = 0.5 * (tau1 + tau2), tau2 - tau1
    rise, area = _rise_of_line(head[KNEE], middle, grown, d)
    if head[AGAIN] > 0.0:
        rise_again, area_again = _rise_of_line(head[AGAIN], middle, grown, d)
        rise, area = grown - rise + rise_again, grown - area + area_again
    share = (1.0 - steady) / at_1
    bent = grown - d - head[STIFFENING] * (area - head[KNEE_AREA] * d)
    total = steady * (grown - d) + share * bent
    slope = steady * grown + share * (grown - head[STIFFENING] * rise)
    return total * dy / d, slope * dy / d


@inner_kernel
def _rise_of_line(knee: float, middle: float, grown: float, d: float) -> tuple[float, float]:
    """By how much the integral of what rises about one knee grows over a piece beside it or in it, about `middle`, over
    which tau has grown by `grown`; and the integral of it over v."""
    low, width = (1.0 - KNEE_HALF) * knee, 2.0 * KNEE_HALF * knee
    if middle > low + width:
        return grown, grown - knee * d
    if middle > low:
        return grown * (middle - low) / width, (grown * (middle - 2.0 * low) + low * low * d) / (2.0 * width)
    return 0.0, 0.0


@inner_kernel
def piece_table(laws: Floats, law: int, y1: float, v1: float, y2: float, v2: float) -> tuple[float, float]:
    """`piece` for tabulated laws: on long pieces where friction has no place by the tabled integral of e over v, else
    by Gauss-Legendre quadrature, of few points on short pieces."""
    dy = y2 - y1
    d = v2 - v1
    head = laws[law, HEAD]
    if head[GROOVED] == 0.0:
        if abs(d) < 0.05:
            return _strain_sums(SHORT_X, SHORT_W, laws, law, v1, dy, d)
        if abs(d) < LEAST_TABLED:
            return _strain_sums(MIDDLE_X, MIDDLE_W, laws, law, v1, dy, d)
        if head[KNEE] > 0.0:
            return _strain_sums(LONG_X, LONG_W, laws, law, v1, dy, d)
        low, per = head[V_LOW], head[V_PER]
        area = look_up(laws, law, AREA_OF_V, low, per, v2) - look_up(laws, law, AREA_OF_V, low, per, v1)
        risen = look_up(laws, law, E_OF_V, low, per, v2) - look_up(laws, law, E_OF_V, low, per, v1)
        return area * dy / d, risen * dy / d
    if dy < min(SHORT_GROOVE, 0.25 * head[PANEL]) and abs(d) < 0.05:
        return _groove_sums(MIDDLE_X, MIDDLE_W, laws, law, y1, v1, dy, d)
    return _groove_sums(LONG_X, LONG_W, laws, law, y1, v1, dy, d)


@inner_kernel
def _groove_sums(
    x: Floats, weights: Floats, laws: Floats, law: int, y1: float, v1: float, dy: float, d: float
) -> tuple[float, float]:
    """The same where v rises with the groove coordinate g(y1 + dy x), panel by panel."""
    s1 = groove(laws, law, y1)
    span = groove(laws, law, y1 + dy) - s1
    rise = d / span if span > 0.0 else 0.0
    panels = int(min(float(MOST_PANELS), dy / laws[law, HEAD, PANEL])) + 1
    part = dy / panels
    total = slope = 0.0
    for k in range(panels):
        for j in range(len(x)):
            e, de = strain(laws, law, v1 + rise * (groove(laws, law, y1 + (k + x[j]) * part) - s1))
            total += weights[j] * e
            slope += weights[j] * de
    return total * part, slope * part
