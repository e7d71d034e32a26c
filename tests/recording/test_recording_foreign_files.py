"""Files as other programs leave them, cut short or not what they seem: read, or refused in a line that says what to
do."""

from __future__ import annotations

import zipfile
from datetime import datetime, timedelta
from pathlib import Path

import can
import numpy as np
import polars as pl
import pytest
import scipy.io

from cablecomp.errors import InputError
from cablecomp.recording.can_log import Frame
from cablecomp.recording.mapping import mapping_from
from cablecomp.recording.raw_columns import raw_columns
from cablecomp.recording.reader import open_recording, read_all
from cablecomp.recording.suggest import suggest

ROWS = 200
TIME = 0.01 * np.arange(ROWS)


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_all(path)
    return str(caught.value)


def test_dates_of_a_data_frame_are_the_clock(tmp_path: Path) -> None:
    begin = datetime(2026, 3, 1, 9)
    stamps = [begin + timedelta(milliseconds=10 * k) for k in range(ROWS)]
    pl.DataFrame({"when": stamps, "q": TIME, "M": -TIME}).write_parquet(tmp_path / "log.parquet")
    words = ["time_s=when", "motor_position_rad=q", "joint_torque_Nm=M"]
    time = read_all(tmp_path / "log.parquet", mapping_from(words)).columns["time_s"]
    np.testing.assert_allclose(time - time[0], TIME, atol=1e-6)
    assert time[0] == (begin - datetime(1970, 1, 1)).total_seconds()


@pytest.mark.parametrize("packed", [False, True])
def test_a_matlab_file_that_was_cut_is_refused(packed: bool, tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    columns = {"time_s": TIME, "motor_position_rad": np.sin(TIME), "joint_torque_Nm": np.cos(TIME)}
    scipy.io.savemat(path, columns, do_compression=packed)
    assert set(read_all(path).columns) == set(columns)
    whole = path.read_bytes()
    for size in (len(whole) - 1, len(whole) // 2):
        path.write_bytes(whole[:size])
        assert "cut short" in refusal(path) or "damaged" in refusal(path)


@pytest.mark.parametrize("kind", ["log", "asc", "trc"])
def test_a_log_that_ends_inside_of_a_line_loses_that_line_and_says_so(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"log.{kind}"
    with can.Logger(str(path)) as writer:
        for k in range(20):
            writer(
                can.Message(
                    timestamp=1.7e9 + 0.01 * k, arbitration_id=5, is_extended_id=False, data=bytes([k] * 8)
                )
            )

    def decode(frame: Frame) -> tuple[str, dict[str, float]]:
        return "drive", {"motor_position_rad": float(frame.data[0])}

    assert open_recording(path, decode=lambda: decode).notes == ()
    whole = path.read_text()
    last = whole.index("13 13 13" if kind != "log" else "131313")
    path.write_text(whole[:last])
    found = read_all(path, decode=lambda: decode)
    assert found.columns["motor_position_rad"].tolist() == list(range(19))
    assert "last line is not whole" in " ".join(found.notes)


def test_a_blf_that_was_cut_says_how_much_of_it_is_there(tmp_path: Path) -> None:
    path = tmp_path / "log.blf"
    with can.Logger(str(path), max_container_size=400) as writer:
        for k in range(200):
            writer(can.Message(timestamp=1.7e9 + 0.01 * k, arbitration_id=5, data=bytes([k] * 8)))

    def decode(frame: can.Message) -> tuple[str, dict[str, float]]:
        return "drive", {"motor_position_rad": float(frame.data[0])}

    whole = path.read_bytes()
    assert read_all(path, decode=lambda: decode).notes == ()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    found = read_all(path, decode=lambda: decode)
    assert 50 < len(found.columns["time_s"]) < 200
    assert f"of {len(whole):,} bytes" in " ".join(found.notes)


def test_what_is_no_recording_is_called_by_its_name(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "book.xlsx", "w") as book:
        book.writestr("[Content_Types].xml", "<Types/>")
    (tmp_path / "octave.mat").write_text("# Created by Octave 8.4.0\n# name: t\n# type: matrix\n 1\n")
    (tmp_path / "rows.json").write_text('{"time_s": [0, 1], "motor_position_rad": [0, 1]}')
    scipy.io.savemat(tmp_path / "old.mat", {"t": TIME, "q": TIME}, format="4")
    (tmp_path / "bag.csv").write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    (tmp_path / "nothing.mat").write_bytes(b"")
    assert refusal(tmp_path / "book.xlsx").endswith("is an Excel workbook; save its sheet as CSV")
    assert "Octave" in refusal(tmp_path / "octave.mat")
    assert "is JSON text" in refusal(tmp_path / "rows.json")
    assert "save -v7" in refusal(tmp_path / "old.mat")
    assert refusal(tmp_path / "bag.csv").endswith("is a ROS bag; rename it to bag.bag")
    assert refusal(tmp_path / "nothing.mat").endswith("is empty; record or export it anew")


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_are_seen_though_the_first_rows_are_whole_numbers(
    separator: str, tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    rows = ["time_s;motor_position_rad;joint_torque_Nm", "0;0;0", "1;0,5;-1,25", "2;1;0"]
    path.write_text("\n".join(rows).replace(";", separator))
    columns = read_all(path).columns
    assert columns["motor_position_rad"].tolist() == [0.0, 0.5, 1.0]
    assert columns["joint_torque_Nm"].tolist() == [0.0, -1.25, 0.0]


def test_commas_between_thousands_are_no_decimal_commas(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time_ms;motor_position_deg\n0;0.5\n1,000;0.7\n")
    assert "line 3: column 'time_ms' holds '1,000'; a number is expected there" in refusal(path)


@pytest.mark.parametrize("line_break", ["\n", "\r\n"])
def test_decimal_commas_inside_quotes_stand_between_commas(line_break: str, tmp_path: Path) -> None:
    """As a spreadsheet of a country with decimal commas writes where commas are asked for between cells (RFC 4180)."""
    path = tmp_path / "log.csv"
    rows = [
        '"time_s","motor_position_rad","joint_torque_Nm"',
        '"0","1",""',
        '"0,5","1,234","-1,25e-1"',
        '1,"2",0',
    ]
    path.write_bytes(line_break.join(rows).encode())
    columns = read_all(path, gaps=True).columns
    assert columns["time_s"].tolist() == [0.0, 0.5, 1.0]
    assert columns["motor_position_rad"].tolist() == [1.0, 1.234, 2.0]
    assert np.array_equal(columns["joint_torque_Nm"], [np.nan, -0.125, 0.0], equal_nan=True)


@pytest.mark.parametrize("row", ['"1,000",0.7', '"1,000","2,345"', '"1,000.5",0.7'])
def test_a_comma_inside_quotes_that_may_divide_thousands_is_refused(row: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(f"time_ms,motor_position_deg\n0,1\n{row}\n")
    assert "line 3: '\"1,000" in refusal(path)
    assert "write a point for the one and nothing for the other" in refusal(path)


@pytest.mark.parametrize("head", ["time_s,motor_position_rad", "time_s,motor_position_rad,"])
@pytest.mark.parametrize("units", ["", "s,rad\n", "s,rad,\n"])
def test_a_separator_behind_every_row_is_no_column(head: str, units: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(f"{head}\n{units}0,1,\n1,2,\n2,3,\n")
    columns = read_all(path).columns
    assert {n: v.tolist() for n, v in columns.items()} == {
        "time_s": [0.0, 1.0, 2.0],
        "motor_position_rad": [1.0, 2.0, 3.0],
    }
    path.write_text(f"{head}\n{units}0,1,\n1,\n2,3,\n")
    line = 3 + bool(units)
    assert f"line {line}: has 1 cell where the header names 2 columns" in refusal(path)


def test_a_last_cell_before_a_separator_may_be_empty(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    for separator in ("\t", ";", ","):
        path.write_text("t,q,y,\n0,1,2,\n1,2,,\n2,3,4,\n".replace(",", separator))
        columns = raw_columns(path).columns
        np.testing.assert_array_equal(columns["y"], [2.0, np.nan, 4.0])
        assert list(columns) == ["t", "q", "y"]


def test_a_last_column_without_a_name_may_be_empty_in_the_first_row(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,q,\n0,1,\n1,2,5\n2,3,4\n")
    np.testing.assert_array_equal(raw_columns(path).columns["(column 3)"], [np.nan, 5.0, 4.0])


def test_bars_stand_between_cells_too(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time_s|motor_position_rad\n0|1\n1|2\n")
    assert read_all(path).columns["motor_position_rad"].tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("time,|F| [N],|M| [Nm]\n0,1,2\n1,2,3\n", ["time", "|F| [N]", "|M| [Nm]"]),
        ("t;|q|;|y|\n0;1;2\n1;2;3\n", ["t", "|q|", "|y|"]),
        ("|t| |q|\n0 1\n1 2\n", ["|t|", "|q|"]),
        ("|t|,|q|,\n0,1,\n1,2,\n", ["|t|", "|q|"]),
        ("t, s;q, rad\n0,5;1,5\n1,5;2,5\n", ["t, s", "q, rad"]),
        ("t|q|y\n0|1|2|\n1|2|3|\n", ["t", "q", "y"]),
    ],
)
def test_what_separates_is_told_by_header_and_row_together(
    text: str, columns: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text)
    found = raw_columns(path).columns
    assert list(found) == columns
    assert all(np.ptp(values) == 1.0 for values in found.values())


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("t,q\n0,1,2\n1,2,3\n", "line 2: has 3 cells where the header names 2 columns"),
        ("t:q\n0:1\n1:2\n", "line 2: column 't:q' holds '0:1'"),
        (
            "t,q\ns,furlong\n0,1\n",
            "line 2: column 't' holds 's'; a number is expected there (of a row of units, ",
        ),
    ],
)
def test_a_file_without_a_column_of_numbers_says_where_and_why(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        raw_columns(path)
    assert f"{path}: no column holds numbers: {says}" in str(caught.value)


def test_remarks_beside_the_arrays_of_npz_are_left_out_and_named(tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    channels = {"time_s": TIME, "motor_position_rad": TIME, "other_k": np.ones((ROWS, 1), order="F")}
    turned = np.asfortranarray(np.ones((ROWS, 2)))
    np.savez(path, **channels, remark="rig 2", names=np.array(["a"]), setup={"kp": 1}, jacobian=turned)  # type: ignore[arg-type]  # stub: `**` may be a flag
    assert list(read_all(path).columns) == list(channels)
    (note,) = open_recording(path).notes
    assert all(f"array {name!r}" in note for name in ("remark", "names", "setup", "jacobian"))
    np.savez(path, **(channels | {"motor_position_rad": np.array(["x"] * ROWS)}))  # type: ignore[arg-type]  # as above
    assert "array 'motor_position_rad' holds <U1, not numbers" in refusal(path)


def test_an_empty_data_set_beside_the_columns_of_hdf5_is_none(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py", reason="h5py is not installed")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["time_s"], file["motor_position_rad"], file["gains"] = TIME, TIME, h5py.Empty("f8")
    assert set(read_all(tmp_path / "log.h5").columns) == {"time_s", "motor_position_rad"}


def test_a_bag_without_its_index_is_told_what_to_give_instead(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    assert "is a directory" in refusal(tmp_path / "bag")
    (tmp_path / "bag/bag_0.db3").write_bytes(b"SQLite format 3\0")
    assert f"give {tmp_path / 'bag/bag_0.db3'}, or run `ros2 bag reindex`" in refusal(tmp_path / "bag")


def test_an_angle_without_a_unit_is_in_degrees_where_the_other_is_and_it_goes_beyond_a_turn() -> None:
    swing = np.sin(TIME)
    far = {
        s.channel: s.source.unit for s in suggest({"t": TIME, "theta_m": 120 * swing, "theta_j": 40 * swing})
    }
    near = {
        s.channel: s.source.unit for s in suggest({"t": TIME, "theta_m": 120 * swing, "theta_j": 0.7 * swing})
    }
    assert (far["motor_position_rad"], far["joint_position_rad"]) == ("deg", "deg")
    assert (near["motor_position_rad"], near["joint_position_rad"]) == ("deg", None)
