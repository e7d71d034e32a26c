"""Closed forms of the open circuit drive (thesis, chapter 3): one cable, input pulley held, moment M on the
output pulley.

`m` = M/(R T0), positive where it tightens the cable; m > -1. Angles in rad, moments in N m. The multistage
open circuit is the same drive with its equivalent stage (5-26).
"""

from __future__ import annotations

import math

import numpy as np

from cablecomp.thesis.closed_forms.stage import (
    EquivalentStage,
    cable_change,
    cable_change_slope,
    cable_loading,
    cable_loading_slope,
)
from cablecomp.thesis.closed_forms.wrap import Array, Number, gap


def open_loading_normalised(m: Number, GF: Number) -> Array:
    """theta EA mu_eff/T0 = sgn(m) [m - ln(1 + m)] + GF m during loading: (3-17) with unending wraps."""
    x = np.asarray(m, dtype=float)
    return np.asarray(np.where(x < 0.0, -1.0, 1.0) * gap(x) + np.asarray(GF) * x)


def open_unloading_normalised(m: Number, m_peak: Number, GF: Number) -> Array:
    """theta EA mu_eff/T0 = sgn(m_pk) [2 sqrt((1 + m_pk)(1 + m)) - m - 2 - ln(1 + m_pk)] + GF m (3-21), before
    erasure.
    """
    x, peak = np.asarray(m, dtype=float), np.asarray(m_peak, dtype=float)
    bump = 2.0 * np.sqrt((1.0 + peak) * (1.0 + x)) - x - 2.0 - np.log1p(peak)
    return np.asarray(np.where(peak < 0.0, -1.0, 1.0) * bump + np.asarray(GF) * x)


def open_stiffness_normalised(m: Number, GF: Number) -> Array:
    """k_T/(EA mu_eff R) = 1/(GF + |m|/(1 + m)) during loading: (3-19) with unending wraps; infinite at m = 0,
    GF = 0.
    """
    x = np.asarray(m, dtype=float)
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / (np.asarray(GF) + np.abs(x) / (1.0 + x)))


def open_erasing_moment(m_peak: Number) -> Array:
    """Dimensionless moment that erases the peak `m_peak`, -m_pk/(1 + m_pk) (3-22)."""
    peak = np.asarray(m_peak, dtype=float)
    return np.asarray(-peak / (1.0 + peak))


def open_loading_deflection_rad(moment_Nm: Number, stage: EquivalentStage) -> Array:
    """Deflection during loading (3-17), finite wraps included; rad."""
    return stage.angle_scale_rad * cable_loading(_dimensionless(moment_Nm, stage), stage)


def open_unloading_deflection_rad(moment_Nm: Number, peak_Nm: Number, stage: EquivalentStage) -> Array:
    """Deflection after a reversal at `peak_Nm` (3-21), past erasure (3-22) and with finite wraps; rad."""
    m, peak = _dimensionless(moment_Nm, stage), _dimensionless(peak_Nm, stage)
    shape = cable_loading(peak, stage) + cable_change(1.0 + m, 1.0 + peak, stage)
    return stage.angle_scale_rad * shape


def open_stiffness_Nm_per_rad(
    moment_Nm: Number, stage: EquivalentStage, peak_Nm: Number | None = None
) -> Array:
    """Tangent stiffness k_T = EA mu* R/(GF* + m/(1 + m)) (3-19), or after a reversal at
    `peak_Nm`; N m/rad.
    """
    m = _dimensionless(moment_Nm, stage)
    if peak_Nm is None:
        compliance = cable_loading_slope(1.0 + m, stage)
    else:
        compliance = cable_change_slope(1.0 + m, 1.0 + _dimensionless(peak_Nm, stage), stage)
    return np.asarray(stage.EA_N * stage.mu_eff * stage.radius_m / compliance)


def open_slip_moments_Nm(stage: EquivalentStage) -> tuple[float, float]:
    """Moments (negative, positive) at which a wrap first slips to its termination; N m.

    |ln(1 + m)| = mu Theta of the pulley that comes first; infinite, and -R T0 (slack), where wraps never end.
    """
    least = min(wrap.mu_wrap for wrap in stage.wraps)
    scale = stage.moment_scale_Nm
    return scale * math.expm1(-least), scale * math.expm1(least) if least < 700.0 else math.inf


def _dimensionless(moment_Nm: Number, stage: EquivalentStage) -> Array:
    return np.asarray(np.asarray(moment_Nm, dtype=float) / stage.moment_scale_Nm)
