"""Fit one set of parameters to many recordings of a drive, by joint angle, by motor torque, or by both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, inf, log, sqrt
from typing import Final, Literal

import numpy as np
from scipy.optimize import least_squares

from cablecomp.config import JointConfig
from cablecomp.errors import InputError
from cablecomp.identification.transmission_path import PathModel, PathRecording, path_model, predict_path
from cablecomp.signal.autocorrelation import integrated_time_of_parts
from cablecomp.signal.smoothing import FloatArray

Channel = Literal["joint_position_rad", "motor_torque_Nm"]
JOINT: Final[Channel] = "joint_position_rad"
MOTOR: Final[Channel] = "motor_torque_Nm"

_STEP = 1e-3
_HOPELESS = 30.0


@dataclass(frozen=True)
class Unknown:
    """A free parameter: name as `transmission_path` and `parameters` know it, start, bounds, and how far
    from the start it may plausibly lie (1-sigma, in its logarithm if `logarithmic`, else in its own unit;
    infinite = not known)."""

    name: str
    start: float
    low: float
    high: float
    sd: float = inf
    logarithmic: bool = True

    def to_x(self, value: float) -> float:
        """The value as the fit moves it."""
        return log(value) if self.logarithmic else value

    def value(self, x: float) -> float:
        """The value in its own unit."""
        return exp(x) if self.logarithmic else x


@dataclass(frozen=True)
class PathFit:
    """Result: `values` by name; `zero_rad`: joint encoder's zero of each session; `motor_zero`: the motor
    torque's zero [N m] and slope [N m/rad] (empty if it was not measured); `misfit`: RMS of measured less
    predicted over the rows that count, by channel; `sigma`: what a misfit counts for (its RMS times the
    root of its memory)."""

    config: JointConfig
    values: Mapping[str, float]
    zero_rad: Mapping[str, float]
    motor_zero: Mapping[str, FloatArray]
    misfit: Mapping[Channel, float]
    sigma: Mapping[Channel, float]


def fit_path(
    config: JointConfig,
    recordings: Sequence[PathRecording],
    unknowns: Sequence[Unknown],
    *,
    fixed: Mapping[str, float] | None = None,
    scale: Mapping[Channel, float],
    iterations: int = 12,
    weigh: bool = True,
) -> PathFit:
    """Least squares of all recordings' misfits over `scale`, with the unknowns' `sd` as priors.

    `scale` names the channels to fit and the misfit expected there. The joint encoder has one zero per
    session, the motor's torque a zero and a slope over the motor's angle per session (sensor's zero; wires
    and seals beside the cables): these are solved for within the fit. With `weigh` a second pass takes for
    scale what the first one left, times the root of its memory in rows, so that priors keep their weight.
    Raises InputError if the joint cannot follow the recordings at the start.
    """
    fit = _Fit(config, recordings, unknowns, fixed or {})
    x = np.array([u.to_x(u.start) for u in unknowns])
    fit.misfits(x)
    sigma = dict(scale)
    for passes in range(2 if weigh else 1):
        if passes:
            sigma = fit.remembered(x, sigma)
        x = fit.solve(x, sigma, iterations)
    misfits = fit.misfits(x)
    rms = {c: _rms(misfits[c]) for c in (JOINT, MOTOR) if c in misfits}
    return PathFit(
        config, fit.values(x), dict(fit.zero_rad), dict(fit.motor_zero), rms, fit.remembered(x, sigma)
    )


def misfit_of(
    fit: PathFit,
    recordings: Sequence[PathRecording],
    zero: Literal["fitted", "session", "recording"] = "fitted",
) -> dict[str, FloatArray]:
    """Measured less predicted joint angle [rad] of each recording's counted rows.

    `zero`: the encoder's zero found in the fit (the session must have been in it), or the mean of these
    recordings' misfit by session, or by recording.
    """
    found = {}
    for r in recordings:
        predicted = predict_path(fit.config, fit.values, r).joint_position_rad
        found[r.name] = (r.columns[JOINT] - predicted)[r.counted]
    if zero == "fitted":
        return {r.name: found[r.name] - fit.zero_rad[r.session] for r in recordings}
    key = {r.name: r.session if zero == "session" else r.name for r in recordings}
    means = {
        k: float(np.mean(np.concatenate([m for n, m in found.items() if key[n] == k]))) for k in key.values()
    }
    return {name: m - means[key[name]] for name, m in found.items()}


def rms(parts: Mapping[str, FloatArray]) -> float:
    """Root mean square over all parts together."""
    return _rms(list(parts.values()))


class _Fit:
    """Misfits of all recordings as a function of the unknowns."""

    def __init__(
        self,
        config: JointConfig,
        recordings: Sequence[PathRecording],
        unknowns: Sequence[Unknown],
        fixed: Mapping[str, float],
    ) -> None:
        self.config = config
        self.recordings = tuple(recordings)
        self.unknowns = tuple(unknowns)
        self.fixed = dict(fixed)
        self.zero_rad: dict[str, float] = {}
        self.motor_zero: dict[str, FloatArray] = {}
        self._low = np.array([u.to_x(u.low) for u in unknowns])
        self._high = np.array([u.to_x(u.high) for u in unknowns])
        self._start = np.array([u.to_x(u.start) for u in unknowns])
        self._prior = np.array([u.sd for u in unknowns])
        self._weights = [r.weight for r in self.recordings]

    def values(self, x: FloatArray) -> dict[str, float]:
        return {**self.fixed, **{u.name: u.value(float(v)) for u, v in zip(self.unknowns, x, strict=True)}}

    def misfits(self, x: FloatArray) -> dict[Channel, list[FloatArray]]:
        """Measured less predicted, less zero (and slope), by channel and recording."""
        values = self.values(x)
        joint, motor = [], []
        models: dict[
            tuple[object, ...], PathModel
        ] = {}  # recordings in which the joint stands alike share one
        for r in self.recordings:
            key = (r.bend_rad, *r.own.items())
            if key not in models:
                models[key] = path_model(self.config, values, r)
            found = models[key].predict(r)
            joint.append((r.columns[JOINT] - found.joint_position_rad)[r.counted])
            if MOTOR in r.columns:
                motor.append((r.columns[MOTOR] - found.motor_torque_Nm)[r.counted])
        zeros: dict[str, FloatArray] = {}
        result: dict[Channel, list[FloatArray]] = {JOINT: self._without_zero(joint, zeros, slope=False)}
        self.zero_rad = {session: float(zero[0]) for session, zero in zeros.items()}
        if len(motor) == len(self.recordings):
            result[MOTOR] = self._without_zero(motor, self.motor_zero, slope=True)
        return result

    def _without_zero(
        self, parts: list[FloatArray], zero: dict[str, FloatArray], slope: bool
    ) -> list[FloatArray]:
        for session in dict.fromkeys(r.session for r in self.recordings):
            mine = [k for k, r in enumerate(self.recordings) if r.session == session]
            motor = [r.columns["motor_position_rad"][r.counted] for r in (self.recordings[k] for k in mine)]
            basis = [np.column_stack((np.ones(len(m)), m) if slope else (np.ones(len(m)),)) for m in motor]
            weight = np.concatenate([self._weights[k] for k in mine])
            whole = np.concatenate([parts[k] for k in mine])
            found = np.linalg.lstsq(weight[:, None] * np.vstack(basis), weight * whole, rcond=None)[0]
            zero[session] = found
            for k, b in zip(mine, basis, strict=True):
                parts[k] = parts[k] - b @ found
        return parts

    def residual(self, x: FloatArray, sigma: Mapping[Channel, float]) -> FloatArray:
        """All misfits over their scale, and the priors."""
        try:
            misfits = self.misfits(x)
            rows = [m / sigma[c] for c in sigma for m in self.weighted(misfits[c])]
        except InputError:
            # A trial that the drive cannot follow: far worse than any real one.
            rows = [np.full(r.rows, _HOPELESS) for _ in sigma for r in self.recordings]
        return np.concatenate([*rows, (x - self._start) / self._prior])

    def solve(self, x: FloatArray, sigma: Mapping[Channel, float], iterations: int) -> FloatArray:
        inside = np.clip(x, self._low + 1e-6, self._high - 1e-6)
        found = least_squares(
            self.residual,
            inside,
            bounds=(self._low, self._high),
            args=(sigma,),
            x_scale="jac",
            diff_step=_STEP,
            max_nfev=iterations,
            ftol=1e-5,
            xtol=1e-5,
        )
        solution: FloatArray = found.x
        return solution

    def remembered(self, x: FloatArray, sigma: Mapping[Channel, float]) -> dict[Channel, float]:
        """RMS misfit times the root of its memory in rows, for the channels of `sigma`."""
        misfits = self.misfits(x)
        parts = {c: self.weighted(misfits[c]) for c in sigma}
        return {c: _rms(p) * sqrt(integrated_time_of_parts(p)) for c, p in parts.items()}

    def weighted(self, misfits: Sequence[FloatArray]) -> list[FloatArray]:
        """Rows weighted by the time that they stand for."""
        return [w * m for m, w in zip(misfits, self._weights, strict=True)]


def _rms(parts: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(list(parts)) ** 2)))
