"""The online observer of one cable-driven joint."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig
from cablecomp.durable import write_durably
from cablecomp.effects import extend
from cablecomp.effects.catalogue import is_bounded, other_channels
from cablecomp.errors import InputError, InternalError
from cablecomp.mechanics.assemble import Model, assemble
from cablecomp.mechanics.drive import Arrays
from cablecomp.mechanics.invariants import heights_fit, profile_violations, violations
from cablecomp.mechanics.pointer import kernel_address
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.start import joint_start
from cablecomp.mechanics.status import STATUS_OK
from cablecomp.observer import stepper as st
from cablecomp.observer.block import block_of, estimates
from cablecomp.observer.bounds import BoundPair
from cablecomp.observer.refusal import refused
from cablecomp.observer.rows import PLACES, answers, put_asked, put_sample, readings
from cablecomp.observer.snapshot import pack, unpack
from cablecomp.observer.wraps import WrapProfile, wrap_profiles
from cablecomp.signals import NAN, Estimate, Sample


class Observer:
    """Tracks the tension history of a joint and predicts its deflection, sample by sample.

    State: the tension profile on every wrap (`mechanics.profile`). `step` commits a sample, `peek` predicts without
    committing; `run` steps through a block with the same compiled code. Time is an argument of every call. With
    `bounds` two extreme histories run beside it: the true deflection lies between, whatever happened before the start
    (NaN where an effect of the configuration gives no guarantee).

    A sample that the joint cannot take raises SampleRefused (an InputError that carries the reason), and then leaves no
    trace: the state is what it was before, bit for bit. What `step` takes `run` takes, and the other way round.
    """

    def __init__(self, config: JointConfig, *, bounds: bool = False) -> None:
        self.config = config
        self.model: Model = assemble(config, extend(config))
        m = self.model
        self.channels = other_channels(config)
        self._memory, self._heights = m.memory.copy(), m.heights.copy()
        # every array is written in place for good, so one tuple serves all calls
        self._arrays = Arrays(m.fixed, m.layout, self._memory, self._heights, m.laws)
        # the first row of each is a step's, the second what `step_ahead` predicts
        self._reading = readings(2, len(self.channels))
        self._cells = self._reading.rows.data.cast("B")
        self._second = self._reading.rows.strides[0]
        outs, self._answer = answers(2)
        self._out = outs[0]
        self._one = (*self._arrays, self._reading.rows[:1], outs[:1])
        self._address = 0
        self._places: Ints | None = None
        self._ratio = config.drive.ratio
        self._named = m.named(self._memory, self._heights)
        self._spare = int(self._named.size.spare_at)
        self._last_time = -math.inf
        self._source = config.observer.load
        self._motor_zero = config.motor_zero_Nm
        self._zero_load = config.sensors.joint_torque_offset_Nm
        self._bounds = self._bound_pair() if bounds and is_bounded(config) else None

    # --- the three ways to use it ---------------------------------------------------------------------------------

    def step(self, sample: Sample) -> Estimate:
        """Commit one sample and say what the joint does."""
        fresh = self._read(sample)
        if self._source == "both_encoders":
            return self._taken(sample, self._walk_inverse(True), fresh)
        return self._taken(sample, st.walk(*self._one, True)[1], fresh)

    def step_ahead(
        self, sample: Sample, time_s: float, motor_position_rad: float, joint_torque_Nm: float
    ) -> tuple[Estimate, float]:
        """`step` a sample and `peek_deflection` of the other three, in one compiled call; the deflection is NaN where
        it has to be asked for by itself."""
        if self._source == "both_encoders":
            return self.step(sample), NAN
        fresh = self._read(sample)
        put_asked(self._cells, self._second, time_s, motor_position_rad, joint_torque_Nm)
        places = self._located() if self._places is None else self._places
        status, ahead = st.walk_ahead(places, self._arrays.laws)
        estimate = self._taken(sample, status, fresh)
        if ahead != STATUS_OK:
            return estimate, NAN
        return estimate, float(self._answer.joint[1]) - self._ratio * motor_position_rad

    def peek(self, sample: Sample) -> Estimate:
        """Predict the joint for a sample (for instance the load expected next) and commit nothing."""
        fresh = self._read(sample)
        return self._peeked(sample, st.walk(*self._one, False)[1], fresh)

    def peek_deflection(self, time_s: float, motor_position_rad: float, joint_torque_Nm: float) -> float:
        """`peek` for a loop: the deflection [rad] alone, at another load and motor angle, all else as in the
        last sample."""
        put_asked(self._cells, 0, time_s, motor_position_rad, joint_torque_Nm)
        _, status = st.walk(*self._one, False)
        if status != STATUS_OK:
            self._refuse(status, time_s, False)
        return float(self._answer.joint[0]) - self._ratio * motor_position_rad

    def run(self, columns: Mapping[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
        """Step through a block of samples given as canonical channels; returns the estimates as columns.

        Raises SampleRefused naming the sample (counted from 0 within the block) that cannot be taken; those
        before it are committed.
        """
        read = block_of(self.config, self.channels, columns)
        count = len(read.rows)
        outs, answer = answers(count)
        low = np.full(count, NAN)
        high = np.full(count, NAN)
        fresh = count > 0 and self._last_time == -math.inf
        if fresh:
            self._start(read.time[0], read.motor[0])
        done, status = self._run_rows(read.rows, outs, low, high)
        if done:
            self._last_time = float(read.time[done - 1])
        if status != STATUS_OK:
            self._out[:] = outs[done]
            self._refuse(status, read.time[done], fresh and done == 0, done)
        return estimates(answer, low, high, self._ratio * read.motor)

    def inverse(self, sample: Sample) -> Estimate:
        """Joint torque that explains both encoders (its sample's joint torque is not read); commits nothing."""
        fresh = self._read(sample)
        return self._peeked(sample, self._walk_inverse(False), fresh)

    def step_inverse(self, sample: Sample) -> Estimate:
        """As `inverse`, and commits the sample with the torque found."""
        fresh = self._read(sample)
        return self._taken(sample, self._walk_inverse(True), fresh)

    # --- state ----------------------------------------------------------------------------------------------------

    def snapshot(self) -> bytes:
        """The whole state as a small, versioned, checksummed block of bytes."""
        return pack(self.config, self.model, *self._parts(), self._last_time)

    def restore(self, data: bytes) -> None:
        """Take up a state from `snapshot`; raises InputError, and changes nothing, if it is damaged, belongs to
        another joint or holds what no joint can be in."""
        before = [part.copy() for part in self._all_arrays()], self._last_time
        try:
            self._last_time = unpack(data, self.config, self.model, *self._parts())
            found = self._violations()
            if found:
                raise InputError(
                    f"snapshot: holds an impossible state ({found[0]}); start from a known state instead"
                )
        except InputError:
            for part, old in zip(self._all_arrays(), before[0], strict=True):
                part[:] = old
            self._last_time = before[1]
            raise

    def save(self, path: Path) -> None:
        """Write the snapshot to a file: a power cut leaves the old file or the new one; raises OSError."""
        write_durably(path, self.snapshot())

    def load(self, path: Path) -> None:
        """Restore from a file written by `save`."""
        try:
            data = path.read_bytes()
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror}); give a snapshot file") from None
        self.restore(data)

    def vector(self) -> Floats:
        """The state as one vector of floats, bounds left out; `set_vector` takes it up (for solvers that own
        the state)."""
        return np.concatenate(
            [self._memory[: self._spare], self._heights.astype(np.float64), [self._last_time]]
        )

    def set_vector(self, vector: Floats) -> None:
        """Take up a state given by `vector` of an observer of the same configuration; all zeros = nothing is known yet.

        Raises InputError, and changes nothing, if it cannot be such a state.
        """
        heights = vector[self._spare : -1]
        known = bool(np.any(heights))
        if len(vector) != self._spare + len(self._heights) + 1 or (
            known and not heights_fit(self.model, heights)
        ):
            raise InputError(
                f"{self.config.name}: this vector is no state of the joint; give one from Observer.vector"
            )
        if not known:
            self._forget()
            return
        self._memory[: self._spare] = vector[: self._spare]
        self._heights[:] = heights
        self._last_time = float(vector[-1])

    def check_state(self) -> None:
        """Verify every invariant of the state (`mechanics.invariants`); raises InternalError that names the
        first broken one."""
        found = self._violations()
        if found:
            raise InternalError(f"{self.config.name}: the observer's state is broken: {found[0]}")

    def copy(self) -> Observer:
        """An independent observer in the same state."""
        twin = Observer(self.config, bounds=self._bounds is not None)
        twin.restore(self.snapshot())
        return twin

    # --- what can be asked ----------------------------------------------------------------------------------------

    def compile(self) -> None:
        """Have what a loop calls (step, peek, inverse, bounds) compiled, or read from the cache, before it is
        armed; the state stays as it is."""
        self._located()
        twin = Observer(self.config, bounds=self._bounds is not None)
        still = Sample(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (0.0,) * len(self.channels))
        twin.step(still)
        twin.peek(still)
        twin.inverse(still)
        twin.step_ahead(still, 0.0, 0.0, 0.0)

    def compile_bounds(self) -> None:
        """As `compile`, for what the bounds alone call."""
        if self._bounds is not None:
            self._bounds.start(0.0, 0.0)
            self._bounds.compile(self._arrays)
            self._bounds.forget()

    def stiffness(self) -> float:
        """Present tangent stiffness dM/dtheta [N m/rad] of the drive, in the direction last loaded."""
        return 1.0 / float(self._named.context.compliance)

    def merge_error_rad(self) -> float:
        """Bound [rad] on the error of the present deflection that merging of profile pieces can have made."""
        pairs = zip(self._named.cables, self._named.states, strict=True)
        return float(sum(cable.weight * state.error for cable, state in pairs))

    def pieces(self) -> int:
        """Number of points that describe all profiles: the memory in use."""
        return int(self._heights.sum())

    def profiles(self) -> list[WrapProfile]:
        """The tension profile on every wrap, termination first."""
        return wrap_profiles(self.config, self.model, self._memory, self._heights)

    # --- inside ---------------------------------------------------------------------------------------------------

    def _bound_pair(self) -> BoundPair:
        options = self.config.observer
        return BoundPair(self.model, (options.past_tension_min, options.past_tension_max))

    def _parts(self) -> tuple[list[tuple[Floats, Ints]], list[Floats]]:
        """All that makes up the state: histories, further numbers."""
        states: list[tuple[Floats, Ints]] = [(self._memory, self._heights)]
        if self._bounds is None:
            return states, []
        return states + self._bounds.states(), [self._bounds.numbers]

    def _all_arrays(self) -> list[Floats | Ints]:
        states, numbers = self._parts()
        return [array for state in states for array in state] + list(numbers)

    def _violations(self) -> list[str]:
        if self._last_time == -math.inf:
            return []
        found = violations(self.model, self._memory, self._heights)
        for memory, heights in [] if self._bounds is None else self._bounds.states():
            found += profile_violations(self.model, memory, heights)
        return found

    def _start(self, time_s: float, motor: float) -> None:
        m = self.model
        joint_start(m.fixed, m.layout, self._memory, self._heights, m.laws, time_s, motor, 0.0)
        if self._bounds is not None:
            self._bounds.start(time_s, motor)

    def _forget(self) -> None:
        """Know nothing, as before the first sample."""
        self._memory[:], self._heights[:], self._last_time = self.model.memory, self.model.heights, -math.inf
        if self._bounds is not None:
            self._bounds.forget()

    def _read(self, sample: Sample) -> bool:
        """Write a sample's readings into the kernel's row; True if the state was started for it, as it is the first."""
        time, motor, load, joint, torque, temperature, other = sample
        if self._source == "motor_torque":
            load = -(torque - self._motor_zero) / self._ratio
        elif self._source == "none":
            load = self._zero_load
        put_sample(self._cells, 0, time, motor, load, joint, temperature)
        if self.channels:
            read = self._reading.other[0]
            read[: len(self.channels)] = NAN
            for k, value in enumerate(other[: len(self.channels)]):
                read[k] = value
        if self._last_time != -math.inf:
            return False
        self._start(time, motor)
        return True

    def _run_rows(self, rows: Floats, outs: Floats, low: Floats, high: Floats) -> tuple[int, int]:
        """Run a block by the compiled loop that does what is wanted; returns rows done and the last status."""
        known = len(rows), STATUS_OK
        if self.config.observer.load == "both_encoders":
            before = self._memory.copy(), self._heights.copy()
            known = st.walk_inverse(self._walk_at(), *self._arrays, rows, outs, True)
            if self._bounds is None:
                return known
            # every row's load is known by now: once more, with the bounds
            self._memory[:], self._heights[:] = before
        if self._bounds is None:
            return st.walk(*self._arrays, rows, outs, True)
        interval = np.empty((len(rows), 2))
        ended = self._bounds.run(self._walk_at(), self._arrays, rows[: known[0]], outs, interval)
        low[:], high[:] = interval[:, 0], interval[:, 1]
        return ended if ended[1] != STATUS_OK else known

    def _walk_inverse(self, commit: bool) -> int:
        """`walk` for the sample that was read, its load found from both encoders: the status."""
        return int(st.walk_inverse(self._walk_at(), *self._one, commit)[1])

    def _walk_at(self) -> int:
        """Where the machine code of `walk` lies for this observer's arrays."""
        if self._address == 0:
            self._address = kernel_address(st.walk, *self._one, True)
        return self._address

    def _located(self) -> Ints:
        """Where this observer's arrays lie, for `walk_ahead`."""
        names = ("fixed", "layout", "memory", "heights")
        arrays = dict(zip(names, self._arrays, strict=False))
        two = {"rows": self._one[5], "outs": self._one[6]}
        at = np.zeros(1, PLACES)
        at["walk"] = self._walk_at()
        for name, array in {**arrays, **two}.items():
            at[name] = array.ctypes.data, array.shape[-1]
        self._places = at.view(np.int64)
        return self._places

    def _taken(self, sample: Sample, status: int, fresh: bool) -> Estimate:
        """What a step ends with: the estimate, or the refusal."""
        if status != STATUS_OK:
            self._refuse(status, sample.time_s, fresh)
        self._last_time = sample.time_s
        low, high = NAN, NAN
        if self._bounds is not None:
            low, high = self._bounds.step(self._arrays)
        return self._estimate(sample, low, high)

    def _peeked(self, sample: Sample, status: int, fresh: bool) -> Estimate:
        """What a prediction ends with; nothing is left of it."""
        if status != STATUS_OK:
            self._refuse(status, sample.time_s, fresh)
        if fresh:
            self._forget()
        return self._estimate(sample, NAN, NAN)

    def _refuse(self, status: int, time_s: float, fresh: bool, index: int | None = None) -> NoReturn:
        if fresh:
            self._forget()
        raise refused(status, float(time_s), self._last_time, float(self._answer.strength[0]), index)

    def _estimate(self, sample: Sample, low: float, high: float) -> Estimate:
        # in the order of `Answer`, which itself would cost 0.4 us of a step's 4
        joint, drive, load, tension_h, tension_l, _, _, _, motor_torque, _ = self._out.tolist()
        rigid = self._ratio * sample.motor_position_rad
        shift = joint - drive - rigid
        # made without Python's own call of its class, which took a third longer
        return tuple.__new__(
            Estimate,
            (
                sample.time_s,
                joint - rigid,
                low + shift,
                high + shift,
                joint,
                load,
                tension_h,
                tension_l,
                motor_torque,
            ),
        )
