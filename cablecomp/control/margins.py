"""Margins of a loop over the whole stiffness range, and the gain that keeps them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from cablecomp.control.plant_model import response, stable_when_closed


@dataclass(frozen=True)
class Margin:
    """Margins of one loop at one stiffness: gain margin (factor), phase margin (degrees), least
    distance of the loop's frequency response from -1 (modulus margin), where it crosses 1 (Hz), whether
    the closed loop is stable.
    """

    stiffness_Nm_per_rad: float
    gain_margin: float
    phase_margin_deg: float
    modulus_margin: float
    crossover_Hz: float
    stable: bool


@dataclass(frozen=True)
class Loop:
    """A loop by name, with its margins over the range, worst first is `worst`."""

    name: str
    text: str
    margins: tuple[Margin, ...]

    @property
    def worst(self) -> Margin:
        """The stiffness at which the loop comes nearest to -1."""
        return min(self.margins, key=lambda m: m.modulus_margin if m.stable else -1.0)


def margin_of(loop: Any, stiffness: float, grid: NDArray[np.float64]) -> Margin:
    """Margins of a discrete loop `L` (closed by negative feedback), by python-control."""
    around = np.squeeze(response(loop, np.exp(1j * grid * loop.dt)))
    distance = float(np.min(np.abs(1.0 + around)))
    if not stable_when_closed(loop):
        return Margin(stiffness, 0.0, 0.0, distance, _crossing(around, grid), False)
    gain, phase, *_ = control.stability_margins(control.frd(around, grid))
    return Margin(stiffness, float(gain), float(phase), distance, _crossing(around, grid), True)


def holds(loop: Any, modulus: float, grid: NDArray[np.float64]) -> bool:
    """Whether the closed loop is stable and the loop stays that far from -1."""

    def keeps_off(omega: NDArray[np.float64]) -> bool:
        around = np.squeeze(response(loop, np.exp(1j * omega * loop.dt)))
        return float(np.min(np.abs(1.0 + around))) >= modulus

    # a few frequencies tell most loops that do not hold
    return keeps_off(grid[::20]) and stable_when_closed(loop) and keeps_off(grid)


def grid_for(period_s: float, points: int = 600) -> NDArray[np.float64]:
    """Angular frequencies from 0.05 Hz to just under the Nyquist frequency, rad/s."""
    return np.asarray(2.0 * np.pi * np.geomspace(0.05, 0.499 / period_s, points), dtype=np.float64)


def highest_gain(
    loops: Callable[[float], Sequence[Any]],
    low: float,
    high: float,
    modulus: float,
    grid: NDArray[np.float64],
) -> float:
    """Greatest gain in [low, high] (bisection in its logarithm) at which every loop is stable with that
    modulus margin; 0 if not even `low` is.
    """

    def good(gain: float) -> bool:
        return all(holds(loop, modulus, grid) for loop in loops(gain))

    if not good(low):
        return 0.0
    if good(high):
        return high
    for _ in range(12):
        middle = (low * high) ** 0.5
        if good(middle):
            low = middle
        else:
            high = middle
    return low


def modulus_for(gain_margin: float, phase_margin_deg: float) -> float:
    """The distance from -1 that guarantees both margins: max(1 - 1/GM, 2 sin(PM/2))."""
    return float(max(1.0 - 1.0 / gain_margin, 2.0 * np.sin(np.radians(phase_margin_deg) / 2.0)))


def _crossing(response: NDArray[np.complex128], grid: NDArray[np.float64]) -> float:
    above = np.flatnonzero(np.abs(response) >= 1.0)
    return float(grid[above[-1]] / (2.0 * np.pi)) if len(above) else 0.0


def shown(value: float, digits: int = 3) -> str:
    """A number for tables; infinite is a dash."""
    return f"{value:.{digits}g}" if isfinite(value) else "–"
