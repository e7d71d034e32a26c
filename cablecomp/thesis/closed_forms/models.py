"""Special cases and approximate models of the closed circuit drive (thesis, 4.2.3, 4.2.4, 4.2.6, Tables 4.2
and 6.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from cablecomp.errors import InputError
from cablecomp.thesis.closed_forms.closed import Tensions
from cablecomp.thesis.closed_forms.wrap import Array, Number, gap

ModelName = Literal["I", "II", "III"]


def narrow_tensions(m: Number) -> Tensions:
    """Tensions for GF -> 0 during loading, tau_l = m/(e^m - 1), tau_h = m e^m/(e^m - 1) (4-42, 4-44)."""
    load = np.asarray(m, dtype=float)
    size = np.abs(load)
    safe = np.where(size > 0.0, size, 1.0)
    tight = np.where(size > 0.0, -safe / np.expm1(-safe), 1.0)
    easy = tight * np.exp(-size)
    return Tensions(np.where(load < 0.0, easy, tight), np.where(load < 0.0, tight, easy))


def narrow_tensions_unloading(m: Number, m_peak: Number) -> Tensions:
    """Exact tensions for GF -> 0 after a reversal, until either bump is erased (Appendix C, D-18 and D-20).

    The quadratic of Appendix C has the root sqrt(tau_l) = [(1 + y) sqrt(tau_lpk) + (1 - y) sqrt(tau_hpk)]/2,
    y = m/m_pk, and sqrt(tau_h) is its mirror image; after a full unload both are [(sqrt(tau_hpk) +
    sqrt(tau_lpk))/2]^2, above 1.
    """
    peak = narrow_tensions(m_peak)
    y = np.asarray(m, dtype=float) / np.asarray(m_peak)
    root_h, root_l = np.sqrt(peak.h), np.sqrt(peak.l)
    tight = ((1.0 + y) * root_h + (1.0 - y) * root_l) / 2.0
    easy = ((1.0 + y) * root_l + (1.0 - y) * root_h) / 2.0
    return Tensions(tight**2, easy**2)


def model_i_normalised(m: Number, GF: Number) -> Array:
    """theta EA mu_eff/T0 = GF m/2: model I, the free spans alone (4-49); for |m| <= 2."""
    return np.asarray(np.asarray(GF) * np.asarray(m, dtype=float) / 2.0)


def model_ii_normalised(m: Number, GF: Number) -> Array:
    """theta EA mu_eff/T0 = (m/2)(1 + GF) - ln(1 + m/2): model II (4-50); for |m| <= 2, odd in m."""
    half = np.abs(np.asarray(m, dtype=float)) / 2.0
    return np.asarray(np.sign(m) * (gap(half) + np.asarray(GF) * half))


def model_iii_normalised(m: Number, GF: Number) -> Array:
    """(4-18) with the tensions of GF = 0: model III (4-51), odd in m."""
    load = np.asarray(m, dtype=float)
    excess = narrow_excess(np.abs(load))
    return np.asarray(np.sign(load) * (gap(excess) + np.asarray(GF) * excess))


def narrow_excess(m: Number) -> Array:
    """tau_h - 1 for GF -> 0, without cancellation for small m; m >= 0."""
    load = np.asarray(m, dtype=float)
    near = load < 0.03  # m/2 + m^2/12 - m^4/720 + m^6/30240
    x = np.where(near, load, 1.0)
    series = x / 2.0 + x**2 / 12.0 - x**4 / 720.0 + x**6 / 30240.0
    return np.where(near, series, narrow_tensions(load).h - 1.0)


_MODELS = {"I": model_i_normalised, "II": model_ii_normalised, "III": model_iii_normalised}


def model_normalised(name: ModelName, m: Number, GF: Number) -> Array:
    """theta EA mu_eff/T0 of model I, II or III."""
    return _MODELS[name](m, GF)


@dataclass(frozen=True)
class ModelChoice:
    """An approximate model, the worst relative error of its deflection during loading, and up to which m it
    holds.
    """

    name: ModelName
    worst_error: float
    m_limit: float


def choose_model(GF: float) -> ModelChoice:
    """The simplest model that the thesis recommends for this GF (Tables 4.2 and 6.3). Raises InputError for
    GF < 0.
    """
    if not GF >= 0.0:
        raise InputError(f"GF is {GF}; a geometry-friction number L mu_eff/R >= 0 is accepted")
    if GF <= 1.0:
        return ModelChoice("III", 0.12, 4.0)
    if GF <= 3.0:
        return ModelChoice("III", 0.18, 4.0)
    if GF < 10.0:
        return ModelChoice("II", 0.12, 2.0)
    return ModelChoice("I", 0.11, 2.0)


class PretensionRule(NamedTuple):
    """The thesis's range for the pretension that a load asks for (4.2.3, 4.2.5); N."""

    narrow_N: float
    wide_N: float


def pretension_rule(moment_max_Nm: float, radius_m: float) -> PretensionRule:
    """Pretension that keeps both cables taut: M_max/(4R) for nearly tangent pulleys, M_max/(2R) for far ones;
    N.
    """
    force = abs(moment_max_Nm) / radius_m
    return PretensionRule(force / 4.0, force / 2.0)
