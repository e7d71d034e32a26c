"""Compiled run through a block of samples with the bounds beside it."""

from __future__ import annotations

from cablecomp.mechanics.drive import Arrays
from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.pointer import call_bounds_step, call_step_rows
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.status import STATUS_OK


@kernel
def run_bounded(
    step_rows_at: int,
    bounds_step_at: int,
    joint: Arrays,
    rows: Floats,
    outs: Floats,
    numbers: Floats,
    low: tuple[Floats, Ints],
    up: tuple[Floats, Ints],
    interval: Floats,
) -> tuple[int, int]:
    """Step through rows of readings; `interval` gets the lowest and the highest joint angle [rad] of the drive.

    `step_rows_at`, `bounds_step_at`: where the machine code of `step_rows` and of `bounds_step` lies; `low`, `up`:
    memory and heights of the extreme histories. Returns how many rows were done and the status of the row that stopped
    it.
    """
    for k in range(rows.shape[0]):
        _, status = call_step_rows(step_rows_at, (joint, rows[k : k + 1], outs[k : k + 1], True))
        if status != STATUS_OK:
            return k, status
        interval[k, 0], interval[k, 1] = call_bounds_step(bounds_step_at, (joint, numbers, low, up))
    return rows.shape[0], STATUS_OK
