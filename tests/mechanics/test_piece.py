"""A straight piece of a profile: its strain's integral against quadrature, across the ways in which it is done."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from cablecomp.mechanics.piece import piece
from cablecomp.mechanics.tables import LEAST_STIFFNESS, stiffening_law

WIDTH_RAD = 2.0


@pytest.mark.parametrize("steady", [0.0, 0.4])
@pytest.mark.parametrize("stiffening", [-0.4, 1e-7, 2e-6, 0.02, 0.5, 0.95])
@pytest.mark.parametrize("rise", [0.01, 0.049, 0.051, 0.2, 0.5, 2.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_stiffening_piece_is_the_integral_of_its_strain(
    stiffening: float, rise: float, way: float, steady: float
) -> None:
    """e(tau) = int_1^tau w + (1 - w)/(1 + b (t - 1)) dt = w (tau - 1) + (1 - w) ln(1 + b (tau - 1))/b, tau = exp(v)."""
    law = np.stack([stiffening_law(stiffening, steady)])

    def strain(v: float) -> float:
        yields = np.log1p(stiffening * np.expm1(v)) / stiffening
        return float(steady * np.expm1(v) + (1.0 - steady) * yields)

    for begin in (-2.5, -0.6, 0.0, 0.4):
        end = begin + way * rise
        if 1.0 + stiffening * np.expm1(max(begin, end)) < LEAST_STIFFNESS:
            continue  # softer than the law is meant for
        total, slope = piece(law, 0, 1.0, begin, np.exp(begin), 1.0 + WIDTH_RAD, end, np.exp(end))
        mean = quad(strain, begin, end, epsabs=1e-14, epsrel=1e-13)[0] / (end - begin)
        assert total == pytest.approx(WIDTH_RAD * mean, abs=2e-13)
        mean_slope = (strain(end) - strain(begin)) / (end - begin)
        assert slope == pytest.approx(WIDTH_RAD * mean_slope, abs=2e-12)


@pytest.mark.parametrize("steady", [0.0, 0.4])
@pytest.mark.parametrize(("share", "knee"), [(-0.5, 0.7), (0.75, 1.0), (0.9, 1.5), (0.95, 0.3)])
@pytest.mark.parametrize("rise", [0.01, 0.049, 0.051, 0.2, 0.5, 2.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_piece_across_a_knee_is_the_integral_of_its_strain(
    share: float, knee: float, rise: float, way: float, steady: float
) -> None:
    """de/dtau = w + (1 - w) (1 - b S(tau))/(1 - b S(1)), S from 0 at 0.75 u straight to 1 at 1.25 u, e(1) = 0."""
    law = np.stack([stiffening_law(share, steady, knee)])
    bends = np.array([0.75 * knee, 1.25 * knee])

    def area(tau: float) -> float:
        inside = min(max(tau, bends[0]), bends[1]) - bends[0]
        return float(inside**2 / (2.0 * np.ptp(bends)) + max(tau - bends[1], 0.0))

    def strain(v: float) -> float:
        at_1 = 1.0 - share * np.interp(1.0, bends, [0.0, 1.0])
        bent = (np.expm1(v) - share * (area(np.exp(v)) - area(1.0))) / at_1
        return float(steady * np.expm1(v) + (1.0 - steady) * bent)

    for begin in (-2.5, -0.6, 0.0, 0.4):
        end = begin + way * rise
        total, slope = piece(law, 0, 1.0, begin, np.exp(begin), 1.0 + WIDTH_RAD, end, np.exp(end))
        low, high = sorted((begin, end))
        parts = [low, *(v for v in np.log(bends) if low < v < high), high]
        found = sum(quad(strain, a, b, epsabs=1e-14, epsrel=1e-13)[0] for a, b in pairwise(parts))
        assert total == pytest.approx(WIDTH_RAD * found / (high - low), abs=2e-13)
        assert slope == pytest.approx(WIDTH_RAD * (strain(end) - strain(begin)) / (end - begin), abs=2e-12)
