"""Operators with memory: exponential filters (they forget in time) and plays (they forget by motion)."""

from __future__ import annotations

import numpy as np

from cablecomp.mechanics.jit import njit
from cablecomp.signal.smoothing import FloatArray, IntArray


def lagged(values: FloatArray, time_s: FloatArray, tau_s: float, starts: IntArray) -> FloatArray:
    """Return y with tau dy/dt = x - y, started at y = x in each recording; exact for steps of x at the
    samples.
    """
    return _lagged(values, time_s, float(tau_s), np.append(starts, len(values)))


def play(values: FloatArray, radius: float, starts: IntArray) -> FloatArray:
    """Return the play operator: y = max(x - r, min(x + r, y)), started at y = x in each recording."""
    return _play(values, float(radius), np.append(starts, len(values)))


@njit
def _lagged(values: FloatArray, time_s: FloatArray, tau_s: float, bounds: IntArray) -> FloatArray:
    out = np.empty(len(values))
    for part in range(len(bounds) - 1):
        state = values[bounds[part]]
        out[bounds[part]] = state
        for i in range(bounds[part] + 1, bounds[part + 1]):
            keep = np.exp(-max(0.0, time_s[i] - time_s[i - 1]) / tau_s)
            state = values[i] + keep * (state - values[i])
            out[i] = state
    return out


@njit
def _play(values: FloatArray, radius: float, bounds: IntArray) -> FloatArray:
    out = np.empty(len(values))
    for part in range(len(bounds) - 1):
        state = values[bounds[part]]
        for i in range(bounds[part], bounds[part + 1]):
            state = max(values[i] - radius, min(values[i] + radius, state))
            out[i] = state
    return out
