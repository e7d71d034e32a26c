"""Statistics of a stream in bounded memory: moments, best straight line, histogram, spectrum."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cablecomp.recording.table import FloatArray


class Moments:
    """Mean, root mean square and largest magnitude of a stream.

    Blocks are merged as by Chan, Golub and LeVeque, "Updating formulae and a pairwise algorithm", 1979.
    """

    def __init__(self) -> None:
        self.count = 0
        self.mean = 0.0
        self.largest = 0.0
        self._scatter = 0.0

    def add(self, values: FloatArray) -> None:
        """Take in finite values."""
        added = len(values)
        if not added:
            return
        mean = float(values.mean())
        shift = mean - self.mean
        total = self.count + added
        self._scatter += float(np.square(values - mean).sum()) + shift**2 * self.count * added / total
        self.mean += shift * added / total
        self.count = total
        self.largest = max(self.largest, float(np.abs(values).max()))

    @property
    def sd(self) -> float:
        """Standard deviation about the mean (divided by the count); NaN of nothing."""
        return math.sqrt(self._scatter / self.count) if self.count else math.nan

    @property
    def rms(self) -> float:
        """Root mean square about zero; NaN of nothing."""
        return math.hypot(self.sd, self.mean)


class Line(NamedTuple):
    """y = offset + slope * x, and the root mean square of what it leaves."""

    slope: float
    offset: float
    rmse: float


class LineFit:
    """Least-squares straight line through a stream of points, from merged central sums."""

    def __init__(self) -> None:
        self._count = 0
        self._mean = np.zeros(2)
        self._scatter = np.zeros((2, 2))

    def add(self, x: FloatArray, y: FloatArray) -> None:
        """Take in finite points."""
        if not len(x):
            return
        points = np.stack([x, y])
        mean = points.mean(axis=1)
        central = points - mean[:, None]
        shift = mean - self._mean
        total = self._count + len(x)
        self._scatter += central @ central.T + np.outer(shift, shift) * (self._count * len(x) / total)
        self._mean = self._mean + shift * (len(x) / total)
        self._count = total

    def line(self) -> Line | None:
        """Return the line; None without points. A constant x gives slope 0."""
        if not self._count:
            return None
        xx, xy, yy = self._scatter[0, 0], self._scatter[0, 1], self._scatter[1, 1]
        slope = float(xy / xx) if xx > 0.0 else 0.0
        left = max(float(yy - slope * xy), 0.0)
        return Line(slope, float(self._mean[1] - slope * self._mean[0]), math.sqrt(left / self._count))


class Bins(NamedTuple):
    """Histogram: `edges` has one value more than `counts`."""

    edges: FloatArray
    counts: FloatArray


class Histogram:
    """Histogram about zero of a stream of unknown range: the range doubles as needed, bins merge in pairs."""

    def __init__(self, bins: int = 128) -> None:
        self._half = bins // 2
        self._reach = 0.0
        self._counts = np.zeros(2 * self._half)

    def add(self, values: FloatArray) -> None:
        """Take in finite values."""
        if not len(values):
            return
        largest = float(np.abs(values).max())
        if self._reach == 0.0:
            if largest == 0.0:
                self._counts[self._half] += len(values)
                return
            self._reach = largest * 1.000001
        while largest >= self._reach:
            pairs = self._counts.reshape(-1, 2).sum(axis=1)
            self._counts = np.zeros_like(self._counts)
            quarter = self._half // 2
            self._counts[quarter : quarter + len(pairs)] = pairs
            self._reach *= 2.0
        scaled = ((values / self._reach + 1.0) * self._half).astype(np.intp)
        self._counts += np.bincount(np.minimum(scaled, 2 * self._half - 1), minlength=2 * self._half)

    def bins(self) -> Bins:
        """Return the bins; all zero without values."""
        reach = self._reach if self._reach > 0.0 else 1.0
        return Bins(np.linspace(-reach, reach, 2 * self._half + 1), self._counts.copy())


class Density(NamedTuple):
    """One-sided amplitude spectral density: frequency, and amplitude in the signal's unit per sqrt(Hz)."""

    frequency_Hz: FloatArray
    amplitude: FloatArray


class Spectrum:
    """Welch's spectrum of a stream: half overlapped Hann windows of `length` samples, freed of their mean.

    A stream shorter than one window is taken as one window of its own length.
    Source: P. D. Welch, IEEE Trans. Audio Electroacoust. 15(2), 1967.
    """

    def __init__(self, length: int = 4096) -> None:
        self._length = length
        self._held: FloatArray = np.empty(0)
        self._power = np.zeros(length // 2 + 1)
        self._windows = 0

    def add(self, values: FloatArray) -> None:
        """Take in finite values."""
        self._held = np.concatenate([self._held, values])
        hop = self._length // 2
        count = (len(self._held) - self._length) // hop + 1
        if count <= 0:
            return
        view = np.lib.stride_tricks.sliding_window_view(self._held, self._length)[::hop][:count]
        self._power += _periodograms(view).sum(axis=0)
        self._windows += count
        self._held = self._held[count * hop :].copy()

    def density(self, step_s: float) -> Density | None:
        """Return the density for a time step; None for fewer than 16 samples."""
        if self._windows:
            power, length = self._power / self._windows, self._length
        else:
            length = len(self._held)
            if length < 16:
                return None
            power = _periodograms(self._held[None, :])[0]
        frequency: FloatArray = np.fft.rfftfreq(length, step_s).astype(np.float64)
        return Density(frequency[1:], np.sqrt(power[1:] * step_s))


def _periodograms(windows: FloatArray) -> FloatArray:
    """One-sided power per bin for a step of 1."""
    length = windows.shape[1]
    taper = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)
    spectra = np.fft.rfft((windows - windows.mean(axis=1, keepdims=True)) * taper, axis=1)
    power: FloatArray = (np.abs(spectra) ** 2) * (2.0 / np.square(taper).sum())
    if length % 2 == 0:
        power[:, -1] *= 0.5
    return power
