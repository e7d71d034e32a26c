"""Which of several models predicts held-out blocks better; own code: `arch` compares losses, not likelihoods.

A gain counts beyond what chance, dependence between neighbours and the number of tries allow.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import lgamma
from typing import Final

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import t as student

from cablecomp.diagnosis.folds import Layout
from cablecomp.signal.autocorrelation import integrated_time, long_run_variance
from cablecomp.signal.smoothing import FloatArray, IntArray

_FREEDOM: Final = (3.0, 5.0, 10.0, 30.0, 300.0)
"""Degrees of freedom among which Student's t is fitted."""


@dataclass(frozen=True)
class Likelihood:
    """Predictive log-likelihood of held-out residuals.

    `per_sample`: nats, one per held-out sample; `scale`: of the training residuals in rad; `freedom`:
    degrees of freedom of Student's t (infinite = Gaussian); `effective`: effective sample size of the
    held-out residual; `total` = mean of `per_sample` times `effective`: what the data say, dependence
    counted.
    """

    per_sample: FloatArray
    scale: float
    freedom: float
    effective: float
    total: float


@dataclass(frozen=True)
class Score:
    """One candidate against the baseline on held-out blocks.

    `heldout_gain`: share of the baseline's held-out mean square that the candidate removes (negative =
    worse); `gain_sd`: its sd; `log_ratio`: gain in predictive log-likelihood, in nats for the effective
    sample size; `z`: mean gain over its standard error; `margin`: what `z` has to reach; `p_value`:
    corrected for the number of candidates; `supported`: beyond the margin.
    """

    name: str
    heldout_gain: float
    gain_sd: float
    log_ratio: float
    z: float
    margin: float
    p_value: float
    supported: bool


@dataclass(frozen=True)
class Verdict:
    """Scores of all candidates, best first (by log-likelihood gain); `best` is the first supported one, or
    None.
    """

    scores: tuple[Score, ...]
    effective: float
    blocks: int

    @property
    def best(self) -> Score | None:
        """The supported candidate with the largest gain in likelihood."""
        return next((score for score in self.scores if score.supported), None)

    def of(self, name: str) -> Score:
        """Return the score of one candidate."""
        return next(score for score in self.scores if score.name == name)


def heldout_gain(baseline: FloatArray, candidate: FloatArray, layout: Layout) -> float:
    """Return 1 - (candidate's mean square)/(baseline's mean square) on held-out samples; 0 if the baseline
    is exact.
    """
    before = float(np.mean(baseline[layout.heldout] ** 2))
    after = float(np.mean(candidate[layout.heldout] ** 2))
    return 1.0 - after / before if before > 0.0 else 0.0


def effective_size(residual: FloatArray, layout: Layout) -> float:
    """Return the effective sample size of held-out residuals: samples over integrated autocorrelation time.

    The time is averaged over the blocks' own series with the overall mean taken off, so borders do not
    count as memory.
    """
    values = residual - float(np.mean(residual[layout.heldout]))
    taus, sizes = [], []
    for number in layout.heldout_blocks:
        part = values[layout.heldout & (layout.block == number)]
        if len(part) >= 8:
            taus.append(_uncentred_time(part))
            sizes.append(len(part))
    count = int(layout.heldout.sum())
    if not taus:
        return float(count)
    return float(max(1.0, count / np.average(taus, weights=sizes)))


def predictive_likelihood(residual: FloatArray, layout: Layout, robust: bool = False) -> Likelihood:
    """Return the log-likelihood of held-out residuals under the scale (and tails) that the training blocks
    show.

    Gaussian with the training RMS, or, with `robust`, Student's t whose scale and freedom are fitted there.
    """
    training, held = residual[layout.training], residual[layout.heldout]
    scale, freedom = max(float(np.sqrt(np.mean(training**2))), 1e-300), float("inf")
    if robust:
        scale, freedom = _fit_student(training)
    per_sample = _log_density(held, scale, freedom)
    effective = effective_size(residual, layout)
    return Likelihood(per_sample, scale, freedom, effective, float(np.mean(per_sample)) * effective)


def judge(
    baseline: FloatArray,
    candidates: Mapping[str, FloatArray],
    layout: Layout,
    rng: np.random.Generator,
    level: float = 0.01,
    robust: bool = False,
    least_gain: float = 0.0,
    draws: int = 4_000,
) -> Verdict:
    """Compare candidates' residual series with the baseline's on held-out blocks.

    All residuals come from fits on the training blocks alone, simulated through the whole recording. The
    gain per sample is the difference of predictive log-likelihoods; its standard error is the larger one of
    Newey–West inside blocks and the scatter between blocks. The margin is the `1 - level` quantile of the
    largest z over all candidates under a wild bootstrap of block means (Rademacher signs, small numbers of
    blocks corrected by Student's t). `least_gain`: share of mean square that must be removed as well.
    """
    names = list(candidates)
    reference = predictive_likelihood(baseline, layout, robust)
    gains = (
        np.stack([_gain(candidates[name], reference, layout, robust) for name in names])
        if names
        else np.empty((0, 0))
    )
    block = layout.block[layout.heldout]
    errors = np.array([_standard_error(gain, block) for gain in gains])
    z = np.array([_ratio(float(np.mean(gain)), error) for gain, error in zip(gains, errors, strict=True)])
    blocks = len(np.unique(block))
    highest = _highest_null(gains, block, rng, draws)
    margin = max(
        float(np.quantile(highest, 1.0 - level)), float(student.ppf(1.0 - level, max(1, blocks - 1)))
    )
    scores = []
    for index, name in enumerate(names):
        p_value = max(
            float((1 + np.sum(highest >= z[index])) / (draws + 1)),
            min(1.0, float(student.sf(z[index], max(1, blocks - 1)))),
        )
        gain = heldout_gain(baseline, candidates[name], layout)
        scores.append(
            Score(
                name,
                gain,
                _gain_sd(baseline, candidates[name], layout),
                float(np.mean(gains[index])) * reference.effective,
                float(z[index]),
                margin,
                p_value,
                bool(z[index] > margin and gain > least_gain),
            )
        )
    scores.sort(key=lambda score: -score.log_ratio)
    return Verdict(tuple(scores), reference.effective, blocks)


def compare(
    first: FloatArray, second: FloatArray, layout: Layout, rng: np.random.Generator, level: float = 0.05
) -> Score:
    """Compare two models' residual series: the score says how much better `second` predicts than `first`."""
    return judge(first, {"second": second}, layout, rng, level).scores[0]


def _gain(residual: FloatArray, reference: Likelihood, layout: Layout, robust: bool) -> FloatArray:
    own = predictive_likelihood(residual, layout, robust)
    return np.asarray(own.per_sample - reference.per_sample, dtype=np.float64)


def _standard_error(gain: FloatArray, block: IntArray) -> float:
    """Standard error of the mean gain, dependence counted; never below the scatter between blocks."""
    means, counts = _means(gain, block)
    weights = counts / counts.sum()
    centred = means - float(np.mean(gain))
    between = float(np.sqrt(np.sum((weights * centred) ** 2) * len(means) / max(1, len(means) - 1)))
    within = float(np.sqrt(long_run_variance(gain) / len(gain)))
    return max(between, within)


def _highest_null(gains: FloatArray, block: IntArray, rng: np.random.Generator, draws: int) -> FloatArray:
    if not len(gains):
        return np.zeros(draws)
    means, counts = zip(*(_means(gain, block) for gain in gains), strict=True)
    weights = counts[0] / counts[0].sum()
    centred = weights * (np.stack(means) - gains.mean(axis=1)[:, None])
    total = len(weights)
    signs = rng.choice(np.array([-1.0, 1.0]), size=(draws, total))
    sums = signs @ centred.T
    # each draw is studentised by its own scatter, as the data are: heavy tails with few blocks come out right
    own = np.sqrt(np.maximum(np.sum(centred**2, axis=1) - sums**2 / total, 0.0) * total / max(1, total - 1))
    ratio = np.where(own > 0.0, sums / np.maximum(own, 1e-300), 0.0)
    return np.asarray(np.max(ratio, axis=1), dtype=np.float64)


def _means(values: FloatArray, block: IntArray) -> tuple[FloatArray, FloatArray]:
    numbers, index = np.unique(block, return_inverse=True)
    counts = np.bincount(index, minlength=len(numbers)).astype(np.float64)
    return np.asarray(np.bincount(index, values) / counts, dtype=np.float64), counts


def _ratio(mean: float, error: float) -> float:
    if error > 0.0:
        return mean / error
    return 0.0 if mean == 0.0 else float(np.copysign(np.inf, mean))


def _gain_sd(baseline: FloatArray, candidate: FloatArray, layout: Layout) -> float:
    block = layout.block[layout.heldout]
    before = baseline[layout.heldout] ** 2
    whole = float(np.mean(before))
    if whole <= 0.0:
        return 0.0
    share = heldout_gain(baseline, candidate, layout)
    # linearised ratio of means
    terms = (before - candidate[layout.heldout] ** 2 - share * before) / whole
    return _standard_error(np.asarray(terms, dtype=np.float64), block)


def _uncentred_time(values: FloatArray) -> float:
    """Integrated time that counts a block's own offset as memory."""
    power = float(np.mean(values**2))
    if power <= 0.0:
        return 1.0
    offset = float(np.mean(values)) ** 2 / power
    return float((1.0 - offset) * integrated_time(values) + offset * len(values))


def _log_density(values: FloatArray, scale: float, freedom: float) -> FloatArray:
    z = (values / scale) ** 2
    if np.isinf(freedom):
        return np.asarray(-0.5 * z - np.log(scale) - 0.5 * np.log(2.0 * np.pi), dtype=np.float64)
    norm = (
        lgamma(0.5 * (freedom + 1.0)) - lgamma(0.5 * freedom) - 0.5 * np.log(freedom * np.pi) - np.log(scale)
    )
    return np.asarray(norm - 0.5 * (freedom + 1.0) * np.log1p(z / freedom), dtype=np.float64)


def _fit_student(values: FloatArray) -> tuple[float, float]:
    """Scale and freedom (of a short list) with the largest likelihood."""
    spread = max(float(np.median(np.abs(values))) / 0.6745, 1e-300)
    best = (np.inf, spread, float("inf"))
    for freedom in _FREEDOM:
        found = minimize_scalar(
            lambda log_scale, nu=freedom: -float(np.sum(_log_density(values, np.exp(log_scale), nu))),
            bounds=(np.log(spread) - 3.0, np.log(spread) + 3.0),
            method="bounded",
        )
        if found.fun < best[0]:
            best = (float(found.fun), float(np.exp(found.x)), freedom)
    return best[1], best[2]
