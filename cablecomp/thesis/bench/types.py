"""What goes into the bench evaluation and what comes out of it. SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cablecomp.counting import counted
from cablecomp.errors import InputError
from cablecomp.thesis.bench.segments import Segment

_FEWEST = 30
"""Samples of which ramps and holds are told."""
Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class BenchRecording:
    """A drive loaded and unloaded with its input held, from uniform pretension.

    `time_s` rising; `load_Nm` the moment on the output pulley; `deflection_rad` = q_out - (r/R) q_in,
    positive with M; `motor_position_rad` q_in, None = held. Raises InputError for arrays of different length,
    fewer than 30 samples, values that are not finite, time that does not rise.
    """

    time_s: Array
    load_Nm: Array
    deflection_rad: Array
    motor_position_rad: Array | None = None

    def __post_init__(self) -> None:
        arrays = (self.time_s, self.load_Nm, self.deflection_rad)
        lengths = {len(array) for array in arrays}
        if len(lengths) != 1:
            raise InputError(
                f"bench recording has {', '.join(str(len(array)) for array in arrays)} times, loads, "
                "deflections; equal numbers are accepted"
            )
        if min(lengths) < _FEWEST:
            raise InputError(
                f"bench recording has {counted(min(lengths), 'sample')}; {_FEWEST} or more are accepted"
            )
        for name, array in zip(("time_s", "load_Nm", "deflection_rad"), arrays, strict=True):
            bad = np.flatnonzero(~np.isfinite(array))
            if len(bad):
                raise InputError(
                    f"bench recording: {name} is not finite at sample {bad[0]}; cut such samples out"
                )
        if not np.all(np.diff(self.time_s) > 0.0):
            where = int(np.argmin(np.diff(self.time_s))) + 1
            raise InputError(
                f"bench recording: time_s does not rise at sample {where}; sort the samples by time"
            )


@dataclass(frozen=True)
class Measured:
    """A value with its 1-sigma uncertainty: noise, unsettled creep, and the tolerances of EA, T0, lengths and
    radii.
    """

    value: float
    sd: float


@dataclass(frozen=True)
class EquilibriumPoint:
    """The end of one hold."""

    time_s: float
    load_Nm: float
    deflection_rad: float
    drift_rad: float
    """Change of the deflection over the last quarter of the hold, against the quarter before."""
    settled: bool
    """Whether that drift is within its noise."""
    mu_eff: Measured | None
    """Coefficient of friction with which the drive rests here; None where no friction explains the point."""


@dataclass(frozen=True)
class Branch:
    """Loading or unloading. Coefficients are the effective ones (3-8) of the drive's (equivalent, or last)
    stage.
    """

    name: str
    true: Measured | None
    """From the equilibrium points at the ends of the holds (C-1, C-2); None without one."""
    acting: Measured | None
    """From the slope of wrap deflection against the processed load vector while the load moves."""
    correlation: float | None
    """Of that line."""
    samples: int
    points: tuple[EquilibriumPoint, ...]


@dataclass(frozen=True)
class PulleyFriction:
    """Both coefficients of one stage, their nominal ratio kept: the bench sees mu_eff alone."""

    stage: int
    mu_output: Measured
    mu_input: Measured


@dataclass(frozen=True)
class BenchResult:
    """The thesis's bench evaluation of one load cycle."""

    name: str
    circuit: str
    peak_Nm: float
    m_peak: float
    """Dimensionless peak of the drive's (equivalent, or last) stage."""
    mu_eff: Measured
    """From the equilibrium points of both branches; from the acting values where there is no hold."""
    mu_eff_nominal: float
    GF: float
    """With that mu_eff."""
    loading: Branch
    unloading: Branch | None
    pulleys: tuple[PulleyFriction, ...]
    load_noise_Nm: float
    deflection_noise_rad: float
    segments: tuple[Segment, ...]
    notes: tuple[str, ...]
