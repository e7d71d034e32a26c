"""Losses of pulleys that turn steadily under load (thesis, 2.3.1, 2.3.2)."""

from __future__ import annotations

import numpy as np

from cablecomp.thesis.closed_forms.wrap import Array, Number


def steady_efficiency(moment_Nm: Number, radius_m: Number, EA_N: Number) -> Array:
    """Efficiency of two pulleys that turn steadily, (1 - a)/(1 + a), a = M/(2 R EA) (2-116); M on the pulley
    of radius R.
    """
    a = np.abs(np.asarray(moment_Nm, dtype=float)) / (2.0 * np.asarray(radius_m) * np.asarray(EA_N))
    return np.asarray((1.0 - a) / (1.0 + a))


def efficiency_limit(moment_Nm: Number, radius_m: Number, EA_N: Number) -> Array:
    """First-order efficiency limit of a drive, 1 - M/(R EA) (2-118; Green, Tordion, Townsend)."""
    return np.asarray(
        1.0 - np.abs(np.asarray(moment_Nm, dtype=float)) / (np.asarray(radius_m) * np.asarray(EA_N))
    )
