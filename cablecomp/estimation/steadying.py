"""Readings on judged rows with their noise averaged off: as wide as neither neighbours nor the readings object.

A law is run on rows thinned by travel, which is where its cost lies; what was read between them says the same once
more. The mean of as many fine rows on either side has the noise of their number, and of what is straight there no
other value. What is averaged is therefore what a calibrated drive leaves (its prediction, loops and all, is put back: a
control variate). How wide is told by the readings themselves (A. Goldenshluger and A. Nemirovski, On spatially adaptive
estimation of nonparametric regression, Math. Methods Statist. 6, 1997): wider means as long as they agree within their
noise, so that a clearance that is crossed between two rows stays as steep as it was read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cablecomp.errors import InputError
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.limits import AVERAGED_AGREE, AVERAGED_MOST
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import BoolArray, FloatArray, IntArray


class Steadied(NamedTuple):
    """Values on the judged rows, and what part of a fine row's noise (variance) is left in each."""

    values: FloatArray
    part: FloatArray


def steadied(values: FloatArray, read: BoolArray, rows: IntArray, sigma: float) -> Steadied:
    """Values of the fine rows `rows`, each averaged over as many rows on either side as are nearer to it than to
    another of them, were read, and agree.

    `sigma`: white noise of a fine row (1-sigma) [unit of the values]; none, and nothing is averaged. `rows` in order;
    the first and the last are left as they are, and so is the one next to a gap.
    """
    at, part = values[rows].copy(), np.ones(len(rows))
    if sigma <= 0.0 or len(rows) < 3:
        return Steadied(at, part)
    most = np.zeros(len(rows), dtype=np.int64)
    before, after = np.diff(rows)[:-1], np.diff(rows)[1:]
    most[1:-1] = np.minimum((np.minimum(before, after) - 1) // 2, AVERAGED_MOST)
    reach = AVERAGED_AGREE * sigma
    low, high, total = at - reach, at + reach, at.copy()
    going = read[rows]
    for width in range(1, int(most.max()) + 1):
        k = np.flatnonzero(going & (most >= width))
        left, right = rows[k] - width, rows[k] + width
        total[k] += values[left] + values[right]
        mean, rest = total[k] / (2 * width + 1), 1.0 / (2 * width + 1)
        low[k] = np.maximum(low[k], mean - reach * np.sqrt(rest))
        high[k] = np.minimum(high[k], mean + reach * np.sqrt(rest))
        agreed = (low[k] <= high[k]) & read[left] & read[right]
        going[k[~agreed]] = False
        at[k[agreed]], part[k[agreed]] = mean[agreed], rest
    return Steadied(at, part)


def with_steady_readings(problem: Problem, x: FloatArray, evidence: Sequence[Evidence]) -> list[Evidence]:
    """The recordings, their output channels' readings averaged about what the problem's drive predicts at x; as they
    are where it cannot follow them."""
    fine = [on_every_row(e) for e in evidence]
    try:
        misfits = problem.with_evidence(fine).misfits(x)
    except InputError:
        return list(evidence)
    found = []
    for k, e in enumerate(evidence):
        steady, quiet = {}, {}
        for c in (c for c in problem.channels if c in e.counted):
            misfit = misfits[c][k]
            average = steadied(misfit, e.read[c], e.rows, e.noise_of_fine(c))
            steady[c] = e.columns[c][e.rows] - misfit[e.rows] + average.values
            kept = e.counted[c] if e.counted[c].any() else slice(None)
            quiet[c] = float(np.average(average.part[kept], weights=e.weight[kept] ** 2))
        found.append(replace(e, steady=steady, quiet=quiet))
    return found


def as_read(e: Evidence) -> Evidence:
    """The recording with the judged rows' readings as they are."""
    return replace(e, steady={}, quiet={})


def on_every_row(e: Evidence) -> Evidence:
    """All fine rows judged: one counts where its judged neighbours do."""
    every = np.arange(len(e.columns["time_s"]), dtype=np.int64)
    return replace(
        as_read(e),
        rows=every,
        counted={k: np.interp(every, e.rows, v.astype(np.float64)) > 0.99 for k, v in e.counted.items()},
        weight=np.ones(len(every)),
        carryover={
            k: np.column_stack([np.interp(every, e.rows, column) for column in v.T])
            for k, v in e.carryover.items()
        },
    )
