"""Changes of variable: a cable that only stiffens needs no table, and is the same law as with one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from knees import bends, stiff_share
from scipy.integrate import quad

from cablecomp.mechanics.tables import (
    G_OF_Y,
    HEAD,
    MODE,
    TABLED,
    U_OF_V,
    groove,
    law_table,
    plain_law,
    stiffening_law,
    strain_of_tau,
    tau_of_v,
    v_of_tau,
)

WRAP = 12.0


def hardly(values: np.ndarray) -> np.ndarray:
    """Friction that tension and place change, by so little that nothing shows: it has its tables all the same."""
    return 1.0 + 1e-13 * values


@pytest.mark.parametrize(
    ("stiffening", "steady"), [(-0.4, 0.0), (0.0, 0.0), (0.3, 0.0), (0.9, 0.0), (0.9, 0.6)]
)
def test_a_stiffening_cable_without_a_table_is_the_tabled_law(stiffening: float, steady: float) -> None:
    short = np.stack([stiffening_law(stiffening, steady)])
    table = np.stack([law_table(hardly, hardly, WRAP, stiffening, steady)])
    assert table[0, HEAD, MODE] == TABLED
    assert np.ptp(table[0, G_OF_Y]) > 0.0 < np.ptp(table[0, U_OF_V])
    for tau in np.geomspace(0.05, 8.0, 40):
        v = v_of_tau(short, 0, tau)
        assert v_of_tau(table, 0, tau) == pytest.approx(v, abs=1e-9)
        assert tau_of_v(table, 0, v) == pytest.approx(tau_of_v(short, 0, v), rel=1e-9)
        assert strain_of_tau(table, 0, tau) == pytest.approx(strain_of_tau(short, 0, tau), rel=1e-9)
    for y in np.linspace(0.0, WRAP, 25):
        assert groove(table, 0, y) == pytest.approx(groove(short, 0, y), abs=1e-9)


@pytest.mark.parametrize("steady", [0.0, 0.7])
@pytest.mark.parametrize("stiffening", [-0.4, 0.5])
def test_strain_is_the_integral_of_the_stiffness_named(stiffening: float, steady: float) -> None:
    """de/dtau = w + (1 - w)/(1 + b (tau - 1)), e(1) = 0."""
    law = np.stack([stiffening_law(stiffening, steady)])
    assert strain_of_tau(law, 0, 1.0)[0] == 0.0
    for tau in (0.5, 1.0, 1.7, 2.4):
        slope = (strain_of_tau(law, 0, tau + 1e-6)[0] - strain_of_tau(law, 0, tau - 1e-6)[0]) / 2e-6
        assert slope == pytest.approx(steady + (1.0 - steady) / (1.0 + stiffening * (tau - 1.0)), rel=1e-6)
        assert strain_of_tau(law, 0, tau)[1] == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("steady", [0.0, 0.7])
@pytest.mark.parametrize(
    ("share", "knee", "again"),
    [
        (-0.5, 0.7, 0.0),
        (0.75, 1.0, 0.0),
        (0.75, 1.3, 0.0),
        (0.95, 0.3, 0.0),
        (0.8, 0.7, 1.3),
        (-0.4, 0.9, 1.1),
    ],
)
def test_strain_with_a_knee_is_the_integral_of_its_compliance(
    share: float, knee: float, again: float, steady: float
) -> None:
    """de/dtau = w + (1 - w) (1 - b S(tau))/(1 - b S(1)), S from 0 at 0.75 u straight to 1 at 1.25 u, e(1) = 0, or from
    1 to 0 and back about another tension; in a table too."""
    law = np.stack([stiffening_law(share, steady, knee, again)])
    table = np.stack([law_table(hardly, hardly, WRAP, share, steady, knee, again)])

    def yields(tau: float) -> float:
        return 1.0 - share * float(stiff_share(tau, knee, again))

    def compliance(tau: float) -> float:
        return float(steady + (1.0 - steady) * yields(tau) / yields(1.0))

    bent_at = bends(knee, again)
    for tau in (0.02, 0.5, 0.9, 1.0, 1.3, 2.4, 8.0):
        low, high = sorted((1.0, tau))
        parts = [low, *bent_at[(low < bent_at) & (bent_at < high)], high]
        found = sum(quad(compliance, a, b, epsrel=1e-12, epsabs=1e-14)[0] for a, b in pairwise(parts))
        strain = found if tau >= 1.0 else -found
        assert strain_of_tau(law, 0, tau)[0] == pytest.approx(strain, rel=1e-10, abs=1e-13)
        assert strain_of_tau(law, 0, tau)[1] == pytest.approx(compliance(tau), rel=1e-12)
        assert strain_of_tau(table, 0, tau) == pytest.approx(strain_of_tau(law, 0, tau), rel=1e-12)


def test_no_stiffening_is_the_plain_law() -> None:
    none, plain = np.stack([stiffening_law(0.0)]), np.stack([plain_law()])
    for tau in (0.3, 1.0, 3.0):
        assert strain_of_tau(none, 0, tau) == pytest.approx(strain_of_tau(plain, 0, tau))
        assert v_of_tau(none, 0, tau) == v_of_tau(plain, 0, tau) == pytest.approx(np.log(tau))
