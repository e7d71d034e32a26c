"""The page of a fleet: which joints drift, slip, lose strands; every joint over its nights; every row."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any, Final

import numpy as np
from rich.table import Table

from cablecomp.fleet.fleet import Fleet, JointStory
from cablecomp.report import page, style
from cablecomp.report.page import Fact, Section

FLAGS: Final = ("drifts", "slips", "loses strands")
_DRAWN: Final = 12
_ANGLES: Final[Mapping[str, str]] = {
    "rmse_rad": "RMS error / mrad", "zero_rad": "zero / mrad", "step_within_rad": "step within / mrad",
    "before_rad": "before / mrad", "after_rad": "after / mrad",
}  # fmt: skip


def fleet_table(fleet: Fleet) -> Table:
    """What `replay` and `diagnose` print of a fleet."""
    table = Table(title=_counted(fleet), title_justify="left", box=None)
    for name in ("joint", "nights", "failed", "what", "seen"):
        table.add_column(name, justify="right" if name in ("nights", "failed") else "left")
    for j in _worst_first(fleet):
        colour = "red" if j.flags else "yellow" if j.failed else ""
        table.add_row(
            j.joint, str(j.nights), str(j.failed), ", ".join(j.flags) or "–", "; ".join(j.words), style=colour
        )
    return table


def fleet_page(fleet: Fleet, command: str) -> str:
    """The page as HTML that opens offline; `command` made it."""
    lead = f"{_counted(fleet)}, each by itself: {fleet.work}."
    return page.page("Fleet", lead, _sections(fleet, command))


def failures(fleet: Fleet) -> list[str]:
    """Which nights failed, and why, a line each."""
    return [f"{row['joint']}/{row['night']}: {row['failed']}" for row in fleet.rows if row["failed"]]


def _counted(fleet: Fleet) -> str:
    counts = ((len(fleet.joints), "joint"), (len(fleet.rows), "night"))
    return ", ".join(f"{n} {what}{'' if n == 1 else 's'}" for n, what in counts)


def _worst_first(fleet: Fleet) -> list[JointStory]:
    return sorted(fleet.joints, key=lambda j: (-len(j.flags), -j.failed, j.joint))


def _sections(fleet: Fleet, command: str) -> Iterator[Section]:
    failed = [row for row in fleet.rows if row["failed"]]
    counts = [(flag, sum(flag in j.flags for j in fleet.joints)) for flag in FLAGS]
    cards = [
        Fact(f"joint {flag}" if n == 1 else f"joints: {flag}", str(n), "", "bad" if n else "good")
        for flag, n in counts
    ]
    cards.append(
        Fact("failed nights", str(len(failed)), f"of {len(fleet.rows)}", "warn" if failed else "good")
    )
    rows = [(j.joint, j.nights, ", ".join(j.flags) or "–", "; ".join(j.words)) for j in _worst_first(fleet)]
    yield Section("Answer", page.facts(cards) + page.table(("joint", "nights", "what", "seen"), rows))
    drawn = [j for j in _worst_first(fleet) if _curve(fleet, j.joint)[1].size > 1][:_DRAWN]
    if drawn:
        figures = [f"<h3>{escape(j.joint)}</h3>" + page.figure(_over_nights(fleet, j.joint)) for j in drawn]
        more = f" The first {_DRAWN} joints." if len(fleet.joints) > _DRAWN else ""
        yield Section(
            "Over the nights",
            page.columns(*figures),
            f"Zero and compliance of each night, worst joints first.{more}",
        )
    if failed:
        yield Section(
            "What failed", page.bullets(failures(fleet)), "Tried again when the command is given again."
        )
    yield Section(
        "Every night", page.fold(f"{len(fleet.rows)} rows", _all_rows(fleet.rows)) + page.code(command)
    )


def _curve(fleet: Fleet, joint: str) -> tuple[list[str], Any]:
    key = "zero_rad" if fleet.work == "replay" else "before_rad"
    rows = [row for row in fleet.rows if row["joint"] == joint and row.get(key) is not None]
    return [row["night"] for row in rows], np.array([row[key] for row in rows])


def _over_nights(fleet: Fleet, joint: str) -> Any:
    nights, values = _curve(fleet, joint)
    number = np.arange(1, len(nights) + 1)
    name = "zero" if fleet.work == "replay" else "error before"
    fig = style.axes(style.figure(300), "night", style.label(name, "mrad"))
    fig.update_xaxes(dtick=-(-len(nights) // 10))  # whole nights
    fig.add_scatter(
        x=number, y=1e3 * values, mode="lines+markers", name=f"{name} / mrad", hovertext=nights,
        line={"color": style.PREDICTED, "width": 2},
    )  # fmt: skip
    ratios = [r.get("compliance_ratio") for r in fleet.rows if r["joint"] == joint and r["night"] in nights]
    if any(r is not None for r in ratios):
        percent = np.array([np.nan if r is None else 100.0 * (r - 1.0) for r in ratios])
        fig.add_scatter(
            x=number, y=percent, mode="lines+markers", name="compliance beyond the model / %", yaxis="y2",
            line={"color": style.RESIDUAL, "width": 2, "dash": "dot"}, hovertext=nights,
        )  # fmt: skip
        fig.update_layout(
            yaxis2={"overlaying": "y", "side": "right", "showgrid": False, "title": "compliance / %"}
        )
        fig.update_layout(margin={"r": 64})
    return fig


def _all_rows(rows: Sequence[Mapping[str, Any]]) -> str:
    names = list(dict.fromkeys(name for row in rows for name in row))
    shown = [tuple(_cell(name, row.get(name)) for name in names) for row in rows]
    return page.table([_ANGLES.get(name, name.replace("_", " ")) for name in names], shown)


def _cell(name: str, value: Any) -> object:
    if value is None:
        return "–"
    return 1e3 * value if name in _ANGLES else value
