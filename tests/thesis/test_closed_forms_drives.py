"""Open and closed drives: the closed forms against the slip condition, their limits, and their residuals."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from slip_grid import SlipCable, SlipGrid, closed_history

from cablecomp.thesis.closed_forms import closed, models
from cablecomp.thesis.closed_forms import open as open_
from cablecomp.thesis.closed_forms.stage import EquivalentStage, WrapShare, effective_mu

R, SMALL, L, EA, T0, MU_R, MU_r = 0.04, 0.015, 0.03, 2.5e4, 60.0, 0.12, 0.18
MU = effective_mu(SMALL / R, MU_R, MU_r)
GFS = [0.0, 1e-6, 0.006, 0.1, 1.0, 3.0, 10.0, 1e4]


def drive(wrap_out: float = np.inf, wrap_in: float = np.inf) -> EquivalentStage:
    shares = (
        WrapShare(MU / MU_R, MU_R * wrap_out),
        WrapShare(MU * SMALL / R / MU_r, MU_r * wrap_in),
    )
    return EquivalentStage(R, L, EA, T0, MU, shares)


def cable(wrap_out: float, wrap_in: float, points: int = 1001) -> SlipCable:
    return SlipCable(
        [(1.0, SlipGrid(MU_R, wrap_out, points)), (SMALL / R, SlipGrid(MU_r, wrap_in, points))], L / R
    )


@pytest.mark.parametrize(("out", "inn"), [(16.0, 12.0), (3.0, 5.0)])
@pytest.mark.parametrize("peak", [1.7, -0.75])
def test_open_circuit_loading_unloading_and_erasure(out: float, inn: float, peak: float) -> None:
    end = 1.1 * float(open_.open_erasing_moment(peak))
    loads = np.concatenate([np.linspace(0.0, peak, 40)[1:], np.linspace(peak, end, 40)])
    slip, stage = cable(out, inn, 2001), drive(out, inn)
    measured = []
    for m in loads:
        theta, slip = slip.trial(1.0 + m)
        measured.append(theta * T0 / EA)
    moments = loads * stage.moment_scale_Nm
    loading = open_.open_loading_deflection_rad(moments[:39], stage)
    unloading = open_.open_unloading_deflection_rad(moments[39:], moments[38], stage)
    np.testing.assert_allclose(np.concatenate([loading, unloading]), measured, atol=3e-6 * np.ptp(measured))
    if out > 10.0:  # the thesis's own formulas, wraps without end
        scale, before = stage.angle_scale_rad, np.abs(loads[39:] - peak) < abs(end / 1.1 - peak)
        np.testing.assert_allclose(
            scale * open_.open_loading_normalised(loads[:39], stage.GF), loading, rtol=1e-12
        )
        thesis = scale * open_.open_unloading_normalised(loads[39:], peak, stage.GF)
        np.testing.assert_allclose(thesis[before], unloading[before], rtol=1e-11)
        assert np.any(~before)


@pytest.mark.parametrize("peak_m", [None, 1.5])
def test_open_stiffness_is_the_derivative(peak_m: float | None) -> None:
    stage = drive()
    m = np.linspace(-0.4, 1.4, 9) * stage.moment_scale_Nm
    h = 1e-7
    if peak_m is None:
        rise = open_.open_loading_deflection_rad(m + h, stage) - open_.open_loading_deflection_rad(
            m - h, stage
        )
        k = open_.open_stiffness_Nm_per_rad(m, stage)
        np.testing.assert_allclose(
            k / (EA * MU * R),
            open_.open_stiffness_normalised(m / stage.moment_scale_Nm, stage.GF),
            rtol=1e-12,
        )
    else:
        peak = peak_m * stage.moment_scale_Nm
        rise = open_.open_unloading_deflection_rad(m + h, peak, stage) - open_.open_unloading_deflection_rad(
            m - h, peak, stage
        )
        k = open_.open_stiffness_Nm_per_rad(m, stage, peak)
    np.testing.assert_allclose(2 * h / rise, k, rtol=1e-5)
    assert open_.open_stiffness_Nm_per_rad(0.0, stage) == pytest.approx(EA * R**2 / L, rel=1e-12)


@pytest.mark.parametrize(("out", "inn", "peak"), [(20.0, 14.0, 1.8), (3.0, 5.0, 1.8), (2.0, 2.5, 3.0)])
def test_closed_circuit_against_the_slip_condition(out: float, inn: float, peak: float) -> None:
    stage = drive(out, inn)
    loads = np.concatenate([np.linspace(0.0, peak, 7)[1:], np.linspace(peak, -1.2 * peak, 12)[1:]])
    rows = closed_history(cable(out, inn), cable(out, inn), loads)
    up = closed.closed_tensions_loading(loads[:6], stage)
    down = closed.closed_tensions_unloading(loads[6:], peak, stage)
    np.testing.assert_allclose(np.concatenate([up.h, down.h]), rows[:, 0], atol=1e-5)
    np.testing.assert_allclose(np.concatenate([up.l, down.l]), rows[:, 1], atol=1e-5)
    M = loads * stage.moment_scale_Nm
    theta = np.concatenate(
        [
            closed.closed_loading_deflection_rad(M[:6], stage),
            closed.closed_unloading_deflection_rad(M[6:], M[5], stage),
        ]
    )
    wanted = rows[:, 2] * T0 / EA
    taut = rows[:, 0] > 1e-9  # the grid's theta is the h cable's length: meaningless once h hangs slack
    np.testing.assert_allclose(theta[taut], wanted[taut], atol=2e-5 * np.ptp(wanted[taut]))


@pytest.mark.parametrize("GF", GFS)
def test_loading_tensions_solve_4_15(GF: float) -> None:
    m = np.array([1e-9, 1e-4, 0.1, 1.0, 1.9, 3.0, 8.0])
    tau = closed.closed_tensions_loading(m, closed.unending_stage(GF))
    taut = tau.l > 0.0
    residual = (
        np.log(tau.l[taut]) - np.log(tau.h[taut]) + (1.0 + GF) * m[taut] + 2.0 * GF * (tau.l[taut] - 1.0)
    )
    # One ulp of tau moves the residual by its slope; nothing better can be represented.
    slope = 1.0 / tau.l[taut] + 1.0 + 2.0 * GF
    assert np.all(np.abs(residual) <= 1e-14 * np.maximum(slope * tau.l[taut], (1.0 + GF) * (1.0 + m[taut])))
    np.testing.assert_allclose(tau.h - tau.l, m, rtol=1e-15, atol=2.3e-16)
    mirrored = closed.closed_tensions_loading(-m, closed.unending_stage(GF))
    np.testing.assert_array_equal(mirrored.h, tau.l)


@pytest.mark.parametrize("GF", GFS)
@pytest.mark.parametrize("peak", [0.01, 1.0, 3.0])
def test_unloading_tensions_solve_4_21_until_a_bump_is_erased(GF: float, peak: float) -> None:
    stage = closed.unending_stage(GF)
    m = peak * np.linspace(0.999999, -0.3, 9)
    tau, top = closed.closed_tensions_unloading(m, peak, stage), closed.closed_tensions_loading(peak, stage)
    if top.l == 0.0:  # so little tension left that it counts as slack
        return
    kept = (tau.h >= 1.0 / top.h) & (tau.l * top.l <= 1.0)
    h, low = tau.h[kept], tau.l[kept]
    residual = (
        (2 * np.sqrt(top.h * h) - h - np.log(top.h))
        - (2 * np.sqrt(top.l * low) - low - np.log(top.l))
        + GF * (h + low - 2.0)
    )
    assert np.all(np.abs(residual) < 4e-15 * (1.0 + GF) * (1.0 + peak + np.abs(np.log(top.l))))
    assert kept.sum() >= 4 or GF > 100.0


def test_narrow_drive_has_appendix_c_tensions() -> None:
    stage, peak = closed.unending_stage(0.0), 3.1
    m = peak * np.linspace(0.99, -0.3, 12)
    exact, solved = (
        models.narrow_tensions_unloading(m, peak),
        closed.closed_tensions_unloading(m, peak, stage),
    )
    np.testing.assert_allclose(solved.h, exact.h, rtol=1e-14)
    np.testing.assert_allclose(solved.l, exact.l, rtol=1e-14)
    top = models.narrow_tensions(peak)
    x = np.sqrt(exact.l)  # the quadratic of Appendix C
    quadratic = 4 * peak * x**2 - 4 * np.sqrt(top.l) * (m + peak) * x + 4 * top.h * m - (m + peak) ** 2
    assert np.max(np.abs(quadratic)) < 1e-13
    np.testing.assert_allclose(exact.h - exact.l, m, atol=1e-14)
    loading = closed.closed_tensions_loading(m[:6], stage)
    np.testing.assert_allclose(loading.l, models.narrow_tensions(m[:6]).l, rtol=1e-14)


def test_full_unload_leaves_the_tension_above_pretension() -> None:
    tau = closed.closed_tensions_unloading(0.0, 1.3, closed.unending_stage(0.006))
    assert float(tau.h) == pytest.approx(float(tau.l), rel=1e-15)
    assert float(tau.h) - 1.0 == pytest.approx(0.036, abs=0.0005)


def test_wide_drive_and_its_slack() -> None:
    m = np.array([-3.0, -1.0, 0.5, 1.9, 2.0, 3.5])
    far = closed.closed_tensions_loading(m, closed.unending_stage(1e12))
    # 1 +- m/2 (4-27, 4-28); from |m| = 2 one cable is slack and the other carries |m|, as (4-4) asks
    np.testing.assert_allclose(
        far.h, np.maximum(1.0 + m / 2.0, 0.0) + np.maximum(m / 2.0 - 1.0, 0.0), atol=1e-9
    )
    np.testing.assert_allclose(far.h - far.l, m, atol=1e-9)
    stage = dataclasses.replace(drive(1e-7, 1e-7), free_length_m=5.0)
    assert closed.closed_slack_moment_Nm(stage) / stage.moment_scale_Nm == pytest.approx(2.0, abs=1e-6)
    k = closed.closed_stiffness_Nm_per_rad(np.array([1.9, 2.1]) * stage.moment_scale_Nm, stage)
    assert k[1] / k[0] == pytest.approx(0.5, abs=1e-6)


def left_over(excess: np.ndarray) -> np.ndarray:
    """2 sqrt(1 + x) - 2 - ln(1 + x), without cancellation."""
    root = excess / (np.sqrt(1.0 + excess) + 1.0)  # sqrt(1 + x) - 1
    return 2.0 * (root - np.log1p(root))


def test_hysteresis_of_a_wide_drive_is_the_mean_of_both_cables() -> None:
    peaks = np.array([0.05, 0.6, 1.0, 1.8])
    stage = closed.unending_stage(1e7)
    left = closed.closed_unloading_normalised(np.zeros(4), peaks, stage)
    # the bumps and dips settle the tension at tau = 1 + O(1/GF), and GF (tau - 1) in (4-24) therefore stays finite
    both = (left_over(peaks / 2.0) + left_over(-peaks / 2.0)) / 2.0
    np.testing.assert_allclose(left, both, rtol=1e-5)
    thesis = 2.0 * np.sqrt(1.0 + peaks / 2.0) - 2.0 - np.log1p(peaks / 2.0)
    assert np.all(thesis < left)  # (4-39) drops GF (tau - 1), which stays finite
    assert thesis[0] == pytest.approx(left[0], rel=0.06)


@pytest.mark.parametrize("GF", [0.01, 1.0, 12.0])
@pytest.mark.parametrize("peak", [None, 1.6])
def test_closed_stiffness_is_the_derivative(GF: float, peak: float | None) -> None:
    stage = closed.unending_stage(GF)
    m = np.array([-0.4, 0.2, 0.9, 1.5])
    h = 1e-5

    def theta(x: np.ndarray) -> np.ndarray:
        if peak is None:
            return closed.closed_loading_normalised(x, stage)
        return closed.closed_unloading_normalised(x, peak, stage)

    wanted = 2 * h / (theta(m + h) - theta(m - h))
    top = None if peak is None else np.asarray(peak)
    np.testing.assert_allclose(closed.closed_stiffness_normalised(m, stage, top), wanted, rtol=2e-5)
    assert closed.closed_stiffness_normalised(0.0, stage) == pytest.approx(2.0 / GF, rel=1e-12)


def test_slip_and_slack_moments_are_where_the_tensions_say() -> None:
    stage = drive(3.0, 2.0)
    slip, slack = closed.closed_slip_moment_Nm(stage), closed.closed_slack_moment_Nm(stage)
    assert 0.0 < slip < slack
    at = closed.closed_tensions_loading(slip / stage.moment_scale_Nm, stage)
    assert -np.log(at.l) == pytest.approx(min(MU_R * 3.0, MU_r * 2.0), rel=1e-12)
    m = np.array([0.999, 1.001]) * slack / stage.moment_scale_Nm
    tau = closed.closed_tensions_loading(m, stage)
    assert tau.l[0] > 0.0
    assert tau.l[1] == 0.0
    assert np.isinf(closed.closed_slack_moment_Nm(drive()))
    low, high = open_.open_slip_moments_Nm(stage)
    assert np.log1p(low / stage.moment_scale_Nm) == pytest.approx(-min(MU_R * 3.0, MU_r * 2.0), rel=1e-12)
    assert np.log1p(high / stage.moment_scale_Nm) == pytest.approx(min(MU_R * 3.0, MU_r * 2.0), rel=1e-12)


@pytest.mark.parametrize("GF", [1e-4, 0.1, 0.5, 0.999, 1.001, 2.0, 3.0, 3.001, 5.0, 9.99, 10.0, 40.0, 1e3])
def test_recommended_model_stays_within_its_stated_error(GF: float) -> None:
    choice = models.choose_model(GF)
    m = np.linspace(0.01, choice.m_limit, 120)
    exact = closed.closed_loading_normalised(m, closed.unending_stage(GF))
    error = np.max(np.abs(models.model_normalised(choice.name, m, GF) / exact - 1.0))
    assert error <= choice.worst_error + 0.005  # the tables are rounded to a percent


@settings(max_examples=60)
@given(st.floats(0.0, 50.0), st.floats(0.01, 1.99))
def test_models_become_exact_in_their_limit(scale: float, m: float) -> None:
    near = closed.closed_loading_normalised(m, closed.unending_stage(1e-9 * scale))
    assert float(models.model_iii_normalised(m, 1e-9 * scale)) == pytest.approx(float(near), rel=1e-5)
    far = float(closed.closed_loading_normalised(m, closed.unending_stage(1e6 * (1.0 + scale))))
    for name in ("I", "II"):
        assert float(models.model_normalised(name, m, 1e6 * (1.0 + scale))) == pytest.approx(far, rel=1e-4)
