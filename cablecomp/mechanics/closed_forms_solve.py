"""Root of an increasing function, elementwise: Newton's method kept inside a bracket."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cablecomp.mechanics.closed_forms_wrap import Array

_ROUNDS = 300


class ValueSlope(NamedTuple):
    """A function's value and derivative, elementwise."""

    value: Array
    slope: Array


def solve_increasing(function: Callable[[Array], ValueSlope], low: Array, high: Array) -> Array:
    """Return x in [low, high] with function(x) = 0, to the last bits that the function's own rounding leaves.

    A Newton step that leaves the bracket, or that does not halve the last step, gives way to bisection, so
    the bracket always closes. Where the function does not change sign the nearer end is returned.
    """
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    x = 0.5 * (low + high)
    last = high - low
    for _ in range(_ROUNDS):
        value, slope = function(x)
        low = np.where(value <= 0.0, x, low)
        high = np.where(value >= 0.0, x, high)
        middle = 0.5 * (low + high)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            step = -value / slope
            newton = x + step
            # A step of a few ulp may round onto the bracket's edge; it is taken all the same.
            good = np.isfinite(newton) & (newton >= low) & (newton <= high) & (2.0 * np.abs(step) <= last)
        following = np.where(good, newton, middle)
        following = np.where(value == 0.0, x, following)
        last = np.where(good, np.abs(step), 0.5 * (high - low))
        moved = np.abs(following - x)
        x = following
        if np.all(moved <= 2.0**-52 * np.abs(x)):
            break
    return x
