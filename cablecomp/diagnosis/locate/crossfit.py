"""Cross-fitted regressions on contiguous blocks, kept as block sums so that surrogates cost little; own code, as
scikit-learn's cross-validation would fit every fold of every surrogate from the rows again."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final

import numpy as np

from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.signal.smoothing import FloatArray, IntArray

_RIDGE: Final = 1e-3
"""Share of a regressor's own energy that holds its coefficient back."""


@dataclass(frozen=True)
class BlockSums:
    """Normal equations of each block: `gram` b x k x k, `moment` b x k, `fold` of each block, `energy` b =
    sum w r^2. Of what a fit has taken off the residual: `cross` b x k x q, its products with the regressors, `own`
    b x q, with the residual.
    """

    gram: FloatArray
    moment: FloatArray
    fold: IntArray
    energy: FloatArray
    cross: FloatArray
    own: FloatArray

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return len(self.energy)

    def select(self, columns: IntArray) -> BlockSums:
        """Return the sums of some of the regressors."""
        return BlockSums(
            self.gram[:, columns][:, :, columns],
            self.moment[:, columns],
            self.fold,
            self.energy,
            self.cross[:, columns],
            self.own,
        )


def block_sums(
    basis: FloatArray,
    residual: FloatArray,
    weight: FloatArray,
    block: IntArray,
    beneath: FloatArray | None = None,
) -> BlockSums:
    """Return the weighted normal equations of residual on basis (n x k) for contiguous blocks 0…b-1.

    Blocks are dealt out to the folds in turn, so that every fold sees the whole recording. `beneath` (n x q): what has
    been taken off the residual and the basis, orthonormal under the weight.
    """
    firsts = np.flatnonzero(np.concatenate(([True], np.diff(block) != 0)))
    bounds = np.append(firsts, len(block))
    weighted = basis * weight[:, None]
    spans = list(itertools.pairwise(bounds))
    gram = np.stack([weighted[a:b].T @ basis[a:b] for a, b in spans])
    moment = np.add.reduceat(weighted * residual[:, None], firsts, axis=0)
    energy = np.add.reduceat(weight * residual**2, firsts)
    fold = (np.arange(len(firsts)) % LIMITS.crossfit).astype(np.int64)
    taken = np.empty((len(block), 0)) if beneath is None else beneath
    cross = np.stack([weighted[a:b].T @ taken[a:b] for a, b in spans])
    own = np.stack([taken[a:b].T @ (weight * residual)[a:b] for a, b in spans])
    return BlockSums(gram, moment, fold, np.asarray(energy, dtype=np.float64), cross, own)


def gains(sums: BlockSums) -> FloatArray:
    """Return how much of each block's energy the fit on the other folds removes there (b)."""
    total, ridge = _normal(sums)
    whole = sums.moment.sum(axis=0)
    out = np.zeros(sums.blocks)
    for here in _folds(sums):
        train = total - sums.gram[here].sum(axis=0) + ridge
        c = np.linalg.solve(train, whole - sums.moment[here].sum(axis=0))
        out[here] = 2.0 * sums.moment[here] @ c - np.einsum("k,bkl,l->b", c, sums.gram[here], c)
    return out


def surrogate_gains(sums: BlockSums, signs: FloatArray) -> FloatArray:
    """Return the same, summed over all blocks, for residuals whose blocks have these signs (s x b): s.

    What the fit would have taken off them is taken off again: of noise, too, a fit leaves what it cannot follow.
    """
    total, ridge = _normal(sums)
    again = signs @ sums.own
    whole = signs @ sums.moment - again @ sums.cross.sum(axis=0).T
    out = np.zeros(len(signs))
    for here in _folds(sums):
        held = sums.gram[here].sum(axis=0)
        moments = signs[:, here] @ sums.moment[here] - again @ sums.cross[here].sum(axis=0).T
        c = np.linalg.solve(total - held + ridge, (whole - moments).T).T
        out += np.sum((2.0 * moments - c @ held) * c, axis=1)
    return out


def _normal(sums: BlockSums) -> tuple[FloatArray, FloatArray]:
    """The normal matrix of all blocks, and its ridge: a thousandth of each regressor's own energy, so that a regressor
    absent from the other folds predicts nothing."""
    total = sums.gram.sum(axis=0)
    scale = np.diag(total)
    return total, np.diag(_RIDGE * scale + 1e-12 * max(float(scale.max(initial=0.0)), 1e-300))


def _folds(sums: BlockSums) -> list[IntArray]:
    """The blocks of each fold that has any."""
    found = [np.flatnonzero(sums.fold == fold) for fold in range(LIMITS.crossfit)]
    return [here for here in found if len(here)]


def coefficients(sums: BlockSums) -> FloatArray:
    """Return the coefficients of the (ridge) fit over all blocks."""
    total, ridge = _normal(sums)
    return np.asarray(np.linalg.solve(total + ridge, sums.moment.sum(axis=0)), dtype=np.float64)
