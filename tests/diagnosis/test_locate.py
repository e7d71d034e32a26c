"""Laws of locating: planted dependences rank first, noise gives uniform p-values, instants are found."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from planted import SIGMA, autoregressive, causes, columns, recording

from cablecomp.diagnosis.locate.covariates import Covariates, covariates
from cablecomp.diagnosis.locate.crossfit import block_sums, gains, surrogate_gains
from cablecomp.diagnosis.locate.location import Mismatch, beyond_chance_first, locate
from cablecomp.diagnosis.locate.segments import segment
from cablecomp.diagnosis.locate.series import make_series, thin
from cablecomp.diagnosis.locate.views import hats, load_path
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.signal.smoothing import FloatArray


@cache
def bench(kind: str) -> tuple[Covariates, dict[str, FloatArray]]:
    channels, found = recording(kind)
    return found, causes(channels, found)


SWEEP = sorted(set(bench("sweep")[1]) - {"dwell"})
HOLD = sorted(set(bench("hold")[1]) - {"velocity", "motor_angle"})


@pytest.mark.parametrize(("kind", "cause"), [("sweep", c) for c in SWEEP] + [("hold", c) for c in HOLD])
def test_a_planted_dependence_ranks_first(kind: str, cause: str) -> None:
    found, shapes = bench(kind)
    rng = np.random.default_rng(7)
    shape = shapes[cause]
    noise = SIGMA * rng.standard_normal(found.samples) + autoregressive(rng, found.samples, 60.0, SIGMA)
    residual = 3.0 * SIGMA * shape / np.std(shape) + noise
    location = locate(make_series(residual, SIGMA, found), np.random.default_rng(1), surrogates=199)
    first = location.mismatch[0]
    assert first.covariate == cause.split(",")[0]
    assert first.p_value < 0.05
    assert first.share > 0.6


@pytest.mark.parametrize("memory", [0.1, 4.0])
def test_noise_gives_uniform_p_values_however_long_it_remembers(memory: float) -> None:
    channels = columns("sweep", 2_000, 0.018)
    found = covariates(channels)
    lowest = []
    for trial in range(24):
        residual = autoregressive(np.random.default_rng(trial), found.samples, memory, SIGMA)
        location = locate(make_series(residual, SIGMA, found), np.random.default_rng(trial), surrogates=99)
        lowest.append(min(entry.p_value for entry in location.mismatch))
    # binomial bounds at three standard deviations
    for level in (0.05, 0.2, 0.5):
        share = float(np.mean(np.array(lowest) <= level))
        assert abs(share - level) < 3.0 * np.sqrt(level * (1.0 - level) / 24.0) + 0.02


def test_what_a_fit_leaves_of_noise_has_uniform_p_values_too() -> None:
    channels = columns("sweep", 1_000, 0.036)
    found = covariates(channels)
    steps = hats(found.values["time"], 10)
    fitted = np.column_stack((load_path(make_series(np.zeros(1_000), SIGMA, found)), steps))
    fitted, _ = np.linalg.qr(fitted)
    lowest = []
    for trial in range(24):
        noise = SIGMA * np.random.default_rng(trial).standard_normal(found.samples)
        residual = noise - fitted @ (fitted.T @ noise)
        location = locate(
            make_series(residual, SIGMA, found), np.random.default_rng(trial), nuisance=fitted, surrogates=99
        )
        lowest.append(min(entry.p_value for entry in location.mismatch))
    # binomial bounds at three standard deviations
    for level in (0.05, 0.2, 0.5):
        share = float(np.mean(np.array(lowest) <= level))
        assert abs(share - level) < 3.0 * np.sqrt(level * (1.0 - level) / 24.0) + 0.02


def test_what_calibration_can_explain_is_not_counted() -> None:
    found, _ = bench("sweep")
    rng = np.random.default_rng(3)
    load = found.values["load"]
    after = found.values["time"] > 30.0
    path = load_path(make_series(load, SIGMA, found))
    residual = 4.0 * SIGMA * after * load + SIGMA * rng.standard_normal(found.samples)
    residual -= path @ np.linalg.lstsq(path, residual, rcond=None)[0]
    location = locate(make_series(residual, SIGMA, found), rng, nuisance=path, surrogates=199)
    assert location.mismatch[0].covariate == "time"
    assert min(abs(instant - 30.0) for instant in location.changes_s) < 0.5


def test_intervals_and_range_show_where() -> None:
    found, _ = bench("sweep")
    rng = np.random.default_rng(5)
    time = found.values["time"]
    patch = np.exp(-(((found.values["motor_angle"] - 0.3) / 0.05) ** 2))
    residual = 6.0 * SIGMA * patch + SIGMA * rng.standard_normal(found.samples)
    location = locate(make_series(residual, SIGMA, found), rng, surrogates=99)
    first = location.mismatch[0]
    assert first.covariate in ("motor_angle", "joint_angle")
    assert 0.1 < first.low < 0.3 < first.high < 0.5
    inside = np.zeros(found.samples, dtype=bool)
    for begin, end in first.intervals_s:
        inside |= (time >= begin) & (time <= end)
    assert float(np.sum(patch[inside] ** 2)) > 0.5 * float(np.sum(patch**2))
    assert float(np.mean(inside)) < 0.5


def test_changes_are_found_to_the_sample_and_not_in_noise() -> None:
    rng = np.random.default_rng(9)
    load = np.sin(np.arange(6_000) / 90.0)
    regressors = np.column_stack((np.ones(6_000), load))
    noise = autoregressive(rng, 6_000, 5.0, 1.0)
    assert len(segment(noise, regressors).changes) == 0
    found = segment(noise + 3.0 * (np.arange(6_000) > 4_321) * load, regressors)
    assert found.changes == pytest.approx([4_321], abs=30)


def test_thinning_keeps_means_and_recordings_apart() -> None:
    found, _ = bench("sweep")
    series = make_series(np.arange(found.samples, dtype=np.float64), SIGMA, found)
    small = thin(series, limit=500)
    assert small.series.samples == 500
    assert small.series.residual[0] == pytest.approx(4.5)
    assert small.series.sigma[0] == pytest.approx(SIGMA / np.sqrt(10.0))
    assert small.group[-1] == 499


def test_a_residual_of_another_length_is_refused() -> None:
    with pytest.raises(InputError, match="same samples"):
        make_series(np.zeros(5), SIGMA, bench("sweep")[0])


def rows_of_blocks() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Regressors, residual, weight and block (of uneven lengths) of 700 rows that depend on the first regressor."""
    rng = np.random.default_rng(11)
    block = np.sort(rng.integers(0, 13, 700))
    basis = rng.standard_normal((700, 3)) * np.array([1.0, 20.0, 0.1])
    residual = 0.8 * basis[:, 0] + rng.standard_normal(700)
    return basis, residual, rng.uniform(0.5, 2.0, 700), block


def test_a_surrogate_is_the_residual_with_the_signs_of_its_blocks() -> None:
    """Its gain is that of rows fitted by NumPy, a thousandth of each regressor's energy as ridge; none flipped, or all,
    leave the fit what it is."""
    basis, residual, weight, block = rows_of_blocks()
    sums = block_sums(basis, residual, weight, block)
    signs = np.random.default_rng(2).choice([-1.0, 1.0], size=(6, sums.blocks))
    signs[0], signs[1] = 1.0, -1.0
    found = surrogate_gains(sums, signs)
    assert found[:2] == pytest.approx([gains(sums).sum()] * 2, rel=1e-12)
    expected = [gain_of_rows(basis, residual * flipped[block], weight, block) for flipped in signs]
    assert found == pytest.approx(expected, rel=1e-9)
    assert np.ptp(found) > 0.1 * found[0]


def gain_of_rows(basis: FloatArray, residual: FloatArray, weight: FloatArray, block: FloatArray) -> float:
    """Energy that least squares on the rows of the other folds take off those of each fold."""
    root = np.sqrt(weight)
    rows, target = basis * root[:, None], residual * root
    energy = np.sum(rows**2, axis=0)
    ridge = np.diag(np.sqrt(1e-3 * energy + 1e-12 * energy.max()))
    gain = 0.0
    for fold in range(LIMITS.crossfit):
        here = block % LIMITS.crossfit == fold
        stacked = np.concatenate((rows[~here], ridge))
        c = np.linalg.lstsq(stacked, np.concatenate((target[~here], np.zeros(len(ridge)))), rcond=None)[0]
        gain += float(np.sum(target[here] ** 2) - np.sum((target[here] - rows[here] @ c) ** 2))
    return gain


@pytest.mark.parametrize(
    ("shares", "p_values", "first"),
    [
        ((0.35, 0.32), (0.16, 0.001), 1),
        ((0.35, 0.32), (0.04, 0.001), 0),  # both beyond chance: the larger
        ((0.35, 0.20), (0.16, 0.001), 0),  # accounts for far less
        ((0.35, 0.32), (0.16, 0.2), 0),
        ((0.35, 0.34, 0.33), (0.3, 0.2, 0.01), 2),
    ],
)
def test_what_is_followed_beyond_chance_goes_before_what_may_be_chance(
    shares: tuple[float, ...], p_values: tuple[float, ...], first: int
) -> None:
    parts = tuple(
        Mismatch(str(k), share, 0.0, 1.0, (), p, "")
        for k, (share, p) in enumerate(zip(shares, p_values, strict=True))
    )
    found = beyond_chance_first(parts)
    assert found[0] is parts[first]
    assert sorted(m.covariate for m in found) == [m.covariate for m in parts]
    assert beyond_chance_first(()) == ()
