"""A whole run of blind trials: the truth stays shut until all verdicts are written."""

from __future__ import annotations

import errno
import io
import json
import os
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blind_joint import JOINT, recording
from blind_verdict import verdict

from cablecomp.cli import concealing
from cablecomp.cluster import Workers
from cablecomp.config_text import joint_text
from cablecomp.errors import InputError
from cablecomp.recording import atomic
from cablecomp.recording.atomic import atomic_directory
from cablecomp.recording.writer import write_canonical
from cablecomp.trials.prove import Blind, Wish, prove
from cablecomp.trials.sealed import SEALED, check_seal, digest, read_sealed, truth_from


def seal(out: Path, number: int, plain: dict[str, Any]) -> None:
    """A trial's truth under its seal, with the true angles that a plant would know."""
    angles = io.BytesIO()
    clean = recording(JOINT, number, noise=False)
    np.savez(angles, time_s_1=clean["time_s"], joint_rad_1=clean["joint_position_rad"],
             plain_rad_1=clean["joint_position_rad"])  # fmt: skip
    (out / SEALED).mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(out / SEALED / f"{number:05d}.zip", "w") as archive:
        archive.writestr("truth.json", json.dumps(plain))
        archive.writestr("truth.npz", angles.getvalue())


def _conceal(log: list[str]) -> Callable[..., str]:
    def work(out: Path, wish: Wish, told: Callable[[int, int], None]) -> str:
        for k in range(wish.trials):
            folder = out / "trials" / f"{k:05d}"
            (folder / "recordings").mkdir(parents=True)
            (folder / "joint.toml").write_text(joint_text(JOINT))
            write_canonical(folder / "recordings" / "recording-1.csv", recording(JOINT, k))
            seal(out, k, _plain_truth(k))
            told(k + 1, wish.trials)
        log.append("concealed")
        return digest(out / SEALED)

    return work


def _plain_truth(number: int) -> dict[str, Any]:
    drive = {k: v for k, v in JOINT.drive.stage[0].model_dump().items() if v is not None}
    return {
        "trial": number, "kind": "none", "case": "", "partner": "", "effects": [], "depends_on": [],
        "imperfections": {}, "loop_rad": 1e-3, "noise_floor_rad": 1e-5, "true": drive,
        "recordings": [{"course": "bench", "zeros": {"joint_position": 0.0}}],
    }  # fmt: skip


def _fake_diagnosis(log: list[str]) -> Callable[[Path, Sequence[Path], Path], None]:
    def work(folder: Path, further: Sequence[Path], out: Path) -> None:
        assert sorted(p.name for p in folder.iterdir()) == ["joint.toml", "recordings"]
        log.append(f"diagnosed {folder.name} with {len(further)}")
        if folder.name == "00001":
            raise InputError("the joint cannot follow")
        said = verdict(next_experiment=None if further else {"why": "", "protocol": "x"})
        (out / "diagnosis.json").write_text(json.dumps(said))
        if not further:
            (out / "next_experiment.toml").write_text("x")

    return work


def _fake_experiment(log: list[str]) -> Callable[[Path, Path, Path], None]:
    def work(sealed: Path, protocol: Path, out: Path) -> None:
        log.append(f"experiment {sealed.stem}")
        out.write_text("")

    return work


def test_the_whole_way_in_order_and_again_without_work(tmp_path: Path) -> None:
    log: list[str] = []
    blind = Blind(tmp_path, _conceal(log), _fake_experiment(log), Workers(0), _fake_diagnosis(log))
    wish = Wish(2, 5, "none,confounded", "catalogue", "none")
    board = prove(blind, wish, lambda what, done, of: None, log.append)
    assert log[0] == "concealed"
    assert log[1] == digest(tmp_path / SEALED)
    assert log[2:] == [
        "diagnosed 00000 with 0",
        "diagnosed 00001 with 0",
        "experiment 00000",
        "diagnosed 00000 with 1",
    ]
    assert [r.outcome for r in board.rows] == ["consistent", "failed"]
    assert json.loads((tmp_path / "scoreboard.json").read_text())["trials"] == 2
    before = len(log)
    prove(blind, wish, lambda what, done, of: None, log.append)
    assert log[before:] == [digest(tmp_path / SEALED)]
    with pytest.raises(InputError, match="holds another run"):
        prove(blind, replace(wish, trials=3), lambda what, done, of: None, log.append)


@pytest.mark.parametrize("name", ["timing.json", "diagnosis.json", "after-experiment/timing.json"])
def test_a_verdict_that_was_damaged_is_made_anew(tmp_path: Path, name: str) -> None:
    log: list[str] = []
    blind = Blind(tmp_path, _conceal(log), _fake_experiment(log), Workers(0), _fake_diagnosis(log))
    wish = Wish(1, 5, "none,confounded", "catalogue", "none")
    prove(blind, wish, lambda what, done, of: None, log.append)
    before = len(log)
    (damaged,) = tmp_path.glob(f"verdicts/00000/{name}")
    damaged.write_text('{"seconds": 1', encoding="utf-8")
    board = prove(blind, wish, lambda what, done, of: None, log.append)
    assert [r.outcome for r in board.rows] == ["consistent"]
    assert log[-1] == f"diagnosed 00000 with {int('/' in name)}"
    assert len(log) > before + 1


def test_a_budget_that_is_spent_leaves_the_rest_for_the_next_time(tmp_path: Path) -> None:
    log: list[str] = []
    blind = Blind(tmp_path, _conceal(log), _fake_experiment(log), Workers(0), _fake_diagnosis(log))
    wish = Wish(2, 5, "none,confounded", "catalogue", "none")
    first = prove(blind, wish, lambda what, done, of: None, log.append, budget_s=0.0)
    assert ([r.number for r in first.rows], first.counted) == ([0], "1 of 2")
    assert log[2:] == ["diagnosed 00000 with 0"]
    whole = prove(blind, wish, lambda what, done, of: None, log.append)
    assert ([r.number for r in whole.rows], whole.counted) == ([0, 1], "2")
    assert log[4:] == ["diagnosed 00001 with 0", "experiment 00000", "diagnosed 00000 with 1"]


def test_a_verdict_that_the_disk_does_not_take_is_no_failure_of_the_trial_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command ends in one line, and once there is room goes on with that trial."""
    log: list[str] = []

    def full(*given: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    def on_a_full_disk(folder: Path, further: Sequence[Path], out: Path) -> None:
        with monkeypatch.context() as now, atomic_directory(out):
            now.setattr(atomic, "_move_into", full)

    wish = Wish(1, 5, "none", "catalogue", "none")
    blind = Blind(tmp_path, _conceal(log), _fake_experiment(log), Workers(0), on_a_full_disk)
    with pytest.raises(InputError, match=r"00000: cannot be written \(No space left.*make room") as told:
        prove(blind, wish, lambda what, done, of: None, log.append)
    assert len(str(told.value).splitlines()) == 1
    again = replace(blind, diagnose=_fake_diagnosis(log))
    board = prove(again, wish, lambda what, done, of: None, log.append)
    assert [r.outcome for r in board.rows] == ["consistent"]


def test_a_broken_seal_is_not_opened(tmp_path: Path) -> None:
    seal(tmp_path, 0, _plain_truth(0))
    sha256 = digest(tmp_path / SEALED)
    (path,) = check_seal(tmp_path / SEALED, sha256)
    plain, angles = read_sealed(path)
    assert truth_from(plain).kind == "none"
    assert isnan(truth_from(plain).size)
    assert "joint_rad_1" in angles
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("more.txt", "later")
    with pytest.raises(InputError, match="the truth was changed"):
        check_seal(tmp_path / SEALED, sha256)
    with pytest.raises(InputError, match="lacks or misstates 'kind'"):
        truth_from({k: v for k, v in plain.items() if k != "kind"})


def test_who_conceals_is_not_waited_for_by_who_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    said = "import time; print('written 1 of 2', flush=True); time.sleep(10)"
    monkeypatch.setattr(concealing, "_command", lambda *given: [sys.executable, "-S", "-c", said])

    def interrupted(done: int, of: int) -> None:
        raise KeyboardInterrupt

    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        concealing.conceal_joints(Path("out"), Wish(2, 1, "single", "mixed", "none"), 1, interrupted)
    assert time.monotonic() - begin < 5.0


def test_who_conceals_ends_with_who_is_killed() -> None:
    assert concealing._command("firmware_sim.conceal", {})[-2:] == ["--starter", str(os.getpid())]
    code = (
        "import os, time; from firmware_sim.starter import end_with; "
        "end_with(os.getppid()); print('there', flush=True); time.sleep(10)"
    )
    shell = ["sh", "-c", '"$0" -c "$1" & wait', sys.executable, code]
    begin = time.monotonic()
    with subprocess.Popen(shell, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2]) as starter:
        assert starter.stdout is not None
        assert starter.stdout.readline() == b"there\n"
        starter.kill()
        starter.stdout.read()  # until nobody holds its other end any more
    assert time.monotonic() - begin < 8.0
