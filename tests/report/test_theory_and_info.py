"""Theory figures and tables say what the closed forms and the design sheet say."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from rendering import as_text

from cablecomp.config import JointConfig, load_joint, parse_joint
from cablecomp.errors import InputError
from cablecomp.report.info import bench_table, design_table, quantity
from cablecomp.report.theory import CHAPTERS, write_theory_figures
from cablecomp.report.theory_common import Figure, subject_of
from cablecomp.thesis.bench.evaluate import BenchRecording, evaluate_bench
from cablecomp.thesis.bench.vectors import DriveOnBench
from cablecomp.thesis.design import design_sheet

JOINTS = sorted((Path(__file__).parents[2] / "configs" / "joints").glob("*.toml"))
NUMBERS = ["2.7", "2.8", "3.2", "3.3", "3.4", "4.4", "4.5"] + [f"4.{i}" for i in range(7, 16)]


def joint(name: str) -> JointConfig:
    return load_joint(next(path for path in JOINTS if path.stem == name))


def curve(figure: object, name: str) -> tuple[np.ndarray, np.ndarray]:
    trace = next(trace for trace in figure.data if trace.name == name)
    return np.asarray(trace.x), np.asarray(trace.y)


def theory_figures(config: JointConfig) -> list[Figure]:
    """All figures of the page."""
    subject = subject_of(config, None)
    return [figure for _, _, draw in CHAPTERS for figure in draw(subject)]


@pytest.mark.parametrize("path", JOINTS, ids=lambda path: path.stem)
def test_every_figure_of_the_thesis_is_drawn_for_every_joint(path: Path) -> None:
    figures = theory_figures(load_joint(path))
    assert [figure.number for figure in figures] == NUMBERS
    for figure in figures:
        assert len(figure.caption) > 40
        for trace in figure.figure.data:
            y = np.asarray(trace.y, dtype=float)
            assert not np.any(np.isnan(y)), f"{figure.number}: {trace.name}"


def test_own_curves_pass_through_the_design_sheet() -> None:
    config = joint("capstan-arm")
    sheet = design_sheet(config)
    assert sheet.equivalent is not None
    m_peak = sheet.load_max_Nm / sheet.equivalent.moment_scale_Nm
    figures = {figure.number: figure.figure for figure in theory_figures(config)}
    x, m = curve(figures["4.11"], "this joint")
    theta = np.interp(m_peak, m, x) * sheet.equivalent.angle_scale_rad
    assert theta == pytest.approx(sheet.deflection_rad, rel=1e-4)
    m, tau = curve(figures["4.9"], "this joint")
    assert np.interp(m_peak, m, tau) * 180.0 == pytest.approx(sheet.tension_greatest_N, rel=1e-4)
    x, m = curve(figures["4.7"], "this joint")
    assert x[-1] * sheet.equivalent.angle_scale_rad == pytest.approx(sheet.hysteresis_rad, rel=1e-9)


def test_thesis_values_are_on_the_thesis_curves() -> None:
    figures = {figure.number: figure.figure for figure in theory_figures(joint("snow-closed-rig"))}
    x, m = curve(figures["4.7"], "thesis: GF = 0, m_pk = 4")
    assert np.max(x) == pytest.approx(1.67, abs=0.05)  # Fig. 4.7 ends at about 1.7
    m, tau = curve(figures["4.8"], "GF = ∞")
    assert np.interp(2.0, m, tau) == pytest.approx(0.0, abs=0.01)
    m, k = curve(figures["3.3"], "GF = 1")
    assert np.max(k) == pytest.approx(1.0, rel=0.02)


def test_the_page_is_whole_and_opens_offline(tmp_path: Path) -> None:
    path = write_theory_figures(joint("two-stage-series"), tmp_path / "figures")
    html = path.read_text(encoding="utf-8")
    assert [entry.name for entry in path.parent.iterdir()] == ["theory.html"]
    assert html.count('id="plotly"') == 1
    assert not re.search(r'<(script|link|img)[^>]+(src|href)="', html)
    for number in NUMBERS:
        assert f">{number} · " in html


def test_nothing_is_written_where_the_load_is_unknown(tmp_path: Path) -> None:
    data = joint("capstan-arm").model_dump(by_alias=True)
    data["limits"] = {}
    with pytest.raises(InputError, match="joint_torque_max_Nm"):
        write_theory_figures(parse_joint(data, "x"), tmp_path / "figures")
    assert not (tmp_path / "figures").exists()
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(InputError, match="file"):
        write_theory_figures(joint("capstan-arm"), blocked)


@pytest.mark.parametrize("path", JOINTS, ids=lambda path: path.stem)
def test_design_table_shows_values_with_units(path: Path) -> None:
    sheet = design_sheet(load_joint(path))
    text = as_text(design_table(sheet), 140)
    assert path.stem in text
    assert quantity(sheet.hysteresis_rad, "rad") in text
    assert quantity(sheet.zero_load_stiffness_Nm_per_rad, "N·m/rad") in text
    assert len(re.findall(r"^\d +(output|input) ", text, re.MULTILINE)) == 2 * len(sheet.stages)
    assert "nan" not in text
    assert "…" not in text


def test_bench_table_shows_values_with_uncertainties() -> None:
    config = joint("snow-closed-rig")
    t = np.arange(0.0, 200.0, 0.1)
    load = np.interp(t, [20.0, 80.0, 110.0, 170.0], [0.0, 2.5, 2.5, 0.0])
    bench = DriveOnBench(config.drive)
    theta = np.where(t < 95.0, bench.deflection(load, 1.0), bench.deflection(load, 1.0, 2.5))
    text = as_text(bench_table(evaluate_bench(BenchRecording(t, load, theta), config)))
    assert re.search(r"loading +0\.07\d* ± 0\.00\d+ +0\.07", text)
    assert re.search(r"unloading +0\.07\d* ± 0\.00\d+ +0\.07", text)


def test_quantities_read_well() -> None:
    assert quantity(0.0011206, "rad") == "1.121 mrad"
    assert quantity(67935.5, "N·m/rad") == "67.94 kN·m/rad"
    assert quantity(-0.02, "N") == "-20.00 mN"
    assert quantity(None, "N") == quantity(float("nan"), "N") == "–"
    assert quantity(float("inf"), "N·m") == "unlimited"
    assert quantity(0.0, "N") == "0 N"
