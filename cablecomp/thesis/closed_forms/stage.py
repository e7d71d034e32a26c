"""The one stage that the closed forms speak of: a single stage, or the equivalent of several (thesis, 3-8,
3-15, 5-1..5-22).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cablecomp.config import Drive, Stage, ratios_to_last
from cablecomp.errors import InputError
from cablecomp.thesis.closed_forms.wrap import (
    Array,
    Number,
    loading_shape_of_excess,
    loading_shape_of_log,
    loading_shape_slope,
    reversal_change,
    reversal_slope,
)


@dataclass(frozen=True)
class WrapShare:
    """One pulley's part of a cable's wrapped compliance: its share (they sum to 1) and its mu *
    wrap angle.
    """

    share: float
    mu_wrap: float = math.inf


UNENDING = (WrapShare(1.0),)


@dataclass(frozen=True)
class EquivalentStage:
    """One cable between an output pulley and a held input pulley, referred to the output pulley. SI units.

    `mu_eff`: 1/mu_eff = 1/mu_R + (r/R)/mu_r (3-8). `wraps`: the pulleys' shares and mu * wrap angles; by
    default the wraps never end, as the thesis assumes.
    """

    radius_m: float
    free_length_m: float
    EA_N: float
    pretension_N: float
    mu_eff: float
    wraps: tuple[WrapShare, ...] = UNENDING

    @property
    def GF(self) -> float:
        """Geometry-friction number L mu_eff / R (3-15)."""
        return self.free_length_m * self.mu_eff / self.radius_m

    @property
    def angle_scale_rad(self) -> float:
        """T0/(EA mu_eff): what a dimensionless deflection is multiplied by; rad."""
        return self.pretension_N / (self.EA_N * self.mu_eff)

    @property
    def moment_scale_Nm(self) -> float:
        """R T0: what a dimensionless moment is multiplied by; N m."""
        return self.radius_m * self.pretension_N

    def unending(self) -> EquivalentStage:
        """The same stage with wraps that never end."""
        return replace(self, wraps=UNENDING)

    def with_friction(self, factor: float) -> EquivalentStage:
        """The same stage with every coefficient of friction times `factor`."""
        wraps = tuple(replace(wrap, mu_wrap=wrap.mu_wrap * factor) for wrap in self.wraps)
        return replace(self, mu_eff=self.mu_eff * factor, wraps=wraps)


def effective_mu(ratio: float, mu_output: float, mu_input: float) -> float:
    """Effective coefficient of friction of two pulleys of `ratio` r/R, 1/mu_eff = 1/mu_R + (r/R)/mu_r (3-8)."""
    return 1.0 / (1.0 / mu_output + ratio / mu_input)


def settled_pretensions_N(drive: Drive) -> Array:
    """Pretension of every stage of one continuous circuit, T0_i = T0_k N_ik R_k/R_i (5-1); N."""
    last = drive.stage[-1]
    radii = np.array([stage.output_radius_m for stage in drive.stage])
    return np.asarray(
        last.pretension_N * np.array(ratios_to_last(drive.stage)) * last.output_radius_m / radii
    )


def equivalent_of(stage: Stage) -> EquivalentStage:
    """One stage as the closed forms need it, with its finite wraps."""
    mu = effective_mu(stage.ratio, stage.mu_output, stage.mu_input)
    return EquivalentStage(
        stage.output_radius_m,
        stage.free_length_m,
        stage.EA_N,
        stage.pretension_N,
        mu,
        (
            WrapShare(mu / stage.mu_output, stage.mu_output * stage.wrap_output_rad),
            WrapShare(mu * stage.ratio / stage.mu_input, stage.mu_input * stage.wrap_input_rad),
        ),
    )


def equivalent_stage(drive: Drive) -> EquivalentStage:
    """The single stage that an open circuit, or a closed one of kind 1, of any number of stages amounts to
    (5-19..5-21).

    1/mu_ms = sum N_ik^2 (R_k/R_i)(EA_k/EA_i)/mu_eff,i and L_ms = sum N_ik^2 (R_k/R_i)^2 (EA_k/EA_i) L_i, at
    the last stage's R, EA and T0. Exact, finite wraps included: all stages carry the same dimensionless
    tension (5-9). Raises InputError for several closed stages in series, which are no single stage (5-27).
    """
    if is_series(drive):
        raise InputError("closed stages in series have no equivalent single stage; take every stage apart")
    last = drive.stage[-1]
    parts = [equivalent_of(stage) for stage in drive.stage]
    weights = [
        float(n) ** 2 * last.output_radius_m / part.radius_m * last.EA_N / part.EA_N
        for n, part in zip(ratios_to_last(drive.stage), parts, strict=True)
    ]
    mu = 1.0 / sum(weight / part.mu_eff for weight, part in zip(weights, parts, strict=True))
    length = sum(
        weight * last.output_radius_m / part.radius_m * part.free_length_m
        for weight, part in zip(weights, parts, strict=True)
    )
    wraps = tuple(
        WrapShare(weight * wrap.share / part.mu_eff * mu, wrap.mu_wrap)
        for weight, part in zip(weights, parts, strict=True)
        for wrap in part.wraps
    )
    return EquivalentStage(last.output_radius_m, length, last.EA_N, last.pretension_N, mu, wraps)


def is_series(drive: Drive) -> bool:
    """Whether the drive is several closed circuits in series (kind 2), the only drive without an equivalent
    stage.
    """
    return drive.circuit == "closed" and len(drive.stage) > 1 and drive.arrangement == "series"


def cable_loading(excess: Number, stage: EquivalentStage) -> Array:
    """Dimensionless elongation of the whole cable, wraps and span, of `excess` = tau - 1 during loading
    (3-9).
    """
    x = np.asarray(excess, dtype=float)
    return _sum(stage, lambda wrap: loading_shape_of_excess(x, wrap)) + stage.GF * x


def cable_loading_of_log(log_tau: Number, stage: EquivalentStage) -> Array:
    """As `cable_loading`, of ln tau: for a cable that has almost no tension left."""
    u = np.asarray(log_tau, dtype=float)
    return np.asarray(_sum(stage, lambda wrap: loading_shape_of_log(u, wrap)) + stage.GF * np.expm1(u))


def cable_loading_slope(tau: Number, stage: EquivalentStage) -> Array:
    """d/d tau of `cable_loading`."""
    return _sum(stage, lambda wrap: loading_shape_slope(tau, wrap)) + stage.GF


def cable_change(tau: Number, tau_peak: Number, stage: EquivalentStage) -> Array:
    """Change of the cable's dimensionless elongation since the load reversed at `tau_peak`
    (3-10 less 3-9).
    """
    span = stage.GF * (np.asarray(tau, dtype=float) - np.asarray(tau_peak))
    return np.asarray(_sum(stage, lambda wrap: reversal_change(tau, tau_peak, wrap)) + span)


def cable_change_slope(tau: Number, tau_peak: Number, stage: EquivalentStage) -> Array:
    """d/d tau of `cable_change`."""
    return _sum(stage, lambda wrap: reversal_slope(tau, tau_peak, wrap)) + stage.GF


def _sum(stage: EquivalentStage, shape: Callable[[float], Array]) -> Array:
    first, *rest = stage.wraps
    total = first.share * shape(first.mu_wrap)
    for wrap in rest:
        total = total + wrap.share * shape(wrap.mu_wrap)
    return np.asarray(total)
