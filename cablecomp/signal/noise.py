"""Noise floor of a channel out of the recording itself; own code: libraries do not tell white noise from rounding."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb, hypot, sqrt
from typing import Final

import numpy as np
from scipy.optimize import brentq

from cablecomp.errors import InputError
from cablecomp.signal.smoothing import FloatArray, group_means

_FEWEST: Final = 32
_ORDERS: Final = (2, 3, 4, 5, 6)
_HARMONICS: Final = np.arange(1, 25, dtype=np.float64)


@dataclass(frozen=True)
class ChannelNoise:
    """Noise of one channel, in the channel's unit.

    `sigma`: 1-sigma of a reading, quantisation included; `white`: the part that is there before rounding;
    `resolution`: step of the grid that the readings lie on (0 = no grid seen);
    `resting_share`: share of the recording in which the channel moves by less than a grid step within a
    block, where quantisation acts as a constant offset and not as noise; `coloured`: differences of higher
    order keep falling, so noise is filtered or the motion is not resolved by the sampling, and `sigma` is a
    lower bound; `samples`: readings used.
    """

    sigma: float
    white: float
    resolution: float
    resting_share: float
    coloured: bool
    samples: int


def reading_sigma(white: float | None, resolution: float | None) -> float:
    """1-sigma of a reading: white noise, and d/sqrt(12) of a grid of step d that the signal crosses (None = 0).

    Source: B. Widrow, I. Kollár, Quantization Noise (2008), chapter 4: uniform error of a quantiser.
    """
    return hypot(white or 0.0, (resolution or 0.0) / sqrt(12.0))


def grid_step(values: FloatArray) -> float:
    """Return the step of the grid that all values lie on, or 0 if they lie on none.

    The smallest distance between distinct values is refined over all short distances and accepted if nine
    tenths of them are whole multiples within a fifth of a step; text files that round the grid to decimals
    are thus understood.
    """
    distinct = np.unique(values)
    if len(distinct) < 2 or len(distinct) > 0.9 * len(values):
        return 0.0
    gaps = np.diff(distinct)
    gaps = gaps[gaps > 1e-12 * np.max(np.abs(distinct))]
    if len(gaps) < 2:
        return float(gaps[0]) if len(gaps) else 0.0
    step = float(np.median(gaps[gaps < 1.5 * np.quantile(gaps, 0.02)]))
    for reach in (2.5, 8.5, 30.5):
        near = gaps[gaps < reach * step]
        step = float(near.sum() / np.maximum(1.0, np.round(near / step)).sum())
    off = np.abs(gaps / step - np.round(gaps / step))[gaps < 30.5 * step]
    return step if len(off) and np.mean(off < 0.2) > 0.9 else 0.0


def channel_noise(time_s: FloatArray, values: FloatArray, resolution: float | None = None) -> ChannelNoise:
    """Estimate white noise and quantisation of a channel from its differences of order 2 to 6.

    A difference of order p over the true time stamps removes any motion that is locally a polynomial; its
    mean square over blocks is compared with what noise sigma, rounded to steps d while the signal moves by
    v steps per sample, gives: sigma^2 + d^2/12 + sum_j 2 c_j K(j v), K(x) = d^2 sum_k cos(2 pi k x) exp(-4
    pi^2 k^2 sigma^2/d^2)/(2 pi^2 k^2), c_j the autocorrelation of the difference's weights. At rest that
    tends to the flips between two values, in quick motion to d^2/12. Blocks with kinks or jumps are left
    out. `resolution`: the step if it is known (0 = none), None = detect it.

    Raises InputError if fewer than 32 readings are finite.
    """
    kept = np.isfinite(values) & np.isfinite(time_s)
    kept &= np.concatenate(([True], np.diff(time_s) > 0.0))
    time_s, values = time_s[kept], values[kept]
    if len(values) < _FEWEST:
        raise InputError(
            f"a noise floor needs {_FEWEST} readings at distinct times, found {len(values)}; "
            "give a longer recording, or the noise in [sensors]"
        )
    step = grid_step(values) if resolution is None else resolution
    block = int(np.clip(len(values) // 20, 16, 100))
    powers = {order: group_means(_differences(time_s, values, order) ** 2, block) for order in _ORDERS}
    order, coloured = _settled_order(powers, step)
    power = powers[order]
    speed = _speed_in_steps(values, block, step, len(power))
    inside = power <= 4.0 * np.median(power) + step**2
    white = _solve_white(power[inside], speed[inside], step, order)
    resting = float(np.mean(speed * block < 1.0)) if step > 0.0 else 0.0
    return ChannelNoise(reading_sigma(white, step), white, step, resting, coloured, len(values))


def _differences(time_s: FloatArray, values: FloatArray, order: int) -> FloatArray:
    """Divided differences of one order, scaled so that white noise keeps its variance."""
    size = order + 1
    times = np.lib.stride_tricks.sliding_window_view(time_s, size)
    readings = np.lib.stride_tricks.sliding_window_view(values, size)
    scale = (times[:, -1] - times[:, 0])[:, None]
    weights = np.ones(times.shape)
    for shift in range(1, size):
        weights /= (times - np.roll(times, shift, axis=1)) / scale
    weights /= np.sqrt(np.sum(weights**2, axis=1))[:, None]
    # the mean of the window is taken off first: values may be large against their differences
    centred = readings - readings.mean(axis=1, keepdims=True)
    return np.asarray(np.sum(weights * centred, axis=1), dtype=np.float64)


def _settled_order(powers: dict[int, FloatArray], step: float) -> tuple[int, bool]:
    """The lowest order from which on the next one no longer falls, and whether none was found."""
    level = {}
    for order, power in powers.items():
        level[order] = float(np.mean(power[power <= 4.0 * np.median(power) + step**2]))
    for order in _ORDERS[:-1]:
        if level[order + 1] >= 0.88 * level[order]:
            return order, False
    return _ORDERS[-1], True


def _speed_in_steps(values: FloatArray, block: int, step: float, count: int) -> FloatArray:
    """Mean speed in each block, in grid steps per sample."""
    if step <= 0.0:
        return np.zeros(count)
    starts = np.arange(count) * block
    ends = np.minimum(starts + block, len(values) - 1)
    third = np.maximum(1, (ends - starts) // 3)
    edges = np.array(
        [
            values[e - k : e].mean() - values[s : s + k].mean()
            for s, e, k in zip(starts, ends, third, strict=True)
        ]
    )
    return np.asarray(np.abs(edges) / step / np.maximum(1, ends - starts - third), dtype=np.float64)


def _solve_white(power: FloatArray, speed: FloatArray, step: float, order: int) -> float:
    measured = float(np.mean(power))
    if step <= 0.0:
        return float(np.sqrt(measured))
    lags = np.arange(1, order + 1)
    coefficients = np.array([(-1.0) ** k * comb(order, k) for k in range(order + 1)])
    correlation = np.correlate(coefficients, coefficients, mode="full")[order:] / np.sum(coefficients**2)
    phases = np.cos(2.0 * np.pi * np.multiply.outer(np.multiply.outer(speed, lags), _HARMONICS))
    swing = np.einsum("bjk,j->k", phases, 2.0 * correlation[1:]) / len(speed)

    def excess(white: float) -> float:
        damping = np.exp(-4.0 * np.pi**2 * _HARMONICS**2 * (white / step) ** 2)
        sawtooth = float(np.sum(swing * damping / (2.0 * np.pi**2 * _HARMONICS**2)))
        return white**2 + step**2 * (1.0 / 12.0 + sawtooth) - measured

    high = float(np.sqrt(measured)) + step
    return float(brentq(excess, 0.0, high)) if excess(0.0) < 0.0 < excess(high) else 0.0
