"""Writing the trials of a blind run: public folders, and each truth under a seal of its own."""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable
from concurrent.futures import as_completed
from pathlib import Path

import numpy as np

from firmware_sim.plant import PlantError
from firmware_sim.trials.folder import full_truth, true_angles, write_public
from firmware_sim.trials.order import Wanted
from firmware_sim.trials.processes import processes
from firmware_sim.trials.seal import ANGLES, SEALED, TRUTH, digest, truth_text, write_seal
from firmware_sim.trials.world import draw_world
from firmware_sim.trials.writing import folder_name

Progress = Callable[[int, int], None]
"""Told how many trials are written, and of how many."""

PUBLIC = "trials"


def make_trial(wanted: Wanted, number: int, out: str) -> None:
    """Draw one trial, write its public folder and, once that is there, its seal."""
    world = draw_world(wanted, number)
    public = Path(out) / PUBLIC / folder_name(number)
    shutil.rmtree(public, ignore_errors=True)
    write_public(public, world)
    angles = io.BytesIO()
    np.savez_compressed(angles, **true_angles(world))
    files: dict[str, str | bytes] = {TRUTH: truth_text(full_truth(world, wanted)), ANGLES: angles.getvalue()}
    write_seal(_seal(out, number), files)


def generate(
    wanted: Wanted, trials: int, out: Path, workers: int = 2, progress: Progress | None = None
) -> str:
    """Write `trials` trials under `out` with their seals; returns the SHA-256 of all seals.

    Those whose seal is there already are kept. What is written depends on what is wanted and on each trial's
    number, not on how many there are nor on the number of worker processes. Raises PlantError for fewer than
    one trial, or a place that cannot be written.
    """
    if trials < 1 or workers < 1:
        raise PlantError(f"{trials} trials by {workers} workers; at least one of each is accepted")
    try:
        (out / PUBLIC).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise PlantError(f"{out}: cannot be made ({error.strerror}); give another folder") from None
    left = [k for k in range(trials) if not _seal(out, k).exists()]
    done = trials - len(left)

    def tell() -> None:
        if progress is not None:
            progress(done, trials)

    if workers == 1:
        for k in left:
            make_trial(wanted, k, str(out))
            done += 1
            tell()
        return digest(out / SEALED)
    with processes(workers) as pool:
        for job in as_completed([pool.submit(make_trial, wanted, k, str(out)) for k in left]):
            job.result()
            done += 1
            tell()
    return digest(out / SEALED)


def _seal(out: Path | str, number: int) -> Path:
    return Path(out) / SEALED / f"{folder_name(number)}.zip"
