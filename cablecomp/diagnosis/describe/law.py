"""A sparse law for a residual: few terms, chosen and fitted on training blocks, accepted on held-out ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cablecomp.diagnosis.describe.judge import judge
from cablecomp.diagnosis.describe.terms import Term
from cablecomp.diagnosis.folds import Layout
from cablecomp.diagnosis.locate.crossfit import BlockSums, block_sums, gains
from cablecomp.diagnosis.locate.series import Series
from cablecomp.signal.smoothing import FloatArray

MOST_TERMS: Final = 5
"""Terms of a sparse law: of more nobody reads anything."""
_LEAST_SHARE: Final = 0.02
"""Share of the energy on held-out blocks that a further term has to remove."""


@dataclass(frozen=True)
class LawTerm:
    """One term: `coefficient` ± `sd` (in `unit`) times `symbol`."""

    symbol: str
    coefficient: float
    sd: float
    unit: str


@dataclass(frozen=True)
class SparseLaw:
    """residual = sum of terms, in rad.

    `equation`: written out with units; `heldout_gain`: share of the residual's held-out mean square
    that the law removes; `p_value` of that on held-out blocks; `supported`: beyond the margin;
    `prediction`: the law's values on the series' samples.
    """

    terms: tuple[LawTerm, ...]
    equation: str
    heldout_gain: float
    p_value: float
    supported: bool
    prediction: FloatArray


def sparse_law(
    series: Series, library: Sequence[Term], layout: Layout, rng: np.random.Generator, level: float = 0.01
) -> SparseLaw | None:
    """Choose terms step by step, fit them on the training blocks, and judge the law on the held-out ones.

    A term enters if it removes most of what is left on blocks that its fit did not see (inside the
    training half), at least 2 % of the energy and two standard errors; terms that later ones make idle
    are dropped. Coefficients' sd comes from the scatter between blocks. None if no term enters.
    """
    training = _TrainingHalf(series, layout)
    chosen: list[int] = []
    usable = [index for index, term in enumerate(library) if _varies(term)]
    best = training.gain(library, chosen)
    while len(chosen) < MOST_TERMS:
        trials = {index: training.gain(library, [*chosen, index]) for index in usable if index not in chosen}
        if not trials:
            break
        top = max(trials, key=lambda index: float(trials[index].sum()))
        if not training.worth(trials[top] - best):
            break
        chosen.append(top)
        best = trials[top]
        for earlier in [index for index in chosen if index != top]:
            without = training.gain(library, [index for index in chosen if index != earlier])
            if not training.worth(best - without):
                chosen.remove(earlier)
                best = without
    if not chosen:
        return None
    return _judged(series, [library[index] for index in chosen], training, layout, rng, level)


class _TrainingHalf:
    """Cross-fitted gains inside the training blocks, all terms' block sums worked out once."""

    def __init__(self, series: Series, layout: Layout) -> None:
        self.rows = np.flatnonzero(layout.training)
        block = layout.block[self.rows]
        self.block = np.searchsorted(np.unique(block), block).astype(np.int64)
        self.weight = 1.0 / series.sigma[self.rows] ** 2
        self.residual = series.residual[self.rows]
        self.energy = float(np.sum(self.weight * self.residual**2))
        self._joint: BlockSums | None = None
        self._columns: list[FloatArray] = []

    def gain(self, library: Sequence[Term], chosen: Sequence[int]) -> FloatArray:
        """Energy removed from each block by a constant and the chosen terms, fitted on the other blocks."""
        if self._joint is None:
            self._prepare(library)
        assert self._joint is not None
        columns = np.concatenate([np.zeros(1), *(self._columns[index] for index in chosen)])
        return gains(self._joint.select(columns.astype(np.int64)))

    def worth(self, gain: FloatArray) -> bool:
        """Whether a gain per block is large enough and does not come from few blocks."""
        total = float(gain.sum())
        error = float(np.std(gain, ddof=1) * np.sqrt(len(gain)))
        return total > _LEAST_SHARE * self.energy and total > 2.0 * error

    def _prepare(self, library: Sequence[Term]) -> None:
        parts, first = [np.ones((len(self.rows), 1))], 1
        for term in library:
            values = term.values[self.rows]
            scale = float(np.sqrt(np.mean(values**2)))
            parts.append(values / (scale if scale > 0.0 else 1.0))
            self._columns.append(np.arange(first, first + values.shape[1], dtype=np.float64))
            first += values.shape[1]
        self._joint = block_sums(np.hstack(parts), self.residual, self.weight, self.block)


def _judged(
    series: Series,
    chosen: Sequence[Term],
    training: _TrainingHalf,
    layout: Layout,
    rng: np.random.Generator,
    level: float,
) -> SparseLaw:
    basis = np.hstack([np.ones((series.samples, 1)), *(term.values for term in chosen)])
    rows = training.rows
    weighted = basis[rows] * training.weight[:, None]
    inverse = np.linalg.pinv(weighted.T @ basis[rows])
    fit = inverse @ (weighted.T @ training.residual)
    rest = training.residual - basis[rows] @ fit
    scores = np.zeros((int(training.block[-1]) + 1, basis.shape[1]))
    np.add.at(scores, training.block, weighted * rest[:, None])
    covariance = inverse @ (scores.T @ scores) @ inverse
    sds = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    prediction = basis @ fit
    held = judge(series.residual, series.residual - prediction, layout, rng, level)
    symbols = ["1", *(symbol for term in chosen for symbol in term.symbols)]
    units = ["rad", *(_unit(term.unit) for term in chosen for _ in term.symbols)]
    terms = tuple(
        LawTerm(symbol, float(value), float(sd), unit)
        for symbol, value, sd, unit in zip(symbols, fit, sds, units, strict=True)
    )
    return SparseLaw(
        terms, equation(terms), held.heldout_gain, held.p_value, held.supported, np.asarray(prediction)
    )


def equation(terms: Sequence[LawTerm]) -> str:
    """Return the law as a line of text with coefficients, their sd and units."""
    parts = []
    for term in terms:
        if term.symbol == "1" and abs(term.coefficient) < 2.0 * term.sd:
            continue
        factor = "" if term.symbol == "1" else f" {term.symbol}"
        parts.append(f"({term.coefficient:.3g} ± {term.sd:.1g}) {term.unit}{factor}")
    return "residual = " + (" + ".join(parts) if parts else "0")


def _unit(unit: str) -> str:
    if not unit:
        return "rad"
    bare = unit.startswith("(") or not any(sign in unit for sign in " ·/√")
    return f"rad/{unit}" if bare else f"rad/({unit})"


def _varies(term: Term) -> bool:
    spread = np.ptp(term.values, axis=0)
    return bool(np.all(np.isfinite(term.values)) and np.all(spread > 0.0))
