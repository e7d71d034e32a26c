"""The closed forms of one wrap against the slip condition itself, and against each other's limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from slip_grid import SlipGrid

from cablecomp.thesis.closed_forms import energy, wrap

MU = 0.15


def unloading_shape(tau: float, peak: float, mu_wrap: float = np.inf) -> float:
    """Dimensionless elongation after one reversal (2-79)."""
    return float(wrap.loading_shape(peak, mu_wrap) + wrap.reversal_change(tau, peak, mu_wrap))


def ramp(grid: SlipGrid, start: float, end: float, steps: int = 40) -> None:
    for tau in np.geomspace(start, end, steps + 1)[1:]:
        grid.load(float(tau))


@pytest.mark.parametrize("tau", [0.2, 0.7, 1.3, 3.0])
def test_loading_elongation_is_the_integral_of_the_slipped_profile(tau: float) -> None:
    grid = SlipGrid(MU, 14.0)
    ramp(grid, 1.0, tau)
    assert wrap.loading_shape(tau) == pytest.approx(MU * grid.elongation(), rel=2e-6, abs=1e-6)
    affected = grid.step * np.count_nonzero(np.abs(grid.tension - 1.0) > 1e-9)
    assert abs(np.log(tau)) / MU == pytest.approx(affected, abs=2.5 * grid.step)  # (2-24)


@pytest.mark.parametrize("peak", [0.4, 2.2])
@pytest.mark.parametrize("share", [0.3, 0.8, 1.1, 1.6])
def test_unloading_follows_the_bump_and_forgets_it_once_erased(peak: float, share: float) -> None:
    tau = float(np.exp(np.log(peak) * (1.0 - 2.0 * share)))  # share 1: erased (2-71)
    grid = SlipGrid(MU, 14.0)
    ramp(grid, 1.0, peak)
    ramp(grid, peak, tau)
    assert unloading_shape(tau, peak) == pytest.approx(MU * grid.elongation(), abs=2e-6)
    if share < 1.0:
        corner = int(np.argmax(grid.tension) if peak > 1.0 else np.argmin(grid.tension))
        alpha = abs(np.log(peak / tau)) / (2.0 * MU)  # (2-62)
        assert alpha == pytest.approx(corner * grid.step, abs=grid.step)
        assert np.sqrt(tau * peak) == pytest.approx(grid.tension[corner], rel=2e-3)  # (2-68)


@pytest.mark.parametrize("wrapped", [0.5, 2.0])
@pytest.mark.parametrize(
    ("peak", "tau"), [(3.0, 2.4), (3.0, 1.2), (3.0, 0.4), (0.3, 0.5), (0.3, 2.0), (1.2, 0.7)]
)
def test_a_short_wrap_slips_to_its_termination(wrapped: float, peak: float, tau: float) -> None:
    grid = SlipGrid(MU, wrapped)
    ramp(grid, 1.0, peak)
    assert wrap.loading_shape(peak, MU * wrapped) == pytest.approx(MU * grid.elongation(), abs=2e-7)
    ramp(grid, peak, tau)
    assert unloading_shape(tau, peak, MU * wrapped) == pytest.approx(MU * grid.elongation(), abs=2e-7)


@pytest.mark.parametrize(("peak", "tau"), [(2.2, 1.3), (2.2, 1.0), (2.2, 0.7), (0.5, 0.8), (0.5, 1.3)])
def test_unwinding_erases_the_bump_at_the_general_angle(peak: float, tau: float) -> None:
    grid = SlipGrid(MU, 24.0, 4001)
    ramp(grid, 1.0, peak)
    ramp(grid, peak, tau)
    alpha = abs(np.log(peak / tau)) / (2.0 * MU)  # (2-62)
    quarter = round(alpha / 4.0 / grid.step)
    grid.unwind(quarter)
    corner = int(np.argmax(grid.tension) if peak > 1.0 else np.argmin(grid.tension))
    assert corner * grid.step == pytest.approx(alpha - quarter * grid.step / 2.0, abs=2 * grid.step)  # (2-72)
    unwound = quarter
    virgin = SlipGrid(MU, 24.0, 4001)
    ramp(virgin, 1.0, tau)
    while np.max(np.abs(grid.tension - virgin.tension[: len(grid.tension)])) > 1e-6:
        grid.unwind(1)
        unwound += 1
    # every level of tension holds |ln T| of friction angle: (2-74) is its special case for tau at or past 1
    beta = max(abs(np.log(peak)) - abs(np.log(tau)), 0.0) / MU
    assert unwound * grid.step == pytest.approx(beta, abs=3 * grid.step)
    thesis = np.log(tau * peak) / MU * np.sign(peak - 1.0)
    if (tau - 1.0) * (peak - 1.0) <= 0.0:
        assert beta == pytest.approx(thesis, rel=1e-12)
    else:
        assert beta < thesis


@given(st.floats(0.05, 20.0), st.floats(0.05, 20.0), st.floats(0.01, 3.0))
def test_slopes_are_derivatives(tau: float, peak: float, c: float) -> None:
    step = 1e-6 * tau
    for shape, slope in (
        (lambda t: wrap.loading_shape(t, c), wrap.loading_shape_slope(tau, c)),
        (lambda t: unloading_shape(t, peak, c), wrap.reversal_slope(tau, peak, c)),
    ):
        forward = float(shape(tau + step) - shape(tau)) / step
        backward = float(shape(tau) - shape(tau - step)) / step
        low, high = sorted((forward, backward))
        room = 1e-4 * (1.0 + 1.0 / tau) * max(1.0, peak)
        assert low - room <= float(slope) <= high + room
        assert float(slope) >= 0.0


@given(st.floats(1e-12, 1e-3))
def test_small_loads_keep_their_relative_accuracy(excess: float) -> None:
    series = excess**2 / 2.0 - excess**3 / 3.0 + excess**4 / 4.0 - excess**5 / 5.0
    assert float(wrap.gap(excess)) == pytest.approx(series, rel=1e-14)
    assert float(wrap.loading_shape_of_log(-excess)) == pytest.approx(
        -(excess**2 / 2.0 - excess**3 / 6.0 + excess**4 / 24.0 - excess**5 / 120.0), rel=1e-13
    )


def test_a_slack_wrap_has_given_back_all_its_stretch() -> None:
    assert wrap.loading_shape(0.0, 0.7) == pytest.approx(-0.7, rel=1e-15)
    assert np.isneginf(wrap.loading_shape(0.0))


def test_steady_losses_agree_with_the_slip_zone_integral() -> None:
    """(2-113) from its own integral: friction force times slip speed over the slip zone (2-109)."""
    high, low, mu, R, EA, speed = 90.0, 40.0, 0.2, 0.06, 2e4, 3.0
    theta = np.linspace(0.0, np.log(high / low) / mu, 20001)  # (2-99)
    tension = low * np.exp(mu * theta)
    loss = np.trapezoid(mu * tension * speed * R * (tension - low) / EA, theta)
    moment = (high - low) * R
    assert speed * moment * (high - low) / (2.0 * EA) == pytest.approx(loss, rel=1e-8)
    # two such pulleys between the power put in and the power taken out
    taken, given = speed * moment - loss, speed * moment + loss
    assert energy.steady_efficiency(moment, R, EA) == pytest.approx(taken / given, rel=1e-6)
    exact, limit = energy.steady_efficiency(moment, R, EA), energy.efficiency_limit(moment, R, EA)
    assert exact == pytest.approx(float(limit), abs=(moment / (R * EA)) ** 2)
