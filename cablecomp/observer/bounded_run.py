"""Compiled run through a block of samples with the bounds beside it."""

from __future__ import annotations

from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.pointer import call_walk
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.status import STATUS_OK
from cablecomp.observer.bounds_circuit import bounds_step


@kernel
def run_bounded(
    walk_at: int, fixed: Floats, layout: Ints, memory: Floats, heights: Ints, laws: Floats, rows: Floats, outs: Floats,
    numbers: Floats, memory_low: Floats, heights_low: Ints, memory_up: Floats, heights_up: Ints, interval: Floats,
) -> tuple[int, int]:  # fmt: skip
    """Step through rows of readings; `interval` gets the lowest and the highest joint angle [rad] of the drive.

    `walk_at`: where the machine code of `walk` lies. Returns how many rows were done and the status of the row that
    stopped it.
    """
    for k in range(rows.shape[0]):
        _, status = call_walk(
            walk_at, fixed, layout, memory, heights, laws, rows[k : k + 1], outs[k : k + 1], True
        )
        if status != STATUS_OK:
            return k, status
        interval[k, 0], interval[k, 1] = bounds_step(
            fixed, layout, laws, memory, numbers, memory_low, heights_low, memory_up, heights_up
        )
    return rows.shape[0], STATUS_OK
