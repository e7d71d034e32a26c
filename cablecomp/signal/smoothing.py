"""Zero-phase local fits of a channel: value, rate and second rate; own code: SciPy's Savitzky-Golay wants even steps.

Here time stamps are uneven, and a window ends at gaps and, where asked, at corners.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cablecomp.mechanics.jit import njit

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_GROUPED_WIDTH: Final = 32
_GAP: Final = 10.0
_REACHES: Final = np.array([1, 2, 3, 4, 6, 8, 11, 15, 20, 27, 36, 48, 64], dtype=np.int64)
_EVEN: Final = 8  # samples either way over which a window's width is evened out
_CORNER: Final = 0.5  # of the variance of a window to both sides, from which a line to one side is taken
_FAR: Final = 4.0  # standard deviations off its reading, beyond which a window to both sides crosses a corner
_AGREE: Final = 1.5  # half width of the confidence intervals that have to meet, in standard deviations


@dataclass(frozen=True)
class Smooth:
    """A channel after a local quadratic fit.

    `value`, `slope` (unit/s), `curvature` (unit/s^2) have the channel's length; `gain` = sd of `value` over
    sd of a white reading; `slope_gain` = sd of `slope` over sd of a reading (1/s); `half_width_s` = half
    the window.
    """

    value: FloatArray
    slope: FloatArray
    curvature: FloatArray
    gain: float
    slope_gain: float
    half_width_s: float


def step_s(time_s: FloatArray) -> float:
    """Return the usual time step (median of the positive steps) in s; 1 if there is none."""
    steps = np.diff(time_s)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if len(steps) else 1.0


def segment_bounds(time_s: FloatArray) -> IntArray:
    """Return indices 0, …, n that cut the samples at gaps in time (steps beyond 10 times the usual one)."""
    cuts = np.flatnonzero(np.diff(time_s) > _GAP * step_s(time_s)) + 1
    return np.concatenate(([0], cuts, [len(time_s)])).astype(np.int64)


def local_fit(time_s: FloatArray, values: FloatArray, half_width_s: float) -> Smooth:
    """Fit a quadratic in a tricube window around every sample, by the time stamps as they are.

    Windows end at gaps. Wide windows work on means of neighbouring samples, so that the cost does not grow
    with the width. Readings must be finite.
    """
    group = max(1, int(half_width_s / step_s(time_s) / _GROUPED_WIDTH))
    if group == 1:
        value, slope, curvature, gain, slope_gain = _local_quadratic(
            time_s, values, segment_bounds(time_s), half_width_s
        )
        return Smooth(
            value, slope, curvature, float(np.median(gain)), float(np.median(slope_gain)), half_width_s
        )
    coarse_time, coarse = group_means(time_s, group), group_means(values, group)
    inner = local_fit(coarse_time, coarse, half_width_s)
    nearest = np.minimum(np.arange(len(time_s)) // group, len(coarse) - 1)
    offset = time_s - coarse_time[nearest]
    slope = np.interp(time_s, coarse_time, inner.slope)
    # the quadratic of the nearest group; its error is that of a window shifted by half a group
    value = inner.value[nearest] + inner.slope[nearest] * offset + 0.5 * inner.curvature[nearest] * offset**2
    curvature = np.interp(time_s, coarse_time, inner.curvature)
    root = float(np.sqrt(group))
    return Smooth(value, slope, curvature, inner.gain / root, inner.slope_gain / root, half_width_s)


def fit_to_noise(time_s: FloatArray, values: FloatArray, sigma: float) -> Smooth:
    """Smooth with the widest window that still fits the readings to within their noise `sigma`
    (quantisation included).

    The window grows by factors of two; it stops growing when, in more than a tenth of the recording, the
    misfit exceeds what noise explains. The bias of the result is then of the order of the noise or below.
    """
    step = step_s(time_s)
    chunk = max(8, len(values) // 60)
    best = local_fit(time_s, values, 2.01 * step)
    half = 4
    while half < max(5, len(values) // 12):
        candidate = local_fit(time_s, values, (half + 0.01) * step)
        misfit = group_means((values - candidate.value) ** 2, chunk)
        allowed = sigma**2 * (1.05 + 3.0 * np.sqrt(2.0 / chunk))
        if np.quantile(misfit, 0.9) > allowed:
            break
        best, half = candidate, half * 2
    return best


def keep_corners(time_s: FloatArray, values: FloatArray, sigma: float) -> FloatArray:
    """Smooth a channel with white noise `sigma` without lag, its corners rounded off little.

    At a corner that turns by one sigma a sample, a bias of about one sigma is left.

    How wide a window may be is asked sample by sample: as wide as the estimates of all narrower ones agree,
    their intervals of +-1.5 standard deviations sharing a point (intersection of confidence intervals:
    Goldenshluger and Nemirovski 1997, Katkovnik 1999). Where a window to both sides may be wide, the sample
    takes a quadratic with tricube weights, its width changing slowly so that second differences stay quiet;
    at a corner, and where that lies further off the reading than noise does, for its neighbours' windows may be wide
    where its own may not, a line to the side that is straight. Windows end at gaps; readings must be finite.
    """
    if not sigma > 0.0 or len(values) < 3:
        return np.asarray(values, dtype=np.float64)
    bounds = segment_bounds(time_s)
    wide, variance, line, line_variance = _widest(time_s, values, bounds, sigma, _REACHES, _AGREE)
    widths = np.exp(_local_mean(np.log(wide), bounds, _EVEN))
    smooth = _tricube(time_s, values, bounds, widths)
    corner = (line_variance < _CORNER * variance) | (np.abs(smooth - values) > _FAR * sigma)
    return np.asarray(np.where(corner, line, smooth), dtype=np.float64)


def group_means(values: FloatArray, size: int) -> FloatArray:
    """Return means of consecutive groups of `size` samples (the last group may be shorter)."""
    starts = np.arange(0, len(values), size)
    counts = np.diff(np.append(starts, len(values)))
    return np.asarray(np.add.reduceat(values, starts) / counts, dtype=np.float64)


@njit
def _moments(
    time_s: FloatArray, values: FloatArray, low: int, high: int, i: int, half_width_s: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Sums of w x^k (k = 0…4) and w x^k y (k = 0…2) over low…high - 1 about sample i, tricube weights w."""
    s0 = s1 = s2 = s3 = s4 = y0 = y1 = y2 = 0.0
    for j in range(low, high):
        x = (time_s[j] - time_s[i]) / half_width_s
        w = (1.0 - min(1.0, abs(x)) ** 3) ** 3
        s0 += w
        s1 += w * x
        s2 += w * x * x
        s3 += w * x**3
        s4 += w * x**4
        y0 += w * values[j]
        y1 += w * x * values[j]
        y2 += w * x * x * values[j]
    return s0, s1, s2, s3, s4, y0, y1, y2


@njit
def _local_quadratic(
    time_s: FloatArray, values: FloatArray, bounds: IntArray, half_width_s: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    n = len(values)
    value, slope, curvature = values.copy(), np.zeros(n), np.zeros(n)
    gain, slope_gain = np.ones(n), np.zeros(n)
    for b in range(len(bounds) - 1):
        first, last = bounds[b], bounds[b + 1]
        low, high = first, first
        for i in range(first, last):
            while time_s[low] < time_s[i] - half_width_s:
                low += 1
            while high < last and time_s[high] <= time_s[i] + half_width_s:
                high += 1
            s0, s1, s2, s3, s4, y0, y1, y2 = _moments(time_s, values, low, high, i, half_width_s)
            # cofactors of the symmetric 3 x 3 normal matrix
            c00, c01, c02 = s2 * s4 - s3 * s3, s2 * s3 - s1 * s4, s1 * s3 - s2 * s2
            c11, c12, c22 = s0 * s4 - s2 * s2, s1 * s2 - s0 * s3, s0 * s2 - s1 * s1
            det = s0 * c00 + s1 * c01 + s2 * c02
            if high - low < 4 or det <= 1e-9 * s0 * s0 * s0:
                continue
            value[i] = (c00 * y0 + c01 * y1 + c02 * y2) / det
            slope[i] = (c01 * y0 + c11 * y1 + c12 * y2) / det / half_width_s
            curvature[i] = 2.0 * (c02 * y0 + c12 * y1 + c22 * y2) / det / half_width_s**2
            g = gs = 0.0
            for j in range(low, high):
                x = (time_s[j] - time_s[i]) / half_width_s
                w = (1.0 - min(1.0, abs(x)) ** 3) ** 3
                g += (w * (c00 + c01 * x + c02 * x * x) / det) ** 2
                gs += (w * (c01 + c11 * x + c12 * x * x) / det / half_width_s) ** 2
            gain[i], slope_gain[i] = np.sqrt(g), np.sqrt(gs)
    return value, slope, curvature, gain, slope_gain


@njit
def _widest(
    time_s: FloatArray, values: FloatArray, bounds: IntArray, sigma: float, reaches: IntArray, agree: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Of every sample: reach (samples, at least 1) and variance (over a reading's) of the widest window to
    both sides; value and variance of the better line to one side."""
    n = len(values)
    wide, variance = np.ones(n), np.ones(n)
    line, line_variance = values.copy(), np.ones(n)
    for b in range(len(bounds) - 1):
        first, last = bounds[b], bounds[b + 1]
        for i in range(first, last):
            for side in range(3):
                low, high = values[i] - agree * sigma, values[i] + agree * sigma
                for reach in reaches:
                    begin = i if side == 1 else i - reach
                    end = i if side == 0 else i + reach
                    if begin < first or end >= last:
                        break
                    if end - begin < 2:
                        continue
                    estimate, share = _at_sample(time_s, values, begin, end, i)
                    allowed = agree * sigma * np.sqrt(share)
                    low, high = max(low, estimate - allowed), min(high, estimate + allowed)
                    if low > high:
                        break
                    if side == 2:
                        wide[i], variance[i] = reach, share
                    elif share < line_variance[i]:
                        line[i], line_variance[i] = estimate, share
    return wide, variance, line, line_variance


@njit
def _at_sample(time_s: FloatArray, values: FloatArray, begin: int, end: int, i: int) -> tuple[float, float]:
    """Value at sample i of the line (at an end) or quadratic (inside) through begin..end, and its variance
    over that of a reading."""
    s0 = s1 = s2 = s3 = s4 = y0 = y1 = y2 = 0.0
    width = time_s[end] - time_s[begin]
    for j in range(begin, end + 1):
        x = (time_s[j] - time_s[i]) / width
        s0 += 1.0
        s1 += x
        s2 += x * x
        s3 += x**3
        s4 += x**4
        y0 += values[j]
        y1 += x * values[j]
        y2 += x * x * values[j]
    if begin < i < end and end - begin >= 4:
        c00, c01, c02 = s2 * s4 - s3 * s3, s2 * s3 - s1 * s4, s1 * s3 - s2 * s2
        det = s0 * c00 + s1 * c01 + s2 * c02
        return (c00 * y0 + c01 * y1 + c02 * y2) / det, c00 / det
    det = s0 * s2 - s1 * s1
    return (s2 * y0 - s1 * y1) / det, s2 / det


@njit
def _local_mean(values: FloatArray, bounds: IntArray, reach: int) -> FloatArray:
    out = values.copy()
    for b in range(len(bounds) - 1):
        first, last = bounds[b], bounds[b + 1]
        for i in range(first, last):
            begin, end = max(first, i - reach), min(last, i + reach + 1)
            out[i] = np.mean(values[begin:end])
    return out


@njit
def _tricube(time_s: FloatArray, values: FloatArray, bounds: IntArray, widths: FloatArray) -> FloatArray:
    """Quadratic with tricube weights over `widths` samples to either side; a reading where that is none."""
    out = values.copy()
    for b in range(len(bounds) - 1):
        first, last = bounds[b], bounds[b + 1]
        for i in range(first, last):
            reach = int(np.ceil(1.3 * widths[i]))
            begin, end = max(first, i - reach), min(last - 1, i + reach)
            if reach < 2 or i - begin < reach or end - i < reach:
                continue
            step = (time_s[end] - time_s[begin]) / (end - begin)
            half = (1.3 * widths[i] + 0.5) * step
            s0, s1, s2, s3, s4, y0, y1, y2 = _moments(time_s, values, begin, end + 1, i, half)
            c00, c01, c02 = s2 * s4 - s3 * s3, s2 * s3 - s1 * s4, s1 * s3 - s2 * s2
            det = s0 * c00 + s1 * c01 + s2 * c02
            if det > 1e-9 * s0 * s0 * s0:
                out[i] = (c00 * y0 + c01 * y1 + c02 * y2) / det
    return out
