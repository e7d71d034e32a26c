"""What is written is read back to the bit, in every accepted form, whole or in blocks."""

from __future__ import annotations

import gzip
import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cablecomp.errors import InputError
from cablecomp.recording.reader import open_recording, read_all
from cablecomp.recording.table import RemarkLog
from cablecomp.recording.writer import write_canonical

TEXT = "# made by hand\ntime_s,motor_position_rad,joint_torque_Nm\n0,0.1,-1\n0.5,0.25,2e-3\n0.75,-0.3,3\n"
ROWS = {
    "time_s": [0.0, 0.5, 0.75],
    "motor_position_rad": [0.1, 0.25, -0.3],
    "joint_torque_Nm": [-1.0, 2e-3, 3.0],
}


def _same(path: Path) -> None:
    table = read_all(path)
    assert {name: list(values) for name, values in table.columns.items()} == ROWS


@pytest.mark.parametrize(
    "content",
    [
        TEXT.encode(),
        TEXT.replace("\n", "\r\n").encode(),
        TEXT.replace("\n", "\r").encode(),
        b"\xef\xbb\xbf" + TEXT.encode(),
        TEXT.replace(",", ";").encode(),
        TEXT.replace(",", "\t").encode(),
        TEXT.replace(",", ";").replace(".", ",").encode(),
        TEXT.replace(",", ", ").encode(),
        TEXT.replace("0.25", '"0.25"').replace("time_s", '"time_s"').encode(),
        TEXT.rstrip("\n").encode(),
        (TEXT + "\n\r\n\n").encode(),
        ("\n# more\n\n" + TEXT).encode(),
        TEXT.replace(",", " ").encode(),
        TEXT.replace(",", "   ").replace("\n0", "\n  0").encode(),
        TEXT.replace("time_s", "# time_s").encode(),
        ("Logger v1.2\nserial: 123\n\n" + TEXT).encode(),
        ("Logger,1.2\nchannels;a;b;c;d\n" + TEXT).encode(),
        ("Operator,Ann,\nSerial,123,\n" + TEXT).encode(),
        ("time of day,operator,rig\n" + TEXT).encode(),
        ("Logger v1.2\n" + TEXT.replace("Nm\n", "Nm\ns,rad,Nm\n")).encode(),
        ("Operator,Ann,\n" + TEXT.replace("Nm\n", "Nm\ns,rad,Nm\n")).encode(),
    ],
    ids=["plain", "crlf", "cr", "bom", "semicolon", "tab", "comma decimals", "blanks", "quotes", "no end",
         "blank end", "blank head", "only blanks", "aligned", "names as a comment", "preamble", "table before",
         "preamble filled up", "preamble like names", "preamble and units", "filled up and units"],
)  # fmt: skip
@pytest.mark.parametrize("ending", [".csv", ".csv.gz", ".txt", ".parquet"])
def test_csv_dialects_and_wrong_endings_read_the_same(content: bytes, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{ending}"
    path.write_bytes(content)
    _same(path)
    path.write_bytes(gzip.compress(content[:40]) + gzip.compress(content[40:]))
    _same(path)


@pytest.mark.parametrize("row", ["warming,up,now", "warming,,", "ERR,ERR,ERR", ",0.25,1"])
def test_words_in_the_first_row_are_no_names(row: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(TEXT.replace("Nm\n", f"Nm\n{row}\n"))
    with pytest.raises(InputError, match="line 3: column 'time_s' "):
        read_all(path)


def test_a_block_knows_its_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(TEXT)
    blocks = list(open_recording(path).blocks(rows=2))
    assert [(block.first_line, block.rows) for block in blocks] == [(3, 2), (5, 1)]
    assert blocks[-1].fraction == 1.0
    assert open_recording(path).comments == ("made by hand",)


finite = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=60, deadline=None)
@given(values=st.lists(st.tuples(finite, finite), min_size=1, max_size=40), packed=st.booleans())
def test_every_finite_float_survives_writing_and_reading(
    values: list[tuple[float, float]], packed: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("bits") / ("a.csv.gz" if packed else "a.csv")
    array = np.array(values)
    columns = {
        "time_s": np.sort(array[:, 0]),
        "joint_torque_Nm": array[:, 1].copy(),
        "other_x": array[::-1, 1].copy(),
    }
    write_canonical(path, columns)
    table = read_all(path)
    for name, written in columns.items():
        assert table.columns[name].tobytes() == written.tobytes()


def test_block_size_changes_nothing(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    path = tmp_path / "a.csv"
    time = np.cumsum(rng.uniform(0.5, 1.5, 5000))
    write_canonical(path, {"time_s": time, "joint_torque_Nm": rng.standard_normal(5000)})
    recording = open_recording(path)
    for rows in (1, 7, 4999, 5000, 10**6):
        joined = np.concatenate([block.columns["joint_torque_Nm"] for block in recording.blocks(rows)])
        assert joined.tobytes() == read_all(path).columns["joint_torque_Nm"].tobytes()
        lines = [block.first_line for block in recording.blocks(rows)]
        assert lines == list(range(2, 5002, rows))


def test_gaps_repeats_and_empty_optional_cells_are_remarked_with_their_line(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    time = np.arange(200) * 0.01
    time[100:] += 3.0
    time[151] = time[150]
    lines = [f"{t:.9f},{'' if k in (20, 21) else k}" for k, t in enumerate(time)]
    path.write_text("time_s,other_x\n" + "\n".join(lines))
    for rows in (65536, 30):
        log = RemarkLog()
        for block in open_recording(path).blocks(rows):
            log.add(block.remarks)
        notes = "; ".join(log.notes())
        assert [(gap.line, round(gap.size, 6)) for gap in log.gaps] == [(102, 3.01)]
        assert "1 gap in time, at line 102 (3.01 s)" in notes
        assert "1 row with the time stamp of the row before, first at line 153" in notes
        assert "other_x is empty in 2 rows, first at line 22" in notes
        assert "line 201 does not end with a line break" in notes


@pytest.mark.parametrize(("step_s", "gaps"), [(0.099, []), (0.101, [52])])
def test_a_gap_is_longer_than_ten_usual_steps(tmp_path: Path, step_s: float, gaps: list[int]) -> None:
    time = 0.01 * np.arange(100)
    time[50:] += step_s - 0.01
    write_canonical(tmp_path / "a.csv", {"time_s": time, "other_x": time})
    log = RemarkLog()
    for block in open_recording(tmp_path / "a.csv").blocks():
        log.add(block.remarks)
    assert [gap.line for gap in log.gaps] == gaps


def test_a_long_recording_streams_in_bounded_memory(tmp_path: Path) -> None:
    path = tmp_path / "long.csv.gz"
    rows = 3_000_000
    row = b"%d,0.125,-3.5,1e-3,0.25,77\n"
    with gzip.open(path, "wb", 1) as file:
        file.write(b"time_ms,motor_position_rad,joint_torque_Nm,other_a,other_b,other_c\n")
        for start in range(0, rows, 100_000):
            file.write(b"".join(row % k for k in range(start, start + 100_000)))
    tracemalloc.start()
    total = sum(block.rows for block in open_recording(path).blocks())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert total == rows
    assert peak < 60e6  # the table itself would take 144 MB


def test_missing_channel_says_what_was_found(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(TEXT)
    with pytest.raises(
        InputError, match="has no column joint_position_rad, needed for x; found: time_s, motor"
    ):
        open_recording(path).require(["joint_position_rad"], "for x")


def _real() -> Path:
    root = os.environ.get("CABLECOMP_RECORDINGS")
    if not root or not Path(root).is_dir():
        pytest.skip("CABLECOMP_RECORDINGS does not name a directory of recordings measured on hardware")
    return Path(root)


def test_recordings_of_the_surgical_jaw_are_read_whole() -> None:
    files = sorted((_real() / "davinci-jaw").glob("*/*.csv.gz"))
    assert len(files) == 57
    for path in files[::8]:
        table = read_all(path)
        assert {"motor_position_rad", "joint_position_rad", "joint_torque_Nm", "motor_torque_Nm"} <= set(
            table.channels
        )
        text = gzip.decompress(path.read_bytes())
        assert table.rows == sum(not line.startswith(b"#") for line in text.splitlines()) - 1
        assert 19.0 < table.columns["time_s"][-1] - table.columns["time_s"][0] < 21.0


def test_recordings_of_the_sheathed_tendon_are_read_whole() -> None:
    files = sorted((_real() / "tendon-sheath").glob("*.csv.gz"))
    assert len(files) == 5
    for path in files:
        table = read_all(path)
        angle = np.deg2rad(float(path.name.removesuffix(".csv.gz").split("_")[1]))
        assert np.allclose(table.columns["other_sheath_angle_rad"], angle, atol=1e-6)
        assert table.rows > 500
