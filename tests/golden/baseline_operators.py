"""Compiled hysteresis operators of the models that ours is compared with."""

from __future__ import annotations

import numpy as np

from cablecomp.mechanics.jit import njit
from cablecomp.signal.smoothing import FloatArray


@njit
def plays(values: FloatArray, radii: FloatArray) -> FloatArray:
    """Return play operators of `values`, one column for each radius, started at rest in the middle of
    the play.
    """
    out = np.empty((len(values), len(radii)))
    for k in range(len(radii)):
        state = values[0]
        for i in range(len(values)):
            state = max(values[i] - radii[k], min(values[i] + radii[k], state))
            out[i, k] = state
    return out


@njit
def bouc_wen(values: FloatArray, reach: float, shape: float, power: float) -> FloatArray:
    """Return z of the normalised Bouc–Wen model driven by `values`, z = 0 at the start, -1 <= z <= 1.

    dz = dx/reach (1 - |z|^power (shape sgn(z dx) + 1 - shape)); `reach`: distance over which z builds
    up; steps longer than a tenth of it are divided.
    """
    out = np.empty(len(values))
    z = 0.0
    out[0] = z
    for i in range(1, len(values)):
        step = values[i] - values[i - 1]
        parts = int(abs(step) / (0.1 * reach)) + 1
        dx = step / parts
        for _ in range(parts):
            sign = 1.0 if z * dx >= 0.0 else -1.0
            z += dx / reach * (1.0 - abs(z) ** power * (shape * sign + 1.0 - shape))
            z = min(1.0, max(-1.0, z))
        out[i] = z
    return out
