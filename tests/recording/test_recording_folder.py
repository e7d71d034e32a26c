"""What in a folder is a recording."""

from __future__ import annotations

from pathlib import Path

import pytest

from cablecomp.errors import InputError
from cablecomp.recording.folder import find_recordings


def test_what_a_run_wrote_beside_its_recording_is_none(tmp_path: Path) -> None:
    """A run's folder may be given whole, also inside of another one; a file that is named is taken as it is."""
    night = tmp_path / "night"
    night.mkdir()
    for name in (
        "recording.csv",
        "prediction.csv",
        "cycles.csv",
        "run.json",
        "joint.toml",
        ".recording.csv.part",
    ):
        (night / name).touch()
    (tmp_path / "own.parquet").touch()
    assert find_recordings([tmp_path]) == [night / "recording.csv", tmp_path / "own.parquet"]
    assert find_recordings([night / "cycles.csv"]) == [night / "cycles.csv"]


def test_a_recording_is_found_once_whatever_path_or_link_leads_to_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    night = tmp_path / "night"
    night.mkdir()
    (night / "a.csv").touch()
    (night / "b.csv").touch()
    (tmp_path / "link.csv").symlink_to(night / "a.csv")
    (tmp_path / "again").symlink_to(night)
    monkeypatch.chdir(tmp_path)
    given = [
        Path("night/a.csv"),
        night / "a.csv",
        Path("link.csv"),
        Path("night/../night/a.csv"),
        Path("again"),
    ]
    assert find_recordings(given) == [Path("night/a.csv"), Path("again/b.csv")]


def test_a_folder_without_recordings_is_refused(tmp_path: Path) -> None:
    (tmp_path / "prediction.csv").touch()
    with pytest.raises(InputError, match="holds no recording"):
        find_recordings([tmp_path])
