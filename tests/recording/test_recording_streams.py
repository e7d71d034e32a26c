"""Streaming statistics equal those of the whole, whatever the blocks; thinning loses no extreme."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from cablecomp.recording.streams import Histogram, LineFit, Moments, Spectrum
from cablecomp.recording.thinning import RowThinner

sizes = st.lists(st.integers(0, 400), min_size=1, max_size=8)


@settings(max_examples=40, deadline=None)
@given(sizes=sizes, seed=st.integers(0, 999), shift=st.sampled_from([0.0, 1.0, 1e6]))
def test_moments_and_line_equal_the_whole(sizes: list[int], seed: int, shift: float) -> None:
    rng = np.random.default_rng(seed)
    blocks = [rng.standard_normal((2, size)) + shift for size in [*sizes, 3]]
    moments, fit = Moments(), LineFit()
    for x, y in blocks:
        moments.add(y)
        fit.add(x, y)
    x, y = np.concatenate(blocks, axis=1)
    assert moments.count == len(y)
    assert moments.mean == pytest.approx(y.mean(), abs=1e-12 * (1 + shift))
    assert moments.sd == pytest.approx(y.std(), rel=1e-9)
    assert moments.rms == pytest.approx(np.sqrt(np.mean(y**2)), rel=1e-12)
    assert moments.largest == np.abs(y).max()
    line = fit.line()
    assert line is not None
    slope = np.cov(x, y, bias=True)[0, 1] / x.var()
    assert line.slope == pytest.approx(slope, abs=1e-8)
    left = y - y.mean() - slope * (x - x.mean())
    assert line.rmse == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-6, abs=1e-9)


def test_a_line_is_found_exactly_and_a_constant_load_gives_slope_zero() -> None:
    fit = LineFit()
    x = np.linspace(-1.0, 2.0, 301)
    fit.add(x[:100], 3.0 * x[:100] + 1.0)
    fit.add(x[100:], 3.0 * x[100:] + 1.0)
    line = fit.line()
    assert line is not None
    assert line == pytest.approx((3.0, 1.0, 0.0), abs=1e-7)
    flat = LineFit()
    flat.add(np.full(4, 2.0), np.array([0.0, 1.0, 2.0, 3.0]))
    assert flat.line() == pytest.approx((0.0, 1.5, np.std([0.0, 1.0, 2.0, 3.0])))
    assert LineFit().line() is None


@settings(max_examples=40, deadline=None)
@given(sizes=sizes, seed=st.integers(0, 999))
def test_histogram_counts_every_value_in_its_bin(sizes: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    blocks = [rng.standard_normal(size) * 4.0**k for k, size in enumerate(sizes)]
    histogram = Histogram(32)
    for block in blocks:
        histogram.add(block)
    edges, counts = histogram.bins()
    values = np.concatenate(blocks)
    expected, _ = np.histogram(values, edges)
    assert counts.sum() == len(values)
    assert np.abs(counts - expected).sum() <= 2  # a value on an edge may round to either side


@pytest.mark.parametrize("count", [300, 1024, 10_000])
def test_spectrum_equals_welch_of_the_whole(count: int) -> None:
    rng = np.random.default_rng(3)
    signal = rng.standard_normal(count).cumsum()
    spectrum = Spectrum(1024)
    for block in np.array_split(signal, 7):
        spectrum.add(block)
    density = spectrum.density(0.002)
    frequency, power = scipy.signal.welch(
        signal, fs=500.0, window="hann", nperseg=min(1024, count), detrend="constant"
    )
    assert density is not None
    assert density.frequency_Hz == pytest.approx(frequency[1:])
    assert density.amplitude == pytest.approx(np.sqrt(power[1:]), rel=1e-9)
    assert Spectrum(1024).density(0.002) is None


@settings(max_examples=40, deadline=None)
@given(sizes=st.lists(st.integers(1, 900), min_size=1, max_size=10), seed=st.integers(0, 999))
def test_thinning_keeps_extremes_order_and_whole_rows(sizes: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    total = sum(sizes)
    data = {name: rng.standard_normal(total) for name in ("a", "b", "c")}
    data["absent"] = np.full(total, np.nan)
    thinner = RowThinner(("a", "b", "c", "absent"), ("a", "b", "absent"), buckets=8)
    start = 0
    for size in sizes:
        thinner.add({name: values[start : start + size] for name, values in data.items()})
        start += size
    rows = thinner.rows()
    index = rows["row"].astype(int)
    assert np.all(np.diff(index) > 0)
    assert index[0] == 0
    assert index[-1] == total - 1 or total > 17
    assert len(index) <= 16 * 7 + 8
    for name in ("a", "b", "c"):
        assert np.array_equal(rows[name], data[name][index])
    for name in ("a", "b"):
        assert rows[name].max() == data[name].max()
        assert rows[name].min() == data[name].min()
