"""Did a value change over the nights, slowly or at once? The shortest of three descriptions; own code: it is short."""

from __future__ import annotations

from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

FEWEST: Final = 5
"""Values below which nothing is said: a step has three parameters."""
EVIDENCE: Final = 10.0
"""Difference of the Bayesian information criterion that is called very strong (Kass and Raftery, J. Am. Stat.
Assoc. 90, 1995)."""


class Change(NamedTuple):
    """`how`: nothing, a trend or a step; `size`: last less first of the trend, or height of the step; `at`:
    first index after the step; `evidence`: difference of the information criterion to no change."""

    how: Literal["", "trend", "step"]
    size: float = 0.0
    at: int = 0
    evidence: float = 0.0


def change(values: ArrayLike, known_sd: float) -> Change:
    """Describe `values`, in order, by a constant, a straight line or one step.

    Gaussian scatter of unknown size, not below `known_sd` (what one value is known to); n ln(RSS/n + known_sd²)
    + k ln n with k = 1, 2, 3 is least for the description that is taken.
    """
    y = np.asarray(values, dtype=np.float64)
    n = len(y)
    if n < FEWEST or not np.all(np.isfinite(y)):
        return Change("")
    t = np.arange(n) - 0.5 * (n - 1)
    slope = float(t @ y / (t @ t))
    plain = _criterion(y - y.mean(), 1, known_sd)
    found = [Change("trend", slope * (n - 1), 0, plain - _criterion(y - y.mean() - slope * t, 2, known_sd))]
    for at in range(2, n - 1):  # two values on either side
        before, after = float(y[:at].mean()), float(y[at:].mean())
        left = np.concatenate([y[:at] - before, y[at:] - after])
        found.append(Change("step", after - before, at, plain - _criterion(left, 3, known_sd)))
    best = max(found, key=lambda c: c.evidence)
    return best if best.evidence > EVIDENCE else Change("", evidence=best.evidence)


def _criterion(left: np.ndarray, parameters: int, known_sd: float) -> float:
    n = len(left)
    return n * float(np.log(left @ left / n + max(known_sd, 1e-300) ** 2)) + parameters * float(np.log(n))
