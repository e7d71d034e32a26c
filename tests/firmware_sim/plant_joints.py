"""Joints, load courses and closed forms that the plant's tests share. The formulas are restated here from
the thesis."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from firmware_sim.plant import PlantConfig, StageConfig

Floats = NDArray[np.float64]


def joint(circuit: str = "closed", **changes: float) -> PlantConfig:
    """A one-stage joint; any stage value may be changed. The cable is stiff, so that strains stay below
    1e-3."""
    values = {
        "output_radius_m": 0.04,
        "input_radius_m": 0.02,
        "free_length_m": 0.06,
        "EA_N": 2.0e5,
        "pretension_N": 50.0,
        "mu_output": 0.12,
        "mu_input": 0.15,
        "wrap_output_rad": 12.0,
        "wrap_input_rad": 14.0,
    }
    return PlantConfig("test", circuit, (StageConfig(**{**values, **changes}),))


def mu_effective(s: StageConfig) -> float:
    """(3-8)."""
    return 1.0 / (1.0 / s.mu_output + s.input_radius_m / s.output_radius_m / s.mu_input)


def geometry_friction(s: StageConfig) -> float:
    """(3-15)."""
    return s.free_length_m * mu_effective(s) / s.output_radius_m


def open_loading(s: StageConfig, m: float) -> float:
    """(3-17), rad."""
    sign = math.copysign(1.0, m)
    mu, gf = mu_effective(s) * sign, geometry_friction(s) * sign
    return s.pretension_N / (s.EA_N * mu) * ((1 + gf) * m - math.log1p(m))


def open_unloading(s: StageConfig, m: float, peak: float) -> float:
    """(3-21), rad."""
    sign = math.copysign(1.0, peak)
    mu, gf = mu_effective(s) * sign, geometry_friction(s) * sign
    wrapped = 2 * math.sqrt((1 + peak) * (1 + m)) + (gf - 1) * m - 2 - math.log1p(peak)
    return s.pretension_N / (s.EA_N * mu) * wrapped


def closed_loading(s: StageConfig, m: float) -> tuple[float, float, float]:
    """(4-15), (4-18): deflection in rad, tau_h, tau_l."""
    gf = geometry_friction(s)
    low = brentq(lambda t: math.log(t / (t + m)) + (1 + gf) * m + 2 * gf * (t - 1), 1e-9, 1.0 + 1e-12)
    high = low + m
    scale = s.pretension_N / (s.EA_N * mu_effective(s))
    return scale * ((high - 1 - math.log(high)) + gf * (high - 1)), high, low


def closed_unloading(s: StageConfig, m: float, peak: float) -> tuple[float, float, float]:
    """(4-21), (4-24): deflection in rad, tau_h, tau_l."""
    gf = geometry_friction(s)
    _, high_peak, low_peak = closed_loading(s, peak)

    def wrap(tau: float, tau_peak: float) -> float:
        return 2 * math.sqrt(tau * tau_peak) - tau - 1 - math.log(tau_peak)

    def balance(low: float) -> float:
        return wrap(low + m, high_peak) - wrap(low, low_peak) + gf * (2 * low + m - 2)

    grid = np.linspace(low_peak * (1 - 1e-6), 2.0, 300)  # the first root is the one with tau_l > 0 (App. C)
    signs = np.sign([balance(low) for low in grid])
    first = int(np.argmax(signs != signs[0]))
    low = brentq(balance, grid[first - 1], grid[first]) if first else low_peak
    scale = s.pretension_N / (s.EA_N * mu_effective(s))
    return scale * (wrap(low + m, high_peak) + gf * (low + m - 1)), low + m, low


def course(*turns: float, points: int = 200) -> Floats:
    """Straight lines from one turning point to the next, `points` samples each."""
    pieces = [np.linspace(a, b, points, endpoint=False) for a, b in pairwise(turns)]
    return np.concatenate([*pieces, [turns[-1]]])


def clock(values: Floats, dt: float = 0.01) -> Floats:
    """Sample times for a course."""
    return dt * np.arange(len(values))
