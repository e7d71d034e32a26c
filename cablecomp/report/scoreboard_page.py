"""The scoreboard of blind trials as a page and as a table for the terminal."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from pathlib import Path

import numpy as np
from rich.table import Table
from rich.text import Text

from cablecomp.recording.atomic import atomic_file
from cablecomp.report import page
from cablecomp.report import scoreboard_figures as figures
from cablecomp.report.page import Fact, Section
from cablecomp.trials.scoreboard import Scoreboard, Target, rate
from cablecomp.trials.scoring import Row


def scoreboard_table(board: Scoreboard) -> Table:
    """What was reached against what is to be reached, for the terminal."""
    table = Table(title=f"{len(board.rows)} blind trials, seed {board.seed}", title_justify="left")
    table.add_column("what")
    for name in ("reached", "to reach", "of"):
        table.add_column(name, justify="right")
    for t in board.targets:
        colour = {True: "green", False: "red", None: "dim"}[t.ok]
        table.add_row(t.what, Text(_reached(t), colour), _asked(t), str(t.of))
    return table


def write_scoreboard_page(board: Scoreboard, path: Path, command: str) -> None:
    """Write the page; `command` is what reproduces it."""
    with atomic_file(path) as temporary:
        temporary.write_text(scoreboard_page(board, command), encoding="utf-8")


def scoreboard_page(board: Scoreboard, command: str) -> str:
    """The whole page: figures to reach, confusion, naming by size, confidence, errors, every trial."""
    lead = (
        f"{len(board.rows)} simulated joints with concealed physics, seed {board.seed}. The truth was sealed "
        "before any diagnosis and opened after all verdicts were written."
    )
    sections = [
        Section("What was reached", _facts(board) + _targets(board) + page.code(command)),
        Section(
            "Named by size",
            page.columns(
                page.figure(figures.naming_by_size(board), "Single effects; bars are 95 % intervals."),
                page.figure(figures.reliability(board), "All names given, in bins of confidence."),
            ),
            "Decidable are the trials in which the true model itself beats the recalibrated drive on "
            "held-out data beyond its margin.",
        ),
        Section("Concealed and named", page.figure(figures.confusion(board)), "Trials counted."),
        Section(
            "How good the models are",
            page.columns(
                page.figure(figures.ratios(board)),
                page.figure(figures.deviations(board), "Values that fall outside are drawn at the edge."),
            ),
        ),
        Section("By effect", _by_effect(board)),
        Section("Trials that went wrong", _wrong(board) or page.paragraph("None.")),
        Section("All trials", page.fold("Every trial", _trials(board.rows))),
    ]
    return page.page("Blind trials", lead, sections)


def _facts(board: Scoreboard) -> str:
    seconds = [r.seconds for r in board.rows if isfinite(r.seconds)]
    failed = sum(bool(r.failed) for r in board.rows)
    return page.facts(
        [
            Fact("trials", str(len(board.rows)), f"seed {board.seed}"),
            Fact("seal", board.sha256[:12] + "…", "SHA-256 of the sealed truth, checked"),
            Fact("one diagnosis", page.number(float(np.median(seconds)) if seconds else None, "s"), "median"),
            Fact("failed", str(failed), "diagnoses without a verdict", "bad" if failed else "good"),
        ]
    )


def _targets(board: Scoreboard) -> str:
    mark = {True: "reached", False: "not reached", None: "no trials"}
    rows = [(t.what, _reached(t), _asked(t), t.of, mark[t.ok]) for t in board.targets]
    return page.table(("what", "reached", "to reach", "of", ""), rows)


def _by_effect(board: Scoreboard) -> str:
    single = board.of_kind("single", "unknown")
    rows = []
    for name in sorted({r.truth[0] for r in single}):
        own = [r for r in single if r.truth[0] == name]
        decidable = [r for r in own if r.decidable]
        rows.append(
            (
                name,
                len(own),
                len(decidable),
                sum(r.first_right for r in decidable),
                sum(bool(r.located) for r in decidable),
                sum(r.wrong for r in own),
                _median([r.heldout_rad / r.true_rad for r in own if r.true_rad > 0.0]),
                rate(own, lambda r: r.verdict == "unexplained").hits,
            )
        )
    heads = ("effect", "trials", "decidable", "named", "located", "wrong name", "RMSE / true", "unexplained")
    return page.table(heads, rows)


def _wrong(board: Scoreboard) -> str:
    return _trials(r for r in board.rows if not _fine(r)) if any(not _fine(r) for r in board.rows) else ""


def _fine(row: Row) -> bool:
    if row.failed or row.wrong:
        return False
    if row.kind in ("single", "pair"):
        return row.all_right and bool(row.located) if row.decidable else True
    if row.kind == "unknown":
        return row.verdict == "unexplained" or not row.visible
    if row.kind == "confounded":
        return bool(row.said_tied and row.settled)
    return not row.named


def _trials(rows: Iterable[Row]) -> str:
    heads = (
        "trial",
        "kind",
        "concealed",
        "size / %",
        "course",
        "verdict",
        "named",
        "first covariate",
        "decidable",
        "RMSE / true",
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
        ", ".join(r.truth),
        100.0 * r.size,
        r.excitation,
        r.verdict,
        named + (f" tied: {tied}" if tied else ""),
        r.covariate,
        "yes" if r.decidable else "no",
        r.heldout_rad / r.true_rad if r.true_rad > 0.0 else float("nan"),
        r.seconds,
        r.failed or ("settled" if r.settled else ""),
    )


def _reached(t: Target) -> str:
    if not isfinite(t.reached):
        return "–"
    return f"{t.reached:.2f}" if _is_plain(t) else f"{100 * t.reached:.1f} %"


def _asked(t: Target) -> str:
    def shown(value: float) -> str:
        return f"{value:g}" if _is_plain(t) else f"{100 * value:g} %"

    parts = [
        f"≥ {shown(t.least)}" if t.least is not None else "",
        f"≤ {shown(t.most)}" if t.most is not None else "",
    ]
    return " ".join(p for p in parts if p)


def _is_plain(t: Target) -> bool:
    """Whether the figure is a number and no share."""
    return (t.most or 0.0) > 1.0


def _median(values: list[float]) -> float:
    kept = [v for v in values if isfinite(v)]
    return float(np.median(kept)) if kept else float("nan")
