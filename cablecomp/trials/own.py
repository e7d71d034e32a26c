"""Blind trials in somebody's own recordings: known physics concealed in pieces of them, and what of it would
have been found."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from cablecomp.cluster import Workers
from cablecomp.config import JointConfig, with_laws_of
from cablecomp.config.sessions import Session
from cablecomp.config_text import write_joint
from cablecomp.diagnosis.body import session_names
from cablecomp.errors import InputError
from cablecomp.estimation.standing import claimed_as, stated_of
from cablecomp.signal.smoothing import FloatArray
from cablecomp.trials.curves import Concealed, Curves, curves, score_concealed
from cablecomp.trials.run import (
    JOINT_FILE,
    NOT_DIAGNOSED,
    PIECES,
    Announce,
    Diagnose,
    Job,
    Place,
    Tell,
    Verdict,
    committed,
    diagnose_all,
    diagnose_folder,
    verdict_of,
)
from cablecomp.trials.sealed import SEALED, check_seal, read_sealed
from cablecomp.trials.shares import write_json

SCORED = "concealed.json"
Columns = Mapping[str, FloatArray]
Conceal = Callable[[Path, "OwnWish", Path, Callable[[int, int], None]], str]
"""Reads pieces of recordings, writes public trials and sealed truths into a folder; returns the SHA-256 of the
seals."""


@dataclass(frozen=True)
class OwnWish:
    """How much: `rounds` pieces of at most `seconds` of recordings each (one twin and one trial of every
    physics in each), begun for at most `budget_s`; `physics`: ids with commas between, empty for all."""

    seed: int
    rounds: int
    seconds: float
    budget_s: float = inf
    physics: str = ""


@dataclass(frozen=True)
class Own:
    """A run's folder, the recordings by their paths, their joint, and what works on them."""

    out: Path
    recordings: Mapping[str, Columns]
    joint: JointConfig
    conceal: Conceal
    workers: Workers
    diagnose: Diagnose = diagnose_folder


def prove_in(own: Own, wish: OwnWish, tell: Tell, announce: Announce) -> Curves:
    """Conceal, diagnose each trial blindly, open the truth, and say what size of each physics would have been found.

    Writes `concealed.json`. With the same folder again, it goes on where it stopped. Raises
    InputError for recordings that cannot be used, or a folder that holds another run.
    """
    out = own.out
    wanted = {
        "recordings": sorted(own.recordings),
        "seed": wish.seed,
        "rounds": wish.rounds,
        "seconds": wish.seconds,
        "physics": wish.physics,
    }
    sha256 = committed(out, wanted, lambda: _conceal(own, wish, tell))
    announce(sha256)
    numbers = [int(p.stem) for p in sorted((out / SEALED).glob("*.zip"))]
    places = [Place(out, k) for k in numbers]
    until = time.monotonic() + wish.budget_s
    jobs: list[Job] = [(own.diagnose, p.public, (), p.verdict) for p in places]
    diagnose_all(jobs, own.workers, "diagnosing", tell, until, least=2)
    check_seal(out / SEALED, sha256)
    truths = [read_sealed(p.sealed)[0] for p in places]
    found = curves(_scored(places, truths), len(places), wanted | {"sha256": sha256})
    write_json(out / SCORED, found.as_json())
    return found


def _conceal(own: Own, wish: OwnWish, tell: Tell) -> str:
    """Conceal in pieces of the recordings; where that fails nothing of it is left."""
    pieces = own.out / PIECES
    try:
        for k in range(wish.rounds):
            folder = pieces / f"{k:05d}"
            folder.mkdir(parents=True, exist_ok=True)
            drawn = piece(own.joint, own.recordings, wish.seconds, wish.seed, k)
            for n, table in enumerate(drawn.values(), start=1):
                np.savez(folder / f"recording-{n}.npz", **table)  # type: ignore[arg-type]  # stub: `**` may be a flag
            write_joint(folder / JOINT_FILE, joint_of_piece(own.joint, drawn))
        return own.conceal(pieces, wish, own.out, lambda done, of: tell("concealing", done, of))
    except InputError:
        shutil.rmtree(pieces, ignore_errors=True)
        raise


def piece(
    joint: JointConfig, recordings: Mapping[str, Columns], seconds: float, seed: int, number: int
) -> dict[str, dict[str, FloatArray]]:
    """One piece: stretches of recordings of one session, at most `seconds` together, drawn from the seed; by the
    recordings' names. A run's pieces begin with another recording each, as long as there is one.

    Raises InputError where nothing lasts long enough to be diagnosed.
    """
    rng = np.random.default_rng([seed, 41, number])
    usable = {n: c for n, c in recordings.items() if "joint_position_rad" in c and len(c["time_s"]) >= 200}
    if not usable:
        raise InputError("no recording holds 200 samples of joint_position_rad; physics is concealed in such")
    names = list(usable)
    session = session_names(joint, names)
    turns = np.random.default_rng([seed, 41]).permutation(len(names))
    first = names[int(turns[number % len(names)])]
    mates = [n for n in names if session[n] == session[first] and n != first]
    chosen, left = {}, seconds
    for name in (first, *(str(n) for n in rng.permutation(np.asarray(mates, dtype=object)))):
        if left < 0.2 * seconds:
            break
        stretch = _stretch(rng, usable[name], left)
        left -= float(np.ptp(stretch["time_s"]))
        chosen[name] = stretch
    shared = set.intersection(*(set(c) for c in chosen.values()))
    return {n: {k: v for k, v in chosen[n].items() if k in shared} for n in names if n in chosen}


def joint_of_piece(joint: JointConfig, drawn: Mapping[str, Columns]) -> JointConfig:
    """The joint with what it states of each recording of a piece under the name that the recording has in there."""
    stated = [stated_of(joint, Path(name), columns) for name, columns in drawn.items()]
    sessions = [s for s in joint.session if not s.name]
    if any(stated):
        for k, values in enumerate(stated, start=1):
            name = f"recording-{k}"
            sessions.append(Session(name=name, mounting="piece", recordings=(f"{name}.npz",), values=values))
    claimed = claimed_as(joint, Path(next(iter(drawn))))  # a piece is of one session
    return with_laws_of(joint, claimed).model_copy(update={"session": tuple(sessions), "depends": ()})


def _stretch(rng: np.random.Generator, columns: Columns, seconds: float) -> dict[str, FloatArray]:
    clock = columns["time_s"]
    begin = float(clock[0] + rng.uniform() * max(float(np.ptp(clock)) - seconds, 0.0))
    here = (clock >= begin) & (clock <= begin + seconds)
    return {name: values[here] for name, values in columns.items()}


def _scored(places: Sequence[Place], truths: Sequence[Mapping[str, Any]]) -> list[Concealed]:
    """Every trial that was diagnosed and whose twin was; where the twin failed, it is said of each."""
    twins = {
        t["round"]: verdict_of(p.verdict)
        for p, t in zip(places, truths, strict=True)
        if t["physics"] == "twin"
    }
    found = []
    for p, t in zip(places, truths, strict=True):
        twin, mine = twins[t["round"]], verdict_of(p.verdict)
        if NOT_DIAGNOSED in (mine.failed, twin.failed):
            continue
        if twin.said is None and t["physics"] != "twin":
            mine = Verdict(None, mine.seconds, f"nothing to compare with, its twin failed: {twin.failed}")
        found.append(score_concealed(t, mine, twin.said))
    return found


def concealed_beside(folder: Path) -> dict[str, Any] | None:
    """What `concealed.json` in a folder says; None where there is none. Raises InputError for one that is none."""
    path = folder / SCORED
    if not path.exists():
        return None
    try:
        answer: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if answer["schema"] == 1 and answer["curves"] is not None:
            return answer
    except (OSError, ValueError, KeyError, TypeError):
        pass
    raise InputError(f"{path}: is no answer of `cablecomp prove --in`; move it away, or run that again")
