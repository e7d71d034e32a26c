"""Smoothing that keeps corners: less noise on straight and curved stretches, peaks where they are."""

from __future__ import annotations

import numpy as np
import pytest

from cablecomp.signal.smoothing import FloatArray, keep_corners, local_fit

SIGMA = 0.01


def noisy(values: FloatArray, seed: int) -> FloatArray:
    return values + SIGMA * np.random.default_rng(seed).standard_normal(len(values))


def test_ramps_lose_most_of_their_noise_and_peaks_stay() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    true = np.abs((0.5 * time) % 2.0 - 1.0)  # a triangle with a corner every 2 s
    draws = np.array([keep_corners(time, noisy(true, seed), SIGMA) - true for seed in range(40)])
    corners = np.arange(200, len(time) - 200, 200)
    straight = np.abs((np.arange(len(time)) + 100) % 200 - 100) > 30
    remaining = float(np.sqrt(np.mean(draws[:, straight] ** 2)))
    assert remaining < 0.4 * SIGMA
    # a window of one width that leaves as much noise rounds the corners off more
    half = next(h for h in range(3, 200) if local_fit(time, true, (h + 0.01) * 0.01).gain < remaining / SIGMA)
    rounded = np.abs(local_fit(time, true, (half + 0.01) * 0.01).value - true)[corners]
    kept = np.abs(draws[:, corners].mean(axis=0))
    assert np.max(kept) < 0.8 * np.min(rounded)


def test_a_sine_keeps_its_height_and_its_acceleration() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    true = np.sin(2.0 * np.pi * 0.7 * time)
    found = keep_corners(time, noisy(true, 1), SIGMA)
    inner = slice(100, -100)
    assert np.sqrt(np.mean((found - true)[inner] ** 2)) < 0.5 * SIGMA
    plain, smooth = (np.diff(v, 2)[inner] / 1e-4 for v in (noisy(true, 1), found))
    wanted = np.diff(true, 2)[inner] / 1e-4
    assert np.std(smooth - wanted) < 0.2 * np.std(plain - wanted)


def test_steps_and_gaps_are_not_smeared() -> None:
    time = np.concatenate((np.arange(0.0, 2.0, 0.01), np.arange(8.0, 10.0, 0.01)))
    true = np.where(time < 1.0, 0.0, np.where(time < 5.0, 1.0, 5.0))
    found = keep_corners(time, noisy(true, 2), SIGMA)
    assert np.max(np.abs(found - true)) < 5.0 * SIGMA


def test_without_noise_nothing_is_touched() -> None:
    values = np.random.default_rng(3).standard_normal(50)
    assert np.array_equal(keep_corners(np.arange(50.0), values, 0.0), values)


@pytest.mark.parametrize("seed", range(12))
def test_what_turns_by_thousands_of_deviations_keeps_its_corners(seed: int) -> None:
    """Ramps between rests, uneven steps, bursts lost: no sample far off, though its neighbours' windows are wide."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(0.016 * (1.0 + 0.2 * rng.uniform(-1.0, 1.0, 1200)))
    kept = np.ones(len(time), dtype=np.bool_)
    for k in rng.integers(0, len(time), 12 * (seed % 2)):
        kept[k : k + rng.integers(1, 16)] = False
    time = time[kept]
    levels = np.cumsum(rng.normal(0.0, 0.5, 24) * (rng.uniform(size=24) < 0.5))
    true = np.interp(time, np.sort(rng.uniform(0.0, time[-1], 24)), levels)
    sigma = 5e-6
    found = keep_corners(time, true + sigma * rng.standard_normal(len(time)), sigma)
    assert np.max(np.abs(found - true)) < 8.0 * sigma
    assert np.sqrt(np.mean((found - true) ** 2)) < 0.8 * sigma
