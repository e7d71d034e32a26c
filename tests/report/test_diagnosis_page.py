"""Laws of the diagnosis page: every part of the result is on it, nothing is fetched, odd cases do not
break it.
"""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from diagnosis_example import NOISE, example

from cablecomp.report import diagnosis_figures as figures
from cablecomp.report.diagnosis_page import diagnosis_page
from cablecomp.report.diagnosis_view import DiagnosisView


@pytest.fixture(scope="module")
def view() -> DiagnosisView:
    return example(2_400)


def text_of(html: str) -> str:
    """The page without scripts and tags."""
    html = re.sub(r"<(script|style).*?</\1>", " ", html, flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", html))


def test_all_parts_of_the_result_are_on_the_page(view: DiagnosisView) -> None:
    text = text_of(diagnosis_page(view))
    for part in (
        "Explained",
        "Viscous slip",
        "118.4 ± 3.1",
        "97 %",
        "pretension_N",
        "33.10 ± 0.22",
        "clock skew",
        "no other_* channel",
        "series compliance / nonlinear cable",
        "load hold 5 s",
        "(3.1e-06 ± 4e-07) rad/(N·m)² M²",
        "0.0041",
        "coefficient_Ns_per_m_rad = 118.4",
        "bench-07.csv",
    ):
        assert part in text, part


def test_the_page_fetches_nothing(view: DiagnosisView) -> None:
    html = diagnosis_page(view)
    assert not re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=", html)


def test_every_verdict_has_a_page(view: DiagnosisView) -> None:
    for verdict in ("consistent", "recalibrate", "unexplained"):
        result = {
            **view.result,
            "verdict": verdict,
            "missing_physics": [],
            "not_excluded": [],
            "next_experiment": {},
        }
        text = text_of(diagnosis_page(replace(view, result=result, hypotheses=(), limits=(), law="")))
        assert verdict.capitalize() in text
        assert "What was missing" not in text


def test_a_page_without_series_or_mismatch_still_stands(view: DiagnosisView) -> None:
    result = {**view.result, "mismatch": [], "calibration": {}, "remainder": {}}
    text = text_of(diagnosis_page(replace(view, result=result, recordings=(), law="")))
    assert "Viscous slip" in text
    assert "Before and after" not in text


def test_names_are_escaped(view: DiagnosisView) -> None:
    html = diagnosis_page(replace(view, joint="<b>x</b>", recordings=()))
    assert "<b>x</b>" not in html


def test_the_map_shows_rms_in_noise_floors(view: DiagnosisView) -> None:
    recording = view.recordings[0]
    size = len(recording.measured_rad)
    flat = replace(
        recording,
        before_rad=recording.measured_rad - 3.0 * NOISE,
        after_rad=recording.measured_rad - NOISE * np.where(np.arange(size) % 2, 1.0, -1.0),
    )
    before, after = (trace.z for trace in figures.energy_map([flat], "load", NOISE).data)
    np.testing.assert_allclose(before[np.isfinite(before)], 3.0, atol=2e-3)
    np.testing.assert_allclose(after[np.isfinite(after)], 1.0, atol=2e-3)


def test_the_spectrum_of_white_noise_lies_on_the_floor(view: DiagnosisView) -> None:
    recording = view.recordings[0]
    noise = NOISE * np.random.default_rng(1).standard_normal(len(recording.measured_rad))
    white = replace(recording, after_rad=recording.measured_rad - noise)
    _, after, floor = figures.spectra([white], NOISE).data
    assert float(np.sqrt(np.mean(np.square(after.y)))) == pytest.approx(float(floor.y[0]), rel=0.1)


def test_several_recordings_share_one_page(view: DiagnosisView) -> None:
    other = replace(view.recordings[0], name="bench-08.csv")
    text = text_of(diagnosis_page(replace(view, recordings=(view.recordings[0], other))))
    assert "2 recordings" in text
    assert "bench-08.csv" in text
