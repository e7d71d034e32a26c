"""Foreign columns: a mapping means what it says, is saved and found again; a recording is looked at."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from springy_joint import joint

from cablecomp.cli.app import main
from cablecomp.errors import ConfigError, InputError
from cablecomp.recording.inspection import inspect
from cablecomp.recording.mapping import (
    FOLDER_MAP,
    ColumnMap,
    Source,
    column_of,
    load_mapping,
    mapping_from,
    mapping_text,
    save_mapping,
)
from cablecomp.recording.raw_columns import raw_columns
from cablecomp.recording.reader import open_recording, read_all


@pytest.mark.parametrize(
    ("source", "channel", "reads", "means"),
    [
        (Source(column="x"), "motor_position_rad", 1.5, 1.5),
        (Source(column="x", unit="deg"), "motor_position_rad", 90.0, math.pi / 2),
        (Source(column="x", unit="°", sign=-1), "joint_position_rad", 90.0, -math.pi / 2),
        (Source(column="x", counts_per_rev=8192), "motor_position_rad", 4096.0, math.pi),
        (Source(column="x", counts_per_rev=8192, zero=100), "motor_position_rad", 4196.0, math.pi),
        (
            Source(column="x", unit="deg", zero=10, sign=-1, scale=0.1),
            "motor_position_rad",
            190.0,
            -math.pi / 10,
        ),
        (Source(column="x", torque_constant_Nm_per_A=0.05), "motor_torque_Nm", 2.0, 0.1),
        (Source(column="x", torque_constant_Nm_per_A=0.05, unit="mA"), "motor_torque_Nm", 2000.0, 0.1),
        (Source(column="x", unit="ms", zero=500.0), "time_s", 1500.0, 1.0),
        (Source(column="x", unit="degF"), "temperature_degC", 212.0, 100.0),
        (Source(column="x", scale=3.0), "other_x", 2.0, 6.0),
    ],
)
def test_a_source_means_sign_times_scale_times_si_of_column_less_zero(
    source: Source, channel: str, reads: float, means: float
) -> None:
    column = column_of(channel, source)
    assert column.factor * reads + column.offset == pytest.approx(means)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["motor_position_rad"], "CHANNEL=COLUMN"),
        (["motor_position_rad=x,unit=furlong"], "unit 'furlong' is none for it; rad, mrad"),
        (["motor_position=x"], r"channel.motor_position\]: no such channel"),
        (["motor_position_rad=y"], "the file has no column 'y'; it has 'x'"),
        (["motor_position_rad=x,sign=2"], "channel.motor_position_rad.sign"),
        (["motor_position_rad=x,sign=left"], "sign is 'left'; a number is accepted"),
        (["motor_position_rad=x,colour=2"], "unknown key `channel.motor_position_rad.colour`"),
        (["motor_position_rad=x,unit=deg,counts_per_rev=9"], "say the same"),
        (["joint_torque_Nm=x,counts_per_rev=9"], "counts_per_rev is for angles"),
        (["motor_position_rad=x,torque_constant_Nm_per_A=1"], "takes a torque from a current"),
        (["motor_position_rad=x,scale=0"], "scale 0"),
        (["time_s=x,sign=-1"], "runs backwards"),
        (["time_s=x", "time_s=time_s"], "--map: time_s is given twice; give it once"),
    ],
)
def test_a_mapping_that_cannot_be_is_refused(words: list[str], says: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("x,time_s\n0,0\n1,1\n")
    with pytest.raises(InputError, match=says):
        read_all(path, mapping_from(words))


def test_all_wrong_columns_are_said_at_once(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("x,time_s\n0,0\n1,1\n")
    with pytest.raises(ConfigError) as caught:
        read_all(path, mapping_from(["motor_position_rad=p", "joint_torque_Nm=q", "other_x=x,unit=V"]))
    assert len(caught.value.lines) == 2


_text = st.text(st.characters(blacklist_categories=["Cs", "Cc"]), min_size=1, max_size=12)
_numbers = st.floats(allow_nan=False, allow_infinity=False, width=32)
_sources = st.builds(
    Source,
    column=_text,
    unit=st.none() | st.sampled_from(["deg", "mrad"]),
    sign=st.sampled_from([1, -1]),
    scale=_numbers.filter(bool),
    zero=_numbers,
)


@settings(deadline=None)
@given(st.dictionaries(st.sampled_from(["motor_position_rad", "joint_position_rad", "other_x.y"]), _sources))
def test_a_mapping_is_read_back_as_written(channels: dict[str, Source]) -> None:
    import tomllib

    mapping = ColumnMap(schema=1, channel=channels)
    text = mapping_text(mapping, ["what run\n1\x07.csv means"])
    assert ColumnMap.model_validate(tomllib.loads(text)) == mapping


def test_a_saved_mapping_is_found_and_said_and_leaves_canonical_files_alone(tmp_path: Path) -> None:
    mapping = mapping_from(["motor_position_rad=enc,unit=deg", "time_s=ms,unit=ms"])
    (tmp_path / "foreign.csv").write_text("ms,enc,state\n0,0,on\n1,90,off\n")
    (tmp_path / "own.csv").write_text("time_s,motor_position_rad\n0,7\n")
    with pytest.raises(InputError, match="`cablecomp inspect` suggests a mapping"):
        read_all(tmp_path / "foreign.csv")
    save_mapping(tmp_path / FOLDER_MAP, mapping, ["a comment"])
    assert load_mapping(tmp_path / FOLDER_MAP) == mapping
    table = read_all(tmp_path / "foreign.csv")
    assert table.columns["motor_position_rad"].tolist() == pytest.approx([0.0, math.pi / 2])
    assert any(FOLDER_MAP in note for note in open_recording(tmp_path / "foreign.csv").notes)
    assert read_all(tmp_path / "own.csv").columns["motor_position_rad"].tolist() == [7.0]


def test_a_row_of_units_is_understood(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("Time,enc,load,state\n[ms],[deg],[mNm],[-]\n0,0,0,1\n10,90,500,1\n")
    columns = read_all(
        path, mapping_from(["time_s=Time", "motor_position_rad=enc", "joint_torque_Nm=load"])
    ).columns
    assert columns["time_s"].tolist() == [0.0, 0.01]
    assert columns["motor_position_rad"].tolist() == pytest.approx([0.0, math.pi / 2])
    assert columns["joint_torque_Nm"].tolist() == [0.0, 0.5]
    path.write_text("time_s,motor_position_deg\ns,deg\n0,0\n1,180\n")
    assert read_all(path).columns["motor_position_rad"].tolist() == pytest.approx([0.0, math.pi])


def test_names_in_a_windows_code_page_are_read(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes("t [ms];motor [°]\n0;1,5\n1;3\n".encode("cp1252"))
    raw = raw_columns(path)
    assert list(raw.columns) == ["t [ms]", "motor [°]"]
    assert list(raw.columns["motor [°]"]) == [1.5, 3.0]


@pytest.mark.parametrize("how", ["{}", "{}Z", "{}+02:00"])
def test_dates_and_times_become_seconds(how: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    stamps = ["2024-03-31T23:59:59.9999995", "2024-03-31 23:59:59.999999750", "2024-04-01T00:00:01"]
    path.write_text(
        "when,motor_position_rad\n" + "".join(f"{how.format(s)},{k}\n" for k, s in enumerate(stamps))
    )
    time = read_all(path, mapping_from(["time_s=when"])).columns["time_s"]
    assert np.diff(time) == pytest.approx([2.5e-7, 1.00000025], abs=1e-11)


def test_dates_may_have_a_decimal_comma(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(
        "when;motor_position_rad\n2024-03-30 23:59:59,500;0,0\n2024-03-31T00:00:00,250;0,5\n", "utf-8"
    )
    columns = read_all(path, mapping_from(["time_s=when"])).columns
    assert np.diff(columns["time_s"]) == pytest.approx([0.75])
    assert columns["motor_position_rad"].tolist() == [0.0, 0.5]


def test_inspection_sees_what_is_wrong_with_a_recording() -> None:
    columns = joint(8000)
    rng = np.random.default_rng(5)
    columns["joint_position_rad"] += 1e-4 * rng.standard_normal(8000)
    columns["joint_torque_Nm"] = np.clip(columns["joint_torque_Nm"], -1.2, 1.2)
    columns["motor_torque_Nm"][2000:3500] = columns["motor_torque_Nm"][2000]
    columns["time_s"] = columns["time_s"].copy()
    columns["time_s"][5000:] += 0.5
    columns["time_s"][6001] = columns["time_s"][6000]
    seen = inspect(columns)
    by_name = {c.name: c for c in seen.channels}
    assert seen.rate_Hz == pytest.approx(1000.0)
    assert [row for row, _ in seen.gaps] == [5000]
    assert seen.gaps[0][1] == pytest.approx(0.501)
    assert seen.duplicates == 1
    assert by_name["joint_position_rad"].noise == pytest.approx(1e-4, rel=0.1)
    assert by_name["motor_torque_Nm"].stuck_s == pytest.approx(1.5, abs=0.01)
    clipped = float(np.mean(np.abs(columns["joint_torque_Nm"]) == 1.2))
    assert by_name["joint_torque_Nm"].clipped == pytest.approx(clipped, abs=0.02)
    assert by_name["motor_position_rad"].clipped == by_name["motor_torque_Nm"].clipped == 0.0


def test_repeatability_is_the_difference_between_like_cycles() -> None:
    t = np.arange(20_000) * 1e-3
    q = np.sin(2.0 * np.pi * 0.25 * t)
    jitter = 1e-3 * np.repeat([1.0, -1.0, 1.0, -1.0, 1.0], 4000)
    seen = inspect({"time_s": t, "motor_position_rad": q, "joint_position_rad": q + jitter}).repeats
    assert seen is not None
    assert seen.cycles == 5
    assert seen.period_s == pytest.approx(4.0, abs=2e-3)
    assert seen.joint_rad == pytest.approx(2e-3, rel=1e-3)
    noise = np.random.default_rng(1).standard_normal(20_000)
    assert inspect({"time_s": t, "motor_position_rad": noise, "joint_position_rad": q}).repeats is None


def test_inspect_shows_suggests_and_saves(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    true = joint(500)
    path = tmp_path / "[red]a.csv"
    names = {"t_ms": true["time_s"] * 1e3, "m_pos": true["motor_position_rad"], "state [x]": ["run"] * 500}
    pl.DataFrame(names).write_csv(path)
    assert main(["inspect", str(path), "--save"]) == 0
    out = capsys.readouterr().out.replace("\n", "")  # lines are as long as the folder's name makes them
    assert "[red]a.csv" in out
    assert "motor_position_rad" in out
    assert read_all(path).columns["motor_position_rad"].tolist() == true["motor_position_rad"].tolist()
    assert main(["inspect", str(path), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["text_columns"] == ["state [x]"]
    assert answer["quality"]["rate_Hz"] == pytest.approx(1000.0)


def test_a_mapping_of_another_file_is_neither_taken_nor_written_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    true = joint(500)
    first, second, place = tmp_path / "a.csv", tmp_path / "b.csv", tmp_path / FOLDER_MAP
    pl.DataFrame({"t_ms": true["time_s"] * 1e3, "m_pos": true["motor_position_rad"]}).write_csv(first)
    pl.DataFrame({"stamp": true["time_s"], "drive_angle": true["motor_position_rad"]}).write_csv(second)
    assert main(["inspect", str(first), "--save"]) == 0
    kept = place.read_text()
    capsys.readouterr()
    assert main(["inspect", str(second), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["mapping"]["channel"]["motor_position_rad"]["column"] == "drive_angle"
    assert answer["quality"]["rate_Hz"] == pytest.approx(1000.0)
    assert main(["inspect", str(second), "--save"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert (
        f"{place}: is of another recording (it names column 't_ms', which {second} has not); rename"
        in said.err
    )
    assert place.read_text() == kept
    place.rename(tmp_path / "a.csv.map.toml")
    assert main(["inspect", str(second), "--save"]) == 0
    for path in (first, second):
        assert read_all(path).columns["motor_position_rad"].tolist() == true["motor_position_rad"].tolist()
