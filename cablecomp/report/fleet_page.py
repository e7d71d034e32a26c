"""The page of a fleet: which joints drift, slip, lose strands; every joint over its nights; every row."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Final

import numpy as np
from plotly.subplots import make_subplots
from rich.table import Table

from cablecomp.counting import counted
from cablecomp.errors import printable
from cablecomp.fleet.fleet import Fleet, JointStory
from cablecomp.fleet.rows import Row
from cablecomp.report import page, style
from cablecomp.report.page import Fact, Section
from cablecomp.signal.smoothing import FloatArray

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
    """Which nights failed, and why, a line each, which names the place once."""
    return [printable(_failure(row)) for row in fleet.rows if row["failed"]]


def _failure(row: Row) -> str:
    place, why = f"{row['joint']}/{row['night']}", str(row["failed"])
    return why if place in why.partition(": ")[0] else f"{place}: {why}"


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
    drawn = [j for j in _worst_first(fleet) if len(_curve(fleet, j.joint)) > 1][:_DRAWN]
    if drawn:
        figures = [f"<h3>{escape(j.joint)}</h3>" + page.figure(_over_nights(fleet, j.joint)) for j in drawn]
        what = "Zero and compliance of each night" if fleet.work == "replay" else "Error of each night"
        more = f" The first {_DRAWN} joints." if len(fleet.joints) > _DRAWN else ""
        yield Section(
            "Over the nights",
            page.columns(*figures),
            f"{what}, worst joints first.{more}",
        )
    if failed:
        yield Section(
            "What failed", page.bullets(failures(fleet)), "Tried again when the command is given again."
        )
    yield Section(
        "Every night", page.fold(counted(len(fleet.rows), "row"), _all_rows(fleet.rows)) + page.code(command)
    )


def _curve(fleet: Fleet, joint: str) -> list[Row]:
    """The nights of a joint that its figure shows."""
    key = "zero_rad" if fleet.work == "replay" else "before_rad"
    return [row for row in fleet.rows if row["joint"] == joint and row.get(key) is not None]


def _over_nights(fleet: Fleet, joint: str) -> Any:
    """What moves from night to night: each quantity on an axis of its own, in a range that scatter does not fill."""
    rows = _curve(fleet, joint)
    panels = _of_replay(rows) if fleet.work == "replay" else _of_diagnosis(rows)
    fig = make_subplots(rows=len(panels), cols=1, shared_xaxes=True, vertical_spacing=0.1)
    fig.update_layout(template=style.template(), height=170 + 130 * len(panels))
    nights = [row["night"] for row in rows]
    for k, panel in enumerate(panels, start=1):
        for name, values, colour in panel.lines:
            fig.add_scatter(
                x=np.arange(1, len(rows) + 1), y=values, mode="lines+markers", name=name, hovertext=nights,
                line={"color": colour, "width": 2}, row=k, col=1,
            )  # fmt: skip
        style.axes(fig, "night" if k == len(panels) else "", panel.title, row=k, col=1)
        fig.update_yaxes(range=panel.extent(), tickformat="~g", nticks=5, row=k, col=1)
    fig.update_xaxes(dtick=-(-len(rows) // 10))  # whole nights
    return fig


@dataclass(frozen=True)
class _Panel:
    """One axis: `least`, in its unit, is what it shows at the least; `from_zero`: it begins there."""

    title: str
    lines: tuple[tuple[str, FloatArray, str], ...]
    least: float
    from_zero: bool = False

    def extent(self) -> tuple[float, float]:
        """Range of the axis."""
        values = np.concatenate([v[np.isfinite(v)] for _, v, _ in self.lines])
        low, high = (float(np.min(values)), float(np.max(values))) if len(values) else (0.0, 0.0)
        low = 0.0 if self.from_zero else low
        wanting = max(self.least - (high - low), 0.0)
        edge = 0.06 * max(high - low, self.least)
        if self.from_zero:
            return low, high + wanting + edge
        return low - 0.5 * wanting - edge, high + 0.5 * wanting + edge


def _of_replay(rows: Sequence[Row]) -> list[_Panel]:
    zero = 1e3 * np.array([row["zero_rad"] for row in rows])
    title = style.label("zero moved", "mrad")
    panels = [_Panel(title, (("zero, from the first night's", zero - zero[0], style.PREDICTED),), 0.2)]
    ratios = np.array([_number(row.get("compliance_ratio")) for row in rows])
    if np.any(np.isfinite(ratios)):
        line = ("compliance beyond the model", 100.0 * (ratios - 1.0), style.RESIDUAL)
        panels.append(_Panel(style.label("compliance", "%"), (line,), 2.0))
    return panels


def _of_diagnosis(rows: Sequence[Row]) -> list[_Panel]:
    before, after = (
        1e3 * np.array([_number(row.get(key)) for row in rows]) for key in ("before_rad", "after_rad")
    )
    lines = (("before", before, style.RESIDUAL), ("after", after, style.PREDICTED))
    return [_Panel(style.label("RMS error", "mrad"), lines, 0.05, from_zero=True)]


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def _all_rows(rows: Sequence[Mapping[str, Any]]) -> str:
    names = list(dict.fromkeys(name for row in rows for name in row))
    shown = [tuple(_cell(name, row.get(name)) for name in names) for row in rows]
    return page.table([_ANGLES.get(name, name.replace("_", " ")) for name in names], shown)


def _cell(name: str, value: Any) -> object:
    if value is None:
        return "–"
    return 1e3 * value if name in _ANGLES else value
