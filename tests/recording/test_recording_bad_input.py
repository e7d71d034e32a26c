"""Every malformed recording ends in one line that names the place, what was found and what is accepted."""

from __future__ import annotations

import gzip
import io
import os
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from cablecomp.errors import InputError
from cablecomp.recording.reader import read_all

GOOD = b"time_s,motor_position_rad,joint_torque_Nm\n0,0.1,1\n1,0.2,2\n2,0.3,3\n"


def _npz(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def _parquet(**arrays: object) -> bytes:
    buffer = io.BytesIO()
    pl.DataFrame(arrays).write_parquet(buffer)
    return buffer.getvalue()


def _replaced(old: bytes, new: bytes) -> bytes:
    assert old in GOOD
    return GOOD.replace(old, new)


LONG = b"time_s,motor_position_rad\n" + b"".join(b"%d,%d.5\n" % (k, k * k % 97) for k in range(9000))
PACKED = gzip.compress(LONG)

CASES: dict[str, tuple[str, bytes, tuple[str, ...]]] = {
    # name: (file name, content, what the one line must say)
    "empty file": ("a.csv", b"", ("is empty", "record or export it")),
    "empty gzip": ("a.csv.gz", gzip.compress(b""), ("gzip of an empty file",)),
    "only line breaks": ("a.csv", b"\n\n\n", ("no header line",)),
    "only comments": ("a.csv", b"# one\n# two\n", ("no header line",)),
    "header only": ("a.csv", b"time_s,motor_position_rad\n", ("no rows",)),
    "header only, cut": ("a.csv", b"time_s,motor_posi", ("line 1", "'motor_posi'", "'motor_position_")),
    "no header": ("a.csv", b"# x\n0,1,2\n1,2,3\n", ("line 2", "column names are expected")),
    "unknown column": ("a.csv", _replaced(b"joint_torque_Nm", b"load"), ("'load'", "other_<name>")),
    "misspelt column": (
        "a.csv",
        _replaced(b"joint_torque_Nm", b"joint_torqe_Nm"),
        ("'joint_torqe_Nm'", "did you mean 'joint_torque_Nm'"),
    ),
    "unknown unit": (
        "a.csv",
        _replaced(b"_Nm", b"_Nmmm"),
        ("line 1", "'joint_torque_Nmmm'", "'Nmmm'", "_Nm, _mNm", "did you mean 'joint_torque_Nmm'"),
    ),
    "unit of another quantity": ("a.csv", _replaced(b"_rad", b"_Nm"), ("'Nm'", "motor_position", "_rad")),
    "no unit": ("a.csv", _replaced(b"_rad", b""), ("'motor_position'", "no unit", "_rad")),
    "bare other_": ("a.csv", _replaced(b"joint_torque_Nm", b"other_"), ("other_<name>",)),
    "nameless column": ("a.csv", _replaced(b"joint_torque_Nm", b""), ("column 3 has no name",)),
    "same column twice": ("a.csv", _replaced(b"joint_torque_Nm", b"time_s"), ("'time_s' occurs twice",)),
    "same channel in two units": (
        "a.csv",
        _replaced(b"joint_torque_Nm", b"time_ms"),
        ("'time_s' and 'time_ms'", "same channel"),
    ),
    "no time": ("a.csv", _replaced(b"time_s", b"other_t"), ("has no column time_s", "found: other_t")),
    "row too short": ("a.csv", _replaced(b"1,0.2,2", b"1,0.2"), ("line 3", "2 cell", "3 columns")),
    "row too long": ("a.csv", _replaced(b"1,0.2,2", b"1,0.2,2,9"), ("line 3", "4 cell", "3 columns")),
    "short and long rows that balance": (
        "a.csv",
        _replaced(b"1,0.2,2\n2,0.3,3", b"1,0.2\n2,0.3,3,4"),
        ("line 3", "2 cell"),
    ),
    "empty cell": ("a.csv", _replaced(b"1,0.2,2", b"1,,2"), ("line 3", "'motor_position_rad' is empty")),
    "NaN": ("a.csv", _replaced(b"0.2,2", b"0.2,nan"), ("line 3", "'joint_torque_Nm' holds 'nan'")),
    "infinite": ("a.csv", _replaced(b"0.2,2", b"0.2,-inf"), ("line 3", "'joint_torque_Nm' holds '-inf'")),
    "too large": ("a.csv", _replaced(b"0.2,2", b"0.2,1e999"), ("line 3", "'joint_torque_Nm' holds '1e999'")),
    "infinite in an optional channel": (
        "a.csv",
        b"time_s,other_x\n0,1\n1,inf\n",
        ("line 3", "'other_x' holds 'inf'"),
    ),
    "text": ("a.csv", _replaced(b"0.3", b"abc"), ("line 4", "'motor_position_rad' holds 'abc'", "number")),
    "thousands separator": ("a.csv", _replaced(b"0.3", b"1_0"), ("line 4", "'1_0'")),
    "row of other units": ("a.csv", _replaced(b"\n0,", b"\nms,rad,Nm\n0,"), ("'time_s'", "unit 'ms'")),
    "row of no units": (
        "a.csv",
        _replaced(b"\n0,", b"\ns,rad,furlong\n0,"),
        ("line 2", "'time_s' holds 's'", "of a row of units, 'furlong' is not known"),
    ),
    "a date that is none": (
        "a.csv",
        b"time_s,other_x\n2024-02-28 10:00:00,1\n2024-02-31 10:00:01,1\n",
        ("line 3", "'2024-02-31 10:00:01'"),
    ),
    "blank line inside": ("a.csv", _replaced(b"\n1,", b"\n\n1,"), ("line 3", "is empty")),
    "comment below the head": ("a.csv", _replaced(b"\n1,", b"\n# note\n1,"), ("line 3", "1 cell")),
    "time backwards": (
        "a.csv",
        _replaced(b"2,0.3", b"0.5,0.3"),
        ("line 4", "backwards", "from 1 s to 0.5 s"),
    ),
    "last line cut": ("a.csv", GOOD[:-3], ("line 4", "2 cell", "cut short")),
    "last number cut": ("a.csv", GOOD[:-2] + b"1e", ("line 4", "'1e'", "cut short")),
    "gzip cut": ("a.csv.gz", PACKED[: len(PACKED) // 2], ("line ", "ends early")),
    "gzip cut in its head": ("a.csv.gz", PACKED[:8], ("ends early",)),
    "gzip damaged": ("a.csv.gz", PACKED[:9000] + b"\xff" * 400 + PACKED[9400:], ("damaged",)),
    "gzip of binary": ("a.csv.gz", gzip.compress(b"\0\1\2" * 99), ("gzip of binary data",)),
    "gzip of Parquet": ("a.csv.gz", gzip.compress(_parquet(time_s=[0.0])), ("gzip of parquet", "unpack")),
    "binary named csv": ("a.csv", bytes(range(256)) * 9, ("binary data", "named .csv", "CSV")),
    "xz": ("a.csv", b"\xfd7zXZ\x00" + b"x" * 50, ("xz-compressed", "convert")),
    "HDF5 named csv": ("a.csv", b"\x89HDF\r\n\x1a\n" + b"\0" * 50, ("HDF5",)),
    "UTF-16": ("a.csv", GOOD.decode().encode("utf-16"), ("UTF-16", "convert")),
    "binary in the middle": ("a.csv", LONG + b"\x80\x81\0\n", ("line 9002", "1 cell")),
    "cut Parquet": ("a.parquet", _parquet(time_s=[0.0, 1.0])[:-20], ("Parquet", "export")),
    "text in Parquet": ("a.parquet", _parquet(time_s=["a"]), ("'time_s' holds String",)),
    "null in Parquet": (
        "a.parquet",
        _parquet(time_s=[0.0, 1.0], motor_position_rad=[0.0, None]),
        ("row 2", "'motor_position_rad' is empty"),
    ),
    "cut npz": ("a.npz", _npz(time_s=np.arange(3.0))[:-30], (".npz",)),
    "npz of unequal lengths": ("a.npz", _npz(time_s=np.arange(3.0), other_x=np.arange(2.0)), ("'other_x'",)),
    "npz of text": ("a.npz", _npz(time_s=np.array(["x"])), (".npz",)),
    "cut MCAP": ("a.mcap", b"\x89MCAP0\r\n" + b"\1", ("MCAP",)),
}


@pytest.mark.parametrize("case", CASES)
def test_malformed_recording_gives_one_clear_line(case: str, tmp_path: Path) -> None:
    name, content, expected = CASES[case]
    if name.endswith(".mcap"):
        pytest.importorskip("mcap", reason="optional package mcap is not installed")
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_all(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{path}: ")
    for part in expected:
        assert part in message


def test_missing_file_and_directory_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read_all(tmp_path / "none.csv")
    with pytest.raises(InputError, match="is a directory"):
        read_all(tmp_path)


def test_a_pipe_is_told_that_a_file_is_needed(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(
        InputError, match=f"{path}: is a pipe or a device; write what comes from it to a file"
    ):
        read_all(path)


@pytest.mark.parametrize("row", [0, 1, 70_000, 299_999])
def test_the_line_is_right_however_long_the_file(row: int, tmp_path: Path) -> None:
    lines = [f"{k},{k}.25" for k in range(300_000)]
    lines[row] = f"{row},x"
    path = tmp_path / "long.csv"
    path.write_text("# comment\ntime_ms,other_x\n" + "\n".join(lines) + "\n")
    with pytest.raises(InputError, match=f"line {row + 3}: column 'other_x' holds 'x'"):
        read_all(path)


def test_time_backwards_between_blocks_is_found(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    count = 2_000_000  # well above one chunk of the reader
    times = np.arange(count)
    times[1_500_000:] -= 10
    pl.DataFrame({"time_ms": times}).write_csv(path)
    with pytest.raises(InputError, match="line 1500002: time runs backwards"):
        read_all(path)
