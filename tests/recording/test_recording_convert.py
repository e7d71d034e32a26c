"""Converted recordings keep every bit, open elsewhere, and say what became of them; MATLAB's files are read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from flipped_bits import same_or_refused
from springy_joint import joint

from cablecomp.cli.app import main
from cablecomp.errors import InputError
from cablecomp.examples import example
from cablecomp.recording.mapping import mapping_from
from cablecomp.recording.reader import open_recording, read_all


@pytest.mark.parametrize("ending", [".csv", ".csv.gz", ".parquet", ".npz", ".mcap"])
def test_convert_keeps_every_bit(ending: str, tmp_path: Path) -> None:
    if ending == ".mcap":
        pytest.importorskip("mcap", reason="optional package mcap is not installed")
    pl.DataFrame(joint(3000)).write_csv(tmp_path / "a.csv")
    assert main(["convert", str(tmp_path / "a.csv"), str(tmp_path / f"b{ending}")]) == 0
    expected, found = (read_all(tmp_path / name).columns for name in ("a.csv", f"b{ending}"))
    assert {n: v.tobytes() for n, v in found.items()} == {n: v.tobytes() for n, v in expected.items()}
    assert (
        main(["convert", str(tmp_path / "a.csv"), str(tmp_path / f"c{ending}"), "--from", "1", "--to", "1.5"])
        == 0
    )
    time = read_all(tmp_path / f"c{ending}").columns["time_s"]
    assert (time[0], time[-1], len(time)) == (1.0, 1.5, 501)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(["a.csv", f"b{ending}", f"c{ending}"])


@pytest.mark.parametrize("ending", [".parquet", ".npz", ".csv.gz"])
def test_no_flipped_bit_in_what_we_write_changes_what_is_read(
    ending: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """And where the file is refused, the words are ours alone: no library prints its own beside them."""
    pl.DataFrame(joint(300)).write_csv(tmp_path / "a.csv")
    path = tmp_path / f"b{ending}"
    assert main(["convert", str(tmp_path / "a.csv"), str(path)]) == 0
    capfd.readouterr()
    same_or_refused(path, path.read_bytes(), 7)
    assert capfd.readouterr().err == ""


def test_parquet_without_checksums_says_so(tmp_path: Path) -> None:
    pl.DataFrame(joint(300)).write_parquet(tmp_path / "a.parquet")
    assert any("no checksums" in note for note in open_recording(tmp_path / "a.parquet").notes)


def test_what_is_written_opens_in_pandas_and_polars_with_their_defaults(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas", reason="optional package pandas is not installed")
    from cablecomp.recording.recorder import Recorder

    rows = np.random.default_rng(5).standard_normal((3000, 4))
    rows[:, 0] = np.arange(3000) * 1e-3
    rows[:2500, 2] = np.nan  # a temperature that comes late
    names = ("time_s", "motor_position_rad", "temperature_degC", "other_x")
    with Recorder(tmp_path / "recording.csv", names) as recorder:
        for row in rows:
            recorder.append(tuple(row))
    for frame in (pandas.read_csv(tmp_path / "recording.csv"), pl.read_csv(tmp_path / "recording.csv")):
        assert tuple(frame.columns) == names
        for k, name in enumerate(names):
            assert "float" in str(frame[name].dtype).lower()
            np.testing.assert_array_equal(np.asarray(frame[name].to_numpy(), dtype=np.float64), rows[:, k])


def test_a_matlab_structure_is_answered_with_what_to_save_in_its_place(tmp_path: Path) -> None:
    import scipy.io

    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"bench": {"time": np.arange(9.0), "torque": np.arange(9.0)}, "rate": 50.0})
    with pytest.raises(InputError, match=r"structures \(bench\).*'-struct', 'bench'"):
        open_recording(path)


def test_matlab_files_of_both_kinds_read_alike(tmp_path: Path) -> None:
    import scipy.io

    true = joint(400)
    table = np.column_stack([true["motor_position_rad"], true["joint_position_rad"]])
    scipy.io.savemat(tmp_path / "a.mat", {"time_s": true["time_s"], "angles": table, "rate": 1000.0})
    files = [tmp_path / "a.mat"]
    try:
        import h5py
    except ImportError:
        pass
    else:  # as MATLAB lays it down: turned over, behind a head of 512 bytes
        with h5py.File(tmp_path / "b.mat", "w", userblock_size=512) as file:
            for name, values in (
                ("time_s", true["time_s"][None, :]),
                ("angles", table.T),
                ("rate", [[1000.0]]),
            ):
                file.create_dataset(name, data=values, chunks=None).attrs["MATLAB_class"] = np.bytes_(
                    "double"
                )
        head = bytearray((tmp_path / "b.mat").read_bytes())
        head[:19] = b"MATLAB 7.3 MAT-file"
        (tmp_path / "b.mat").write_bytes(head)
        files.append(tmp_path / "b.mat")
    for path in files:
        columns = read_all(
            path, mapping_from(["motor_position_rad=angles[0]", "joint_position_rad=angles[1]"])
        ).columns
        for name in ("time_s", "motor_position_rad", "joint_position_rad"):
            assert columns[name].tobytes() == true[name].tobytes(), path


def test_a_file_is_no_folder_to_write_into(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "a.csv"
    log.write_text("time_s,motor_position_rad\n0,0\n1,1\n")
    for ending in ("csv", "parquet"):
        assert main(["convert", str(log), str(log / f"x.{ending}")]) == 2
        said = capsys.readouterr().err
        assert said == (
            f"cablecomp: {log / f'x.{ending}'}: cannot be written (Not a directory); choose another place\n"
        )


def test_a_recording_is_not_written_over_by_what_it_is_converted_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, link = tmp_path / "a.csv", tmp_path / "b.csv"
    pl.DataFrame(joint(10)).write_csv(log)
    link.symlink_to(log)
    before = log.read_bytes()
    for to in (log, link):
        assert main(["convert", str(log), str(to), "--from", "0.005"]) == 2
        assert f"{to}: is the recording itself, which stays as it is; give another" in capsys.readouterr().err
    assert log.read_bytes() == before
    assert link.is_symlink()


def test_what_a_converted_recording_lacks_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, to = tmp_path / "a.csv", tmp_path / "b.csv"
    pl.DataFrame({"t": [0.0, 0.1, 0.2], "joint angle": [0.0, 0.1, 0.0]}).write_csv(log)
    assert main(["convert", str(log), str(to), "--map", "auto", "--json"]) == 0
    assert "missing: motor_position_rad, joint_torque_Nm; which columns are they?" in capsys.readouterr().err
    pl.DataFrame(joint(10)).write_csv(log)
    assert main(["convert", str(log), str(to)]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("load", "says"),
    [
        (
            "motor_torque",
            "missing: motor_torque_Nm; which columns are they? "
            "(the current's: --map 'motor_torque_Nm=COLUMN,torque_constant_Nm_per_A=..')",
        ),
        (
            "joint_torque",
            "missing: joint_torque_Nm; which columns are they? "
            "(a force's, at a radius in m: --map 'joint_torque_Nm=COLUMN,scale=RADIUS')",
        ),
        ("both_encoders", ""),
        ("none", ""),
    ],
)
def test_missing_is_what_the_joint_takes_its_load_from(
    load: str, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, config = tmp_path / "a.csv", tmp_path / "joint.toml"
    config.write_text(
        f"{example('joints', 'wrist-capstan').read_text('utf-8')}\n[observer]\nload = '{load}'\n", "utf-8"
    )
    columns = {n: joint(10)[n] for n in ("time_s", "motor_position_rad", "joint_position_rad")}
    columns["motor_current_A"] = joint(10)["motor_torque_Nm"]
    pl.DataFrame(columns).write_csv(log)
    assert main(["inspect", str(log), "--config", str(config)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert says in shown
    assert says or "missing:" not in shown
    assert main(["convert", str(log), str(tmp_path / "b.csv"), "--config", str(config)]) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert says in said
    assert says or "missing:" not in said


def test_a_load_cells_force_becomes_the_torque_that_is_said_to_be_missing(tmp_path: Path) -> None:
    """20 mm from the axis, pulling against the angle."""
    log, to = tmp_path / "a.csv", tmp_path / "b.csv"
    columns = {n: joint(10)[n] for n in ("time_s", "motor_position_rad", "joint_position_rad")}
    columns["load_cell_N"] = np.linspace(15.0, 25.0, 10)
    pl.DataFrame(columns).write_csv(log)
    assert (
        main(
            [
                "convert",
                str(log),
                str(to),
                "--map",
                "auto",
                "--map",
                "joint_torque_Nm=load_cell_N,scale=-0.02",
            ]
        )
        == 0
    )
    np.testing.assert_allclose(pl.read_csv(to)["joint_torque_Nm"], np.linspace(-0.3, -0.5, 10), rtol=1e-12)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--late", "time_s=0.04"], "--late time_s=0.04: time_s is the clock"),
        (["--late", "joint_torque_Nm=nan"], "--late joint_torque_Nm=nan: CHANNEL=SECONDS is accepted"),
        (["--late", "joint_torque_Nm=inf"], "--late joint_torque_Nm=inf: CHANNEL=SECONDS is accepted"),
        (
            ["--late", "nope=0.04"],
            "a.csv: has no column nope, needed as --late sets it right; found: time_s, ",
        ),
        (["--late", "joint_torque_Nm="], "--late joint_torque_Nm=: CHANNEL=SECONDS is accepted"),
        (
            ["--late", "joint_torque_Nm=1e9"],
            "a.csv: lasts 0.009 s, of which --late joint_torque_Nm=1e+09 leaves no",
        ),
        (
            ["--late", "joint_torque_Nm=0.1", "--late", "joint_torque_Nm=0.2"],
            "--late: joint_torque_Nm is given twice; give it once",
        ),
        (["--from", "nan"], "--from nan --to inf: a time, and none before it, in seconds"),
        (["--to", "nan"], "--from -inf --to nan: a time"),
        (["--from", "2", "--to", "1"], "--from 2 --to 1: a time"),
    ],
)
def test_a_time_that_cannot_be_is_refused_by_its_option(
    words: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pl.DataFrame(joint(10)).write_csv(tmp_path / "a.csv")
    assert main(["convert", str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), *words]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert says in said
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--link", "wrist-virtual"], "a.csv: is no CAN log, which --link, --dbc and --joint are for"),
        (["--joint", "foo"], "--joint says which joint of a link file"),
    ],
)
@pytest.mark.parametrize("command", ["convert", "inspect", "calibrate", "identify"])
def test_what_frames_of_a_bus_mean_is_said_of_no_other_file(
    command: str, words: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pl.DataFrame(joint(10)).write_csv(tmp_path / "a.csv")
    given = {"convert": [str(tmp_path / "b.csv")], "inspect": []}.get(command, ["--config", "wrist-capstan"])
    words = [str(example("links", w)) if w == "wrist-virtual" else w for w in words]
    assert main([command, str(tmp_path / "a.csv"), *given, *words]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert says in said
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
