"""Deflection of closed stages in series in closed form (thesis, 5.2.2): what the kernel and the equivalent
stage are held to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cablecomp.config import Drive
from cablecomp.thesis.closed_forms import closed
from cablecomp.thesis.closed_forms.series import acting_stages
from cablecomp.thesis.closed_forms.stage import EquivalentStage
from cablecomp.thesis.closed_forms.wrap import Array, Number


def series_loading_deflection_rad(moment_Nm: Number, drive: Drive) -> Array:
    """Deflection of closed stages in series during loading, theta_k = sum N_ik theta_i(N_ik M) (5-27..5-30);
    rad.
    """
    return _sum(
        drive, lambda ratio, stage: closed.closed_loading_deflection_rad(ratio * _a(moment_Nm), stage)
    )


def series_unloading_deflection_rad(moment_Nm: Number, peak_Nm: Number, drive: Drive) -> Array:
    """As `series_loading_deflection_rad`, after a reversal at `peak_Nm`; rad."""
    return _sum(
        drive,
        lambda ratio, stage: closed.closed_unloading_deflection_rad(
            ratio * _a(moment_Nm), ratio * _a(peak_Nm), stage
        ),
    )


def _sum(drive: Drive, deflection: Callable[[float, EquivalentStage], Array]) -> Array:
    return np.asarray(
        sum(geared.ratio * deflection(geared.ratio, geared.stage) for geared in acting_stages(drive))
    )


def _a(value: Number) -> Array:
    return np.asarray(value, dtype=float)
