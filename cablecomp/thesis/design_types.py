"""What a design sheet holds (thesis, chapter 6). SI units; each field says what it is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cablecomp.thesis.closed_forms.models import ModelChoice
from cablecomp.thesis.closed_forms.stage import EquivalentStage


@dataclass(frozen=True)
class WrapUse:
    """One pulley's wrap at the greatest load: what the load affects against what is there. rad."""

    pulley: str
    affected_tight_rad: float
    """ln(T_h/T0)/mu on the tightening cable (2-24)."""
    affected_easy_rad: float
    """ln(T0/T_l)/mu on the easing cable; infinite once it is slack, NaN in an open circuit."""
    available_rad: float
    """At joint position zero."""
    available_least_rad: float
    """Over the travel in `[limits]`; as at zero where no travel is stated."""

    @property
    def used(self) -> float:
        """The larger affected angle over the least available one; above 1 the wrap slips to its
        termination.
        """
        affected = np.nanmax([self.affected_tight_rad, self.affected_easy_rad])
        return float(affected / self.available_least_rad) if self.available_least_rad > 0.0 else math.inf


@dataclass(frozen=True)
class StageSheet:
    """One stage at the greatest load, on its own axes. SI units."""

    number: int
    """1 on the input side."""
    ratio: float
    """N_ik: stage output angle to joint angle, and joint torque to stage moment."""
    mu_eff: float
    GF: float
    model: ModelChoice
    pretension_N: float
    moment_Nm: float
    """On the stage's output pulley at the greatest load."""
    tension_greatest_N: float
    tension_least_N: float
    """Of the easing cable at the greatest load; of the only cable at the least load in an open circuit."""
    breaking_margin: float | None
    """Breaking force over the greatest tension."""
    wraps: tuple[WrapUse, ...]
    efficiency: float
    """Limit of two pulleys turning steadily under the greatest load (2-116)."""


@dataclass(frozen=True)
class Pretension:
    """What pretension the greatest load asks of the output stage; N."""

    rule_narrow_N: float
    """M/(4R), nearly tangent pulleys (4.2.5). In an open circuit M/R, for a load that may ease the cable as
    much.
    """
    rule_wide_N: float
    """M/(2R), pulleys far apart (4-31); M/R as above in an open circuit."""
    no_slack_N: float
    """With this drive's wraps, no cable goes slack (own derivation)."""
    no_slip_N: float
    """With this drive's wraps, no wrap slips to its termination (own derivation)."""
    minimum_N: float
    """The rule for this GF or `no_slack_N`, whichever is more."""


@dataclass(frozen=True)
class DesignSheet:
    """The numbers of chapter 6 for one joint. SI units; moments, angles and stiffnesses at the joint.

    Loads are taken from uniform pretension at joint position zero, effects beyond the drive's own left out.
    """

    name: str
    circuit: str
    arrangement: str
    load_max_Nm: float
    ratio: float
    """Joint angle over motor angle, prod r/R (6-2)."""
    equivalent: EquivalentStage | None
    """The one stage that the drive amounts to; None for closed stages in series."""
    mu_eff: float
    """Of the equivalent stage, or of the output stage of a series drive."""
    GF: float
    model: ModelChoice
    zero_load_stiffness_Nm_per_rad: float
    loaded_stiffness_Nm_per_rad: float
    """Tangent, at the greatest load while it grows."""
    deflection_rad: float
    """At the greatest load."""
    hysteresis_rad: float
    """Left after the greatest load is taken off again: the worst open-loop position error."""
    zero_load_tension_N: float
    """Of the output stage after that unload; above the pretension in a closed circuit (Fig. 4.5)."""
    tension_greatest_N: float
    """Over all stages."""
    slip_moment_Nm: float
    """Least load at which a wrap slips to its termination (finite wrap)."""
    slack_moment_Nm: float
    """Least load at which a cable goes slack; the load easing the cable in an open circuit."""
    pretension: Pretension
    efficiency: float
    """All stages turning steadily (2-116), bearings left out."""
    efficiency_limit: float
    """First order, prod 1 - M_i/(R_i EA_i) (2-118)."""
    stages: tuple[StageSheet, ...]
    notes: tuple[str, ...]
