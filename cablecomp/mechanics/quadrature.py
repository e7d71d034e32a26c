"""Gauss-Legendre quadrature, and panels of an arc on which it sees how friction goes by place."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


SEEN = 1e-7
"""Share of the friction on a panel that eight points may miss of it."""
MOST_PANELS = 256
"""Panels of an arc at most: what is rougher than they see is taken as they see it."""


def gauss(points: int) -> tuple[Floats, Floats]:
    """Places and weights of Gauss-Legendre quadrature on [0, 1]."""
    x, weights = np.polynomial.legendre.leggauss(points)
    return (x + 1.0) / 2.0, weights / 2.0


LONG_X, LONG_W = gauss(8)
SHORT_X, SHORT_W = gauss(3)
MIDDLE_X, MIDDLE_W = gauss(5)


def panel(groove_factor: Callable[[Floats], Floats], wrap_max_rad: float) -> float:
    """The longest even part of the wrap [rad] on each of which `LONG_X` finds what it does on both halves, but for the
    share `SEEN`."""
    panels = 1
    while panels < MOST_PANELS:
        one, two = (_on_panels(groove_factor, wrap_max_rad, n) for n in (panels, 2 * panels))
        halves = 0.5 * (two[::2] + two[1::2])
        if np.all(np.abs(one - halves) <= SEEN * halves):
            break
        panels += (panels + 1) // 2
    return wrap_max_rad / panels


def _on_panels(factor: Callable[[Floats], Floats], wrap_max_rad: float, panels: int) -> Floats:
    """Mean of the factor on each of so many even parts of the wrap, by `LONG_X`."""
    places = (np.arange(panels)[:, None] + LONG_X) * (wrap_max_rad / panels)
    return np.asarray(factor(places.ravel()).reshape(places.shape) @ LONG_W)
