"""`cablecomp prove`: blind trials, on simulated joints or in the user's own recordings."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.concealing import OnProgress, conceal_in, conceal_joints, experiment, trial_bar
from cablecomp.cli.folders import out_option
from cablecomp.cli.shared import JsonOption, announce_compilation, console, echo_json, read_joint, warn
from cablecomp.cli.sources import Reading, reads_recordings
from cablecomp.cluster import Workers
from cablecomp.errors import InputError, path_text
from cablecomp.examples import resolve
from cablecomp.recording.folder import find_recordings
from cablecomp.report.concealed_page import concealed_table, write_concealed_page
from cablecomp.report.scoreboard_page import scoreboard_table, write_scoreboard_page
from cablecomp.trials.own import Own, OwnWish, prove_in
from cablecomp.trials.prove import Blind, Wish, prove
from cablecomp.trials.scoreboard import as_json as scoreboard_json

KINDS = "single,single,single,pair,none,stranger,sessions,confounded,motor"


@reads_recordings
def prove_blindly(
    *,
    recordings: Annotated[
        list[Path] | None,
        typer.Option("--in", help="conceal in these recordings of yours (files or folders; give it again for more)"),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="with --in: their joint's configuration (TOML), or an example's name")
    ] = None,
    budget: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            help="seconds after which no trial is begun (60 with --in, else no end); the same folder again goes on",
        ),
    ] = None,
    rounds: Annotated[int, typer.Option(min=1, help="with --in: pieces; 4 hold every size once")] = 4,
    seconds: Annotated[float, typer.Option(min=1.0, help="with --in: of recordings, in each piece")] = 20.0,
    physics: Annotated[
        str, typer.Option(help="with --in: what is concealed, by ids with commas between (late,slip,…); else all")
    ] = "",
    trials: Annotated[int, typer.Option(min=1, help="how many simulated joints")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="of everything that is drawn")] = 1,
    out: Annotated[Path, out_option("folder for trials, verdicts, answer and page")] = Path("prove"),
    kinds: Annotated[str, typer.Option(help="what the joints conceal, in turn; one given twice comes twice")] = KINDS,
    laws: Annotated[str, typer.Option(help="catalogue, other, mixed, or latest")] = "mixed",
    imperfections: Annotated[
        str,
        typer.Option(help="of the world: none, some, all, or vague (all, of a drive known by order of magnitude)"),
    ] = "some",
    workers: Annotated[int, typer.Option(min=1, help="processes on this machine")] = 2,
    scheduler: Annotated[
        str | None, typer.Option(help="address of a Dask scheduler to diagnose on, in place of --workers")
    ] = None,
    reading: Reading,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Blind trials: conceal physics in simulated joints or in your own recordings, diagnose, open the truth,
    keep the score."""
    by = Workers(workers, scheduler)
    announce_compilation()
    if recordings is None:
        if config is not None or physics:
            raise InputError(
                "--config and --physics go with --in: give recordings too, or leave them out for simulated joints"
            )
        wish = Wish(trials, seed, kinds, laws, imperfections)
        _on_joints(wish, inf if budget is None else budget, out, by, as_json)
        return
    if config is None:
        raise InputError("--in needs --config: the joint's configuration, as `cablecomp diagnose` takes it")
    joint = read_joint(resolve(config, "joints"))
    source = reading(joint)
    data = {path_text(p): source.read(p, gaps=True).columns for p in find_recordings(recordings)}
    own = Own(out.absolute(), data, joint, conceal_in, by)
    wish_own = OwnWish(seed, rounds, seconds, 60.0 if budget is None else budget, physics)
    _in_recordings(own, wish_own, out, as_json)


def _on_joints(wish: Wish, budget_s: float, out: Path, by: Workers, as_json: bool) -> None:
    def conceal(where: Path, wanted: Wish, progress: OnProgress) -> str:
        return conceal_joints(where, wanted, by.processes, progress)

    with trial_bar() as tell:
        board = prove(Blind(out.absolute(), conceal, experiment, by), wish, tell, _announce, budget_s)
    write_scoreboard_page(board, out / "scoreboard.html")
    if as_json:
        echo_json(scoreboard_json(board))
        return
    console.print(scoreboard_table(board))
    _say_left(len(board.rows), wish.trials)
    console.print(f"report: {out / 'scoreboard.html'}")


def _in_recordings(own: Own, wish: OwnWish, out: Path, as_json: bool) -> None:
    with trial_bar() as tell:
        found = prove_in(own, wish, tell, _announce)
    answer = found.as_json()
    write_concealed_page(answer, out / "concealed.html")
    if as_json:
        echo_json(answer)
        return
    console.print(concealed_table(answer))
    _say_left(found.done, found.of)
    console.print(f"report: {out / 'concealed.html'}")


def _say_left(done: int, of: int) -> None:
    if done < of:
        console.print(f"{done} of {of} trials are done; the same command again goes on")


def _announce(sha256: str) -> None:
    warn([f"sealed truth, SHA-256 {sha256}"])
