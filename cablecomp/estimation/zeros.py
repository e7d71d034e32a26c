"""What the zeros of a channel can do to its rows: a linear part of every fit, taken off by projection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Zeros:
    """A basis of what the zeros of one channel can do to its weighted rows, and how to read the zeros off."""

    Q: FloatArray
    R: FloatArray
    penalty_rows: int

    def project(self, rows: FloatArray) -> FloatArray:
        """Rows, or columns of them (and the penalties), with the best zeros taken off."""
        padded = np.concatenate([rows, np.zeros((self.penalty_rows, *rows.shape[1:]))])
        return np.asarray(padded - self.Q @ (self.Q.T @ padded), dtype=np.float64)

    def solve(self, rows: FloatArray) -> FloatArray:
        """The zeros themselves."""
        padded = np.concatenate([rows, np.zeros(self.penalty_rows)])
        return np.asarray(np.linalg.lstsq(self.R, self.Q.T @ padded, rcond=None)[0], dtype=np.float64)
