"""Processed load vectors of the thesis (3-34, 3-37, 4-56, 4-59), for any drive.

A drive's deflection is theta = span(M) + vector(M)/s, where s scales every coefficient of friction from its
nominal value and `vector` is the wrapped cables' deflection at s = 1: T0/(EA mu_eff) times the thesis's l,
summed over the stages with N_ik. In an open circuit neither depends on s; in a closed one the tensions do,
weakly, through GF.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from cablecomp.config import Drive
from cablecomp.thesis.closed_forms import closed, models
from cablecomp.thesis.closed_forms.series import acting_stages
from cablecomp.thesis.closed_forms.stage import EquivalentStage, cable_change, cable_loading

Array = npt.NDArray[np.float64]

_ROUNDING = 1e-12  # dimensionless load that is none: the tensions are sums of it and 1


class Parts(NamedTuple):
    """Deflection of a drive in its two parts: theta = span + vector/s; rad."""

    span: Array
    vector: Array


@dataclass(frozen=True)
class DriveOnBench:
    """A drive as the bench sees it: one load, one peak. `narrow`: the thesis's tensions of GF = 0 in place of
    exact ones.
    """

    drive: Drive
    narrow: bool = False

    def parts(self, load_Nm: Array, scale: float, peak_Nm: float | None = None) -> Parts:
        """Span and vector at `load_Nm`, after a reversal at `peak_Nm` if given, for friction scaled by
        `scale`.
        """
        span, vector = np.zeros_like(load_Nm), np.zeros_like(load_Nm)
        for n, nominal in acting_stages(self.drive):
            stage = nominal.with_friction(scale)
            peak = None if peak_Nm is None else np.asarray(n * peak_Nm / stage.moment_scale_Nm)
            m = n * load_Nm / stage.moment_scale_Nm
            m = np.where(np.abs(m) < _ROUNDING, 0.0, m)
            tau, top = self._tensions(m, peak, stage)
            shape = cable_loading((tau if top is None else top) - 1.0, stage)
            if top is not None:
                shape = shape + cable_change(tau, top, stage)
            free = stage.GF * (tau - 1.0)
            span += n * stage.angle_scale_rad * free
            vector += n * nominal.angle_scale_rad * (shape - free)
        return Parts(span, vector)

    def deflection(self, load_Nm: Array, scale: float, peak_Nm: float | None = None) -> Array:
        """Deflection at `load_Nm` for friction scaled by `scale`; rad."""
        parts = self.parts(load_Nm, scale, peak_Nm)
        return np.asarray(parts.span + parts.vector / scale)

    def scale_of_point(
        self,
        load_Nm: float,
        deflection_rad: float,
        peak_Nm: float | None = None,
        near: float | None = None,
    ) -> float | None:
        """Friction scale with which the drive rests at this point: (C-1) and (C-2), exact for closed
        circuits.

        Between 1/50 and 50 times the nominal friction, or within a factor of 2 of `near`; None where nothing
        fits. The greatest of several: with so little friction that whole wraps slip, hysteresis vanishes
        again.
        """
        load = np.asarray([load_Nm])

        def mismatch(log_scale: float) -> float:
            return float(self.deflection(load, float(np.exp(log_scale)), peak_Nm)[0]) - deflection_rad

        reach, centre = (np.log(50.0), 0.0) if near is None else (np.log(2.0), float(np.log(near)))
        upper = centre + reach
        above = mismatch(upper)
        for lower in centre + np.linspace(reach, -reach, 9 if near is not None else 41)[1:]:
            below = mismatch(lower)
            if above * below <= 0.0:
                return float(np.exp(brentq(mismatch, lower, upper, xtol=1e-10)))
            upper, above = lower, below
        return None

    def _tensions(self, m: Array, peak: Array | None, stage: EquivalentStage) -> tuple[Array, Array | None]:
        """Dimensionless tension of the cable that the peak tightens, and its value at the peak."""
        if self.drive.circuit == "open":
            return 1.0 + m, None if peak is None else 1.0 + peak
        if peak is None:
            solved = models.narrow_tensions(m) if self.narrow else closed.closed_tensions_loading(m, stage)
            return solved.h, None
        solve = _narrow_unloading if self.narrow else _exact_unloading
        return solve(m, peak, stage)


def _narrow_unloading(m: Array, peak: Array, stage: EquivalentStage) -> tuple[Array, Array]:
    return models.narrow_tensions_unloading(m, peak).h, models.narrow_tensions(peak).h


def _exact_unloading(m: Array, peak: Array, stage: EquivalentStage) -> tuple[Array, Array]:
    return closed.closed_tensions_unloading(m, peak, stage).h, closed.closed_tensions_loading(peak, stage).h


def interpolated(function: Callable[[Array], Parts], load_Nm: Array, points: int = 200) -> Parts:
    """`function(load_Nm)` by interpolation between `points` loads: a recording has far more samples than
    shapes.
    """
    if len(load_Nm) <= points:
        return function(load_Nm)
    low, high = float(np.min(load_Nm)), float(np.max(load_Nm))
    # Denser towards both ends, where the branches start out steep.
    grid = low + (high - low) * 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, points)))
    parts = function(grid)
    return Parts(CubicSpline(grid, parts.span)(load_Nm), CubicSpline(grid, parts.vector)(load_Nm))
