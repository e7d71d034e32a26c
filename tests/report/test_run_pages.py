"""Pages of runs and designs open offline and hold what was measured."""

from __future__ import annotations

from math import nan
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from rendering import as_text

from cablecomp.config import load_joint
from cablecomp.config_text import joint_text
from cablecomp.control.design import design_loop
from cablecomp.control.options import load_control
from cablecomp.recording.replay import PredictionCsv
from cablecomp.report import page
from cablecomp.report.design_page import design_page, design_rows, design_tables
from cablecomp.report.run_data import RunData, load_run
from cablecomp.report.run_page import deflection_figure, position_figure, run_facts, torque_figure
from cablecomp.runtime.log import CYCLE
from cablecomp.runtime.results import JointResult

CONFIGS = Path(__file__).parents[2] / "configs"


def test_the_design_page_shows_every_loop_and_number() -> None:
    joint = load_joint(CONFIGS / "joints/wrist-capstan.toml")
    found = design_loop(joint, 1000.0, load_control(CONFIGS / "control/wrist-capstan.toml"))
    html = design_page(found)
    head = html.split("<script")[0]
    assert "http" not in head
    for loop in found.loops:
        assert loop.name in html
    for name, value in design_rows(found):
        assert name.replace("'", "&#x27;") in html
        assert value.split(" ")[0] in html
    text = as_text(design_tables(found), 140)
    assert "load feed-forward" in text
    assert "none predicted" in text


@pytest.mark.parametrize("path", sorted((CONFIGS / "joints").glob("*.toml")), ids=lambda p: p.stem)
def test_a_joint_written_back_reads_as_the_same_joint(path: Path, tmp_path: Path) -> None:
    config = load_joint(path)
    again = tmp_path / "again.toml"
    again.write_text(joint_text(config, ("a remark",)), encoding="utf-8")
    assert load_joint(again) == config


@pytest.mark.parametrize(("duration_s", "settled_s"), [(1.0, 0.1), (20.0, 0.5)])
def test_a_short_run_is_not_all_beginning(duration_s: float, settled_s: float) -> None:
    time = np.arange(0.0, duration_s, 0.01)
    data = RunData({"time_s": time}, {}, {"controlled": np.ones_like(time)})
    assert time[data.controlled][0] == pytest.approx(settled_s, abs=0.011)


def test_what_stands_between_backticks_is_code_and_is_escaped() -> None:
    assert page.paragraph("say `a<b` & go") == "<p>say <code>a&lt;b</code> &amp; go</p>"
    assert page.bullets(["one ` alone"]) == "<ul><li>one ` alone</li></ul>"


def test_what_the_joint_encoder_reads_too_much_is_no_error_of_position() -> None:
    """A joint 1 mrad beside where it is wanted, its encoder 20 mrad off."""
    time, on = np.arange(0.0, 1.0, 0.01), np.ones(100)
    recording = {"time_s": time, "joint_position_rad": 0.321 * on, "joint_torque_Nm": 0.0 * on}
    prediction = {"joint_position_rad": 0.3 * on, "residual_rad": 0.001 * on}
    data = RunData(recording, prediction, {"controlled": on, "reference_position_rad": 0.3 * on})
    assert data.error_rad() == pytest.approx(0.001 * on)
    curves = {c.name: c.y for c in position_figure(data).data}
    assert curves["measured"] - curves["asked"] == pytest.approx(curves["error"], abs=1e-4)


def test_a_joint_without_an_encoder_is_shown_where_it_is_predicted() -> None:
    time, on = np.arange(0.0, 1.0, 0.01), np.ones(100)
    prediction = {"joint_position_rad": 0.301 * on, "residual_rad": np.nan * on}
    cycles = {"controlled": on, "reference_position_rad": 0.3 * on}
    data = RunData({"time_s": time, "joint_torque_Nm": 0.0 * on}, prediction, cycles)
    curves = {c.name: c.y for c in position_figure(data).data}
    assert curves["predicted"] == pytest.approx(301.0 * on)
    assert curves["error"] == pytest.approx(on, abs=1e-3)


def test_force_mode_is_shown_by_its_torque_and_encoders_that_tell_the_load_by_no_residual() -> None:
    joint = JointResult("arm", 100, nan, nan, 0.02, 0.03, nan, 9e-3, {"normal": 100})
    names = [fact.label for fact in run_facts(joint)]
    assert names == ["joint torque error, RMS", "deflection, RMS", "cycles with stale data"]
    time, on = np.arange(0.0, 1.0, 0.01), np.ones(100)
    prediction = dict.fromkeys(PredictionCsv.COLUMNS, 0.01 * on)
    cycles = dict.fromkeys(CYCLE, 0.5 * on)
    data = RunData({"time_s": time, "joint_torque_Nm": on}, prediction, cycles)
    assert [c.name for c in torque_figure(data).data] == ["asked", "found", "error", "joint position"]
    drawn = {c.name for c in deflection_figure(data, tested=False).data}
    assert {"predicted", "made up for"} <= drawn
    assert not {"measured", "residual"} & drawn


TABLES = {
    "recording.csv": "time_s,motor_position_rad,joint_position_rad,joint_torque_Nm",
    "prediction.csv": ",".join(PredictionCsv.COLUMNS),
    "cycles.csv": ",".join(CYCLE),
}


@pytest.mark.parametrize("short", TABLES)
@pytest.mark.parametrize("rows", [None, 0, 7])
def test_tables_that_a_full_disk_cut_short_are_drawn_as_far_as_all_of_them_go(
    short: str, rows: int | None, tmp_path: Path
) -> None:
    """`rows` of one table, None = not even its head; forty of the others."""
    for name, head in TABLES.items():
        count = 40 if name != short else 0 if rows is None else rows
        width = len(head.split(","))
        lines = [",".join([repr(1e-3 * k)] * width) for k in range(count)]
        empty = name == short and rows is None and name != "recording.csv"
        (tmp_path / name).write_text("" if empty else "\n".join([head, *lines]) + "\n")
    if short == "recording.csv" and not rows:
        return  # says that it holds no rows, as every reader of recordings does
    data = load_run(tmp_path)
    assert data.rows == (rows or 0)
    if data.rows:
        assert len(data.error_rad()) == len(data.time_s) == len(data.controlled) == data.rows


def test_a_long_run_shows_an_error_of_one_row_and_no_wave_that_there_was_not(tmp_path: Path) -> None:
    """A minute at 1 kHz; the load turns every 15 rows, by chance how many a page leaves out for each that it draws."""
    rows, spike = 60_000, 31_337
    time, on = 1e-3 * np.arange(rows), np.ones(rows)
    load = np.sin(2.0 * np.pi * np.arange(rows) / 15.0)
    late = np.where(np.arange(rows) == spike, 0.005, 0.0)
    nothing = np.zeros(rows)
    tables = {
        "recording.csv": {"joint_torque_Nm": load},
        "prediction.csv": {"joint_position_rad": nothing, "residual_rad": late},
        "cycles.csv": {"controlled": on, "reference_position_rad": nothing},
    }
    for name, columns in tables.items():
        held = pl.DataFrame(
            {key: columns.get(key, nothing) for key in TABLES[name].split(",")} | {"time_s": time}
        )
        held.write_csv(tmp_path / name)
    data = load_run(tmp_path, 4000)
    assert 500 < data.rows <= 4000
    assert np.all(np.diff(data.time_s) > 0.0)
    assert data.time_s[np.argmax(data.error_rad())] == pytest.approx(time[spike])
    assert data.error_rad().max() == pytest.approx(0.005)
    drawn = data.column("joint_torque_Nm")
    for part in range(20):  # its full reach in every stretch
        there = drawn[(data.time_s >= 3.0 * part) & (data.time_s < 3.0 * (part + 1))]
        assert np.ptp(there) > 1.9
