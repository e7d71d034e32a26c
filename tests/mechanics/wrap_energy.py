"""Energy of a wrap that does not turn: what the cable stores, and what slip takes, each from the profiles alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def stored_J(angle_rad: Array, tension_N: Array, radius_m: float, EA_N: float) -> float:
    """Elastic energy R/(2 EA) int T^2 dy of a wrap [J]; tension [N] over angle [rad] from the termination, exponential
    between the points. Source: thesis (2-88) in integral form."""
    log = np.log(tension_N)
    rise = np.diff(log)
    mean = np.where(
        np.abs(rise) > 1e-8,
        np.diff(tension_N**2) / np.where(np.abs(rise) > 1e-8, 2.0 * rise, 1.0),
        tension_N[:-1] ** 2,
    )
    return float(np.sum(mean * np.diff(angle_rad)) * radius_m / (2.0 * EA_N))


def slip_m(
    before: tuple[Array, Array], after: tuple[Array, Array], grid_rad: Array, radius_m: float, EA_N: float
) -> Array:
    """How far the cable slid towards the departure point [m] at each angle of the grid, between two profiles
    (angle, tension): s(y) = R/EA int_0^y (T_after - T_before) dy."""
    change = _tension(grid_rad, after) - _tension(grid_rad, before)
    steps = 0.5 * (change[1:] + change[:-1]) * np.diff(grid_rad)
    return np.concatenate(([0.0], np.cumsum(steps))) * radius_m / EA_N


def friction_work_J(
    before: tuple[Array, Array], after: tuple[Array, Array], radius_m: float, EA_N: float, points: int = 4001
) -> float:
    """Work that friction takes in a small step between two profiles [J]: int |dT/dy| |s(y)| dy, with the mean slope.

    Where the cable slides, |dT/dy| = mu T is the friction per radian; where it sticks, s = 0. Exact for small steps.
    """
    grid = np.linspace(0.0, before[0][-1], points)
    slide = slip_m(before, after, grid, radius_m, EA_N)
    mean = 0.5 * (_tension(grid, after) + _tension(grid, before))
    force = np.abs(np.diff(mean))
    return float(np.sum(force * 0.5 * np.abs(slide[1:] + slide[:-1])))


def _tension(grid_rad: Array, profile: tuple[Array, Array]) -> Array:
    """Tension at the grid's angles: straight in its logarithm between the profile's points."""
    return np.asarray(np.exp(np.interp(grid_rad, profile[0], np.log(profile[1]))))
