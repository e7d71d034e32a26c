"""Guaranteed bounds when nothing is known of the load history before the start."""

from __future__ import annotations

import math

from cablecomp.mechanics.assemble import Model
from cablecomp.mechanics.drive import Arrays
from cablecomp.mechanics.pointer import kernel_address
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.start import joint_start
from cablecomp.observer.bounded_run import run_bounded
from cablecomp.observer.bounds_circuit import bounds_step
from cablecomp.observer.bounds_kernel import bounds_numbers, sides_start

EXTREME = 30.0  # |ln(T/T0)| beyond anything


class BoundPair:
    """The lowest and the highest history that friction admits, led beside an observer's own.

    After `start`, `step` follows each committed step of the observer and says between which joint angles [rad] the true
    one lies, whatever was done to the joint before the start (any profile with |du/ds| <= mu on every wrap, tensions in
    balance with the load). `past` = least and greatest T/T0 that any cable has borne since it was pretensioned, where
    that is known. NaN where no guarantee can be given (so little is known that the angles themselves are open).
    """

    def __init__(self, model: Model, past: tuple[float | None, float | None] = (None, None)) -> None:
        self._model = model
        low, high = past
        self._low = (model.memory.copy(), model.heights.copy())
        self._up = (model.memory.copy(), model.heights.copy())
        self.numbers: Floats = bounds_numbers(
            model, -EXTREME if low is None else math.log(low), EXTREME if high is None else math.log(high)
        )
        self._unstarted = self.numbers.copy()

    def start(self, time_s: float, motor: float) -> None:
        """Know nothing but the position of the motor [rad]."""
        m = self._model
        for memory, heights in (self._low, self._up):
            joint_start(m.fixed, m.layout, memory, heights, m.laws, time_s, motor, 0.0)
        sides_start(m.fixed, m.layout, m.laws, self.numbers, *self._low, *self._up)

    def forget(self) -> None:
        """Be as before `start`."""
        self.numbers[:] = self._unstarted
        for memory, heights in self.states():
            memory[:], heights[:] = self._model.memory, self._model.heights

    def step(self, joint: Arrays) -> tuple[float, float]:
        """Follow a step that the observer's own state has just committed: lowest and highest joint angle [rad]."""
        low, high = bounds_step(*joint, self.numbers, *self._low, *self._up)
        return float(low), float(high)

    def run(
        self, step_rows_at: int, joint: Arrays, rows: Floats, outs: Floats, interval: Floats
    ) -> tuple[int, int]:
        """Step the observer's own state (by `step_rows`, whose machine code lies at `step_rows_at`) and the bounds
        through rows of readings; `interval` gets lowest and highest joint angle. Returns rows done and the
        status that stopped it."""
        return run_bounded(
            step_rows_at, self.compile(joint), joint, rows, outs, self.numbers, self._low, self._up, interval
        )

    def compile(self, joint: Arrays) -> int:
        """Where the machine code of `bounds_step` lies."""
        return kernel_address(bounds_step, *joint, self.numbers, *self._low, *self._up)

    def states(self) -> list[tuple[Floats, Ints]]:
        """The two histories, for a snapshot (with `numbers`)."""
        return [self._low, self._up]
