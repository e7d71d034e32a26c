"""Cross-fitted regressions on contiguous blocks, kept as block sums so that surrogates cost little."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final

import numpy as np

from cablecomp.signal.smoothing import FloatArray, IntArray

FOLDS: Final = 5
_RIDGE: Final = 1e-3


@dataclass(frozen=True)
class BlockSums:
    """Normal equations of each block: `gram` b x k x k, `moment` b x k, `fold` of each block, `energy` b =
    sum w r^2.
    """

    gram: FloatArray
    moment: FloatArray
    fold: IntArray
    energy: FloatArray

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return len(self.energy)

    def select(self, columns: IntArray) -> BlockSums:
        """Return the sums of some of the regressors."""
        return BlockSums(
            self.gram[:, columns][:, :, columns], self.moment[:, columns], self.fold, self.energy
        )


def block_sums(basis: FloatArray, residual: FloatArray, weight: FloatArray, block: IntArray) -> BlockSums:
    """Return the weighted normal equations of residual on basis (n x k) for contiguous blocks 0…b-1.

    Blocks are dealt out to the folds in turn, so that every fold sees the whole recording.
    """
    firsts = np.flatnonzero(np.concatenate(([True], np.diff(block) != 0)))
    bounds = np.append(firsts, len(block))
    weighted = basis * weight[:, None]
    gram = np.stack([weighted[a:b].T @ basis[a:b] for a, b in itertools.pairwise(bounds)])
    moment = np.add.reduceat(weighted * residual[:, None], firsts, axis=0)
    energy = np.add.reduceat(weight * residual**2, firsts)
    fold = (np.arange(len(firsts)) % FOLDS).astype(np.int64)
    return BlockSums(gram, moment, fold, np.asarray(energy, dtype=np.float64))


def gains(sums: BlockSums, signs: FloatArray | None = None) -> FloatArray:
    """Return how much of each block's energy the fit on the other folds removes there (b, or s x b with
    signs).

    `signs` (s x b): block-wise signs of surrogate residuals. Ridge: a thousandth of each regressor's own
    energy, so that a regressor absent from the other folds predicts nothing.
    """
    surrogates = np.ones((1, sums.blocks)) if signs is None else signs
    total = sums.gram.sum(axis=0)
    scale = np.diag(total)
    ridge = np.diag(_RIDGE * scale + 1e-12 * max(float(scale.max(initial=0.0)), 1e-300))
    out = np.zeros((len(surrogates), sums.blocks))
    whole = surrogates @ sums.moment
    for fold in range(FOLDS):
        here = np.flatnonzero(sums.fold == fold)
        if not len(here):
            continue
        train = total - sums.gram[here].sum(axis=0) + ridge
        moments = whole - surrogates[:, here] @ sums.moment[here]
        coefficients = np.linalg.solve(train, moments.T).T
        cross = np.einsum("sk,bk->sb", coefficients, sums.moment[here]) * surrogates[:, here]
        square = np.einsum("sk,bkl,sl->sb", coefficients, sums.gram[here], coefficients, optimize=True)
        out[:, here] = 2.0 * cross - square
    return out[0] if signs is None else out


def coefficients(sums: BlockSums) -> FloatArray:
    """Return the coefficients of the (ridge) fit over all blocks."""
    total = sums.gram.sum(axis=0)
    scale = np.diag(total)
    ridge = np.diag(_RIDGE * scale + 1e-12 * max(float(scale.max(initial=0.0)), 1e-300))
    return np.asarray(np.linalg.solve(total + ridge, sums.moment.sum(axis=0)), dtype=np.float64)
