"""Instants at which a residual's dependence on the load path changes; own code, for its costs come out of running sums.

Bai and Perron's problem by dynamic programming. `ruptures` would solve a regression for every pair of ends; here the
normal equations of any piece are a difference of two sums.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from cablecomp.signal.autocorrelation import integrated_time
from cablecomp.signal.smoothing import FloatArray, IntArray


@dataclass(frozen=True)
class Segments:
    """Pieces of a recording with constant coefficients.

    `bounds`: 0, first samples of the later pieces, n; `gain`: energy that the changes remove over the energy that one
    piece leaves.
    """

    bounds: IntArray
    gain: float

    @property
    def changes(self) -> IntArray:
        """First sample of every piece but the first one."""
        return self.bounds[1:-1]


def segment(
    residual: FloatArray, regressors: FloatArray, cells: int = 120, most: int = 8, strictness: float = 3.0
) -> Segments:
    """Cut residual = regressors @ b into pieces with different b, as few as the noise asks for.

    Minimises sum of squares + penalty * pieces; penalty = strictness (k + 1) ln(cells) s^2 tau, with s^2
    tau the long-run variance of what a local fit leaves, so that autocorrelated noise does not fall apart
    into pieces. At most `most` changes.
    """
    n, k = regressors.shape
    edges = np.unique(np.linspace(0, n, min(cells, max(2, n // (4 * k))) + 1).astype(np.int64))
    count = len(edges) - 1
    gram = np.zeros((count + 1, k, k))
    moment = np.zeros((count + 1, k))
    energy = np.zeros(count + 1)
    for cell, (a, b) in enumerate(itertools.pairwise(edges)):
        part, values = regressors[a:b], residual[a:b]
        gram[cell + 1] = gram[cell] + part.T @ part
        moment[cell + 1] = moment[cell] + part.T @ values
        energy[cell + 1] = energy[cell] + values @ values
    cost = _costs(gram, moment, energy)
    penalty = strictness * (k + 1) * np.log(count + 1.0) * _noise_energy(residual, regressors)
    cuts = _optimal(cost, penalty, most)
    bounds = _refined(residual, regressors, edges[cuts])
    rest = sum(cost[a, b] for a, b in itertools.pairwise(cuts))
    whole = float(cost[0, count])
    return Segments(bounds, 1.0 - float(rest) / whole if whole > 0.0 else 0.0)


def _costs(gram: FloatArray, moment: FloatArray, energy: FloatArray) -> FloatArray:
    """Residual energy of one fit over cells i…j-1, for all i < j."""
    count, k = len(energy), moment.shape[1]
    cost = np.full((count, count), np.inf)
    tiny = 1e-9 * np.eye(k) * max(float(np.trace(gram[-1])) / max(1, count), 1e-300)
    for first in range(count - 1):
        g = gram[first + 1 :] - gram[first] + tiny
        m = moment[first + 1 :] - moment[first]
        fitted = np.einsum("jk,jk->j", m, np.linalg.solve(g, m[..., None])[..., 0])
        cost[first, first + 1 :] = energy[first + 1 :] - energy[first] - fitted
    return cost


def _optimal(cost: FloatArray, penalty: float, most: int) -> IntArray:
    count = len(cost)
    best = np.full((most + 2, count), np.inf)
    origin = np.zeros((most + 2, count), dtype=np.int64)
    best[0, 0] = 0.0
    for pieces in range(1, most + 2):
        for end in range(1, count):
            options = best[pieces - 1, :end] + cost[:end, end]
            origin[pieces, end] = int(np.argmin(options))
            best[pieces, end] = options[origin[pieces, end]]
    totals = best[1:, -1] + penalty * np.arange(1, most + 2)
    pieces = int(np.argmin(totals)) + 1
    cuts = [count - 1]
    for remaining in range(pieces, 0, -1):
        cuts.append(int(origin[remaining, cuts[-1]]))
    return np.array(cuts[::-1], dtype=np.int64)


def _refined(residual: FloatArray, regressors: FloatArray, bounds: IntArray) -> IntArray:
    """Move each change to the sample at which one fit takes over from the other."""
    out = bounds.copy()
    for at in range(1, len(bounds) - 1):
        low, middle, high = out[at - 1], bounds[at], bounds[at + 1]
        left = _fit(regressors[low:middle], residual[low:middle])
        right = _fit(regressors[middle:high], residual[middle:high])
        width = max(2, len(residual) // 60)
        a, b = max(low + 1, middle - width), min(high - 1, middle + width)
        if b <= a:
            continue
        part, values = regressors[a:b], residual[a:b]
        swap = np.cumsum((values - part @ left) ** 2 - (values - part @ right) ** 2)
        out[at] = a + int(np.argmin(np.append(0.0, swap)))
    return np.unique(out)


def _fit(regressors: FloatArray, residual: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.lstsq(regressors, residual, rcond=1e-9)[0], dtype=np.float64)


def _noise_energy(residual: FloatArray, regressors: FloatArray) -> float:
    """Long-run variance of what fits over tenths of the recording leave."""
    rest = residual.copy()
    for part in np.array_split(np.arange(len(residual)), 10):
        rest[part] -= regressors[part] @ _fit(regressors[part], residual[part])
    return float(np.var(rest)) * integrated_time(rest)
