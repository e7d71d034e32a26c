"""What every blind run does: commit to a sealed truth, diagnose public folders elsewhere, keep verdicts, go on
after a stop."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any

from cablecomp.cluster import Workers, spread
from cablecomp.config import load_joint
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import PROTOCOL, write_diagnosis
from cablecomp.errors import InputError, NotWrittenError
from cablecomp.recording.atomic import atomic_directory
from cablecomp.recording.folder import find_recordings
from cablecomp.recording.reader import read_all
from cablecomp.trials.sealed import SEALED, digest
from cablecomp.trials.shares import write_json

COMMITMENT, BEGUN = "commitment.json", "concealing.json"
PUBLIC, VERDICTS, RECORDINGS, PIECES = "trials", "verdicts", "recordings", "pieces"
JOINT_FILE = "joint.toml"
NOT_DIAGNOSED = "not diagnosed"
"""What is said to have failed of a trial whose folder holds no verdict, or a damaged one."""

Tell = Callable[[str, int, int], None]
"""Told what is being done, how much of it is done, and of how much."""
Announce = Callable[[str], None]
"""Told the SHA-256 of the sealed truth, before anything is diagnosed."""
Diagnose = Callable[[Path, Sequence[Path], Path], None]
"""Reads a trial's folder and further recordings, writes its verdict into a folder."""


@dataclass(frozen=True)
class Place:
    """A trial's places by its number: what a diagnosis may see, its verdict, its sealed truth."""

    out: Path
    number: int

    @property
    def public(self) -> Path:
        """Recordings and configuration."""
        return self.out / PUBLIC / f"{self.number:05d}"

    @property
    def verdict(self) -> Path:
        """What the diagnosis wrote."""
        return self.out / VERDICTS / f"{self.number:05d}"

    @property
    def is_diagnosed(self) -> bool:
        """Whether its diagnosis was made, or failed."""
        return verdict_of(self.verdict).failed != NOT_DIAGNOSED

    @property
    def sealed(self) -> Path:
        """The truth."""
        return self.out / SEALED / f"{self.number:05d}.zip"


def committed(out: Path, wanted: Mapping[str, Any], conceal: Callable[[], str]) -> str:
    """Conceal the trials, or find them concealed already; returns the SHA-256 that was committed to.

    What is wanted is written before anything is concealed: what a run left that was stopped meanwhile goes on for the
    same wish alone, and what stands there by itself is nobody's to replace. Raises InputError if the folder holds
    another run, or what was written is not what was announced.
    """
    path, begun = out / COMMITMENT, out / BEGUN
    if path.exists():
        found = _read(path)
        sha256 = found.pop("sha256", None)
        if found != dict(wanted) or not isinstance(sha256, str):
            raise InputError(f"{out}: holds another run ({found}); give another folder with --out")
        return sha256
    if begun.exists():
        if (found := _read(begun)) != dict(wanted):
            raise InputError(
                f"{out}: holds another run's beginning ({found}); give another folder with --out"
            )
    elif there := next((name for name in (PUBLIC, SEALED, VERDICTS, PIECES) if (out / name).exists()), None):
        raise InputError(f"{out / there}: is there already, and of no run; give another folder with --out")
    else:
        out.mkdir(parents=True, exist_ok=True)
        write_json(begun, dict(wanted))
    try:
        sha256 = conceal()
    except InputError:  # nothing of it is left
        begun.unlink(missing_ok=True)
        with suppress(OSError):  # it holds something else
            out.rmdir()
        raise
    if digest(out / SEALED) != sha256:
        raise InputError(f"{out / SEALED}: is not what its SHA-256 says; run again in another folder")
    write_json(path, {**wanted, "sha256": sha256})
    begun.unlink(missing_ok=True)
    return sha256


def _read(path: Path) -> dict[str, Any]:
    """What a run wrote of itself; raises InputError for what none did."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        found = None
    if not isinstance(found, dict):
        raise InputError(f"{path}: is nothing that a run wrote; give another folder with --out")
    return found


Job = tuple[Diagnose, Path, Sequence[Path], Path]


def diagnose_all(
    jobs: Sequence[Job], workers: Workers, what: str, tell: Tell, until: float | None = None, least: int = 0
) -> None:
    """Diagnose what has no verdict yet; no trial stops another, and a worker's death costs that trial alone.

    `until`: an instant of `time.monotonic` after which nothing more is begun, once `least` have been done.
    """
    left = [j for j in jobs if verdict_of(j[3]).failed == NOT_DIAGNOSED]
    done = len(jobs) - len(left)
    tell(what, done, len(jobs))
    with closing(spread(_timed, left, workers)) as outcomes:
        for outcome in outcomes:
            if outcome.result:
                raise InputError(f"{outcome.result}; make room, then the same command goes on")
            if outcome.failed:  # the process died
                place = left[outcome.job][3]
                place.mkdir(parents=True, exist_ok=True)
                write_json(place / "timing.json", {"seconds": None, "failed": outcome.failed})
            done += 1
            tell(what, done, len(jobs))
            if until is not None and time.monotonic() >= until and done >= least:
                return


def _timed(work: Diagnose, folder: Path, further: Sequence[Path], out: Path) -> str:
    """One diagnosis and how long it took; what went wrong is written instead of a verdict. Returns why nothing could be
    written, which is no failure of the trial's."""
    started, failed = time.perf_counter(), ""
    try:
        out.mkdir(parents=True, exist_ok=True)
        try:
            work(folder, further, out)
        except NotWrittenError as error:
            return str(error)
        except (
            Exception
        ) as error:  # whatever it is, it is this trial's failure: counted, and shown on the page
            failed = f"{type(error).__name__}: {error}"
        write_json(out / "timing.json", {"seconds": time.perf_counter() - started, "failed": failed})
    except OSError as error:
        return f"{out}: cannot be written ({error.strerror})"
    return ""


def diagnose_folder(folder: Path, further: Sequence[Path], out: Path) -> None:
    """Diagnose the recordings of a folder (and further ones) with its `joint.toml`; writes the verdict."""
    found = diagnose(load_joint(folder / JOINT_FILE), columns_of(folder, further))
    with atomic_directory(out, (PROTOCOL,)) as spare:
        write_diagnosis(found, spare)


def columns_of(folder: Path, further: Sequence[Path] = ()) -> dict[str, Any]:
    """Channels of all recordings of a trial, by their paths in its folder."""
    paths = {str(p.relative_to(folder)): p for p in find_recordings([folder / RECORDINGS])}
    paths |= {f"{RECORDINGS}/{p.name}": p for p in further}
    return {name: read_all(p, gaps=True).columns for name, p in paths.items()}


@dataclass(frozen=True)
class Verdict:
    """What a diagnosis said (None: it came to no verdict, `failed` says why), and how long it took."""

    said: dict[str, Any] | None
    seconds: float
    failed: str


def verdict_of(place: Path) -> Verdict:
    """The verdict in a folder; what is damaged there is none, and is made anew by `diagnose_all`."""
    try:
        timing = json.loads((place / "timing.json").read_text(encoding="utf-8"))
        seconds = nan if timing["seconds"] is None else float(timing["seconds"])
        if timing["failed"] or not (place / "diagnosis.json").exists():
            return Verdict(None, seconds, str(timing["failed"]) or "no verdict")
        said = json.loads((place / "diagnosis.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, KeyError, TypeError):
        return Verdict(None, nan, NOT_DIAGNOSED)
    return Verdict(said, seconds, "") if isinstance(said, dict) else Verdict(None, nan, NOT_DIAGNOSED)
