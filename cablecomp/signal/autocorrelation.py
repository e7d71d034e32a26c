"""How long a series remembers: integrated autocorrelation time, by Geyer's sequence; own code, as statsmodels has none.

Newey and West's variance of a mean stands beside it, out of the same autocovariance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from cablecomp.signal.smoothing import FloatArray


def autocovariance(values: FloatArray) -> FloatArray:
    """Return the autocovariance at lags 0…n-1 (mean removed, divided by n), by FFT."""
    centred = np.asarray(values, dtype=np.float64) - np.mean(values)
    size = next_fast_len(2 * len(centred), real=True)
    spectrum = rfft(centred, size)
    return np.asarray(irfft(np.abs(spectrum) ** 2, size)[: len(centred)] / len(centred), dtype=np.float64)


def integrated_time(values: FloatArray) -> float:
    """Return tau = 1 + 2 sum rho_k in samples (1 = white), by Geyer's initial monotone sequence.

    Sums of neighbouring autocorrelations are added as long as they are positive, each no larger than the
    one before (C. J. Geyer, Statistical Science 7, 1992, section 3.3). n/tau is the effective sample size
    of a mean.
    """
    covariance = autocovariance(values)
    if len(covariance) < 4 or covariance[0] <= 0.0:
        return 1.0
    correlation = covariance / covariance[0]
    even = len(correlation) // 2 * 2
    pairs = correlation[0:even:2] + correlation[1:even:2]
    ends = np.flatnonzero(pairs <= 0.0)
    pairs = np.minimum.accumulate(pairs[: ends[0]] if len(ends) else pairs)
    return float(max(1.0, 2.0 * np.sum(pairs) - 1.0))


def integrated_time_of_parts(parts: Sequence[FloatArray]) -> float:
    """Return the mean integrated time of several recordings, weighted by their lengths."""
    return float(np.average([integrated_time(part) for part in parts], weights=[len(part) for part in parts]))


def long_run_variance(values: FloatArray, lags: int | None = None) -> float:
    """Return the variance of the mean times n (Newey–West, Bartlett weights).

    `lags`: truncation; None = twice the integrated time, at least 4 (n/100)^(2/9) as Newey and West (1994)
    advise.
    """
    covariance = autocovariance(values)
    count = len(covariance)
    if lags is None:
        lags = int(max(2.0 * integrated_time(values), 4.0 * (count / 100.0) ** (2.0 / 9.0)))
    lags = min(lags, count - 1)
    weights = 1.0 - np.arange(1, lags + 1) / (lags + 1.0)
    return float(max(covariance[0] + 2.0 * np.sum(weights * covariance[1 : lags + 1]), 0.0))
