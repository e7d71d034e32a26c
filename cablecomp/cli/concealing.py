"""Starts the concealing side for blind trials: firmware_sim, in processes of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from cablecomp.cli.shared import plain_counts, warn
from cablecomp.errors import InputError
from cablecomp.trials.own import OwnWish
from cablecomp.trials.prove import Wish

OnProgress = Callable[[int, int], None]


def conceal_joints(out: Path, wish: Wish, workers: int, progress: OnProgress) -> str:
    """Write simulated joints' trials and their seals; returns the seals' SHA-256 as that process printed it.

    Raises InputError with that process's own line where it fails.
    """
    options = {
        "--trials": wish.trials,
        "--seed": wish.seed,
        "--kinds": wish.kinds,
        "--laws": wish.laws,
        "--imperfections": wish.imperfections,
        "--workers": workers,
        "--out": out,
    }
    return _concealed("firmware_sim.trials", options, progress)


def conceal_in(pieces: Path, wish: OwnWish, out: Path, progress: OnProgress) -> str:
    """Conceal physics in pieces of recordings; returns the seals' SHA-256. Raises InputError where that fails."""
    options = {"--in": pieces, "--seed": wish.seed, "--physics": wish.physics, "--out": out}
    return _concealed("firmware_sim.conceal", options, progress)


def experiment(sealed: Path, protocol: Path, out: Path) -> None:
    """Play a proposed experiment on a sealed joint in a process of firmware_sim; only the recording comes
    back."""
    options = {"--sealed": sealed, "--protocol": protocol, "--out": out}
    command = _command("firmware_sim.trials", options, "experiment")
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise InputError(_last_line(done.stderr))


def _command(module: str, options: Mapping[str, object], *words: str) -> Sequence[str]:
    """The command line of a process that ends with this one, whatever ends it."""
    options = {**options, "--starter": os.getpid()}
    return [sys.executable, "-m", module, *words, *(str(x) for pair in options.items() for x in pair)]


def _concealed(module: str, options: Mapping[str, object], progress: OnProgress) -> str:
    sha256, last = "", ""
    with subprocess.Popen(
        _command(module, options), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                words, last = line.split(), line
                if words[:1] == ["written"]:
                    progress(int(words[1]), int(words[3]))
                elif words[:1] == ["sha256"]:
                    sha256 = words[1]
                elif words[:1] == ["left"]:
                    warn([line.strip()])
        except BaseException:
            process.kill()  # else it would be waited for to its end
            raise
    if process.returncode != 0 or not sha256:
        raise InputError(_last_line(last))
    return sha256


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1].removeprefix("error: ") if lines else "the concealing process ended without a word"


@contextmanager
def trial_bar() -> Iterator[Callable[[str, int, int], None]]:
    """Give a function to call with (what is being done, how much of it, of how much); the bars go when it is over."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    errors = Console(stderr=True, markup=False, highlight=False)
    if not errors.is_terminal:
        yield plain_counts(errors)
        return
    with Progress(*columns, console=errors, transient=True) as bar:
        tasks: dict[str, TaskID] = {}

        def tell(what: str, done: int, of: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=of)
            bar.update(tasks[what], completed=done, total=of)

        yield tell
