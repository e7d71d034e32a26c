"""Closed stages in series, kind 2 (thesis, 5.2.2): every stage keeps its own pretension and GF; deflections
add.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cablecomp.config import Drive
from cablecomp.thesis.closed_forms import closed
from cablecomp.thesis.closed_forms.stage import EquivalentStage, equivalent_of, is_series, stage_ratios
from cablecomp.thesis.closed_forms.stage import equivalent_stage as single
from cablecomp.thesis.closed_forms.wrap import Array, Number


class GearedStage(NamedTuple):
    """One stage and its ratio N_ik to the joint: it carries N_ik M and adds N_ik of its own deflection."""

    ratio: float
    stage: EquivalentStage


def acting_stages(drive: Drive) -> tuple[GearedStage, ...]:
    """The stages to sum over: each of a series drive, or the one equivalent stage of any other
    (5-19..5-22).
    """
    if not is_series(drive):
        return (GearedStage(1.0, single(drive)),)
    pairs = zip(stage_ratios(drive), drive.stage, strict=True)
    return tuple(GearedStage(float(ratio), equivalent_of(stage)) for ratio, stage in pairs)


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
