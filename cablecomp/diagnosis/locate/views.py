"""The ways in which a residual may follow a covariate: small sets of regressors, or views."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cablecomp.diagnosis.locate.series import Series
from cablecomp.signal.smoothing import FloatArray

_INSTANTS: Final = 15
"""Instants of a single jump that are looked at, even over the recordings."""
_ROUNDING: Final = 1e-12
"""Range, over the largest value or 1, up to which values are one and the same."""
_COURSE: Final = 5
"""Hat functions along a covariate by which a parameter of the drive changes."""
_NO_COURSE: Final = ("load_direction", "dwell", "reversal")
"""Covariates that are no course: they begin anew with every turn or rest."""
_RATES: Final = ("load_rate", "velocity", "acceleration")
"""Covariates whose rare extremes are drawn in."""
_ANGLE_CURVE: Final = "a curve over the angle"


class Response(NamedTuple):
    """What a change of the drive along a covariate makes of the joint's angle [rad], n x k."""

    covariate: str
    how: str
    columns: FloatArray


class Responses(NamedTuple):
    """What the drive itself can say: `of_laws`, and its sensitivities by what changes (n), for slow changes."""

    of_laws: tuple[Response, ...]
    sensitivities: tuple[tuple[str, FloatArray], ...]


@dataclass(frozen=True)
class View:
    """Regressors for one way of depending on `covariate`; `how` in plain words; `basis` is n x k.

    `beyond_loop`: the view says how the plain loop (load, direction, direction·|load|) changes along the
    covariate; what the unchanging loop explains is not counted for it.
    """

    covariate: str
    how: str
    basis: FloatArray
    beyond_loop: bool = False

    @property
    def width(self) -> int:
        """Number of regressors."""
        return int(self.basis.shape[1])


def hats(values: FloatArray, count: int, even: bool = False) -> FloatArray:
    """Return piecewise linear hat functions of `values` on `count` knots (n x at most count), summing to one.

    Knots sit at quantiles, half-way pulled towards even spacing (`even`: evenly spaced); flat data give one
    column.
    """
    low, high = float(np.min(values)), float(np.max(values))
    if not _changes(values):
        return np.ones((len(values), 1))
    spaced = np.linspace(low, high, count)
    knots = spaced if even else 0.5 * (spaced + np.quantile(values, np.linspace(0.0, 1.0, count)))
    knots = knots[np.concatenate(([True], np.diff(knots) > 1e-9 * (high - low)))]
    index = np.clip(np.searchsorted(knots, values, side="right") - 1, 0, len(knots) - 2)
    share = np.clip((values - knots[index]) / (knots[index + 1] - knots[index]), 0.0, 1.0)
    basis = np.zeros((len(values), len(knots)))
    rows = np.arange(len(values))
    basis[rows, index] = 1.0 - share
    basis[rows, index + 1] += share
    return basis


def contrasts(basis: FloatArray) -> FloatArray:
    """Return hat functions without their mean, one column less: what changes along the covariate."""
    return np.asarray((basis - basis.mean(axis=0))[:, 1:], dtype=np.float64)


def views(series: Series, drive: Responses | None = None) -> Iterator[View]:
    """Yield every view of every covariate that varies in the series.

    `drive`: what the drive itself says, in place of how the plain loop changes; a curve over an angle is not asked
    beside it, for in a loop the angle goes with the load, and whatever has a curve has that one too.
    """
    path = load_path(series)
    changing = {k: v for k, v in series.covariates.values.items() if _changes(v)}
    for name in series.covariates.values:
        if name not in changing and name != "dwell":
            continue
        for view in _views_of(name, series, path):
            if drive is not None and (view.beyond_loop or view.how == _ANGLE_CURVE):
                continue
            if view.width and float(np.max(np.abs(view.basis))) > 0.0:
                yield view
    if drive is not None:
        yield from _drive_views(series, drive, changing)


def _drive_views(series: Series, drive: Responses, changing: Mapping[str, FloatArray]) -> Iterator[View]:
    for response in drive.of_laws:
        if response.covariate in changing and float(np.max(np.abs(response.columns))) > 0.0:
            yield View(response.covariate, response.how, _of_one_size(response.columns))
    for name, values in changing.items():
        if name in _NO_COURSE:
            continue
        course = elapsed(series) if name == "time" else _compressed(values) if name in _RATES else values
        along = contrasts(hats(course, _COURSE))
        for what, column in drive.sensitivities:
            if float(np.max(np.abs(column))) > 0.0:
                yield View(name, f"{what} changes with it", products(along, _of_one_size(column[:, None])))


def _changes(values: FloatArray) -> bool:
    """Whether the values differ by more than rounding."""
    return float(np.ptp(values)) > _ROUNDING * max(1.0, float(np.max(np.abs(values))))


def _of_one_size(columns: FloatArray) -> FloatArray:
    size = np.sqrt(np.mean(columns**2, axis=0))
    return np.asarray(columns / np.where(size > 0.0, size, 1.0), dtype=np.float64)


def load_path(series: Series) -> FloatArray:
    """Return load, direction, direction·|load| (loads over their RMS): the shape of a plain loop."""
    load = series.covariates.values["load"]
    rms = float(np.sqrt(np.mean(load**2)))
    relative = load / rms if rms > 0.0 else load
    direction = series.covariates.values["load_direction"]
    return np.column_stack((relative, direction, direction * np.abs(relative)))


def elapsed(series: Series) -> FloatArray:
    """Return time since the first recording's start with later recordings appended, in s."""
    time = series.covariates.values["time"]
    out = np.empty(len(time))
    end = 0.0
    for span in series.spans():
        out[span] = time[span] - time[span.start] + end
        end = float(out[span.stop - 1])
    return out


def _views_of(name: str, series: Series, path: FloatArray) -> Iterator[View]:
    values = series.covariates.values
    x = values[name]
    direction = values["load_direction"]
    if name == "time":
        yield from _time_views(elapsed(series), path)
    elif name == "load":
        yield View(name, "a curve over the load", contrasts(hats(x, 9)))
        yield View(name, "in proportion to the load", x[:, None] - x.mean())
    elif name == "load_direction":
        yield View(name, "one value for each direction of the load", direction[:, None])
        yield View(name, "differs by direction, in proportion to the load", path[:, 1:])
    elif name == "load_rate":
        yield View(name, "a curve over the rate of load", contrasts(hats(_compressed(x), 8)))
    elif name == "dwell":
        yield from _dwell_views(series)
    elif name == "reversal":
        distance = hats(x, 7)
        yield View(name, "distance in load since the last reversal", products(distance, direction[:, None]))
        turn = series.covariates.motion_direction[:, None]
        motion = hats(series.covariates.motion_reversal, 7)
        yield View(name, "distance in motion since the last reversal", products(motion, turn))
    elif name == "velocity":
        yield View(name, "a curve over the speed", contrasts(hats(_compressed(x), 8)))
        turn = series.covariates.motion_direction
        yield View(name, "one value for each direction of motion", turn[:, None])
    elif name == "acceleration":
        yield View(name, "in proportion to the acceleration", x[:, None])
        yield View(name, "a curve over the acceleration", contrasts(hats(_compressed(x), 7)))
    elif name in ("motor_angle", "joint_angle"):
        yield View(name, _ANGLE_CURVE, contrasts(hats(x, 12, even=True)))
        yield View(name, "a fine pattern over the angle", contrasts(hats(x, 36, even=True)))
        yield View(name, "the loop changes along the angle", products(contrasts(hats(x, 6)), path), True)
    else:
        yield View(name, "in proportion to it", x[:, None] - x.mean())
        yield View(name, "a curve over it", contrasts(hats(x, 7)))
        yield View(name, "the loop changes with it", products(contrasts(hats(x, 4)), path), True)


def _time_views(clock: FloatArray, path: FloatArray) -> Iterator[View]:
    length = float(clock[-1] - clock[0])
    relative = (clock - clock[0]) / length
    drift = np.column_stack((relative, np.log1p(30.0 * relative)))
    yield View("time", "drifts one way", drift - drift.mean(axis=0))
    yield View("time", "the loop drifts one way", products(drift - drift.mean(axis=0), path), True)
    yield View("time", "wanders in time", contrasts(hats(clock, 9, even=True)))
    # single jumps at instants spread over the recording: narrow views find a step that a smooth curve smears
    for instant in np.linspace(0.0, 1.0, _INSTANTS + 2)[1:-1]:
        after = (relative > instant)[:, None] - float(np.mean(relative > instant))
        yield View("time", "jumps once", after)
        yield View("time", "the loop changes at once", products(after, path), True)


def _dwell_views(series: Series) -> Iterator[View]:
    dwell = series.covariates.values["dwell"]
    held = dwell > 0.0
    if float(np.mean(held)) < 0.02:
        return
    direction = series.covariates.values["load_direction"][:, None]
    shape = np.zeros((len(dwell), 1))
    shortest = float(np.min(dwell[held]))
    rest = hats(np.log(dwell[held] + 5.0 * shortest), 6)
    shape = np.zeros((len(dwell), rest.shape[1] + 1))
    shape[held, 1:] = rest
    shape[~held, 0] = 1.0
    yield View("dwell", "goes on in the load's direction after it stops", products(shape, direction))
    yield View("dwell", "changes with the time at constant load", contrasts(shape))


def products(basis: FloatArray, factors: FloatArray) -> FloatArray:
    """Return all products of columns of two matrices (n x k p)."""
    return np.asarray((basis[:, :, None] * factors[:, None, :]).reshape(len(basis), -1), dtype=np.float64)


def _compressed(values: FloatArray) -> FloatArray:
    """Rates with rare extremes drawn in: asinh over the usual size."""
    usual = float(np.median(np.abs(values[values != 0.0]))) if np.any(values != 0.0) else 1.0
    return np.asarray(np.arcsinh(values / usual), dtype=np.float64)
