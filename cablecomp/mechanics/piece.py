"""A straight piece of a tension profile: the integral of its strain by every law of friction and stiffness.

`tables.py` has the laws; `profile.py` makes profiles of pieces.
"""

from __future__ import annotations

import math

import numpy as np

from cablecomp.mechanics.jit import inner_kernel, leaf_kernel
from cablecomp.mechanics.tables import (
    GROOVED,
    HEAD,
    MODE,
    PLAIN,
    STIFF,
    STIFFENING,
    Floats,
    groove,
    stiffening_strain,
    strain,
)

F2, F3, F4, F5, F6, F7, F8 = (1.0 / math.factorial(_n) for _n in range(2, 9))


def _gauss(points: int) -> tuple[Floats, Floats]:
    """Places and weights of Gauss-Legendre quadrature on [0, 1]."""
    x, weights = np.polynomial.legendre.leggauss(points)
    return (x + 1.0) / 2.0, weights / 2.0


SHORT_X, SHORT_W = _gauss(3)
MIDDLE_X, MIDDLE_W = _gauss(5)
LONG_X, LONG_W = _gauss(8)


@leaf_kernel
def piece(
    laws: Floats, law: int, y1: float, v1: float, tau1: float, y2: float, v2: float, tau2: float
) -> tuple[float, float]:
    """Integral of e(v) over y1..y2 and of de/dv; e = strain * EA/T0 = tau - 1 for the plain cable, whose tau
    are tau1, tau2."""
    dy = y2 - y1
    d = v2 - v1
    if laws is None:
        return piece_plain(dy, d, tau1, tau2)
    if laws[0, HEAD, MODE] == PLAIN:
        return piece_plain(dy, d, tau1, tau2)
    if laws[0, HEAD, MODE] == STIFF:
        return _piece_stiff(laws[law, HEAD, STIFFENING], dy, v1, d)
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
def _piece_stiff(b: float, dy: float, v1: float, d: float) -> tuple[float, float]:
    """`piece` for a cable that stiffens under plain friction: Gauss-Legendre quadrature, its error below 1e-13 of the
    strain with 3 points on short pieces, with 5 on middling ones."""
    if abs(d) < 0.05:
        total, slope = _stiff_sums(SHORT_X, SHORT_W, b, v1, d)
    elif abs(d) < 0.4:
        total, slope = _stiff_sums(MIDDLE_X, MIDDLE_W, b, v1, d)
    else:
        total, slope = _stiff_sums(LONG_X, LONG_W, b, v1, d)
    return total * dy, slope * dy


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
def piece_table(laws: Floats, law: int, y1: float, v1: float, y2: float, v2: float) -> tuple[float, float]:
    """`piece` by Gauss-Legendre quadrature, for tabulated laws; 3 points on short pieces where friction has no
    place."""
    dy = y2 - y1
    d = v2 - v1
    total = 0.0
    slope = 0.0
    if laws[law, HEAD, GROOVED] == 0.0:
        if abs(d) < 0.05:
            for j in range(3):
                e, de = strain(laws, law, v1 + d * SHORT_X[j])
                total += SHORT_W[j] * e
                slope += SHORT_W[j] * de
        else:
            for j in range(8):
                e, de = strain(laws, law, v1 + d * LONG_X[j])
                total += LONG_W[j] * e
                slope += LONG_W[j] * de
        return total * dy, slope * dy
    s1 = groove(laws, law, y1)
    span = groove(laws, law, y2) - s1
    for j in range(8):
        y = y1 + dy * LONG_X[j]
        share = (groove(laws, law, y) - s1) / span if span > 0.0 else 0.0
        e, de = strain(laws, law, v1 + d * share)
        total += LONG_W[j] * e
        slope += LONG_W[j] * de
    return total * dy, slope * dy
