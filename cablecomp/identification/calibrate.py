"""Calibration: parameters that are only nominally known, fitted to recordings within their tolerance, with
covariance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, sqrt

import numpy as np
from scipy.optimize import least_squares

from cablecomp.config import JointConfig
from cablecomp.errors import InputError
from cablecomp.identification.misfit import Columns, Prepared, groups_for, predicted, prepare
from cablecomp.identification.parameters import OFFSET, Parameter, free_parameters, with_values
from cablecomp.signal.autocorrelation import integrated_time_of_parts
from cablecomp.signal.smoothing import FloatArray

Progress = Callable[[str, int], None]
"""Told what is being done, and how many simulations have been run."""

_STEP = 0.01  # of a prior's sd: small against what matters, large against the kinks of friction
_HOPELESS = 1e4


@dataclass(frozen=True)
class Fitted:
    """One parameter: value and 1-sigma uncertainty in its own unit, nominal value, distance from it in
    prior sds (NaN = no prior)."""

    name: str
    value: float
    sd: float
    nominal: float
    pull: float


@dataclass(frozen=True)
class Calibration:
    """Result of a fit.

    `config`: the configuration with the fitted values; `covariance`: of `values` in their own units and
    order, with the residual's excess over noise and its memory taken into account (`inflation` = factor on
    every sd); `rmse_rad` of each recording, `nominal_rmse_rad` with nominal parameters and the best offset;
    `noise_rad`: what noise alone would leave; `at_bound`: parameters that ended on a bound; `starts`: cost
    reached from each start; `warnings`: one line each.
    """

    config: JointConfig
    values: tuple[Fitted, ...]
    covariance: FloatArray
    rmse_rad: tuple[float, ...]
    nominal_rmse_rad: tuple[float, ...]
    noise_rad: float
    inflation: float
    at_bound: tuple[str, ...]
    starts: tuple[float, ...]
    simulations: int
    warnings: tuple[str, ...]

    def __getitem__(self, name: str) -> Fitted:
        """The parameter of that name; KeyError if it was not fitted."""
        for fitted in self.values:
            if fitted.name == name:
                return fitted
        raise KeyError(name)


@dataclass(frozen=True)
class FitOptions:
    """How to fit: rows in all after averaging, starts (the nominal point and draws from the prior),
    seconds left out at each recording's beginning, one offset for each recording or one for all,
    iterations from each start."""

    rows: int = 12000
    starts: int = 3
    skip_s: float = 0.0
    offset_each: bool = False
    seed: int = 0
    iterations: int = 25


def calibrate(
    config: JointConfig,
    recordings: Sequence[Columns],
    free: Sequence[str] | None = None,
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    options: FitOptions | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Fit parameters to recordings: least squares of the weighted residual, with the tolerances as priors.

    Minimises `sum ((measured - predicted - offset)/(sigma f))^2 + sum (x/prior sd)^2`, where f inflates the
    noise by what the residual has left (model error, memory), so that priors keep their weight against many
    samples that say the same. `free`: names as in `parameters`; None = all of [tolerance] and the joint
    encoder's offset. `recordings`: canonical channels. Raises InputError for unknown names, missing channels,
    or a joint that the nominal configuration cannot follow.
    """
    options = FitOptions() if options is None else options
    names = _with_offsets(config, free, len(recordings), options.offset_each)
    parameters = free_parameters(config, names, bounds)
    group = groups_for(recordings, options.rows)
    parts = [prepare(r, config, group, options.skip_s) for r in recordings]
    coarse = [prepare(r, config, 4 * group, options.skip_s) for r in recordings] if options.starts > 1 else []
    fit = _Fit(config, parameters, parts, progress)
    start = np.zeros(len(parameters))
    nominal = fit.rmse(fit.with_best_offsets(start))
    costs: list[float] = []
    if coarse:
        start, costs = _best_start(config, parameters, coarse, options, progress)
    x = fit.solve(start, 1.0, options.iterations)
    inflation = fit.excess(x)
    if inflation > 1.2:
        x = fit.solve(x, inflation, options.iterations)
        inflation = fit.excess(x)
    return _result(fit, x, inflation, nominal, tuple(costs))


class _Fit:
    """Weighted residuals of all recordings as a function of the parameters' x."""

    def __init__(
        self,
        config: JointConfig,
        parameters: Sequence[Parameter],
        parts: Sequence[Prepared],
        progress: Progress | None,
    ) -> None:
        self.config = config
        self.parameters = tuple(parameters)
        self.parts = tuple(parts)
        self.simulations = 0
        self._progress = progress
        self._offsets = [k for k, p in enumerate(parameters) if p.name.startswith(OFFSET)]
        self._low = np.array([p.low for p in parameters])
        self._high = np.array([p.high for p in parameters])
        self._prior = np.array([p.prior_sd for p in parameters])

    def values(self, x: FloatArray) -> dict[str, float]:
        """Parameters by name, in their own units."""
        return {p.name: p.value(float(v)) for p, v in zip(self.parameters, x, strict=True)}

    def misfits(self, x: FloatArray) -> list[FloatArray]:
        """Measured less predicted less offset, rad, of each recording (from its first row that counts)."""
        values = self.values(x)
        config = with_values(self.config, values)
        found = []
        for k, part in enumerate(self.parts):
            self.simulations += 1
            offset = values.get(
                f"{OFFSET}[{k}]", values.get(OFFSET, config.sensors.joint_position_offset_rad)
            )
            misfit = part.columns["joint_position_rad"] - predicted(config, part) - offset
            found.append(misfit[part.first :])
        if self._progress is not None:
            self._progress("fitting", self.simulations)
        return found

    def residual(self, x: FloatArray, inflation: float) -> FloatArray:
        """Weighted residual and priors, one vector."""
        try:
            misfits = self.misfits(x)
        except InputError:
            # A trial that the drive cannot follow (slack, cable run out): far worse than any real one.
            misfits = [np.full(p.rows, _HOPELESS) * p.sigma_rad[p.first :] for p in self.parts]
        rows = [m / (p.sigma_rad[p.first :] * inflation) for m, p in zip(misfits, self.parts, strict=True)]
        return np.concatenate([*rows, x / self._prior])

    def jacobian(self, x: FloatArray, inflation: float) -> FloatArray:
        """Forward differences; offsets enter linearly and are known."""
        base = self.residual(x, inflation)
        columns = np.empty((len(base), len(x)))
        for k, p in enumerate(self.parameters):
            if k in self._offsets:
                columns[:, k] = self._offset_column(k, inflation, len(base))
                continue
            step = _STEP if x[k] + _STEP <= p.high else -_STEP
            moved = x.copy()
            moved[k] += step
            columns[:, k] = (self.residual(moved, inflation) - base) / step
        return columns

    def _offset_column(self, k: int, inflation: float, rows: int) -> FloatArray:
        parameter, parts = self.parameters[k], []
        for j, part in enumerate(self.parts):
            mine = parameter.name in (OFFSET, f"{OFFSET}[{j}]")
            column = -parameter.unit / (part.sigma_rad[part.first :] * inflation)
            parts.append(column if mine else np.zeros(part.rows))
        priors = np.zeros(len(self.parameters))
        priors[k] = 1.0 / parameter.prior_sd
        return np.concatenate([*parts, priors])

    def with_best_offsets(self, x: FloatArray) -> FloatArray:
        """The same point, offsets set to the mean misfit; raises InputError if the joint cannot follow the
        recording."""
        x = x.copy()
        misfits = self.misfits(x)
        for k in self._offsets:
            p = self.parameters[k]
            mine = [m for j, m in enumerate(misfits) if p.name in (OFFSET, f"{OFFSET}[{j}]")]
            x[k] += float(np.mean(np.concatenate(mine))) / p.unit
        return x

    def solve(self, x: FloatArray, inflation: float, iterations: int) -> FloatArray:
        """Bounded least squares from x."""
        inside = np.clip(x, self._low + 1e-6, self._high - 1e-6)
        found = least_squares(
            self.residual,
            inside,
            jac=self.jacobian,
            bounds=(self._low, self._high),
            args=(inflation,),
            method="trf",
            x_scale="jac",
            ftol=1e-7,
            xtol=1e-7,
            max_nfev=iterations,
        )
        solution: FloatArray = found.x
        return solution

    def cost(self, x: FloatArray) -> float:
        """Half the sum of squares at x."""
        return 0.5 * float(np.sum(self.residual(x, 1.0) ** 2))

    def excess(self, x: FloatArray) -> float:
        """Factor on the noise that makes the residual as informative as it is: sqrt(chi^2 per row times
        its memory), at least 1."""
        rows = [m / p.sigma_rad[p.first :] for m, p in zip(self.misfits(x), self.parts, strict=True)]
        square = float(np.mean(np.concatenate(rows) ** 2))
        return max(1.0, sqrt(square * integrated_time_of_parts(rows)))

    def rmse(self, x: FloatArray) -> tuple[float, ...]:
        """Root mean square misfit of each recording, rad."""
        return tuple(float(np.sqrt(np.mean(m**2))) for m in self.misfits(x))


def _with_offsets(
    config: JointConfig, free: Sequence[str] | None, recordings: int, each: bool
) -> tuple[str, ...]:
    names = tuple(p.name for p in free_parameters(config, free))
    if not each or OFFSET not in names:
        return names
    return (*(n for n in names if n != OFFSET), *(f"{OFFSET}[{k}]" for k in range(recordings)))


def _best_start(
    config: JointConfig,
    parameters: Sequence[Parameter],
    coarse: Sequence[Prepared],
    options: FitOptions,
    progress: Progress | None,
) -> tuple[FloatArray, list[float]]:
    """Rough fits on few rows from the nominal point and from draws of the prior; the best one's end, and
    all costs."""
    fit = _Fit(config, parameters, coarse, progress)
    rng = np.random.default_rng(options.seed)
    spread = np.array(
        [p.prior_sd if isfinite(p.prior_sd) else (3.0 if p.logarithmic else 0.0) for p in parameters]
    )
    best = np.zeros(len(parameters))
    costs: list[float] = []
    for k in range(options.starts):
        draw = spread * rng.standard_normal(len(parameters)) if k else np.zeros(len(parameters))
        try:
            start = fit.with_best_offsets(draw)
        except InputError:
            if k == 0:
                raise
            start = draw
        end = fit.solve(start, 1.0, options.iterations // 2)
        cost = fit.cost(end)
        if cost < min(costs, default=inf):
            best = end
        costs.append(cost)
    return best, costs


def _result(
    fit: _Fit, x: FloatArray, inflation: float, nominal: tuple[float, ...], costs: tuple[float, ...]
) -> Calibration:
    J = fit.jacobian(x, inflation)
    normal = J.T @ J
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    inverse = np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-12) / np.outer(scale, scale)
    slopes = np.array([p.slope(float(v)) for p, v in zip(fit.parameters, x, strict=True)])
    covariance = inverse * np.outer(slopes, slopes)
    values = tuple(
        Fitted(
            p.name,
            p.value(float(v)),
            sqrt(max(c, 0.0)),
            p.nominal,
            float(v) / p.prior_sd if isfinite(p.prior_sd) else np.nan,
        )
        for p, v, c in zip(fit.parameters, x, np.diag(covariance), strict=True)
    )
    edge = tuple(
        p.name
        for p, v in zip(fit.parameters, x, strict=True)
        if min(v - p.low, p.high - v) < 1e-3 * (p.high - p.low)
    )
    weights = [float(np.mean(p.sigma_rad[p.first :] ** 2)) for p in fit.parts]
    return Calibration(
        with_values(fit.config, {v.name: v.value for v in values}),
        values,
        covariance,
        fit.rmse(x),
        nominal,
        sqrt(float(np.average(weights, weights=[p.rows for p in fit.parts]))),
        inflation,
        edge,
        costs,
        fit.simulations,
        _warnings(values, edge, covariance, costs),
    )


def _warnings(
    values: Sequence[Fitted], edge: Sequence[str], covariance: FloatArray, costs: Sequence[float]
) -> tuple[str, ...]:
    lines = [
        f"{name} ended on its bound: its tolerance is too tight, or something else is missing"
        for name in edge
    ]
    lines += [
        f"{v.name} lies {abs(v.pull):.1f} tolerances from its nominal value"
        for v in values
        if abs(v.pull) > 3.0 and v.name not in edge
    ]
    sd = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    correlation = covariance / np.outer(sd, sd)
    for i in range(len(values)):
        for j in range(i):
            if abs(correlation[i, j]) > 0.98:
                lines.append(
                    f"{values[j].name} and {values[i].name} can hardly be told apart here "
                    f"(correlation {correlation[i, j]:.3f})"
                )
    close = [c for c in costs if c < 1.5 * min(costs)] if costs else []
    if len(costs) > 2 and len(close) == 1:
        lines.append("only one of the starts came to this solution; others stopped in worse ones")
    return tuple(lines)
