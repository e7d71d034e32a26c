"""Blind trials from end to end: conceal, diagnose elsewhere, experiment, and only then open the truth."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from math import nan
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from cablecomp.config import load_joint
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import write_diagnosis
from cablecomp.errors import CablecompError, InputError
from cablecomp.recording.atomic import atomic_directory
from cablecomp.recording.reader import read_all
from cablecomp.trials.reference import Yardstick, measure_truth
from cablecomp.trials.scoreboard import Scoreboard, as_json, scoreboard
from cablecomp.trials.scoring import Row, failed_trial, score_trial
from cablecomp.trials.sealed import Truth, digest, open_sealed

SEALED, COMMITMENT, PUBLIC, VERDICTS = "sealed.zip", "commitment.json", "trials", "verdicts"
PROTOCOL, SECOND = "next_experiment.toml", "after-experiment"

Tell = Callable[[str, int, int], None]
"""Told what is being done, how much of it is done, and of how much."""
Conceal = Callable[[Path, "Wish", Callable[[int, int], None]], str]
"""Writes public trials and the sealed truth under a folder; returns the seal's SHA-256."""
Experiment = Callable[[Path, int, Path, Path], None]
"""Plays a protocol on the sealed joint of a trial (seal, number, protocol) and writes a recording."""
Diagnose = Callable[[Path, Sequence[Path], Path], None]
"""Reads a trial's folder and further recordings, writes its verdict into a folder."""


@dataclass(frozen=True)
class Wish:
    """How many trials, under which seed, of which kind (`mixed` = all)."""

    trials: int
    seed: int
    kind: str = "mixed"


@dataclass(frozen=True)
class Blind:
    """A run's folder, and what works on it: `conceal` and `experiment` belong to the concealing side, and
    tell nothing but their recordings; `diagnose` sees a trial's public folder alone."""

    out: Path
    conceal: Conceal
    experiment: Experiment
    diagnose: Diagnose | None = None
    workers: int = 2


def prove(blind: Blind, wish: Wish, tell: Tell, announce: Callable[[str], None]) -> Scoreboard:
    """Run blind trials and score them; writes `scoreboard.json`.

    Order: trials and the sealed truth are written, the seal's SHA-256 is announced; every trial is diagnosed
    in a process of its own; proposed experiments are played on the sealed joints and diagnosed again; the
    seal is checked and opened; verdicts are scored. A run that was interrupted goes on where it stopped.
    Raises InputError if the folder holds another run or the seal was broken.
    """
    sha256 = _concealed(blind, wish, tell)
    announce(sha256)
    _diagnose_all(blind, wish, tell)
    _experiment_all(blind, wish, tell)
    truths = open_sealed(blind.out / SEALED, sha256)
    rows = _score_all(blind, truths, tell)
    board = scoreboard(rows, sha256, wish.seed, wish.kind)
    _write_json(blind.out / "scoreboard.json", as_json(board))
    return board


def _concealed(blind: Blind, wish: Wish, tell: Tell) -> str:
    """Conceal the trials, or find them concealed already; returns the SHA-256 that was committed to."""
    path = blind.out / COMMITMENT
    wanted = {"trials": wish.trials, "seed": wish.seed, "kind": wish.kind}
    if path.exists():
        found = json.loads(path.read_text())
        sha256: str = found.pop("sha256")
        if found != wanted:
            raise InputError(f"{blind.out}: holds another run ({found}); give another folder with --out")
        return sha256
    sha256 = blind.conceal(blind.out, wish, lambda done, of: tell("concealing", done, of))
    if digest(blind.out / SEALED) != sha256:
        raise InputError(f"{blind.out / SEALED}: is not what its SHA-256 says; run again in another folder")
    _write_json(path, {**wanted, "sha256": sha256})
    return sha256


def _diagnose_all(blind: Blind, wish: Wish, tell: Tell) -> None:
    jobs = []
    for k in range(wish.trials):
        folder, verdict = blind.out / PUBLIC / _name(k), blind.out / VERDICTS / _name(k)
        if not (verdict / "timing.json").exists():
            jobs.append((blind.diagnose or diagnose_folder, folder, (), verdict))
    _run(blind, jobs, "diagnosing", wish.trials, tell)


def _experiment_all(blind: Blind, wish: Wish, tell: Tell) -> None:
    """Play every experiment that a verdict proposes, whatever the trial conceals, and diagnose again."""
    jobs = []
    for k in range(wish.trials):
        verdict = blind.out / VERDICTS / _name(k)
        protocol, second = verdict / PROTOCOL, verdict / SECOND
        if not protocol.exists() or (second / "timing.json").exists():
            continue
        second.mkdir(parents=True, exist_ok=True)
        further = second / "experiment.csv.gz"
        try:
            blind.experiment(blind.out / SEALED, k, protocol, further)
        except CablecompError as error:
            _write_json(second / "timing.json", {"seconds": None, "failed": str(error)})
            continue
        jobs.append((blind.diagnose or diagnose_folder, blind.out / PUBLIC / _name(k), (further,), second))
    _run(blind, jobs, "diagnosing after the experiment", len(jobs), tell)


Job = tuple[Diagnose, Path, Sequence[Path], Path]


def _run(blind: Blind, jobs: Sequence[Job], what: str, total: int, tell: Tell) -> None:
    done = total - len(jobs)
    tell(what, done, total)
    for _ in _in_processes(_timed, jobs, blind.workers):
        done += 1
        tell(what, done, total)


def _timed(work: Diagnose, folder: Path, further: Sequence[Path], out: Path) -> None:
    """One diagnosis and how long it took; what went wrong is written instead of a verdict."""
    out.mkdir(parents=True, exist_ok=True)
    started, failed = time.perf_counter(), ""
    try:
        work(folder, further, out)
    except Exception as error:  # whatever it is, it is this trial's failure: counted, and shown on the page
        failed = f"{type(error).__name__}: {error}"
    _write_json(out / "timing.json", {"seconds": time.perf_counter() - started, "failed": failed})


def diagnose_folder(folder: Path, further: Sequence[Path], out: Path) -> None:
    """Diagnose the recordings of a folder (and further ones) with its `joint.toml`; writes the verdict."""
    paths = [*sorted(folder.glob("recording-*")), *further]
    found = diagnose(load_joint(folder / "joint.toml"), {p.name: read_all(p).columns for p in paths})
    with atomic_directory(out) as spare:
        write_diagnosis(found, spare)


def _score_all(blind: Blind, truths: Mapping[int, Truth], tell: Tell) -> list[Row]:
    jobs = [(blind.out, truth) for truth in truths.values()]
    rows = []
    for row in _in_processes(_score, jobs, blind.workers):
        rows.append(row)
        tell("scoring", len(rows), len(jobs))
    return rows


def _score(out: Path, truth: Truth) -> Row:
    folder, place = out / PUBLIC / _name(truth.number), out / VERDICTS / _name(truth.number)
    recordings = [read_all(p).columns for p in sorted(folder.glob("recording-*"))]
    try:
        yardstick = measure_truth(load_joint(folder / "joint.toml"), recordings, truth)
    except InputError:
        yardstick = Yardstick(nan, nan, False, nan, nan)
    verdict, timing = _verdict(place)
    if verdict is None:
        return failed_trial(truth, yardstick, timing["failed"] or "no verdict", _seconds(timing))
    second, _ = _verdict(place / SECOND)
    return score_trial(truth, yardstick, verdict, second, _seconds(timing))


def _verdict(place: Path) -> tuple[dict[str, Any] | None, dict[str, Any]]:
    """A verdict (None if there is none) and its timing."""
    if not (place / "timing.json").exists():
        return None, {"seconds": None, "failed": "not diagnosed"}
    timing = json.loads((place / "timing.json").read_text())
    if timing["failed"] or not (place / "diagnosis.json").exists():
        return None, timing
    return json.loads((place / "diagnosis.json").read_text()), timing


def _in_processes(work: Callable[..., Any], jobs: Sequence[tuple[Any, ...]], workers: int) -> Iterator[Any]:
    """Results in the order in which they come; `workers` 0 works in this process."""
    if workers == 0:
        for job in jobs:
            yield work(*job)
        return
    if not jobs:
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        running: list[Future[Any]] = [pool.submit(work, *job) for job in jobs]
        for finished in as_completed(running):
            yield finished.result()


def _seconds(timing: Mapping[str, Any]) -> float:
    value = timing["seconds"]
    return nan if value is None else float(value)


def _name(number: int) -> str:
    return f"{number:05d}"


def _write_json(path: Path, data: Any) -> None:
    spare = path.with_name(path.name + ".part")
    spare.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    spare.replace(path)
