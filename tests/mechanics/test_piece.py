"""A straight piece of a profile: its strain's integral against quadrature, across the ways in which it is done."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from knees import bends, stiff_share
from scipy.integrate import quad

from cablecomp.mechanics.piece import piece
from cablecomp.mechanics.tables import LEAST_STIFFNESS, law_table, stiffening_law

WIDTH_RAD = 2.0
Factor = Callable[[Any], Any]


@pytest.mark.parametrize("steady", [0.0, 0.4])
@pytest.mark.parametrize("stiffening", [-0.4, 1e-7, 2e-6, 0.02, 0.5, 0.95])
@pytest.mark.parametrize("rise", [0.01, 0.049, 0.051, 0.19, 0.2, 0.5, 2.0])
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
@pytest.mark.parametrize(
    ("share", "knee", "again"),
    [
        (-0.5, 0.7, 0.0),
        (0.75, 1.0, 0.0),
        (0.9, 1.5, 0.0),
        (0.95, 0.3, 0.0),
        (0.75, 0.6, 1.4),
        (0.9, 0.9, 1.2),  # stiff again before it is at its softest
        (-0.5, 0.4, 0.9),
    ],
)
@pytest.mark.parametrize("rise", [0.01, 0.049, 0.051, 0.2, 0.5, 2.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_piece_across_a_knee_is_the_integral_of_its_strain(
    share: float, knee: float, again: float, rise: float, way: float, steady: float
) -> None:
    """de/dtau = w + (1 - w) (1 - b S(tau))/(1 - b S(1)), S from 0 at 0.75 u straight to 1 at 1.25 u, e(1) = 0; where
    the cable is stiff again 1 less that, and the same about where it is."""
    law = np.stack([stiffening_law(share, steady, knee, again)])
    bent_at = bends(knee, again)

    def area(tau: float) -> float:  # S is straight between bends
        inside = [0.0, *bent_at[bent_at < tau], tau]
        return float(np.trapezoid(stiff_share(inside, knee, again), inside))

    def strain(v: float) -> float:
        at_1 = 1.0 - share * stiff_share(1.0, knee, again)
        bent = (np.expm1(v) - share * (area(np.exp(v)) - area(1.0))) / at_1
        return float(steady * np.expm1(v) + (1.0 - steady) * bent)

    for begin in (-2.5, -0.6, 0.0, 0.4):
        end = begin + way * rise
        total, slope = piece(law, 0, 1.0, begin, np.exp(begin), 1.0 + WIDTH_RAD, end, np.exp(end))
        low, high = sorted((begin, end))
        parts = [low, *(v for v in np.log(bent_at) if low < v < high), high]
        found = sum(quad(strain, a, b, epsabs=1e-14, epsrel=1e-13)[0] for a, b in pairwise(parts))
        assert total == pytest.approx(WIDTH_RAD * found / (high - low), abs=2e-13)
        assert slope == pytest.approx(WIDTH_RAD * (strain(end) - strain(begin)) / (end - begin), abs=2e-12)


@pytest.mark.parametrize("stiffening", [0.0, 0.5])
@pytest.mark.parametrize("exponent", [-0.3, 0.4, 0.8])
@pytest.mark.parametrize("rise", [0.01, 0.049, 0.051, 0.19, 0.21, 0.5])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_piece_under_friction_by_pressure_is_the_integral_of_its_strain(
    exponent: float, rise: float, way: float, stiffening: float
) -> None:
    """mu = mu0 tau^-n: v = (tau^n - 1)/n, so tau = (1 + n v)^(1/n) on a piece that is straight in v; as exactly as
    cubics between 4096 places are (the fourth power of a step of 6e-3)."""
    law = np.stack([law_table(lambda tau: tau**-exponent, None, 1.0, stiffening)])

    def strain(v: float) -> float:
        longer = (1.0 + exponent * v) ** (1.0 / exponent) - 1.0
        return float(np.log1p(stiffening * longer) / stiffening if stiffening else longer)

    for begin in (-0.6, 0.0, 0.4):
        end = begin + way * rise
        taus = [(1.0 + exponent * v) ** (1.0 / exponent) for v in (begin, end)]
        total, slope = piece(law, 0, 1.0, begin, taus[0], 1.0 + WIDTH_RAD, end, taus[1])
        mean = quad(strain, begin, end, epsabs=1e-14, epsrel=1e-13)[0] / (end - begin)
        assert total == pytest.approx(WIDTH_RAD * mean, rel=1e-8, abs=1e-9)
        assert slope == pytest.approx(WIDTH_RAD * (strain(end) - strain(begin)) / (end - begin), rel=3e-7)


@pytest.mark.parametrize("exponent", [-0.3, 0.5])
@pytest.mark.parametrize("rise", [-0.6, 0.03, 0.6])
def test_a_piece_across_a_knee_under_friction_by_pressure_is_the_integral_of_its_strain(
    exponent: float, rise: float
) -> None:
    """Both: v = (tau^n - 1)/n, and compliance that falls by b as S rises from 0.75 u to 1.25 u."""
    share, knee = 0.75, 1.1
    law = np.stack([law_table(lambda tau: tau**-exponent, None, 1.0, share, 0.0, knee)])
    bent_at = bends(knee, 0.0)

    def tau_of(v: float) -> float:
        return float((1.0 + exponent * v) ** (1.0 / exponent))

    def compliance(tau: float) -> float:
        here, at_1 = stiff_share([tau, 1.0], knee, 0.0)
        return float((1.0 - share * here) / (1.0 - share * at_1))

    def strain(v: float) -> float:
        tau = tau_of(v)
        inside = [b for b in bent_at if min(1.0, tau) < b < max(1.0, tau)]
        return float(quad(compliance, 1.0, tau, epsabs=1e-12, points=inside or None)[0])

    for begin in (-0.25, 0.0, 0.1):
        end = begin + rise
        total, _ = piece(law, 0, 1.0, begin, tau_of(begin), 1.0 + WIDTH_RAD, end, tau_of(end))
        inside = [v for v in (bent_at**exponent - 1.0) / exponent if min(begin, end) < v < max(begin, end)]
        found = quad(strain, begin, end, epsabs=1e-11, points=inside or None)[0] / rise
        assert total == pytest.approx(WIDTH_RAD * found, abs=3e-8)


@pytest.mark.parametrize("rise", [-0.3, -0.03, 0.03, 0.3])
@pytest.mark.parametrize("width", [0.01, 0.2, 0.24, 0.26, 2.0])
def test_a_piece_under_friction_by_place_is_the_integral_of_its_strain(width: float, rise: float) -> None:
    """mu = mu0 (1 + a sin y): v rises by the share of g = y + a (1 - cos y) that is gone."""
    law = np.stack([law_table(np.ones_like, lambda y: 1.0 + 0.6 * np.sin(y), 12.0)])
    v = 0.1

    def gone(y: float) -> float:
        return float(y + 0.6 * (1.0 - np.cos(y)))

    for begin in (0.0, 1.3, 4.0, 9.7):
        end = begin + width
        share = rise / (gone(end) - gone(begin))

        def strain(y: float, share: float = share, begin: float = begin) -> float:
            return float(np.expm1(v + share * (gone(y) - gone(begin))))

        found = quad(strain, begin, end, epsabs=1e-14)[0]
        total, slope = piece(law, 0, begin, v, np.exp(v), end, v + rise, np.exp(v + rise))
        assert total == pytest.approx(found, rel=1e-9)
        assert slope == pytest.approx(found + width, rel=1e-9)


def wave(order: float) -> tuple[Factor, Factor]:
    """1 + 0.3 cos(k y - 0.5) and its integral."""
    phase = np.sin(0.5)
    return (
        lambda y: 1.0 + 0.3 * np.cos(order * y - 0.5),
        lambda y: y + 0.3 / order * (np.sin(order * y - 0.5) + phase),
    )


def patch(width: float) -> tuple[Factor, Factor]:
    """1 + 2/(1 + x^2), x = (y - 5)/w, and its integral."""
    return (
        lambda y: 1.0 + 2.0 / (1.0 + ((y - 5.0) / width) ** 2),
        lambda y: y + 2.0 * width * (np.arctan((y - 5.0) / width) + np.arctan(5.0 / width)),
    )


@pytest.mark.parametrize("groove", [*map(wave, (0.3, 1.0, 3.0, 10.0, 50.0)), *map(patch, (0.05, 0.4, 2.0))])
@pytest.mark.parametrize(("begin", "end"), [(0.5, 11.5), (3.0, 7.0), (4.9, 5.1)])
def test_a_piece_across_rough_places_is_the_integral_of_its_strain(
    groove: tuple[Factor, Factor], begin: float, end: float
) -> None:
    """v = v1 + mu (g(y) - g(y1)), e = exp(v) - 1, on arcs of many waves too; as exactly as cubics between 4096 places
    of 12 rad are."""
    factor, g = groove
    law = np.stack([law_table(np.ones_like, factor, 12.0)])
    mu = 0.12

    def v(y: float) -> float:
        return float(-0.2 + mu * (g(y) - g(begin)))

    total, slope = piece(law, 0, begin, v(begin), np.exp(v(begin)), end, v(end), np.exp(v(end)))
    found = quad(lambda y: np.exp(v(y)), begin, end, epsabs=1e-12, epsrel=1e-12, limit=1000, points=[5.0])[0]
    assert slope == pytest.approx(found, rel=5e-8)
    assert total == pytest.approx(found - (end - begin), abs=5e-8 * found)
