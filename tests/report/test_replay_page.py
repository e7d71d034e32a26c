"""The replay's files appear together or not at all; its page is whole and needs nothing else."""

from __future__ import annotations

import gzip
import json
import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from joints import EQUAL, closed
from rendering import figures_of

from cablecomp.config import JointConfig, parse_joint
from cablecomp.errors import InputError
from cablecomp.observer import WrapProfile
from cablecomp.recording.reader import open_recording, read_all
from cablecomp.recording.writer import write_canonical
from cablecomp.report import page
from cablecomp.report.replay_page import write_replay

JOINT = {**closed(EQUAL, "rig <one>"), "tolerance": {"mu_input": 0.3, "EA_N": 2.0}}


class Spring:
    """deflection = load / 500, refuses loads above 90."""

    def __init__(self) -> None:
        self.load = 0.0

    def run(self, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        load = columns["joint_torque_Nm"]
        if load.max() > 90.0:
            raise InputError(f"sample {int(load.argmax())}: too much")
        self.load = float(load[-1])
        deflection = load / 500.0
        return {
            "deflection_rad": deflection,
            "deflection_low_rad": deflection - 1e-3,
            "deflection_high_rad": deflection + 1e-3,
            "joint_position_rad": columns["motor_position_rad"] + deflection,
            "tension_h_N": 30.0 + load,
            "tension_l_N": 30.0 - load,
        }

    def profiles(self) -> Sequence[WrapProfile]:
        angle = np.linspace(0.0, 6.0, 20)
        return [WrapProfile(name, angle, self.load * np.exp(-angle)) for name in ("output", "input")]


def _joint() -> JointConfig:
    return parse_joint(JOINT, "test")


def _columns(count: int) -> dict[str, np.ndarray]:
    time = np.arange(count) * 1e-3
    load = 5.0 * np.sin(7.0 * time)
    joint = load / 500.0 + 1e-4 * np.sin(300.0 * time)
    return {
        "time_s": time,
        "motor_position_rad": np.zeros(count),
        "joint_torque_Nm": load,
        "joint_position_rad": joint,
    }


def test_where_the_joints_position_told_the_load_no_error_is_told(tmp_path: Path) -> None:
    """It would be 1e-14 rad, and a straight line 1e10 times worse."""
    joint = parse_joint({**JOINT, "observer": {"load": "both_encoders"}}, "test")
    write_canonical(tmp_path / "a.csv", _columns(1_000))
    summary = write_replay(open_recording(tmp_path / "a.csv"), joint, Spring(), tmp_path / "out")
    assert (summary.rmse_rad, summary.max_rad) == (None, None)
    html = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "position told the load" in html
    assert "measured minus predicted" not in html
    assert "the error of this prediction" not in html


def _replay(folder: Path, columns: dict[str, np.ndarray]) -> str:
    write_canonical(folder / "a.csv", columns)
    write_replay(open_recording(folder / "a.csv"), _joint(), Spring(), folder / "out", "name = '<&>'")
    return (folder / "out" / "report.html").read_text(encoding="utf-8")


def test_the_three_files_agree_with_each_other(tmp_path: Path) -> None:
    _replay(tmp_path, _columns(3000))
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "prediction.csv",
        "replay.json",
        "report.html",
    ]
    stored = json.loads((tmp_path / "out" / "replay.json").read_text(encoding="utf-8"))
    lines = (tmp_path / "out" / "prediction.csv").read_text().splitlines()
    assert lines[0] == (
        "time_s,deflection_rad,deflection_low_rad,deflection_high_rad,joint_position_rad,residual_rad,"
        "tension_h_N,tension_l_N"
    )
    assert len(lines) == 3001
    residual = np.array([float(line.split(",")[5]) for line in lines[1:]])
    assert stored["samples"] == 3000
    assert stored["rmse_rad"] == pytest.approx(math.sqrt(np.mean(residual**2)))
    assert stored["max_rad"] == pytest.approx(np.abs(residual).max())
    assert {"baseline_linear_rmse_rad", "mean_rad", "samples_per_s", "notes", "assumptions"} <= set(stored)


def test_the_page_is_self_contained_and_escaped(tmp_path: Path) -> None:
    html = _replay(tmp_path, _columns(3000))
    assert html.count('id="plotly"') == 1  # plotly.js, once
    assert not re.search(r"<(script|link|img|iframe)[^>]*(src|href)=", html)
    assert "rig &lt;one&gt;" in html
    assert "&lt;&amp;&gt;" in html
    assert "<one>" not in html
    for title in (
        "Summary",
        "Deflection over time",
        "Load–deflection loop",
        "Residual",
        "Tension on each wrap",
    ):
        assert f"<h2>{title}</h2>" in html
    plain = re.sub(r"\\u([0-9a-f]{4})", lambda match: chr(int(match[1], 16)), "".join(figures_of(html)))
    for unit in (
        "time / s",
        "load / N·m",
        "tension / N",
        "angle from the termination / rad",
        "deflection / ",
    ):
        assert unit in plain
    assert "known only within (1 sigma): mu_input ±30 %" in html
    assert "order of magnitude, taken at the value given: EA_N" in html


def test_the_page_does_not_grow_with_the_recording(tmp_path: Path) -> None:
    short, long = tmp_path / "short", tmp_path / "long"
    short.mkdir()
    long.mkdir()
    size = len(_replay(short, _columns(20_000)))
    assert len(_replay(long, _columns(400_000))) < size + 400_000


@pytest.mark.parametrize("absent", ["joint_position_rad", None])
def test_short_and_uncompared_recordings_have_a_page(absent: str | None, tmp_path: Path) -> None:
    columns = {name: values for name, values in _columns(2).items() if name != absent}
    html = _replay(tmp_path, columns)
    assert ("<h2>Residual</h2>" in html) is (absent is None)
    rows = (tmp_path / "out" / "prediction.csv").read_text().splitlines()
    assert (rows[1].split(",")[5] == "NaN") is (absent is not None)


@pytest.mark.parametrize("fault", ["load", "nan at the end", "cut"])
def test_nothing_is_left_under_out_on_failure(fault: str, tmp_path: Path) -> None:
    columns = _columns(100_000)
    if fault == "load":
        columns["joint_torque_Nm"][-1] = 99.0
    if fault == "nan at the end":
        columns["joint_torque_Nm"][-1] = np.nan
    path = tmp_path / "a.csv.gz"
    write_canonical(path, columns)
    if fault == "cut":
        path.write_bytes(path.read_bytes()[:-2000])
    recording = open_recording(path)
    out = tmp_path / "results" / "out"
    with pytest.raises(InputError, match=r"line \d+"):
        write_replay(recording, _joint(), Spring(), out)
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv.gz"]

    out.mkdir(parents=True)
    (out / "replay.json").write_text("earlier")
    with pytest.raises(InputError):
        write_replay(recording, _joint(), Spring(), out)
    assert [p.read_text() for p in out.iterdir()] == ["earlier"]
    assert [p.name for p in out.parent.iterdir()] == ["out"]


def test_a_gzip_under_a_csv_name_is_replayed_alike(tmp_path: Path) -> None:
    _replay(tmp_path, _columns(500))
    plain = (tmp_path / "out" / "prediction.csv").read_bytes()
    (tmp_path / "b.csv").write_bytes(gzip.compress((tmp_path / "a.csv").read_bytes()))
    write_replay(open_recording(tmp_path / "b.csv"), _joint(), Spring(), tmp_path / "packed")
    assert (tmp_path / "packed" / "prediction.csv").read_bytes() == plain
    assert read_all(tmp_path / "b.csv").rows == 500


@pytest.mark.parametrize(
    ("value", "shown"),
    [(0.0012345, "0.00123 N"), (1.5e-7, "1.5·10⁻⁷ N"), (-2.0, "−2 N"), (None, "–"), (math.nan, "–")],
)
def test_numbers_read_well(value: float | None, shown: str) -> None:
    assert page.number(value, "N") == shown


def test_tables_and_folds_escape_their_text() -> None:
    html = page.table(["a<b"], [["x&y"], [1.25]]) + page.fold("<t>", page.code("<c>"))
    assert "a&lt;b" in html
    assert "x&amp;y" in html
    assert '<td class="number">1.25</td>' in html
    assert "&lt;t&gt;" in html
    assert "&lt;c&gt;" in html
