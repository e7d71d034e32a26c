"""A residual with its noise and covariates: what all of the statistics here work on."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cablecomp.diagnosis.folds import blocks_by_memory
from cablecomp.diagnosis.locate.covariates import Covariates
from cablecomp.errors import InputError
from cablecomp.signal.smoothing import FloatArray, IntArray


@dataclass(frozen=True)
class Series:
    """Measured minus predicted joint angle of one or several recordings.

    `residual`, `sigma` (1-sigma of the measuring noise of each value) in rad; `covariates` on the same
    samples.
    """

    residual: FloatArray
    sigma: FloatArray
    covariates: Covariates

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.residual)

    def spans(self) -> Iterator[slice]:
        """Yield the samples of each recording."""
        bounds = np.append(self.covariates.starts, self.samples)
        for first, last in itertools.pairwise(bounds):
            yield slice(int(first), int(last))

    def parts(self) -> list[FloatArray]:
        """Return the residual of each recording."""
        return [self.residual[span] for span in self.spans()]

    def blocks(self) -> IntArray:
        """Return the block of every sample, longer than the residual remembers."""
        return blocks_by_memory(self.parts())


@dataclass(frozen=True)
class Thinned:
    """A series of group means: `series`, the group of every original sample, and means of further columns."""

    series: Series
    group: IntArray
    extra: FloatArray


def make_series(residual: FloatArray, sigma: FloatArray | float, covariates: Covariates) -> Series:
    """Put a residual (rad) and its noise (rad, > 0) beside covariates of the same length.

    Raises InputError if lengths differ, values are not finite or sigma is not positive.
    """
    values = np.asarray(residual, dtype=np.float64)
    noise = np.broadcast_to(np.asarray(sigma, dtype=np.float64), values.shape).copy()
    if len(values) != covariates.samples:
        raise InputError(
            f"residual has {len(values)} values and the covariates have {covariates.samples}; they must "
            "belong "
            "to the same samples"
        )
    if not (np.isfinite(values).all() and np.isfinite(noise).all() and (noise > 0.0).all()):
        raise InputError(
            "residual and sigma must be finite and sigma positive; leave out samples without a value"
        )
    return Series(values, noise, covariates)


def thin(series: Series, extra: FloatArray | None = None, limit: int = 12_000) -> Thinned:
    """Average neighbouring samples (never across recordings) so that about `limit` are left.

    Noise falls with the root of the group size; covariates and the columns of `extra` (n x p) are averaged
    with it.
    """
    n = series.samples
    columns = np.empty((n, 0)) if extra is None else np.asarray(extra, dtype=np.float64).reshape(n, -1)
    size = int(np.ceil(n / limit))
    if size <= 1:
        return Thinned(series, np.arange(n, dtype=np.int64), columns)
    firsts = np.concatenate([np.arange(span.start, span.stop, size) for span in series.spans()])
    counts = np.diff(np.append(firsts, n))
    group = np.repeat(np.arange(len(firsts)), counts)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.add.reduceat(values, firsts) / counts, dtype=np.float64)

    old = series.covariates
    covariates = Covariates(
        {name: mean(values) for name, values in old.values.items()},
        mean(old.motion_direction),
        mean(old.motion_reversal),
        np.searchsorted(firsts, old.starts).astype(np.int64),
        old.resting_share,
    )
    noise = np.sqrt(mean(series.sigma**2) / counts)
    means = (
        np.add.reduceat(columns, firsts, axis=0) / counts[:, None] if columns.shape[1] else columns[firsts]
    )
    return Thinned(
        Series(mean(series.residual), np.asarray(noise, dtype=np.float64), covariates),
        group.astype(np.int64),
        np.asarray(means, dtype=np.float64),
    )
