"""Models that do not know the drive, fitted on the same data as ours: linear, polynomial, Bouc–Wen, plays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from types import MappingProxyType
from typing import Final, Literal, Protocol

import numpy as np
from baseline_operators import bouc_wen, plays
from scipy.optimize import lsq_linear, minimize

from cablecomp.errors import InputError
from cablecomp.signal.noise import channel_noise
from cablecomp.signal.smoothing import FloatArray, fit_to_noise

Columns = Mapping[str, FloatArray]

Offsets = Literal["common", "each"]
"""Whether the joint encoder has one zero for all recordings, or each recording its own (then it is no
part of the error).
"""

INPUTS: Final = ("motor_position_rad", "joint_torque_Nm", "motor_torque_Nm")
"""Channels that a baseline may use, as far as all recordings have them; further ones are given as `extra`."""

_PLAYS: Final = 12
_TINY: Final = 1e-12


class Baseline(Protocol):
    """A fitted model: joint angle out of the other channels."""

    @property
    def name(self) -> str:
        """Name of the kind of model."""
        ...

    @property
    def parameters(self) -> Mapping[str, float]:
        """Fitted numbers, in SI units."""
        ...

    def predict(self, columns: Columns) -> FloatArray:
        """Return the predicted joint angle (rad) of one recording, which is run through from its first
        sample.
        """
        ...


@dataclass(frozen=True)
class Regression:
    """A model that is linear in its coefficients: joint angle = features(recording) @ coefficients."""

    name: str
    labels: tuple[str, ...]
    coefficients: FloatArray
    features: Callable[[Columns], FloatArray]

    @property
    def parameters(self) -> Mapping[str, float]:
        """Coefficient of each feature."""
        return dict(zip(self.labels, map(float, self.coefficients), strict=True))

    def predict(self, columns: Columns) -> FloatArray:
        """Return the predicted joint angle in rad."""
        return np.asarray(self.features(columns) @ self.coefficients, dtype=np.float64)


@dataclass(frozen=True)
class BoucWen:
    """joint = a + g q_in + c M + c_m tau_m + h z(q_in): Bouc–Wen in the motor angle, with load compliance."""

    linear: Regression
    reach: float
    shape: float
    power: float

    @property
    def name(self) -> str:
        """Name of the kind of model."""
        return "bouc-wen"

    @property
    def parameters(self) -> Mapping[str, float]:
        """Coefficients, and reach (rad), shape and power of the hysteretic part."""
        return {**self.linear.parameters, "reach": self.reach, "shape": self.shape, "power": self.power}

    def predict(self, columns: Columns) -> FloatArray:
        """Return the predicted joint angle in rad."""
        return self.linear.predict(columns)


def fit_linear(
    recordings: Sequence[Columns], extra: Sequence[str] = (), offsets: Offsets = "common"
) -> Baseline:
    """Fit joint = a + g q_in + c M + c_m tau_m by least squares: a drive of constant ratio and stiffness."""
    inputs = _inputs(recordings, extra)

    def features(columns: Columns) -> FloatArray:
        return _plain(columns, inputs)

    return Regression("linear", ("offset", *inputs), _least_squares(recordings, features, offsets), features)


def fit_polynomial(
    recordings: Sequence[Columns], extra: Sequence[str] = (), offsets: Offsets = "common", degree: int = 3
) -> Baseline:
    """Fit a memoryless polynomial of position, torques, direction and speed, lightly damped (ridge)."""
    inputs = _inputs(recordings, extra)
    stacked = np.vstack([_memoryless(columns, inputs) for columns in recordings])
    centre, scale = stacked.mean(axis=0), np.maximum(stacked.std(axis=0), _TINY)
    moving = stacked.std(axis=0) > 1e-9 * np.maximum(np.abs(centre), _TINY)
    names = [name for name, used in zip((*inputs, "direction", "speed"), moving, strict=True) if used]
    powers = [
        group
        for order in range(degree + 1)
        for group in combinations_with_replacement(range(len(names)), order)
        if group.count(len(names) - 2 if "direction" in names else -1) <= 1
    ]

    def features(columns: Columns) -> FloatArray:
        given = ((_memoryless(columns, inputs) - centre) / scale)[:, moving]
        return np.column_stack([np.prod(given[:, list(group)], axis=1) for group in powers])

    labels = tuple("·".join(names[i] for i in group) or "offset" for group in powers)
    return Regression("polynomial", labels, _least_squares(recordings, features, offsets, 1e-6), features)


def fit_plays(
    recordings: Sequence[Columns], extra: Sequence[str] = (), offsets: Offsets = "common", count: int = _PLAYS
) -> Baseline:
    """Fit a Prandtl–Ishlinskii model: plays of the motor angle with weights >= 0, and load compliance.

    joint = a + g q_in + c M + c_m tau_m + sum w_i play(q_in, r_i), g, w_i >= 0, radii spaced by squares
    up to half of the range.
    """
    inputs = _inputs(recordings, extra)
    reach = 0.5 * max(float(np.ptp(columns["motor_position_rad"])) for columns in recordings)
    radii = reach * (np.arange(1, count + 1) / count) ** 2

    def features(columns: Columns) -> FloatArray:
        return np.column_stack((_plain(columns, inputs), plays(columns["motor_position_rad"], radii)))

    labels = ("offset", *inputs, *(f"play {radius:.4g} rad" for radius in radii))
    floor = np.full(len(labels), -np.inf)
    floor[labels.index("motor_position_rad")] = 0.0
    floor[-count:] = 0.0
    return Regression("plays", labels, _least_squares(recordings, features, offsets, 0.0, floor), features)


def fit_bouc_wen(
    recordings: Sequence[Columns], extra: Sequence[str] = (), offsets: Offsets = "common"
) -> Baseline:
    """Fit a Bouc–Wen model in the motor angle with load compliance.

    Coefficients follow from least squares for each trial of reach, shape and power, which are searched
    from several starts (Nelder–Mead on their logarithms; shape in 0…1 by a logistic).
    """
    inputs = _inputs(recordings, extra)
    span = max(float(np.ptp(columns["motor_position_rad"])) for columns in recordings)

    def build(trial: FloatArray) -> BoucWen:
        reach, shape, power = _natural(trial, span)

        def features(columns: Columns) -> FloatArray:
            z = bouc_wen(columns["motor_position_rad"], reach, shape, power)
            return np.column_stack((_plain(columns, inputs), z))

        labels = ("offset", *inputs, "hysteretic")
        linear = Regression("bouc-wen", labels, _least_squares(recordings, features, offsets), features)
        return BoucWen(linear, reach, shape, power)

    def loss(trial: FloatArray) -> float:
        return rmse(build(trial), recordings, offsets)

    starts = [np.array([share, 0.0, 0.0]) for share in np.log((0.01, 0.05, 0.2, 0.6))]
    first = min(starts, key=loss)
    simplex = np.vstack((first, first + np.diag([0.7, 1.0, 0.5])))
    options = {"maxfev": 200, "xatol": 1e-3, "fatol": 1e-9, "initial_simplex": simplex}
    found = minimize(loss, first, method="Nelder-Mead", options=options)
    return build(np.asarray(found.x, dtype=np.float64))


BASELINES: Final[Mapping[str, Callable[..., Baseline]]] = MappingProxyType(
    {
        "linear": fit_linear,
        "polynomial": fit_polynomial,
        "bouc-wen": fit_bouc_wen,
        "plays": fit_plays,
    }
)
"""Every kind of baseline and its fit: fit(recordings, extra, offsets) -> Baseline."""


def rmse(model: Baseline, recordings: Sequence[Columns], offsets: Offsets = "common") -> float:
    """Return the RMS of measured minus predicted joint angle over all samples of the recordings, in rad.

    With `offsets` = "each" the mean error of each recording is taken off first.
    """
    squares, samples = 0.0, 0
    for columns in recordings:
        error = columns["joint_position_rad"] - model.predict(columns)
        if offsets == "each":
            error = error - error.mean()
        squares += float(error @ error)
        samples += len(error)
    return float(np.sqrt(squares / max(1, samples)))


def _inputs(recordings: Sequence[Columns], extra: Sequence[str]) -> tuple[str, ...]:
    if not recordings:
        raise InputError("a baseline needs at least one recording to be fitted on")
    for needed in ("motor_position_rad", "joint_position_rad"):
        for number, columns in enumerate(recordings, start=1):
            if needed not in columns:
                raise InputError(
                    f"recording {number} of {len(recordings)} has no {needed}; baselines need it"
                )
    return tuple(name for name in (*INPUTS, *extra) if all(name in columns for columns in recordings))


def _plain(columns: Columns, inputs: Sequence[str]) -> FloatArray:
    return np.column_stack((np.ones(len(columns["motor_position_rad"])), *(columns[name] for name in inputs)))


def _memoryless(columns: Columns, inputs: Sequence[str]) -> FloatArray:
    """Inputs, direction (smooth step) and speed of the motor."""
    motor = columns["motor_position_rad"]
    time = columns["time_s"]
    speed = fit_to_noise(time, motor, channel_noise(time, motor).sigma).slope
    usual = max(float(np.sqrt(np.mean(speed**2))), _TINY)
    return np.column_stack((*(columns[name] for name in inputs), np.tanh(10.0 * speed / usual), speed))


def _natural(trial: FloatArray, span: float) -> tuple[float, float, float]:
    reach = span * float(np.exp(np.clip(trial[0], -9.0, 2.0)))
    shape = float(1.0 / (1.0 + np.exp(-np.clip(trial[1], -30.0, 30.0))))
    return reach, shape, float(np.exp(np.clip(trial[2], -1.5, 2.0)))


def _least_squares(
    recordings: Sequence[Columns],
    features: Callable[[Columns], FloatArray],
    offsets: Offsets,
    damping: float = 0.0,
    floor: FloatArray | None = None,
) -> FloatArray:
    """Coefficients out of the normal equations of all recordings; `floor`: lower bounds."""
    gram: FloatArray | None = None
    moment: FloatArray | None = None
    for columns in recordings:
        basis, target = features(columns), columns["joint_position_rad"]
        if offsets == "each":
            # one row in a thousandth of its weight keeps the common offset determined
            basis = np.vstack((basis - basis.mean(axis=0), 1e-3 * basis.mean(axis=0)))
            target = np.append(target - target.mean(), 1e-3 * target.mean())
        square, cross = basis.T @ basis, basis.T @ target
        gram = square if gram is None else gram + square
        moment = cross if moment is None else moment + cross
    assert gram is not None
    assert moment is not None
    scale = np.sqrt(np.maximum(np.diag(gram), _TINY))
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale) + damping * np.eye(len(scale)))
    kept = values > 1e-12 * values[-1]
    root = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
    goal = (vectors[:, kept].T @ (moment / scale)) / np.sqrt(values[kept])
    if floor is None:
        return np.asarray(np.linalg.lstsq(root, goal, rcond=None)[0] / scale, dtype=np.float64)
    bounded = lsq_linear(root, goal, bounds=(floor, np.inf), tol=1e-12)
    return np.asarray(bounded.x / scale, dtype=np.float64)
