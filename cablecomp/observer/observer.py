"""The online observer of one cable-driven joint."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from struct import error as StructError
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig
from cablecomp.durable import write_durably
from cablecomp.effects import extend
from cablecomp.effects.catalogue import is_bounded, other_channels
from cablecomp.errors import InputError, InternalError
from cablecomp.mechanics.assemble import Model, assemble
from cablecomp.mechanics.invariants import profile_violations, violations
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.status import STATUS_OK
from cablecomp.observer.block import block_of, estimates
from cablecomp.observer.bounds import BoundPair
from cablecomp.observer.compiled import CompiledJoint
from cablecomp.observer.refusal import refused, unreadable
from cablecomp.observer.rows import answers
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

    One thread at a time: `peek` and `step` write the same row, and what another thread peeks at meanwhile would be
    committed. A thread of its own asks a `copy`, taken between two steps.
    """

    def __init__(self, config: JointConfig, *, bounds: bool = False) -> None:
        if not isinstance(config, JointConfig):
            raise InputError(
                f"`config` is a {type(config).__name__}; give a JointConfig (`load_joint`, `parse_joint`)"
            )
        self.config = config
        self.model: Model = assemble(config, extend(config))
        self.channels = other_channels(config)
        self._joint = CompiledJoint(self.model, len(self.channels))
        self._ratio = config.drive.ratio
        self._last_time = -math.inf
        self._source = config.observer.load
        self._inverts = self._source == "both_encoders"
        self._motor_zero = config.motor_zero_Nm
        self._zero_load = config.sensors.joint_torque_offset_Nm
        self._joint_zero = config.sensors.joint_position_offset_rad
        self._bounds = self._bound_pair() if bounds and is_bounded(config) else None

    # --- the three ways to use it ---------------------------------------------------------------------------------

    def step(self, sample: Sample) -> Estimate:
        """Commit one sample and say what the joint does."""
        fresh = self._read(sample)
        if self._inverts:
            return self._taken(sample, self._joint.step_inverse(True)[1], fresh)
        return self._taken(sample, self._joint.step(True)[1], fresh)

    def step_ahead(
        self, sample: Sample, time_s: float, motor_position_rad: float, joint_torque_Nm: float
    ) -> tuple[Estimate, float]:
        """`step` a sample and `peek_deflection` of the other three, in one compiled call; the deflection is NaN where
        it has to be asked for by itself."""
        if self._inverts:
            return self.step(sample), NAN
        try:
            self._joint.put_ahead(time_s, motor_position_rad, joint_torque_Nm)
        except StructError:
            raise unreadable(Sample(time_s, motor_position_rad, joint_torque_Nm)) from None
        fresh = self._read(sample)
        status, ahead = self._joint.step_and_predict()
        estimate = self._taken(sample, status, fresh)
        if ahead != STATUS_OK:
            return estimate, NAN
        return estimate, float(self._joint.joint[1]) - self._ratio * float(motor_position_rad)

    def peek(self, sample: Sample) -> Estimate:
        """Predict the joint for a sample (for instance the load expected next) and commit nothing."""
        fresh = self._read(sample)
        return self._peeked(sample, self._joint.step(False)[1], fresh)

    def peek_deflection(self, time_s: float, motor_position_rad: float, joint_torque_Nm: float) -> float:
        """`peek` for a loop: the deflection [rad] alone, at another load and motor angle, all else as in the
        last sample."""
        try:
            self._joint.put_asked(time_s, motor_position_rad, joint_torque_Nm)
        except StructError:
            raise unreadable(Sample(time_s, motor_position_rad, joint_torque_Nm)) from None
        _, status = self._joint.step(False)
        if status != STATUS_OK:
            self._refuse(status, time_s, False)
        return float(self._joint.joint[0]) - self._ratio * float(motor_position_rad)

    def run(self, columns: Mapping[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
        """Step through a block of samples given as canonical channels; returns the estimates as columns.

        Raises SampleRefused naming the sample (counted from 0 within the block) that cannot be taken; those
        before it are committed.
        """
        read = block_of(self.config, self.channels, columns)
        count = len(read.rows)
        outs, answer = answers(count)
        interval = np.full((count, 2), NAN)
        fresh = count > 0 and self._last_time == -math.inf
        if fresh:
            self._start(read.time[0], read.motor[0])
        done, status = self._joint.run(read.rows, outs, self._inverts, self._bounds, interval)
        if done:
            self._last_time = float(read.time[done - 1])
        if status != STATUS_OK:
            self._joint.answer[:] = outs[done]
            self._refuse(status, read.time[done], fresh and done == 0, done)
        return estimates(answer, interval[:, 0], interval[:, 1], self._ratio * read.motor)

    def inverse(self, sample: Sample) -> Estimate:
        """Joint torque that explains both encoders, the joint's offset taken off (its sample's joint torque is not
        read); commits nothing."""
        fresh = self._read(sample)
        return self._peeked(sample, self._joint.step_inverse(False)[1], fresh)

    def step_inverse(self, sample: Sample) -> Estimate:
        """As `inverse`, and commits the sample with the torque found."""
        fresh = self._read(sample)
        return self._taken(sample, self._joint.step_inverse(True)[1], fresh)

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
        except BaseException:
            for part, old in zip(self._all_arrays(), before[0], strict=True):
                part[:] = old
            self._last_time = before[1]
            raise

    def save(self, path: Path | str) -> None:
        """Write the snapshot to a file: a power cut leaves the old file or the new one; raises OSError."""
        write_durably(Path(path), self.snapshot())

    def load(self, path: Path | str) -> None:
        """Restore from a file written by `save`."""
        try:
            data = Path(path).read_bytes()
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror}); give a snapshot file") from None
        self.restore(data)

    def vector(self) -> Floats:
        """The state as one vector of floats, bounds left out; `set_vector` takes it up (for solvers that own
        the state)."""
        return np.append(self._joint.vector(), self._last_time)

    def set_vector(self, vector: Floats) -> None:
        """Take up a state given by `vector` of an observer of the same configuration; all zeros = nothing is known yet.

        Raises InputError, and changes nothing, if it cannot be such a state.
        """
        vector = np.asarray(vector, dtype=np.float64)
        last = float(vector[-1]) if vector.ndim == 1 and len(vector) else NAN
        unknown = last == -math.inf and not np.any(vector[-1 - len(self._joint.heights) : -1])
        if not (math.isfinite(last) or unknown) or not self._joint.take_up(vector[:-1]):
            raise InputError(
                f"{self.config.name}: this vector is no state of the joint; give one from Observer.vector"
            )
        self._last_time = last
        if self.pieces() == 0:
            self._forget()

    def check_state(self) -> None:
        """Verify every invariant of the state (`mechanics.invariants`); raises InternalError that names the
        first broken one."""
        found = self._violations()
        if found:
            raise InternalError(f"{self.config.name}: the observer's state is broken: {found[0]}")

    def copy(self) -> Observer:
        """An independent observer in the same state."""
        return _restored(self.config, self._bounds is not None, self.snapshot())

    def __reduce__(self) -> tuple[Callable[..., Observer], tuple[JointConfig, bool, bytes]]:
        """What `copy`, `deepcopy` and `pickle` make one of: the state is written in place, and no two may share it."""
        return _restored, (self.config, self._bounds is not None, self.snapshot())

    # --- what can be asked ----------------------------------------------------------------------------------------

    def compile(self) -> None:
        """Have what a loop calls (step, peek, inverse, bounds) compiled, or read from the cache, before it is
        armed; the state stays as it is."""
        twin = Observer(self.config, bounds=self._bounds is not None)
        still = Sample(0.0, 0.0, 0.0, 0.0, self._motor_zero, 0.0, (0.0,) * len(self.channels))
        twin.step(still)
        twin.peek(still)
        twin.inverse(still)
        twin.step_ahead(still, 0.0, 0.0, 0.0)

    def compile_bounds(self) -> None:
        """As `compile`, for what the bounds alone call."""
        if self._bounds is not None:
            self._bounds.start(0.0, 0.0)
            self._bounds.compile(self._joint.arrays)
            self._bounds.forget()

    def stiffness(self) -> float:
        """Present tangent stiffness dM/dtheta [N m/rad] of the drive, in the direction last loaded; raises InputError
        before the first sample, which has loaded it in none."""
        compliance = self._joint.compliance()
        if not compliance > 0.0:
            raise InputError(
                f"{self.config.name}: no sample has been taken yet; step one, then ask its stiffness"
            )
        return 1.0 / compliance

    def merge_error_rad(self) -> float:
        """Bound [rad] on the error of the present deflection that merging of profile pieces can have made."""
        return self._joint.merge_error()

    def pieces(self) -> int:
        """Number of points that describe all profiles: the memory in use."""
        return int(self._joint.heights.sum())

    def profiles(self) -> list[WrapProfile]:
        """The tension profile on every wrap, termination first."""
        return wrap_profiles(self.config, self.model, self._joint.memory, self._joint.heights)

    # --- inside ---------------------------------------------------------------------------------------------------

    def _bound_pair(self) -> BoundPair:
        options = self.config.observer
        return BoundPair(self.model, (options.past_tension_min, options.past_tension_max))

    def _parts(self) -> tuple[list[tuple[Floats, Ints]], list[Floats]]:
        """All that makes up the state: histories, further numbers."""
        states: list[tuple[Floats, Ints]] = [(self._joint.memory, self._joint.heights)]
        if self._bounds is None:
            return states, []
        return states + self._bounds.states(), [self._bounds.numbers]

    def _all_arrays(self) -> list[Floats | Ints]:
        states, numbers = self._parts()
        return [array for state in states for array in state] + list(numbers)

    def _violations(self) -> list[str]:
        if self._last_time == -math.inf:
            return [f"{self.pieces()} points before any time"] if self.pieces() else []
        found = violations(self.model, self._joint.memory, self._joint.heights)
        if self._last_time != self._joint.time_s():
            found.append(f"the last sample at {self._last_time} s, the state at {self._joint.time_s()} s")
        for memory, heights in [] if self._bounds is None else self._bounds.states():
            found += profile_violations(self.model, memory, heights)
        return found

    def _start(self, time_s: float, motor: float) -> None:
        self._joint.start(time_s, motor)
        if self._bounds is not None:
            self._bounds.start(time_s, motor)

    def _forget(self) -> None:
        """Know nothing, as before the first sample."""
        self._joint.forget()
        self._last_time = -math.inf
        if self._bounds is not None:
            self._bounds.forget()

    def _read(self, sample: Sample) -> bool:
        """Write a sample's readings into the kernel's row; True if the state was started for it, as it is the first."""
        try:
            _, motor, load, joint, torque, temperature, other = sample
            time = sample.time_s
            if self._source == "motor_torque":
                load = -(torque - self._motor_zero) / self._ratio
            elif self._source == "none":
                load = self._zero_load
            self._joint.put_sample(time, motor, load, joint - self._joint_zero, temperature)
            if self.channels:
                self._joint.put_other(other)
        except (AttributeError, TypeError, ValueError, StructError):
            raise unreadable(sample) from None
        if self._last_time != -math.inf:
            return False
        self._start(float(time), float(motor))  # of other numbers it would be compiled anew
        return True

    def _taken(self, sample: Sample, status: int, fresh: bool) -> Estimate:
        """What a step ends with: the estimate, or the refusal."""
        if status != STATUS_OK:
            self._refuse(status, sample.time_s, fresh)
        self._last_time = sample.time_s
        low, high = NAN, NAN
        if self._bounds is not None:
            low, high = self._bounds.step(self._joint.arrays)
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
        raise refused(status, float(time_s), self._last_time, float(self._joint.strength[0]), index)

    def _estimate(self, sample: Sample, low: float, high: float) -> Estimate:
        # in the order of `Answer`, which itself would cost 0.4 us of a step's 4
        joint, drive, load, tension_h, tension_l, _, _, _, motor_torque, _ = self._joint.answer.tolist()
        rigid = self._ratio * float(sample.motor_position_rad)
        shift = joint - drive - rigid
        # made without Python's own call of its class, which took a third longer
        angles = (joint - rigid, low + shift, high + shift, joint)
        return tuple.__new__(Estimate, (sample.time_s, *angles, load, tension_h, tension_l, motor_torque))


def _restored(config: JointConfig, bounds: bool, snapshot: bytes) -> Observer:
    """An observer of that joint in the state of a snapshot."""
    observer = Observer(config, bounds=bounds)
    observer.restore(snapshot)
    return observer
