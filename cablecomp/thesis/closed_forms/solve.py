"""Root of an increasing function, elementwise: Newton's method in a bracket; own code, SciPy's on arrays keeps none."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cablecomp.thesis.closed_forms.wrap import Array

_ROUNDS = 300
_NEWTON = 2.0**-33  # after a Newton step this small, relative to x, the error is its square: rounding
_BISECTION = 2.0**-51


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
    done = np.zeros(x.shape, dtype=bool)
    for _ in range(_ROUNDS):
        value, slope = function(x)
        low = np.where(value <= 0.0, x, low)
        high = np.where(value >= 0.0, x, high)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            step = -value / slope
            newton = x + step
            good = np.isfinite(newton) & (newton >= low) & (newton <= high) & (2.0 * np.abs(step) <= last)
        following = np.where(good, newton, 0.5 * (low + high))
        last = np.where(good, np.abs(step), 0.5 * (high - low))
        moved = np.abs(following - x)
        x = np.where(done | (value == 0.0), x, following)
        done |= (value == 0.0) | (moved <= np.where(good, _NEWTON, _BISECTION) * np.abs(x))
        if np.all(done):
            break
    return x
