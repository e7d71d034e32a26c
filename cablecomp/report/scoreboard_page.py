"""The scoreboard of blind trials as a page and as a table for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite
from pathlib import Path

import numpy as np
from rich.table import Table
from rich.text import Text

from cablecomp.recording.atomic import atomic_file
from cablecomp.report import page
from cablecomp.report import scoreboard_figures as figures
from cablecomp.report.page import Fact, Section
from cablecomp.trials.row import Row
from cablecomp.trials.scoreboard import Part, Scoreboard, Target
from cablecomp.trials.shares import Rate


def scoreboard_table(board: Scoreboard) -> Table:
    """What was reached against what is to be reached, for the terminal."""
    table = Table(title=f"{board.counted} blind trials, seed {board.wish['seed']}", title_justify="left")
    table.add_column("what")
    for name in ("reached", "95 % interval", "to reach", "of"):
        table.add_column(name, justify="right")
    for t in board.targets:
        colour = {True: "green", False: "red", None: "dim"}[t.ok]
        table.add_row(t.what, Text(_shown(t, t.reached), colour), _interval(t), _asked(t), str(t.of))
    return table


def write_scoreboard_page(board: Scoreboard, path: Path) -> None:
    """Write the page."""
    with atomic_file(path) as temporary:
        temporary.write_text(scoreboard_page(board), encoding="utf-8")


def scoreboard_page(board: Scoreboard) -> str:
    """The whole page: figures to reach, what they hang on, confidence, confusion, errors, every trial."""
    wish = board.wish
    command = "cablecomp prove " + " ".join(f"--{k} {v}" for k, v in wish.items())
    lead = (
        f"{board.counted} simulated joints with concealed physics, seed "
        f"{wish['seed']}, laws: {wish['laws']}, imperfections: "
        f"{wish['imperfections']}. The truth was sealed before any diagnosis "
        f"and opened after their verdicts were written."
    )
    sections = [
        Section("What was reached", _facts(board) + _targets(board) + page.code(command)),
        _hangs_on(board),
        _named_by_size(board),
        _confidence(board),
        _models(board),
        Section("Trials that went wrong", _wrong(board) or page.paragraph("None.")),
        Section("All trials", page.fold("Every trial", _trials(board.rows))),
    ]
    return page.page("Blind trials", lead, sections)


def _hangs_on(board: Scoreboard) -> Section:
    parts = page.columns(_parts("imperfection", board.by_imperfection), _parts("size / loop", board.by_size))
    return Section(
        "What it hangs on",
        parts + page.fold("by law", _parts("law", board.by_law)),
        "Named first and located by the residual itself where decidable; wrong names of all trials. An "
        "imperfection's trials mostly have others too.",
    )


def _named_by_size(board: Scoreboard) -> Section:
    return Section(
        "Named by size",
        page.columns(
            page.figure(figures.naming_by_size(board), "Single effects; bars are 95 % intervals."),
            page.figure(figures.confusion(board), "What was concealed, and the first name; trials counted."),
        ),
        "Decidable are the trials in which the true law itself, taken off the recorded angle, beats the "
        "recalibrated drive on data left out by what an effect has to bring.",
    )


def _confidence(board: Scoreboard) -> Section:
    mean, low, high = (page.number(v) for v in board.trust.perfect)
    return Section(
        "Confidence",
        page.columns(
            page.figure(
                figures.reliability(board),
                "All effects that were weighed, named or not, in bins of equal counts.",
            ),
            page.figure(figures.risk(board), "Of the surest share of them, how many are wrong."),
        ),
        f"Expected calibration error {page.number(board.trust.error)} (as many effects, each right with exactly its "
        f"confidence, show {mean}; 95 %: {low} to {high}), Brier score {page.number(board.trust.brier)}.",
    )


def _models(board: Scoreboard) -> Section:
    values = (
        page.figure(figures.deviations(board), "Values that fall outside are drawn at the edge.")
        if any(r.estimates for r in board.rows)
        else page.paragraph(
            "No value was stated that has a true one: laws of other forms have other parameters."
        )
    )
    return Section("How good the models are", page.columns(page.figure(figures.ratios(board)), values))


def _facts(board: Scoreboard) -> str:
    seconds = [r.seconds for r in board.rows if isfinite(r.seconds)]
    failed = sum(bool(r.failed) for r in board.rows)
    return page.facts(
        [
            Fact("trials", str(len(board.rows)), f"seed {board.wish['seed']}"),
            Fact("seal", board.sha256[:12] + "…", "SHA-256 of the sealed truth, checked"),
            Fact("one diagnosis", page.number(float(np.median(seconds)) if seconds else None, "s"), "median"),
            Fact("failed", str(failed), "diagnoses without a verdict", "bad" if failed else "good"),
        ]
    )


def _targets(board: Scoreboard) -> str:
    mark = {True: "reached", False: "not reached", None: ""}
    rows = [(t.what, _shown(t, t.reached), _interval(t), _asked(t), t.of, mark[t.ok]) for t in board.targets]
    return page.table(("what", "reached", "95 % interval", "to reach", "of", ""), rows)


def _parts(head: str, parts: Sequence[Part]) -> str:
    rows = [(p.name, p.trials, _hits(p.right), _hits(p.located), _hits(p.wrong)) for p in parts]
    return page.table((head, "trials", "named first", "located", "wrong name"), rows)


def _hits(r: Rate) -> str:
    return f"{r.hits} of {r.of}" if r.of else "–"


def _wrong(board: Scoreboard) -> str:
    return _trials(r for r in board.rows if not _fine(r)) if any(not _fine(r) for r in board.rows) else ""


def _fine(row: Row) -> bool:
    if row.failed or row.wrong:
        return False
    if row.kind in ("single", "pair", "motor"):
        return row.all_right and row.located is not False if row.decidable else True
    if row.kind == "confounded":
        return bool(row.said_tied and row.settled)
    return not (row.kind == "none" and row.empirical)


def _trials(rows: Iterable[Row]) -> str:
    heads = (
        "trial",
        "kind",
        "concealed",
        "imperfections",
        "size / %",
        "course",
        "verdict",
        "named",
        "first covariate",
        "decidable",
        "RMSE / noise",
        "time / s",
        "remark",
    )
    return page.table(heads, [_trial(r) for r in rows])


def _trial(r: Row) -> tuple[object, ...]:
    named = ", ".join(f"{n.effect} ({100 * n.confidence:.0f} %)" for n in r.named)
    tied = "; ".join(" or ".join(group) for group in r.tied)
    return (
        r.number,
        r.case or r.kind,
        ", ".join(r.forms),
        ", ".join(r.imperfections),
        f"{100.0 * r.size:.2g}" if isfinite(r.size) else "–",
        r.excitation,
        r.verdict,
        named + (f" tied: {tied}" if tied else ""),
        r.covariate,
        "yes" if r.decidable else "no",
        r.heldout_rad / r.true_rad if r.true_rad > 0.0 else float("nan"),
        r.seconds,
        r.failed or ("settled" if r.settled else ""),
    )


def _shown(t: Target, value: float) -> str:
    if not isfinite(value):
        return "–"
    return f"{100 * value:.1f} %" if t.unit == "%" else page.number(value, "" if t.unit == "1" else t.unit)


def _interval(t: Target) -> str:
    low, high = t.interval
    return f"{_shown(t, low)} … {_shown(t, high)}" if isfinite(low) else ""


def _asked(t: Target) -> str:
    parts = [f"{sign} {_shown(t, v)}" for sign, v in (("≥", t.least), ("≤", t.most)) if v is not None]
    return " ".join(parts)
