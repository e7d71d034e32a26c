"""Output appears whole or not at all; what a live recorder wrote reads back to the bit."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cablecomp.errors import DeviceError, InputError, InternalError
from cablecomp.recording.atomic import atomic_directory
from cablecomp.recording.reader import open_recording, read_all
from cablecomp.recording.recorder import Recorder
from cablecomp.recording.table import Block
from cablecomp.recording.writer import write_canonical

CHANNELS = ("time_s", "joint_torque_Nm", "motor_position_rad", "temperature_degC", "other_x")


def _rows(count: int) -> np.ndarray:
    rows = np.random.default_rng(5).standard_normal((count, len(CHANNELS)))
    rows[:, 0] = np.arange(count) * 1e-3
    rows[::3, 3] = np.nan
    return rows


def _fail_halfway(out: Path) -> None:
    with atomic_directory(out) as folder:
        (folder / "a.txt").write_text("half")
        raise RuntimeError("stop")


def test_a_failure_leaves_nothing_and_a_success_keeps_other_files(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    with pytest.raises(RuntimeError, match="stop"):
        _fail_halfway(out)
    assert list(tmp_path.iterdir()) == []

    with atomic_directory(out) as folder:
        (folder / "a.txt").write_text("1")
        (folder / "sub").mkdir()
        (folder / "sub" / "b.txt").write_text("1")
    (out / "mine.txt").write_text("mine")
    (out / "sub" / "mine.txt").write_text("mine")
    with pytest.raises(RuntimeError, match="stop"):
        _fail_halfway(out)
    with atomic_directory(out) as folder:
        (folder / "sub").mkdir()
        (folder / "sub" / "b.txt").write_text("2")
    found = {str(p.relative_to(out)): p.read_text() for p in out.rglob("*") if p.is_file()}
    assert found == {"a.txt": "1", "mine.txt": "mine", "sub/b.txt": "2", "sub/mine.txt": "mine"}
    assert [p.name for p in out.parent.iterdir()] == ["out"]


def test_what_is_not_written_anew_goes_where_it_belongs_to_what_is(tmp_path: Path) -> None:
    """The experiment that an earlier diagnosis proposed is none of a later one that proposes none."""
    out = tmp_path / "out"
    for proposed in ("first", None, "third"):
        with atomic_directory(out, ("proposed",)) as folder:
            (folder / "answer").write_text("")
            if proposed:
                (folder / "proposed").write_text(proposed)
        found = (out / "proposed").read_text() if (out / "proposed").exists() else None
        assert found == proposed
    with pytest.raises(RuntimeError, match="stop"), atomic_directory(out, ("proposed",)):
        raise RuntimeError("stop")
    assert (out / "proposed").read_text() == "third"


def test_an_output_that_cannot_be_made_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(InputError, match="is a file; --out takes a directory"),
        atomic_directory(tmp_path / "file"),
    ):
        pass
    with (
        pytest.raises(InputError, match=r"below/out: \S+/file is a file; --out takes a directory"),
        atomic_directory(tmp_path / "file" / "below" / "out"),
    ):
        pass
    with pytest.raises(InputError, match="cannot be written"):
        write_canonical(tmp_path / "none" / "a.csv", {"time_s": np.zeros(1)})


@pytest.mark.parametrize("count", [1, 99, 100, 1001])
def test_a_recording_made_live_reads_back_to_the_bit(count: int, tmp_path: Path) -> None:
    rows = _rows(count)
    with Recorder(tmp_path / "live.csv", CHANNELS, rows_per_write=100) as recorder:
        for row in rows:
            recorder.append(tuple(row))
        assert recorder.rows == count
    table = read_all(tmp_path / "live.csv")
    assert table.channels == (
        "time_s",
        "motor_position_rad",
        "joint_torque_Nm",
        "temperature_degC",
        "other_x",
    )
    for k, name in enumerate(CHANNELS):
        assert table.columns[name].tobytes() == np.ascontiguousarray(rows[:, k]).tobytes()


def test_a_program_that_dies_of_an_exception_leaves_every_row(tmp_path: Path) -> None:
    program = (
        "from cablecomp.recording.recorder import Recorder\n"
        f"recorder = Recorder({str(tmp_path / 'live.csv')!r}, ['time_s', 'other_x'], rows_per_write=1000)\n"
        "for k in range(2500):\n"
        "    recorder.append((k * 1e-3, 0.1 * k))\n"
        "raise RuntimeError('unexpected')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert "unexpected" in done.stderr
    table = read_all(tmp_path / "live.csv")
    assert np.array_equal(table.columns["other_x"], 0.1 * np.arange(2500))


def test_a_recorder_refuses_what_is_not_canonical_and_a_place_it_cannot_write(tmp_path: Path) -> None:
    with pytest.raises(InternalError, match="'time_ms' must be written as 'time_s'"):
        Recorder(tmp_path / "a.csv", ["time_ms"])
    with pytest.raises(InternalError, match="time_s"):
        Recorder(tmp_path / "a.csv", ["other_x"])
    with pytest.raises(DeviceError, match="cannot be written"):
        Recorder(tmp_path / "none" / "a.csv", ["time_s"])
    assert list(tmp_path.iterdir()) == []


def test_mcap_is_read_back_as_written(tmp_path: Path) -> None:
    pytest.importorskip("mcap", reason="optional package mcap is not installed")
    from cablecomp.recording.mcap_writer import write_mcap

    rows = _rows(40_000)
    columns = {name: np.ascontiguousarray(rows[:, k]) for k, name in enumerate(CHANNELS)}
    write_mcap(tmp_path / "a.mcap", [Block(1, columns, 1.0)])
    recording = open_recording(tmp_path / "a.mcap")
    blocks = list(recording.blocks(10_000))
    assert [block.first_line for block in blocks] == [1, 10_001, 20_001, 30_001]
    for name, written in columns.items():
        assert np.concatenate([b.columns[name] for b in blocks]).tobytes() == written.tobytes()
    whole = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="MCAP"):
        read_all(tmp_path / "cut.mcap")


def test_mcap_topics_of_single_values_become_channels(tmp_path: Path) -> None:
    writer_module = pytest.importorskip("mcap.writer", reason="optional package mcap is not installed")
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = writer_module.Writer(stream)
        writer.start()
        schema = writer.register_schema("s", "jsonschema", b"{}")
        topics = {
            name: writer.register_channel(f"/rig/{name}", "json", schema)
            for name in ("motor_position_deg", "joint_torque_mNm", "status")
        }
        for k in range(3):
            stamp = 10**18 + k * 10**7
            for name, text in (
                ("motor_position_deg", f'{{"value": {90 * k}}}'),
                ("joint_torque_mNm", f'{{"data": {k}}}'),
                ("status", '{"text": "fine"}'),
            ):
                writer.add_message(topics[name], stamp, text.encode(), stamp)
        writer.finish()
    table = read_all(tmp_path / "a.mcap")
    assert table.columns["time_s"] == pytest.approx([0.0, 0.01, 0.02])
    assert table.columns["motor_position_rad"] == pytest.approx([0.0, np.pi / 2, np.pi])
    assert table.columns["joint_torque_Nm"] == pytest.approx([0.0, 1e-3, 2e-3])
