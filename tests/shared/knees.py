"""A cable's knee as straight lines, for tests: the share S that is 1 beyond it, or beside a softer stretch."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def bends(knee: float, again: float) -> NDArray[np.float64]:
    """T/T0 between which S is straight: a quarter beside each of what is given."""
    return np.sort([w * u for u in (knee, again) if u for w in (0.75, 1.25)])


def stiff_share(tau: ArrayLike, knee: float, again: float) -> NDArray[np.float64]:
    """S at these T/T0: from 0 to 1 about the knee; with `again`, from 1 to 0 there and back to 1 about that."""
    once, twice = (np.interp(tau, [0.75 * u, 1.25 * u], [0.0, 1.0]) for u in (knee, again or knee))
    return np.asarray(1.0 - once + twice if again else once)
