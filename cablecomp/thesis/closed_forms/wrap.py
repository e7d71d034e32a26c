"""Closed forms of one wrapped cable end (thesis, chapter 2): elongation, stiffness, tension bump, erasure.

Everything here holds for a wrap with one free end and one termination that starts from uniform pretension.
`tau` is the free end's tension over the pretension, `mu_wrap` = mu * wrap angle (infinite: the termination is
never reached, as the thesis assumes). The `shape` functions are dimensionless: elongation * EA * mu / (R T0),
positive when the cable is longer.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
Number: TypeAlias = npt.ArrayLike

_SERIES = 1.0 / np.arange(2.0, 20.0)


def gap(excess: Number) -> Array:
    """Return `x - ln(1 + x)` without cancellation for small x; x > -1."""
    x = np.asarray(excess, dtype=float)
    small = np.abs(x) < 0.06
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.asarray(x - np.log1p(x))
    if np.any(small):
        y = x[small]
        series = np.zeros_like(y)
        for coefficient in _SERIES[::-1]:  # x^2/2 - x^3/3 + x^4/4 - ...
            series = coefficient - y * series
        found[small] = y * y * series
    return found


def loading_shape(tau: Number, mu_wrap: Number = math.inf) -> Array:
    """Dimensionless elongation of a wrap loaded from uniform pretension.

    |shape| = tau - 1 - ln tau (2-48) while the affected angle is inside the wrap; beyond, the whole wrap
    slips and shape = s tau (1 - exp(-s mu_wrap)) - mu_wrap with s = sgn(tau - 1) (own derivation: the
    integral of the profile that ends at the termination). `tau` >= 0; 0 is a slack cable.
    """
    return loading_shape_of_excess(np.asarray(tau, dtype=float) - 1.0, mu_wrap)


def loading_shape_of_excess(excess: Number, mu_wrap: Number = math.inf) -> Array:
    """As `loading_shape`, of tau - 1: keeps its relative accuracy for loads of any smallness."""
    x, c = np.broadcast_arrays(np.asarray(excess, dtype=float), np.asarray(mu_wrap, dtype=float))
    sign = np.where(x < 0.0, -1.0, 1.0)
    with np.errstate(divide="ignore"):
        inside = np.abs(np.log1p(x)) <= c
    return np.where(inside, sign * gap(x), slipped_shape(1.0 + x, c, sign))


def loading_shape_of_log(log_tau: Number, mu_wrap: Number = math.inf) -> Array:
    """As `loading_shape`, of ln tau: keeps its relative accuracy for tensions of any smallness."""
    u, c = np.broadcast_arrays(np.asarray(log_tau, dtype=float), np.asarray(mu_wrap, dtype=float))
    sign = np.where(u < 0.0, -1.0, 1.0)
    # exp(u) - 1 - u; near 0 in the other form, which does not cancel
    inside = np.where(np.abs(u) < 0.05, gap(np.expm1(np.clip(u, -1.0, 1.0))), np.expm1(u) - u)
    return np.where(np.abs(u) <= c, sign * inside, slipped_shape(np.exp(u), c, sign))


def slipped_shape(tau: Number, mu_wrap: Number, direction: Number) -> Array:
    """Dimensionless elongation of a wrap that slips along all its length; `direction` +1 if the free end is
    the tighter.
    """
    s, c = np.asarray(direction, dtype=float), np.asarray(mu_wrap, dtype=float)
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(-s * np.asarray(tau) * np.expm1(-s * c) - c)


def loading_shape_slope(tau: Number, mu_wrap: Number = math.inf) -> Array:
    """d shape / d tau of `loading_shape`: |1 - 1/tau|, at most |1 - exp(-s mu_wrap)|; the wrap's
    dimensionless compliance.
    """
    t, c = np.broadcast_arrays(np.asarray(tau, dtype=float), np.asarray(mu_wrap, dtype=float))
    with np.errstate(divide="ignore", over="ignore"):
        inside = np.abs((t - 1.0) / t)
        return np.where(np.abs(np.log(t)) <= c, inside, np.abs(np.expm1(np.where(t < 1.0, c, -c))))


def reversal_change(tau: Number, tau_peak: Number, mu_wrap: Number = math.inf) -> Array:
    """Change of shape since the load reversed at `tau_peak`, reached in one monotone loading from uniform
    pretension.

    -s (sqrt(tau_peak) - sqrt(tau))^2 with s = sgn(tau_peak - 1): (2-79) less (2-48), free of cancellation.
    Past the erasing load 1/tau_peak (2-71) the loading form takes over by itself; so it does where `tau` goes
    on past the peak. In a wrap that had slipped to its termination, the corner arrives there at tau_peak
    exp(-2 s mu_wrap) and the whole wrap slips back.
    """
    t, peak, c = _three(tau, tau_peak, mu_wrap)
    s, log_t, log_peak = _logs(t, peak)
    with np.errstate(invalid="ignore"):
        back = s * (log_peak - log_t)
        slipped = s * log_peak > c
        bump = -s * ((peak - t) / (np.sqrt(peak) + np.sqrt(t))) ** 2
        whole = slipped_shape(t, c, -s) - loading_shape(peak, c)
        virgin = loading_shape(t, c) - loading_shape(peak, c)
        in_bump = (back >= 0.0) & (back <= 2.0 * np.minimum(c, s * log_peak))
        return np.where(in_bump, bump, np.where((back > 0.0) & slipped, whole, virgin))


def reversal_slope(tau: Number, tau_peak: Number, mu_wrap: Number = math.inf) -> Array:
    """d/d tau of `reversal_change`: |sqrt(tau_peak/tau) - 1| inside the bump; never negative."""
    t, peak, c = _three(tau, tau_peak, mu_wrap)
    s, log_t, log_peak = _logs(t, peak)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        back = s * (log_peak - log_t)
        slipped = s * log_peak > c
        in_bump = (back >= 0.0) & (back <= 2.0 * np.minimum(c, s * log_peak))
        bump = np.abs(np.sqrt(peak / t) - 1.0)
        whole = np.abs(np.expm1(s * c))
        return np.where(in_bump, bump, np.where((back > 0.0) & slipped, whole, loading_shape_slope(t, c)))


def _three(tau: Number, tau_peak: Number, mu_wrap: Number) -> tuple[Array, Array, Array]:
    t, peak, c = np.broadcast_arrays(
        np.asarray(tau, dtype=float), np.asarray(tau_peak, dtype=float), np.asarray(mu_wrap, dtype=float)
    )
    return t, peak, c


def _logs(tau: Array, peak: Array) -> tuple[Array, Array, Array]:
    with np.errstate(divide="ignore"):
        return np.where(peak < 1.0, -1.0, 1.0), np.log(tau), np.log(peak)
