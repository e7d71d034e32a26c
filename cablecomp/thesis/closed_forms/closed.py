"""Closed forms of the closed circuit drive (thesis, chapter 4): two antagonistic cables, input pulley held.

`m` = M/(R T0). Positive M tightens cable h and eases cable l by the same length (4-1); the drive is
symmetric, so a negative M swaps the two. Exact for any GF, finite wraps, slack of either cable, and one
reversal after loading from uniform pretension; longer histories belong to the wrap profile itself.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cablecomp.thesis.closed_forms.solve import ValueSlope, solve_increasing
from cablecomp.thesis.closed_forms.stage import (
    EquivalentStage,
    cable_change,
    cable_change_slope,
    cable_loading,
    cable_loading_of_log,
    cable_loading_slope,
)
from cablecomp.thesis.closed_forms.wrap import Array, Number

_DEEPEST = -680.0  # ln of the smallest tension looked for; below, the cable counts as slack


class Tensions(NamedTuple):
    """Dimensionless tensions of the two cables; h tightens under M > 0."""

    h: Array
    l: Array


def unending_stage(GF: float) -> EquivalentStage:
    """A stage of that GF in units where R = EA = T0 = mu_eff = 1, wraps without end."""
    return EquivalentStage(1.0, GF, 1.0, 1.0, 1.0)


def closed_tensions_loading(m: Number, stage: EquivalentStage) -> Tensions:
    """Tensions during loading from uniform pretension: (4-15), tau_h = tau_l + m; either cable
    may go slack.
    """
    load = np.asarray(m, dtype=float)
    low = _loading_low(np.abs(load), stage)
    return _signed(load, low)


def closed_tensions_unloading(m: Number, m_peak: Number, stage: EquivalentStage) -> Tensions:
    """Tensions after loading to `m_peak` and a reversal (4-21), on past zero load and past the erasure of
    either bump.

    Where `m` lies beyond the peak again, loading has simply gone on.
    """
    load, peak = np.broadcast_arrays(np.asarray(m, dtype=float), np.asarray(m_peak, dtype=float))
    sign = np.where(peak < 0.0, -1.0, 1.0)
    load, peak = sign * load, sign * peak
    onward = load >= peak
    back = _unloading(np.where(onward, peak, load), peak, stage)
    first = _loading_low(np.abs(load), stage)
    tight, easy = np.where(onward, first + load, back.h), np.where(onward, first, back.l)
    return Tensions(np.where(sign > 0.0, tight, easy), np.where(sign > 0.0, easy, tight))


def closed_loading_normalised(m: Number, stage: EquivalentStage) -> Array:
    """theta EA mu_eff/T0 = (tau_h - 1 - ln tau_h) + GF (tau_h - 1) during loading (4-18), odd in m."""
    load = np.asarray(m, dtype=float)
    excess = _loading_excess(np.abs(load), stage)
    return np.asarray(np.sign(load) * cable_loading(excess, stage))


def closed_unloading_normalised(m: Number, m_peak: Number, stage: EquivalentStage) -> Array:
    """theta EA mu_eff/T0 = 2 sqrt(tau_hpk tau_h) - tau_h - 1 - ln tau_hpk + GF (tau_h - 1) after a reversal
    (4-24).

    Of the cable that the peak tightened, which is never slack before the load has changed sign; once it is,
    the other cable's length says how far the drive went.
    """
    load, peak = np.broadcast_arrays(np.asarray(m, dtype=float), np.asarray(m_peak, dtype=float))
    sign = np.where(peak < 0.0, -1.0, 1.0)
    load, peak = sign * load, sign * peak
    now, then = closed_tensions_unloading(load, peak, stage), closed_tensions_loading(peak, stage)
    tight = cable_loading(then.h - 1.0, stage) + cable_change(now.h, then.h, stage)
    easy = cable_loading(then.l - 1.0, stage) + cable_change(now.l, then.l, stage)
    shape = np.where(now.h > 0.0, tight, -easy)
    return sign * np.where(load >= peak, closed_loading_normalised(load, stage), shape)


def closed_stiffness_normalised(m: Number, stage: EquivalentStage, m_peak: Number | None = None) -> Array:
    """k_T/(EA mu_eff R) = 1/c_h + 1/c_l, c = d(cable elongation)/d tau: both cables in parallel; 2/GF at no
    load.

    (4-46) of the thesis is its GF -> 0 case. A slack cable drops out. With `m_peak`: after that reversal.
    """
    load = np.asarray(m, dtype=float)
    with np.errstate(divide="ignore"):
        if m_peak is None:
            tau = closed_tensions_loading(load, stage)
            parts = [np.where(t > 0.0, 1.0 / cable_loading_slope(t, stage), 0.0) for t in tau]
        else:
            tau, then = closed_tensions_unloading(load, m_peak, stage), closed_tensions_loading(m_peak, stage)
            pairs = zip(tau, then, strict=True)
            parts = [np.where(t > 0.0, 1.0 / cable_change_slope(t, pk, stage), 0.0) for t, pk in pairs]
    return np.asarray(parts[0] + parts[1])


def closed_loading_deflection_rad(moment_Nm: Number, stage: EquivalentStage) -> Array:
    """Deflection during loading (4-18); rad."""
    return stage.angle_scale_rad * closed_loading_normalised(_dimensionless(moment_Nm, stage), stage)


def closed_unloading_deflection_rad(moment_Nm: Number, peak_Nm: Number, stage: EquivalentStage) -> Array:
    """Deflection after loading to `peak_Nm` and a reversal (4-24); rad."""
    m, peak = _dimensionless(moment_Nm, stage), _dimensionless(peak_Nm, stage)
    return stage.angle_scale_rad * closed_unloading_normalised(m, peak, stage)


def closed_stiffness_Nm_per_rad(
    moment_Nm: Number, stage: EquivalentStage, peak_Nm: Number | None = None
) -> Array:
    """Tangent stiffness during loading, or after a reversal at `peak_Nm`; N m/rad."""
    peak = None if peak_Nm is None else _dimensionless(peak_Nm, stage)
    shape = closed_stiffness_normalised(_dimensionless(moment_Nm, stage), stage, peak)
    return stage.EA_N * stage.mu_eff * stage.radius_m * shape


def closed_slip_moment_Nm(stage: EquivalentStage) -> float:
    """Moment at which a wrap first slips to its termination; N m, infinite where wraps never end.

    The easing cable gets there first: tau_l = exp(-mu Theta) of the shorter wrap; tau_h then follows from
    (4-1).
    """
    least = min(wrap.mu_wrap for wrap in stage.wraps)
    return _moment_where_low_is(math.exp(-least), stage) if least < -_DEEPEST else math.inf


def closed_slack_moment_Nm(stage: EquivalentStage) -> float:
    """Moment at which the easing cable goes slack: tau_l = 0 in (4-1); N m, infinite where wraps never end.

    m = 2 for GF -> infinity (4-31), more for smaller GF.
    """
    endless = any(math.isinf(wrap.mu_wrap) for wrap in stage.wraps)
    return math.inf if endless else _moment_where_low_is(0.0, stage)


def _moment_where_low_is(low: float, stage: EquivalentStage) -> float:
    length = -cable_loading(low - 1.0, stage)

    def mismatch(excess: Array) -> ValueSlope:
        return ValueSlope(
            cable_loading(excess, stage) - length, np.asarray(cable_loading_slope(1.0 + excess, stage))
        )

    high = np.asarray(1.0)
    while mismatch(high).value < 0.0:
        high = high * 2.0
    excess = solve_increasing(mismatch, np.asarray(0.0), high)
    return float(stage.moment_scale_Nm * (1.0 + excess - low))


def _loading_low(m: Array, stage: EquivalentStage) -> Array:
    """tau of the easing cable for |m|; zero where it is slack."""
    if math.isinf(stage.GF):
        return np.asarray(np.maximum(1.0 - m / 2.0, 0.0))
    return np.asarray(np.exp(_loading_log(m, stage)))


def _loading_excess(m: Array, stage: EquivalentStage) -> Array:
    """tau_h - 1 of the tightening cable for |m|, relatively accurate however small m is."""
    if math.isinf(stage.GF):
        return _loading_low(m, stage) + m - 1.0
    return np.asarray(m + np.expm1(_loading_log(m, stage)))


def _loading_log(m: Array, stage: EquivalentStage) -> Array:
    """ln tau_l from (4-1): [elongation of h](m + tau_l) + [elongation of l](tau_l) = 0; -inf where l is
    slack.
    """

    def mismatch(v: Array) -> ValueSlope:
        tau = np.exp(v)
        easing = np.expm1(v)
        value = cable_loading(m + easing, stage) + cable_loading_of_log(v, stage)
        slope = cable_loading_slope(m + tau, stage) + cable_loading_slope(tau, stage)
        return ValueSlope(value, tau * slope)

    with np.errstate(divide="ignore"):
        # The low cable takes at most half of the load (GF -> infinity), at least what it takes at GF = 0
        # (4-42), unless a wrap that slips makes it take more; then the bracket opens downwards.
        low = np.log(np.maximum(1.0 - m / 2.0, 0.0))
    low = np.maximum(low, -1.0)
    high = np.zeros_like(m)
    for _ in range(10):
        above = (mismatch(low).value > 0.0) & (low > _DEEPEST)
        if not np.any(above):
            break
        low = np.where(above, np.maximum(2.0 * low, _DEEPEST), low)
    slack = mismatch(low).value > 0.0
    return np.where(slack, -np.inf, solve_increasing(mismatch, low, high))


def _unloading(m: Array, peak: Array, stage: EquivalentStage) -> Tensions:
    """Tensions for m <= peak, peak >= 0, after a reversal at the peak."""
    then = closed_tensions_loading(peak, stage)
    if math.isinf(stage.GF):
        return closed_tensions_loading(m, stage)
    # A cable that hung slack at the peak starts from the length at which it comes taut, not from the peak's
    # own.
    loose = cable_loading(then.h - 1.0, stage) + cable_loading(then.l - 1.0, stage)
    offset = np.where(then.l > 0.0, 0.0, loose)
    forward = m >= 0.0
    load = np.abs(m)

    def mismatch(v: Array) -> ValueSlope:
        small = np.exp(v)
        large = small + load
        h, low = np.where(forward, large, small), np.where(forward, small, large)
        value = cable_change(h, then.h, stage) + cable_change(low, then.l, stage) + offset
        slope = cable_change_slope(h, then.h, stage) + cable_change_slope(low, then.l, stage)
        return ValueSlope(value, small * slope)

    smallest = np.where(forward, then.l, then.l - load)
    with np.errstate(divide="ignore", invalid="ignore"):
        low = np.where(smallest > 0.0, np.log(np.maximum(smallest, 0.0)), -1.0)
        high = np.log(np.where(forward, then.l + peak - load, then.h))
    low = np.minimum(low, high)
    for _ in range(12):
        above = (mismatch(low).value > 0.0) & (low > _DEEPEST) & ~(smallest > 0.0)
        if not np.any(above):
            break
        low = np.where(above, np.maximum(2.0 * low - 1.0, _DEEPEST), low)
    slack = (mismatch(low).value > 0.0) & ~(smallest > 0.0)
    small = np.where(slack, 0.0, np.exp(solve_increasing(mismatch, low, high)))
    large = small + load
    return Tensions(np.where(forward, large, small), np.where(forward, small, large))


def _signed(load: Array, low: Array) -> Tensions:
    high = low + np.abs(load)
    return Tensions(np.where(load < 0.0, low, high), np.where(load < 0.0, high, low))


def _dimensionless(moment_Nm: Number, stage: EquivalentStage) -> Array:
    return np.asarray(np.asarray(moment_Nm, dtype=float) / stage.moment_scale_Nm)
