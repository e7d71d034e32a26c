"""Laws of the diagnosis page's figures."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from diagnosis_example import NOISE, example

from cablecomp.diagnosis.result import Diagnosis
from cablecomp.report import diagnosis_figures as figures
from cablecomp.report.replay_figures import Scale


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return example(600)


def test_the_map_shows_rms_in_noise_floors(found: Diagnosis) -> None:
    trace = found.traces[0]
    size = len(trace.measured_rad)
    flat = replace(
        trace,
        before_rad=trace.measured_rad - 3.0 * NOISE,
        after_rad=trace.measured_rad - NOISE * np.where(np.arange(size) % 2, 1.0, -1.0),
    )
    before, after = (trace.z for trace in figures.energy_map([flat], "load", NOISE).data)
    np.testing.assert_allclose(before[np.isfinite(before)], 3.0, atol=2e-3)
    np.testing.assert_allclose(after[np.isfinite(after)], 1.0, atol=2e-3)


def test_the_mean_error_is_that_of_what_was_fitted(found: Diagnosis) -> None:
    """An unknown history at the beginning moves no point of the curve."""
    trace = found.traces[0]
    counted = np.arange(len(trace.measured_rad)) >= 200
    moved = replace(trace, before_rad=trace.measured_rad - np.where(counted, 0.0, 1e-3), counted=counted)
    lines = [s for s in figures.along([moved], "load", NOISE, Scale(1.0, "rad")).data if "before" in s.name]
    assert lines
    assert all(np.max(np.abs(line.y)) == 0.0 for line in lines)


def test_readings_set_aside_interrupt_no_stretch_that_was_kept_for_the_end(found: Diagnosis) -> None:
    """Every third reading of it: all of it is shaded, as where all were read."""
    trace = found.traces[0]
    aside = (np.arange(len(trace.counted)) % 3 == 1) & ~trace.counted
    assert aside.sum() > 3
    unit = Scale(1e3, "mrad")
    whole, holed = (
        [(s.x0, s.x1) for s in figures.at_a_glance(t, unit).layout.shapes]
        for t in (trace, replace(trace, measured_rad=np.where(aside, np.nan, trace.measured_rad)))
    )
    assert len(whole) == 2  # of deflection, of the error
    assert np.abs(np.subtract(holed, whole)).max() <= 2.0 * np.diff(trace.covariates["time"]).max()


def test_a_hypothesis_fitted_twice_beside_one_model_has_one_bar(found: Diagnosis) -> None:
    """Two bars in one place would lie on each other, and make all bars thin."""
    first = found.tested[0]
    again = (replace(first, heldout_gain=0.5 * first.heldout_gain), *found.tested)
    rounds = {name: k + 1 for k, name in enumerate(dict.fromkeys(t.beside for t in again))}
    bars = [
        (y, x) for trace in figures.tried(again, rounds).data for x, y in zip(trace.x, trace.y, strict=True)
    ]
    assert len({y for y, _ in bars}) == len(bars) == len(found.tested)
    assert pytest.approx(100.0 * first.heldout_gain) in [x for _, x in bars]
