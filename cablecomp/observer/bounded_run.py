"""Compiled run through a block of samples with the bounds beside it."""

from __future__ import annotations

from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.status import STATUS_OK
from cablecomp.observer.bounds_circuit import bounds_step
from cablecomp.observer.stepper import find_load, step_one


@kernel
def run_bounded(
    P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, rows: Floats, outs: Floats, inverse: bool,
    W: Floats, SL: Floats, JL: Ints, SU: Floats, JU: Ints, interval: Floats,
) -> tuple[int, int]:  # fmt: skip
    """Step through rows of readings; `interval` gets the lowest and the highest joint angle [rad] of the drive.

    Returns how many rows were done and the status of the row that stopped it.
    """
    for k in range(rows.shape[0]):
        status = STATUS_OK
        if inverse:
            status = find_load(P, I, S, J, L, rows[k], outs[k])
        if status == STATUS_OK:
            status = step_one(P, I, S, J, L, rows[k], outs[k])
        if status != STATUS_OK:
            return k, status
        interval[k, 0], interval[k, 1] = bounds_step(P, I, L, S, W, SL, JL, SU, JU)
    return rows.shape[0], STATUS_OK
