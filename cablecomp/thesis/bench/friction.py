"""Coefficients of friction of one branch of a bench cycle: equilibrium points, and the line through the
moving part.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cablecomp.config import Drive, JointConfig
from cablecomp.thesis.bench.segments import Segment, Smoothed, trimmed
from cablecomp.thesis.bench.types import Array, Branch, EquilibriumPoint, Measured
from cablecomp.thesis.bench.vectors import DriveOnBench, interpolated
from cablecomp.thesis.closed_forms.series import acting_stages

_PERTURBED = ("EA_N", "pretension_N", "free_length_m", "output_radius_m", "input_radius_m")
_ROUNDS = 30


@dataclass(frozen=True)
class BenchData:
    """The recording with offsets and the sensor's own twist taken out, cut into its branches."""

    time_s: Array
    load: Smoothed
    deflection: Array
    deflection_noise: float
    deflection_step: float
    """What quantisation leaves in a mean at rest, where noise does not carry the reading over a step; rad."""
    load_noise: float
    loading: tuple[Segment, ...]
    unloading: tuple[Segment, ...]
    segments: tuple[Segment, ...]
    peak: float
    notes: tuple[str, ...]


def branch_of(
    name: str,
    phase: tuple[Segment, ...],
    data: BenchData,
    bench: DriveOnBench,
    config: JointConfig,
    peak: float | None,
) -> Branch:
    """True and acting coefficients of loading (`peak` None) or of unloading from `peak`, N m."""
    nominal = acting_stages(config.drive)[-1].stage.mu_eff
    line = _fit(phase, data, bench, peak)
    near = None if line is None else line.scale
    # The hold at the peak belongs to loading; what rests there has not been unloaded.
    points = tuple(
        _equilibrium(segment, data, config, bench, peak, near) for segment in phase if segment.is_hold
    )
    acting = None
    if line is not None:

        def scale_with(other: DriveOnBench) -> float | None:
            fitted = _fit(phase, data, other, peak)
            return None if fitted is None else fitted.scale

        spread = _tolerance_sd(scale_with, line.scale, bench, config)
        acting = Measured(nominal * line.scale, nominal * math.hypot(line.scale_sd, spread))
    return Branch(
        name,
        weighted_mean([point.mu_eff for point in points if point.mu_eff is not None]),
        acting,
        None if line is None else line.correlation,
        0 if line is None else line.samples,
        points,
    )


@dataclass(frozen=True)
class _Line:
    scale: float
    scale_sd: float
    correlation: float
    samples: int


def _fit(
    phase: tuple[Segment, ...], data: BenchData, bench: DriveOnBench, peak: float | None
) -> _Line | None:
    """Least-squares line of wrap deflection against the load vector, repeated until the scale of friction
    settles.
    """
    margin = data.load.window  # half for where the ramp begins, half for what the smoothing mixes in there
    index = np.concatenate(
        [np.arange(len(data.time_s))[trimmed(s, margin)] for s in phase if not s.is_hold]
        or [np.empty(0, int)]
    )
    if len(index) < 10:
        return None
    load, deflection = data.load.value[index], data.deflection[index]
    if peak is not None:
        load = np.sign(peak) * np.minimum(np.sign(peak) * load, abs(peak))
    scale = 1.0
    for _ in range(_ROUNDS):
        current = scale
        parts = interpolated(partial(bench.parts, scale=current, peak_Nm=peak), load)
        wrap = deflection - parts.span
        slope, intercept = np.polyfit(parts.vector, wrap, 1)
        if not slope > 0.0:
            return None
        scale = 1.0 / float(slope)
        if abs(scale - current) < 1e-8 * scale:
            break
    residual = wrap - slope * parts.vector - intercept
    step = 1e-3 * float(np.ptp(load))
    ahead = interpolated(lambda x: bench.parts(x - math.copysign(step, data.peak), scale, peak), load)
    rise = (parts.span - ahead.span + (parts.vector - ahead.vector) / scale) / step
    white = np.hypot(data.deflection_noise, rise * data.load_noise)
    sd = _slope_sd(parts.vector, residual, white, data.load.window)
    correlation = float(np.corrcoef(parts.vector, wrap)[0, 1])
    return _Line(scale, scale * scale * sd, correlation, len(index))


def _slope_sd(x: Array, residual: Array, white: Array, block: int) -> float:
    """1-sigma of a line's slope: the known white noise, or more where the residual says so.

    The smoothed load is correlated over its window, but as the window keeps sums, the slope feels it like the
    white noise that it was made of. What the model misses is correlated as well: sums of the score over
    blocks show it.
    """
    centred = x - x.mean()
    known = float(np.sum((centred * white) ** 2))
    sums = np.add.reduceat(centred * residual, np.arange(0, len(x), 2 * max(1, block)))
    return math.sqrt(max(known, float(sums @ sums))) / float(centred @ centred)


def _equilibrium(
    hold: Segment,
    data: BenchData,
    config: JointConfig,
    bench: DriveOnBench,
    peak: float | None,
    near: float | None,
) -> EquilibriumPoint:
    length = hold.stop - hold.start
    margin = min(data.load.window // 2, length // 4)
    stop = hold.stop - margin if hold.stop < len(data.time_s) else hold.stop
    quarter = max(3, (stop - hold.start) // 4)
    last = slice(max(stop - quarter, hold.start), stop)
    before = slice(max(stop - 2 * quarter, hold.start), max(stop - quarter, hold.start + 1))
    theta = float(np.mean(data.deflection[last]))
    load = float(np.mean(data.load.value[last]))
    mean_sd = math.hypot(data.deflection_noise / math.sqrt(quarter), data.deflection_step)
    drift = theta - float(np.mean(data.deflection[before]))
    zero_sd = data.deflection_noise / math.sqrt(max(3, data.loading[0].start))
    load_sd = data.load_noise / math.sqrt(quarter)
    settled = abs(drift) < 3.0 * math.sqrt(2.0) * mean_sd
    # Creep that is still seen goes on for longer than it was watched.
    noise = math.hypot(math.hypot(mean_sd, zero_sd), 0.0 if settled else 2.0 * drift)
    point = EquilibriumPoint(float(data.time_s[stop - 1]), load, theta, drift, settled, None)
    return replace(point, mu_eff=_friction_of(point, noise, load_sd, config, bench, peak, near))


def _friction_of(
    point: EquilibriumPoint,
    noise: float,
    load_sd: float,
    config: JointConfig,
    bench: DriveOnBench,
    peak: float | None,
    near: float | None,
) -> Measured | None:
    scale = None
    if near is not None:
        scale = bench.scale_of_point(point.load_Nm, point.deflection_rad, peak, near)
    if scale is None:
        scale = bench.scale_of_point(point.load_Nm, point.deflection_rad, peak)
    if scale is None:
        return None
    nominal = acting_stages(config.drive)[-1].stage.mu_eff
    load = np.asarray([point.load_Nm])
    slope = _slope(lambda x: float(bench.deflection(load, x, peak)[0]), scale, 1e-4 * scale)
    step = 1e-4 * max(abs(point.load_Nm), 1e-3 * abs(peak if peak is not None else point.load_Nm))
    by_load = _slope(lambda x: float(bench.deflection(np.asarray([x]), scale, peak)[0]), point.load_Nm, step)
    by_peak = 0.0
    if peak is not None:
        by_peak = _slope(
            lambda x: float(bench.deflection(load, scale, x)[0]), peak, math.copysign(1e-3 * peak, 1.0)
        )
    spread = _tolerance_sd(
        lambda other: other.scale_of_point(point.load_Nm, point.deflection_rad, peak, scale),
        scale,
        bench,
        config,
    )
    # The peak's load is a mean over a hold as well, of about the same length.
    seen = math.hypot(noise, by_load * load_sd, by_peak * load_sd)
    sd = math.hypot(seen / abs(slope), spread)
    return Measured(nominal * scale, nominal * sd)


def _slope(function: Callable[[float], float], at: float, step: float) -> float:
    return (function(at + step) - function(at - step)) / (2.0 * step)


def _tolerance_sd(
    scale_with: Callable[[DriveOnBench], float | None],
    scale: float,
    bench: DriveOnBench,
    config: JointConfig,
) -> float:
    """What the tolerances of EA, T0, lengths and radii make of the scale of friction; each to first order."""
    total = 0.0
    for key in _PERTURBED:
        tolerance = config.tolerance.get(key, 0.0)
        if tolerance == 0.0:
            continue
        step = min(tolerance, 0.01)
        moved = scale_with(replace(bench, drive=_scaled(bench.drive, key, 1.0 + step)))
        if moved is not None:
            # The nominal mu_eff that a scale refers to moves with the radii.
            share = acting_stages(_scaled(bench.drive, key, 1.0 + step))[-1].stage.mu_eff
            share /= acting_stages(bench.drive)[-1].stage.mu_eff
            total += ((moved * share - scale) / step * tolerance) ** 2
    return math.sqrt(total)


def _scaled(drive: Drive, key: str, factor: float) -> Drive:
    stages = tuple(stage.model_copy(update={key: getattr(stage, key) * factor}) for stage in drive.stage)
    return drive.model_copy(update={"stage": stages})


def weighted_mean(values: list[Measured]) -> Measured | None:
    """Weighted mean; its uncertainty is the best one's, or the scatter, since tolerances are
    common to all.
    """
    if not values:
        return None
    weights = np.array([1.0 / max(value.sd, 1e-12) ** 2 for value in values])
    numbers = np.array([value.value for value in values])
    mean = float(weights @ numbers / weights.sum())
    scatter = math.sqrt(float(weights @ (numbers - mean) ** 2 / weights.sum()))
    return Measured(mean, max(min(value.sd for value in values), scatter))
