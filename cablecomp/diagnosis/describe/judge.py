"""Whether a law predicts held-out blocks better than none does; own code: `arch` compares losses, not likelihoods.

A gain counts beyond what chance and dependence between neighbours allow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from cablecomp.diagnosis.folds import Layout
from cablecomp.signal.autocorrelation import long_run_variance
from cablecomp.signal.smoothing import FloatArray, IntArray


@dataclass(frozen=True)
class Score:
    """A law against none on held-out blocks.

    `heldout_gain`: share of the held-out mean square that it removes (negative = worse); `z`: mean gain in predictive
    log-likelihood over its standard error; `supported`: whether `z` is beyond chance at the level asked for.
    """

    heldout_gain: float
    z: float
    p_value: float
    supported: bool


def judge(
    before: FloatArray,
    after: FloatArray,
    layout: Layout,
    rng: np.random.Generator,
    level: float = 0.01,
    draws: int = 4_000,
) -> Score:
    """Compare what is left with a law to what is left without, on held-out blocks; the law was fitted to the others.

    The gain per sample is the difference of predictive log-likelihoods; its standard error is the larger one of
    Newey–West inside blocks and the scatter between blocks. `z` has to be beyond its `1 - level` quantile under a wild
    bootstrap of block means (Rademacher signs, small numbers of blocks corrected by Student's t).
    """
    gain = predictive_likelihood(after, layout) - predictive_likelihood(before, layout)
    block = layout.block[layout.heldout]
    freedom = max(1, len(np.unique(block)) - 1)
    mean, error = float(np.mean(gain)), _standard_error(gain, block)
    z = mean / error if error > 0.0 else 0.0 if mean == 0.0 else float(np.copysign(np.inf, mean))
    by_chance = _by_chance(gain, block, rng, draws)
    margin = max(float(np.quantile(by_chance, 1.0 - level)), float(student.ppf(1.0 - level, freedom)))
    p_value = max(float((1 + np.sum(by_chance >= z)) / (draws + 1)), min(1.0, float(student.sf(z, freedom))))
    return Score(heldout_gain(before, after, layout), z, p_value, z > margin)


def heldout_gain(before: FloatArray, after: FloatArray, layout: Layout) -> float:
    """1 - (mean square after)/(mean square before) on held-out samples; 0 if nothing was left before."""
    whole = float(np.mean(before[layout.heldout] ** 2))
    rest = float(np.mean(after[layout.heldout] ** 2))
    return 1.0 - rest / whole if whole > 0.0 else 0.0


def predictive_likelihood(residual: FloatArray, layout: Layout) -> FloatArray:
    """Gaussian log-likelihood of each held-out residual, nats, under the RMS that the training blocks show."""
    scale = max(float(np.sqrt(np.mean(residual[layout.training] ** 2))), 1e-300)
    z = (residual[layout.heldout] / scale) ** 2
    return np.asarray(-0.5 * z - np.log(scale) - 0.5 * np.log(2.0 * np.pi), dtype=np.float64)


def _standard_error(gain: FloatArray, block: IntArray) -> float:
    """Standard error of the mean gain, dependence counted; never below the scatter between blocks."""
    means, counts = _means(gain, block)
    weights = counts / counts.sum()
    centred = means - float(np.mean(gain))
    between = float(np.sqrt(np.sum((weights * centred) ** 2) * len(means) / max(1, len(means) - 1)))
    within = float(np.sqrt(long_run_variance(gain) / len(gain)))
    return max(between, within)


def _by_chance(gain: FloatArray, block: IntArray, rng: np.random.Generator, draws: int) -> FloatArray:
    """z of mean gains whose blocks have random signs."""
    means, counts = _means(gain, block)
    centred = counts / counts.sum() * (means - float(np.mean(gain)))
    total = len(centred)
    sums = rng.choice(np.array([-1.0, 1.0]), size=(draws, total)) @ centred
    # each draw is studentised by its own scatter, as the data are: heavy tails with few blocks come out right
    scatter = np.maximum(np.sum(centred**2) - sums**2 / total, 0.0) * total / max(1, total - 1)
    own = np.sqrt(scatter)
    return np.asarray(np.where(own > 0.0, sums / np.maximum(own, 1e-300), 0.0), dtype=np.float64)


def _means(values: FloatArray, block: IntArray) -> tuple[FloatArray, FloatArray]:
    numbers, index = np.unique(block, return_inverse=True)
    counts = np.bincount(index, minlength=len(numbers)).astype(np.float64)
    return np.asarray(np.bincount(index, values) / counts, dtype=np.float64), counts
