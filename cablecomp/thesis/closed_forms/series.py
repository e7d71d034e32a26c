"""Closed stages in series, kind 2 (thesis, 5.2.2): every stage keeps its own pretension and GF; deflections
add.
"""

from __future__ import annotations

from typing import NamedTuple

from cablecomp.config import Drive, ratios_to_last
from cablecomp.thesis.closed_forms.stage import EquivalentStage, equivalent_of, is_series
from cablecomp.thesis.closed_forms.stage import equivalent_stage as single


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
    pairs = zip(ratios_to_last(drive.stage), drive.stage, strict=True)
    return tuple(GearedStage(float(ratio), equivalent_of(stage)) for ratio, stage in pairs)
