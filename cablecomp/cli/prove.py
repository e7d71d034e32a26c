"""The command line's proof: blind trials, concealed by firmware_sim in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from cablecomp.cli.shared import console
from cablecomp.errors import InputError
from cablecomp.report.scoreboard_page import scoreboard_table, write_scoreboard_page
from cablecomp.trials.prove import Blind, Wish, prove

_TRIALS = (sys.executable, "-m", "firmware_sim.trials")


def prove_blindly(
    trials: Annotated[int, typer.Option(min=1, help="how many joints")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="of everything that is drawn")] = 1,
    out: Annotated[Path, typer.Option(help="folder for trials, verdicts, scoreboard")] = Path("prove"),
    kind: Annotated[
        str, typer.Option(help="mixed, or only single, pair, nothing, parameters, unknown, confounded")
    ] = "mixed",
    workers: Annotated[int, typer.Option(min=1, help="processes")] = 2,
) -> None:
    """Blind trials: conceal physics in simulated joints, diagnose them, open the truth, keep the score."""
    blind = Blind(out, conceal, experiment, workers=workers)

    def announce(sha256: str) -> None:
        console.print(f"sealed truth, SHA-256 {sha256}", soft_wrap=True)

    with _bar() as tell:
        board = prove(blind, Wish(trials, seed, kind), tell, announce)
    command = f"cablecomp prove --trials {trials} --seed {seed}" + (
        f" --kind {kind}" if kind != "mixed" else ""
    )
    write_scoreboard_page(board, out / "scoreboard.html", command)
    console.print(scoreboard_table(board))
    console.print(f"report: {out / 'scoreboard.html'}")


def conceal(out: Path, wish: Wish, told: Callable[[int, int], None]) -> str:
    """Write trials and seal in a process of firmware_sim; returns the seal's SHA-256 as it printed it.

    Raises InputError with that process's own line where it fails.
    """
    command = [*_TRIALS, "--trials", str(wish.trials), "--seed", str(wish.seed), "--kind", wish.kind]
    sha256, last = "", ""
    with subprocess.Popen(
        [*command, "--out", str(out)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            words, last = line.split(), line
            if words[:1] == ["written"]:
                told(int(words[1]), int(words[3]))
            elif words[:1] == ["sha256"]:
                sha256 = words[1]
    if process.returncode != 0 or not sha256:
        raise InputError(_last_line(last))
    return sha256


def experiment(sealed: Path, trial: int, protocol: Path, out: Path) -> None:
    """Play a proposed experiment on a sealed joint in a process of firmware_sim; only the recording comes
    back."""
    options = {"--sealed": sealed, "--trial": trial, "--protocol": protocol, "--out": out}
    command = [*_TRIALS, "experiment", *(str(x) for pair in options.items() for x in pair)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise InputError(_last_line(done.stderr))


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1].removeprefix("error: ") if lines else "the concealing process ended without a word"


@contextmanager
def _bar() -> Iterator[Callable[[str, int, int], None]]:
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks: dict[str, TaskID] = {}

        def tell(what: str, done: int, of: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=of)
            bar.update(tasks[what], completed=done, total=of)

        yield tell
