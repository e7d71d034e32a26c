"""One joint for the compiled steps: its state, a row of readings, a row of answers, and the calls on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from cablecomp.mechanics.assemble import Model
from cablecomp.mechanics.drive import Arrays
from cablecomp.mechanics.invariants import heights_fit
from cablecomp.mechanics.pointer import kernel_address
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.start import joint_start
from cablecomp.mechanics.status import STATUS_OK
from cablecomp.observer import stepper as st
from cablecomp.observer.bounds import BoundPair
from cablecomp.observer.rows import PLACES, answers, put_asked, put_sample, readings
from cablecomp.signals import NAN

Done = tuple[int, int]
"""Rows done, and the status of the row that stopped it."""


class CompiledJoint:
    """What `Observer` calls for every sample. The state is `memory`, all of its numbers, and `heights`, how many points
    of each tension profile are in use.

    `put_sample(time, motor, load, joint, temperature)` writes what is read next, `put_asked` the first three of it;
    then `step(commit)` or `step_inverse(commit)` steps it, and `answer` is what comes of it, a row `ANSWER`.
    `step_and_predict()` commits that row, and predicts a second, whose first three `put_ahead` wrote.

    Every array is written in place for good, so that each call is bound to its arguments once.
    """

    def __init__(self, model: Model, channels: int) -> None:
        self.model = model
        self.memory, self.heights = model.memory.copy(), model.heights.copy()
        self.arrays = Arrays(model.fixed, model.layout, self.memory, self.heights, model.laws)
        self.named = model.named(self.memory, self.heights)
        read = readings(2, channels)
        self._other = read.other[0, :channels]
        self._rows = read.rows
        self._outs, answer = answers(2)
        self.answer, self.joint, self.strength = self._outs[0], answer.joint, answer.strength
        self._one = (*self.arrays, self._rows[:1], self._outs[:1])
        cells = read.rows.data.cast("B")
        self.put_sample = partial(put_sample, cells, 0)
        self.put_asked = partial(put_asked, cells, 0)
        self.put_ahead = partial(put_asked, cells, read.rows.strides[0])
        self.step = partial(st.step_rows, *self._one)
        self._ahead: Callable[[], Done] | None = None
        self._address = 0

    def put_other(self, values: Sequence[float]) -> None:
        """Write what the further channels read; NaN for those that are not given."""
        self._other[:] = NAN
        for k, value in enumerate(values[: len(self._other)]):
            self._other[k] = value

    def step_inverse(self, commit: bool) -> Done:
        """`step` with the load found from both encoders."""
        return st.step_rows_inverse(self.address(), *self._one, commit)

    def step_and_predict(self) -> Done:
        """Commit the first row and predict the second: the status of each."""
        if self._ahead is None:
            self._ahead = partial(st.step_and_predict, self._located(), self.arrays.laws)
        return self._ahead()

    def run(
        self, rows: Floats, outs: Floats, inverse: bool, bounds: BoundPair | None, interval: Floats
    ) -> Done:
        """Commit a block of readings; with `bounds`, `interval` gets the lowest and the highest joint angle [rad].

        `inverse`: each row's load is found from both encoders, and written to it.
        """
        known = len(rows), STATUS_OK
        if inverse:
            before = self.memory.copy(), self.heights.copy()
            known = st.step_rows_inverse(self.address(), *self.arrays, rows, outs, True)
            if bounds is None:
                return known
            # every row's load is known by now: once more, with the bounds
            self.memory[:], self.heights[:] = before
        if bounds is None:
            return st.step_rows(*self.arrays, rows, outs, True)
        ended = bounds.run(self.address(), self.arrays, rows[: known[0]], outs, interval)
        return ended if ended[1] != STATUS_OK else known

    def start(self, time_s: float, motor: float) -> None:
        """Know nothing but the position of the motor [rad]."""
        m = self.model
        joint_start(m.fixed, m.layout, self.memory, self.heights, m.laws, time_s, motor, 0.0)

    def forget(self) -> None:
        """Be as before `start`."""
        self.memory[:], self.heights[:] = self.model.memory, self.model.heights

    def address(self) -> int:
        """Where the machine code of `step_rows` lies for these arrays."""
        if self._address == 0:
            self._address = kernel_address(st.step_rows, *self._one, True)
        return self._address

    def time_s(self) -> float:
        """Time of the state: that of the sample last committed."""
        return float(self.named.context.time)

    def compliance(self) -> float:
        """Present tangent compliance dtheta/dM [rad/(N m)] of the drive."""
        return float(self.named.context.compliance)

    def merge_error(self) -> float:
        """Bound [rad] on what merging of profile pieces has done to the present deflection."""
        pairs = zip(self.named.cables, self.named.states, strict=True)
        return float(sum(cable.weight * state.error for cable, state in pairs))

    def vector(self) -> Floats:
        """The state in one vector, without the kernel's scratch."""
        return np.concatenate([self._scalars(), self.heights.astype(np.float64)])

    def take_up(self, vector: Floats) -> bool:
        """Be in the state given by `vector`; False, and nothing changed, if it can be none. No point in use: not
        started."""
        scalars = self._scalars()
        heights = vector[len(scalars) :]
        fits = len(heights) == len(self.heights) and (not np.any(heights) or heights_fit(self.model, heights))
        if fits:
            scalars[:], self.heights[:] = vector[: len(scalars)], heights
        return fits

    def _scalars(self) -> Floats:
        part: Floats = self.memory[: int(self.named.size.spare_at)]
        return part

    def _located(self) -> Ints:
        at = np.zeros(1, PLACES)
        at["step_rows"] = self.address()
        located = {**self.arrays._asdict(), "rows": self._rows, "outs": self._outs}
        for name in located.keys() & set(PLACES.names or ()):
            at[name] = located[name].ctypes.data, located[name].shape[-1]
        return at.view(np.int64)
