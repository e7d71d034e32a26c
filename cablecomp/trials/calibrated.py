"""How far stated probabilities can be trusted: calibration error, Brier score, risk against coverage."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BINS = 10
DRAWS = 400
"""Sets drawn for what a perfect confidence would show."""


def calibration_error(probability: Sequence[float], right: Sequence[bool], bins: int = BINS) -> float:
    """Expected calibration error: sum over bins of n_b/n |share right - mean probability|, bins of equal counts.

    Equal counts because names cluster near 0 and 1 (M. Naeini, G. Cooper, M. Hauskrecht, AAAI 2015, with the
    adaptive bins of K. Nguyen and B. O'Connor, EMNLP 2015). NaN for none.
    """
    if not len(probability):
        return nan
    parts = equal_counts(probability, right, bins)
    return float(
        sum(len(p) * abs(float(np.mean(y)) - float(np.mean(p))) for p, y in parts) / len(probability)
    )


def perfect_error(probability: Sequence[float], bins: int = BINS) -> tuple[float, float, float]:
    """Calibration error that probabilities which are exactly right show by chance alone: (mean, 2.5 and 97.5 %) over
    sets of as many, each right with its own probability (J. Bröcker and L. Smith, Weather and Forecasting 22, 2007);
    bins of few effects never agree. NaN for none.
    """
    if not len(probability):
        return nan, nan, nan
    rng, p = np.random.default_rng(0), np.asarray(probability, dtype=np.float64)
    drawn = [calibration_error(probability, (rng.random(len(p)) < p).tolist(), bins) for _ in range(DRAWS)]
    low, high = np.quantile(drawn, (0.025, 0.975))
    return float(np.mean(drawn)), float(low), float(high)


def equal_counts(
    probability: Sequence[float], right: Sequence[bool], bins: int = BINS
) -> list[tuple[Floats, Floats]]:
    """Bins of equal counts by rising probability, each as (probabilities, right as 0 to 1); where an edge falls among
    equal probabilities, each of these is right by the share of all of them."""
    p, y = _sorted(probability, right)
    parts = np.array_split(np.arange(len(p)), max(min(bins, len(p)), 1))
    return [(p[k], y[k]) for k in parts if len(k)]


def brier(probability: Sequence[float], right: Sequence[bool]) -> float:
    """Mean of (probability - right)^2; NaN for none."""
    p, y = np.asarray(probability, dtype=np.float64), np.asarray(right, dtype=np.float64)
    return float(np.mean((p - y) ** 2)) if len(p) else nan


def risk_coverage(score: Sequence[float], right: Sequence[bool]) -> tuple[Floats, Floats]:
    """(coverage, risk): of the names with the highest score, that share of all, how many are wrong."""
    y = _sorted(score, right)[1][::-1]
    count = np.arange(1, len(y) + 1)
    return np.asarray(count / max(len(y), 1)), np.asarray(np.cumsum(1.0 - y) / count)


def risk_area(score: Sequence[float], right: Sequence[bool]) -> float:
    """Area under risk against coverage, the less the better (Y. Geifman and R. El-Yaniv, NeurIPS 2017); NaN for
    none."""
    return float(np.mean(risk_coverage(score, right)[1])) if len(score) else nan


def _sorted(score: Sequence[float], right: Sequence[bool]) -> tuple[Floats, Floats]:
    """Scores, least first, and the share right of those of the same score: caps make many alike, of which none comes
    first."""
    s, y = np.asarray(score, dtype=np.float64), np.asarray(right, dtype=np.float64)
    _, alike, count = np.unique(s, return_inverse=True, return_counts=True)
    share = np.bincount(alike, y) / np.maximum(count, 1)
    order = np.argsort(s, kind="stable")
    return s[order], np.asarray(share[alike[order]], dtype=np.float64)
