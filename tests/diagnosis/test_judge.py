"""Laws of judging: error rates hold under dependent noise and many candidates, real gains are seen."""

from __future__ import annotations

import numpy as np
import pytest
from planted import autoregressive

from cablecomp.diagnosis.describe.judge import (
    compare,
    effective_size,
    heldout_gain,
    judge,
    predictive_likelihood,
)
from cablecomp.diagnosis.folds import Layout, alternate_blocks
from cablecomp.errors import InputError
from cablecomp.signal.autocorrelation import integrated_time, long_run_variance

N = 4_000
DIRECTION = np.sign(np.sin(np.arange(N) * 2.0 * np.pi / 200.0))
START = np.zeros(1, dtype=np.int64)


def layout() -> Layout:
    return alternate_blocks(START, N, DIRECTION)


def test_blocks_alternate_and_each_half_sees_reversals() -> None:
    plan = layout()
    assert not np.any(plan.heldout & plan.training)
    assert np.mean(plan.heldout) == pytest.approx(0.5, abs=0.1)
    turns = np.flatnonzero(np.diff(DIRECTION))
    inside = plan.block[turns[plan.block[turns] == plan.block[turns + 1]]]
    assert set(plan.heldout_blocks) <= set(inside)
    assert np.all(np.diff(plan.block) >= 0)
    assert np.all(plan.heldout | plan.training)


def test_blocks_never_cross_recordings() -> None:
    plan = alternate_blocks(np.array([0, 1_000], dtype=np.int64), N, DIRECTION)
    assert plan.block[999] != plan.block[1_000]


def test_too_short_a_recording_is_refused() -> None:
    with pytest.raises(InputError, match="40 samples"):
        alternate_blocks(START, 20, DIRECTION[:20])


@pytest.mark.parametrize("memory", [0.1, 5.0, 30.0])
def test_autocorrelation_time_of_ar1_is_known(memory: float) -> None:
    a = np.exp(-1.0 / memory)
    values = autoregressive(np.random.default_rng(1), 60_000, memory, 1.0)
    exact = (1.0 + a) / (1.0 - a)
    assert integrated_time(values) == pytest.approx(exact, rel=0.25)
    assert long_run_variance(values) == pytest.approx(exact, rel=0.4)
    assert effective_size(values[:N], layout()) == pytest.approx(N / 2 / exact, rel=0.45)


@pytest.mark.parametrize("memory", [0.1, 10.0])
def test_worthless_candidates_are_rarely_supported(memory: float) -> None:
    plan, wrong = layout(), 0
    for trial in range(60):
        rng = np.random.default_rng(trial)
        residual = autoregressive(rng, N, memory, 1.0)
        rivals = {str(i): autoregressive(rng, N, memory, 1.0) for i in range(8)}
        wrong += judge(residual, rivals, plan, rng, level=0.05, draws=500).best is not None
    assert wrong <= 8  # 3 expected, three standard deviations


def test_a_fitted_idle_regressor_gains_nothing() -> None:
    plan, wrong = layout(), 0
    for trial in range(60):
        rng = np.random.default_rng(trial)
        residual = autoregressive(rng, N, 10.0, 1.0)
        rivals = {}
        for i in range(10):
            idle = autoregressive(rng, N, 50.0, 1.0)
            part = plan.training
            rivals[str(i)] = residual - idle * (idle[part] @ residual[part]) / (idle[part] @ idle[part])
        wrong += judge(residual, rivals, plan, rng, level=0.05, draws=500).best is not None
    assert wrong <= 5


def test_the_true_regressor_wins() -> None:
    plan = layout()
    rng = np.random.default_rng(4)
    cause = np.sin(np.arange(N) * 2.0 * np.pi / 200.0 + 0.4)
    noise = autoregressive(rng, N, 3.0, 1.0)
    verdict = judge(noise + cause, {"idle": noise + cause * 0.99, "true": noise}, plan, rng)
    assert verdict.best is not None
    assert verdict.best.name == "true"
    assert verdict.best.heldout_gain == pytest.approx(1.0 / 3.0, abs=4.0 * verdict.best.gain_sd)
    assert verdict.best.log_ratio > 0.0
    assert heldout_gain(noise + cause, noise, plan) == verdict.best.heldout_gain


def test_comparison_is_antisymmetric_in_sign() -> None:
    plan = layout()
    rng = np.random.default_rng(6)
    first, second = rng.standard_normal(N), 1.2 * rng.standard_normal(N)
    assert compare(first, second, plan, np.random.default_rng(0)).z < -3.0
    assert compare(second, first, plan, np.random.default_rng(0)).supported


def test_heavy_tails_are_met_by_student() -> None:
    rng = np.random.default_rng(8)
    heavy = rng.standard_t(3.0, N)
    plain, robust = (predictive_likelihood(heavy, layout(), flag) for flag in (False, True))
    assert robust.freedom == 3.0
    assert robust.scale == pytest.approx(1.0, rel=0.1)
    assert robust.total > plain.total
    normal = predictive_likelihood(rng.standard_normal(N), layout())
    assert float(np.mean(normal.per_sample)) == pytest.approx(-0.5 * (1.0 + np.log(2.0 * np.pi)), abs=0.05)
