"""Blind trials on simulated joints: conceal, diagnose elsewhere, experiment, and only then open the truth."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from math import inf
from pathlib import Path

from cablecomp.cluster import Workers, spread
from cablecomp.config import load_joint
from cablecomp.diagnosis.result import PROTOCOL
from cablecomp.errors import CablecompError, InputError
from cablecomp.trials.reference import Yardstick, measure_truth
from cablecomp.trials.row import Row
from cablecomp.trials.run import (
    JOINT_FILE,
    NOT_DIAGNOSED,
    Announce,
    Diagnose,
    Job,
    Place,
    Tell,
    columns_of,
    committed,
    diagnose_all,
    diagnose_folder,
    verdict_of,
)
from cablecomp.trials.scoreboard import Scoreboard, as_json, scoreboard
from cablecomp.trials.scoring import failed_trial, score_trial
from cablecomp.trials.sealed import SEALED, check_seal, read_sealed, truth_from
from cablecomp.trials.shares import write_json

CONFOUNDED = "confounded"
SECOND = "after-experiment"

Conceal = Callable[[Path, "Wish", Callable[[int, int], None]], str]
"""Writes public trials and their sealed truths under a folder; returns the SHA-256 of the seals."""
Experiment = Callable[[Path, Path, Path], None]
"""Plays a protocol on the sealed joint of a trial (seal, protocol) and writes a recording."""


@dataclass(frozen=True)
class Wish:
    """How many trials, under which seed, of which kinds in turn, by whose laws, in how imperfect a world."""

    trials: int
    seed: int
    kinds: str
    laws: str
    imperfections: str


@dataclass(frozen=True)
class Blind:
    """A run's folder, and what works on it: `conceal` and `experiment` belong to the concealing side, and
    tell nothing but their recordings; `diagnose` sees a trial's public folder alone."""

    out: Path
    conceal: Conceal
    experiment: Experiment
    workers: Workers
    diagnose: Diagnose = diagnose_folder


def prove(blind: Blind, wish: Wish, tell: Tell, announce: Announce, budget_s: float = inf) -> Scoreboard:
    """Run blind trials and score them; writes `scoreboard.json`.

    Order: trials and the sealed truths are written, the seals' SHA-256 is announced; every trial is diagnosed
    in a process of its own; proposed experiments are played on the sealed joints and diagnosed again; the
    seals are checked and opened; verdicts are scored. A run that was interrupted, or whose `budget_s` was spent (no
    diagnosis is begun after it, but one there is), goes on where it stopped.
    Raises InputError if the folder holds another run or a seal was broken.
    """
    out = blind.out
    sha256 = committed(
        out, asdict(wish), lambda: blind.conceal(out, wish, lambda done, of: tell("concealing", done, of))
    )
    announce(sha256)
    until = time.monotonic() + budget_s
    places = [Place(out, k) for k in range(wish.trials)]
    jobs: list[Job] = [(blind.diagnose, p.public, (), p.verdict) for p in places]
    diagnose_all(jobs, blind.workers, "diagnosing", tell, until, least=1)
    places = [p for p in places if p.is_diagnosed]
    if CONFOUNDED in wish.kinds.split(","):  # experiments are played on these alone
        _experiment_all(blind, places, tell, until)
    check_seal(out / SEALED, sha256)
    board = scoreboard(_score_all(blind, places, tell), sha256, asdict(wish))
    write_json(out / "scoreboard.json", as_json(board))
    return board


def _experiment_all(blind: Blind, places: Sequence[Place], tell: Tell, until: float) -> None:
    """Play the experiments that verdicts propose, and diagnose again with them; the concealing side knows which
    joints are there to be experimented on."""
    jobs: list[Job] = []
    for p in places:
        protocol, second = p.verdict / PROTOCOL, p.verdict / SECOND
        if not protocol.exists() or time.monotonic() >= until:
            continue
        further = second / "experiment.csv.gz"
        if verdict_of(second).failed == NOT_DIAGNOSED:
            second.mkdir(parents=True, exist_ok=True)
            try:
                blind.experiment(p.sealed, protocol, further)
            except CablecompError as error:
                write_json(second / "timing.json", {"seconds": None, "failed": str(error)})
        jobs.append((blind.diagnose, p.public, (further,), second))
    diagnose_all(jobs, blind.workers, "diagnosing after the experiment", tell, until)


def _score_all(blind: Blind, places: Sequence[Place], tell: Tell) -> list[Row]:
    rows: list[Row] = []
    tell("scoring", 0, len(places))
    for outcome in spread(_score, [(p,) for p in places], blind.workers):
        if outcome.result is None:
            raise InputError(f"trial {places[outcome.job].number} could not be scored: {outcome.failed}")
        rows.append(outcome.result)
        tell("scoring", len(rows), len(places))
    return rows


def _score(place: Place) -> Row:
    plain, angles = read_sealed(place.sealed)
    truth = truth_from(plain)
    try:
        joint = load_joint(place.public / JOINT_FILE)
        yardstick = measure_truth(joint, columns_of(place.public), truth, angles)
    except InputError:
        yardstick = Yardstick()
    first, second = verdict_of(place.verdict), verdict_of(place.verdict / SECOND)
    if first.said is None:
        return failed_trial(truth, yardstick, first.failed, first.seconds)
    return score_trial(truth, yardstick, first.said, second.said, first.seconds)
