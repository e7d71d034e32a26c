"""Drawing and writing all trials of a run: public folders first, then the sealed truth."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from firmware_sim.plant import PlantError
from firmware_sim.trials.plan import assignment
from firmware_sim.trials.seal import SEALED, TRUTH, write_seal
from firmware_sim.trials.trial import draw_trial
from firmware_sim.trials.writing import folder_name, true_model, truth_of, truth_text, write_public

Progress = Callable[[int, int], None]
"""Told how many trials are written, and of how many."""

PUBLIC = "trials"


def make_trial(seed: int, number: int, kind: str, out: str) -> tuple[dict[str, Any], str]:
    """Draw one trial and write its public folder; returns its truth and its true model's configuration."""
    trial = draw_trial(seed, assignment(seed, number, kind))
    write_public(Path(out) / PUBLIC / folder_name(number), trial)
    return truth_of(trial), true_model(trial)


def generate(
    trials: int,
    seed: int,
    out: Path,
    kind: str = "mixed",
    workers: int = 2,
    progress: Progress | None = None,
) -> str:
    """Write `trials` trials under `out` and seal their truth; returns the SHA-256 of the sealed archive.

    What is written depends on seed, kind and number of trials, not on the number of worker processes.
    Raises PlantError for a kind that is none, fewer than one trial, or a folder that holds another run.
    """
    assignment(seed, 0, kind)
    if trials < 1 or workers < 1:
        raise PlantError(f"{trials} trials by {workers} workers; at least one of each is accepted")
    if (out / SEALED).exists():
        raise PlantError(f"{out}: holds a sealed run already; give another folder")
    try:
        (out / PUBLIC).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise PlantError(f"{out}: cannot be made ({error.strerror}); give another folder") from None
    files: dict[str, str] = {}
    truths: dict[int, dict[str, Any]] = {}
    for done, (truth, model) in enumerate(_each(trials, seed, kind, str(out), workers), start=1):
        truths[truth["trial"]] = truth
        files[f"models/{folder_name(truth['trial'])}/true-model.toml"] = model
        if progress is not None:
            progress(done, trials)
    files[TRUTH] = truth_text([truths[k] for k in sorted(truths)], seed, kind)
    return write_seal(out / SEALED, files)


def _each(trials: int, seed: int, kind: str, out: str, workers: int) -> Iterator[tuple[dict[str, Any], str]]:
    if workers == 1:
        for k in range(trials):
            yield make_trial(seed, k, kind, out)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        jobs = [pool.submit(make_trial, seed, k, kind, out) for k in range(trials)]
        for job in as_completed(jobs):
            yield job.result()
