"""Laws of judging: error rates hold under dependent noise, real gains are seen and measured right."""

from __future__ import annotations

import numpy as np
import pytest
from planted import autoregressive

from cablecomp.diagnosis.describe.judge import heldout_gain, judge, predictive_likelihood
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
    assert set(plan.block[plan.heldout]) <= set(inside)
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


@pytest.mark.parametrize("memory", [0.1, 10.0])
def test_noise_of_another_seed_is_rarely_supported(memory: float) -> None:
    plan, wrong = layout(), 0
    for trial in range(160):
        rng = np.random.default_rng(trial)
        before, after = (autoregressive(rng, N, memory, 1.0) for _ in range(2))
        wrong += judge(before, after, plan, rng, level=0.05, draws=500).supported
    assert wrong <= 8 + 3 * (160 * 0.05 * 0.95) ** 0.5


def test_a_fitted_idle_regressor_gains_nothing() -> None:
    plan, wrong = layout(), 0
    for trial in range(160):
        rng = np.random.default_rng(trial)
        residual, idle = autoregressive(rng, N, 10.0, 1.0), autoregressive(rng, N, 50.0, 1.0)
        part = plan.training
        after = residual - idle * (idle[part] @ residual[part]) / (idle[part] @ idle[part])
        wrong += judge(residual, after, plan, rng, level=0.05, draws=500).supported
    assert wrong <= 8


def test_the_true_regressor_is_supported_and_its_absence_is_not() -> None:
    """A sine of square 1/2 beside noise of square 1: a third of the whole goes with it."""
    plan = layout()
    rng = np.random.default_rng(4)
    cause = np.sin(np.arange(N) * 2.0 * np.pi / 200.0 + 0.4)
    noise = autoregressive(rng, N, 3.0, 1.0)
    found = judge(noise + cause, noise, plan, rng)
    assert found.supported
    assert found.p_value < 0.01
    assert found.heldout_gain == pytest.approx(1.0 / 3.0, abs=0.05)
    assert found.heldout_gain == heldout_gain(noise + cause, noise, plan)
    back = judge(noise, noise + cause, plan, rng)
    assert back.z < -3.0
    assert not back.supported
    assert back.p_value > 0.99


def test_the_likelihood_of_normal_noise_is_its_entropy() -> None:
    """E ln p = -(1 + ln 2 pi)/2 - ln sigma."""
    noise = 3.0 * np.random.default_rng(8).standard_normal(N)
    expected = -0.5 * (1.0 + np.log(2.0 * np.pi)) - np.log(3.0)
    assert float(np.mean(predictive_likelihood(noise, layout()))) == pytest.approx(expected, abs=0.05)
