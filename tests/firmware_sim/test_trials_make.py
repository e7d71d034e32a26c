"""Trials with their truth beside them: the same whatever else is made, and true to what they say."""

from __future__ import annotations

import csv
import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from firmware_sim.trials.make import main, make
from firmware_sim.trials.order import Wanted


def _read(path: Path) -> dict[str, np.ndarray]:
    with gzip.open(path, "rt") as text:
        rows = list(csv.reader(text))
    return {name: np.array([float(r[k]) for r in rows[1:]]) for k, name in enumerate(rows[0])}


def test_a_trial_depends_on_its_number_and_not_on_how_many_are_made(tmp_path: Path) -> None:
    wanted = Wanted(5, ("single", "none"), "catalogue", "none")
    make(wanted, 2, tmp_path / "both")
    make(wanted, 1, tmp_path / "second", first=1)
    files = sorted(p for p in (tmp_path / "second" / "00001").rglob("*") if p.is_file())
    assert len(files) >= 4
    for path in files:
        other = tmp_path / "both" / path.relative_to(tmp_path / "second")
        assert path.read_bytes() == other.read_bytes(), path.name


def test_the_truth_stands_beside_the_recordings_it_belongs_to(tmp_path: Path) -> None:
    make(Wanted(5, ("single",), "catalogue", "none"), 1, tmp_path)
    folder = tmp_path / "00000"
    truth = json.loads((folder / "truth.json").read_text())
    angles = np.load(folder / "truth.npz")
    for k, entry in enumerate(truth["recordings"], start=1):
        seen = _read(folder / entry["file"])
        assert len(seen["time_s"]) == entry["samples"] == len(angles[f"joint_rad_{k}"])
        noise = seen["joint_position_rad"] - truth["offset_rad"] - angles[f"joint_rad_{k}"]
        assert np.std(noise) < 2.0 * truth["noise_floor_rad"]
    added = angles["joint_rad_1"] - angles["plain_rad_1"]
    assert 0.01 * truth["loop_rad"] < np.std(added) < 2.0 * truth["loop_rad"]
    assert truth["effects"][0]["effect"] not in (folder / "joint.toml").read_text()


def test_what_cannot_be_made_ends_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for more in (["--kinds", "several"], ["--count", "0"]):
        assert main(["--seed", "1", "--count", "1", "--out", str(tmp_path), *more]) == 2
        message = capsys.readouterr().err
        assert message.startswith("error: ")
        assert message.count("\n") == 1
        assert "accepted" in message
