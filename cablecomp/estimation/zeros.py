"""What the zeros of a channel can do to its rows: a linear part of every fit, taken off by projection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cablecomp.estimation.evidence import MOTOR, Evidence
from cablecomp.estimation.limits import CARRYOVER_SD
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

    @property
    def sd(self) -> FloatArray:
        """1-sigma of each of them, all but the zeros as it is [the channel's unit]; 0 of what no row shows."""
        return np.asarray(np.linalg.norm(np.linalg.pinv(self.R), axis=1), dtype=np.float64)


def zeros_of(
    evidence: Sequence[Evidence],
    sessions: Sequence[str],
    channel: str,
    sigma: float,
    departs: Sequence[float],
) -> Zeros:
    """The zeros of a channel of these recordings: each session's (and its slope by motor angle, of the motor's torque),
    each recording's own beside it, and what its history carries over.

    `sigma`: what a row counts for; `departs`: prior sd of each recording's own (empty: it has none) [the channel's
    unit]."""
    width = 2 if channel == MOTOR else 1
    carried = [
        r.carryover[channel].shape[1] if channel in r.counted and channel in r.carryover else 0
        for r in evidence
    ]
    own = width * len(sessions)
    free = own + len(departs)
    blocks = []
    for k, r in enumerate(evidence):
        if channel not in r.counted:
            continue
        kept = r.counted[channel]
        w = r.weight[kept] / sigma
        block = np.zeros((len(w), free + sum(carried)))
        first = width * sessions.index(r.session)
        block[:, first] = w
        if width == 2:
            block[:, first + 1] = w * r.at_rows("motor_position_rad")[kept]
        if departs:
            block[:, own + k] = w
        if carried[k]:
            at = free + sum(carried[:k])
            block[:, at : at + carried[k]] = w[:, None] * r.carryover[channel][kept]
        blocks.append(block)
    matrix = np.vstack(blocks)
    penalty = np.zeros((len(departs) + sum(carried), matrix.shape[1]))
    penalty[:, own:] = np.diag([*(1.0 / sd for sd in departs), *[1.0 / CARRYOVER_SD] * sum(carried)])
    Q, R = np.linalg.qr(np.vstack([matrix, penalty]))
    return Zeros(Q, R, len(penalty))
