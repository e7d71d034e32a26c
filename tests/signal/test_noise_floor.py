"""Laws of the noise floor: known noise and grid are found again, whatever the motion beneath."""

from __future__ import annotations

import numpy as np
import pytest

from cablecomp.errors import InputError
from cablecomp.signal.noise import (
    channel_noise,
    grid_step,
)
from cablecomp.signal.smoothing import fit_to_noise, local_fit

STEP_S = 1e-3
TIME = np.arange(20_000) * STEP_S
MOTIONS = {
    "sweep": 0.5 * np.sin(2.0 * np.pi * 0.2 * TIME),
    "triangle": np.abs((TIME / 5.0) % 2.0 - 1.0),
    "slow ramp": 0.3 + 0.01 * TIME,
    "ramp and hold": np.interp(TIME, [0, 4, 8, 12, 16, 20], [0, 0.4, 0.4, 0.1, 0.1, 0.3]),
}


@pytest.mark.parametrize("motion", list(MOTIONS))
@pytest.mark.parametrize("white", [2e-3, 1e-3, 4e-4, 1e-4])
def test_noise_below_and_above_the_resolution_is_found(motion: str, white: float) -> None:
    rng = np.random.default_rng(3)
    values = MOTIONS[motion] + white * rng.standard_normal(len(TIME))
    found = channel_noise(TIME, np.round(values / 1e-3) * 1e-3)
    assert found.resolution == pytest.approx(1e-3, rel=1e-6)
    # a tenth of a step shows only in the moments of a flip
    assert found.white == pytest.approx(white, rel=0.12, abs=5e-5)
    assert found.sigma == pytest.approx(np.hypot(white, 1e-3 / np.sqrt(12.0)), rel=0.05)
    assert not found.coloured


@pytest.mark.parametrize("motion", list(MOTIONS))
def test_a_noise_free_encoder_leaves_its_resolution_alone(motion: str) -> None:
    found = channel_noise(TIME, np.round(MOTIONS[motion] / 1e-3) * 1e-3)
    assert found.sigma == pytest.approx(1e-3 / np.sqrt(12.0), rel=0.02)


def test_uneven_sampling_and_repeated_stamps_do_not_matter() -> None:
    rng = np.random.default_rng(5)
    time = np.sort(rng.uniform(0.0, 20.0, 8_000))
    time[100:110] = time[100]
    values = 0.5 * np.sin(2.0 * np.pi * 0.2 * time) + 1e-3 * rng.standard_normal(len(time))
    assert channel_noise(time, values).sigma == pytest.approx(1e-3, rel=0.05)


def test_a_rare_jump_is_not_noise() -> None:
    rng = np.random.default_rng(6)
    values = MOTIONS["sweep"] + 1e-3 * rng.standard_normal(len(TIME)) + 0.2 * (TIME > 7.0)
    assert channel_noise(TIME, values).sigma == pytest.approx(1e-3, rel=0.05)


def test_filtered_noise_is_called_coloured() -> None:
    rng = np.random.default_rng(7)
    noise = np.convolve(rng.standard_normal(len(TIME)), np.hanning(15), mode="same")
    assert channel_noise(TIME, MOTIONS["sweep"] + 1e-3 * noise).coloured


def test_a_grid_printed_with_few_decimals_is_still_a_grid() -> None:
    counts = np.random.default_rng(8).integers(-2_000, 2_000, 20_000)
    step = 2.0 * np.pi / 100_000.0
    assert grid_step(np.round(counts * step, 7)) == pytest.approx(step, rel=1e-4)
    assert grid_step(np.random.default_rng(9).standard_normal(5_000)) == 0.0


def test_too_few_readings_are_refused() -> None:
    with pytest.raises(InputError, match="32 readings"):
        channel_noise(TIME[:10], TIME[:10])


def test_a_local_fit_is_exact_on_parabolas_with_uneven_time() -> None:
    time = np.sort(np.random.default_rng(1).uniform(0.0, 10.0, 500))
    for half_width in (0.3, 2.0):
        fit = local_fit(time, 1.0 - 2.0 * time + 3.0 * time**2, half_width)
        inner = (time > 2.0) & (time < 8.0)
        np.testing.assert_allclose(fit.slope[inner], (-2.0 + 6.0 * time)[inner], rtol=2e-2)
    fit = local_fit(time, 1.0 - 2.0 * time + 3.0 * time**2, 0.3)
    np.testing.assert_allclose(fit.curvature[inner], 6.0, rtol=1e-6)


def test_smoothing_gains_precision_and_states_how_much() -> None:
    rng = np.random.default_rng(11)
    truth = 0.5 * np.sin(2.0 * np.pi * 0.2 * TIME)
    fit = fit_to_noise(TIME, truth + 1e-3 * rng.standard_normal(len(TIME)), 1e-3)
    error = float(np.sqrt(np.mean((fit.value - truth) ** 2)))
    assert error < 5e-4
    assert fit.gain < 0.2
