"""What was found of physics concealed in somebody's own recordings: a page, a table, and a section of the
diagnosis page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from plotly.subplots import make_subplots
from rich.table import Table
from rich.text import Text

from cablecomp.counting import counted
from cablecomp.recording.atomic import atomic_file
from cablecomp.report import page, style
from cablecomp.report.diagnosis_words import plain
from cablecomp.report.page import Fact, Section

_COLUMNS = 3
_EXPLAINED = (
    "Each trial stands beside a twin: the same stretch of recordings with nothing "
    "concealed. Found: a right name that the twin "
    "was not given; for a drift of the joint's reading, that the temperature "
    "is what the residual follows first; for a gain, "
    "that a calibrated constant left its twin's by three of its standard deviations. Bars are 95 % intervals."
)


def concealed_table(answer: Mapping[str, Any]) -> Table:
    """What size of each physics was found, which names were wrong or given to twins, for the terminal."""
    trials, twins = counted(answer["of"], "trial"), counted(answer["twins"], "twin")
    wrong, given = answer["wrong_names"], ", ".join(f"{n} {k}" for n, k in _given(answer)) or "none"
    table = Table(
        title=f"{answer['done']} of {trials}, {twins}",
        title_justify="left",
        caption=f"a wrong name beside: {wrong['hits']} of {wrong['of']}; any name in twins: {given}",
        caption_justify="left",
    )
    for name in ("concealed", "sizes: found of put", "found from"):
        table.add_column(name)
    table.add_column("this name in twins", justify="right")
    for c in answer["curves"]:
        sizes = ", ".join(
            f"{_size(p['size'], '')}: {p['found']['hits']}/{p['found']['of']}" for p in c["points"]
        )
        table.add_row(
            c["words"],
            f"{sizes} {c['unit']}",
            Text(_from(c), "green" if c["found_from"] else "dim"),
            _twins(c),
        )
    return table


def _given(answer: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Each name that twins were given, and how many of them."""
    return [(plain(n), f"{k} of {answer['twins']}") for n, k in sorted(answer["names_in_twins"].items())]


def write_concealed_page(answer: Mapping[str, Any], path: Path) -> None:
    """Write the page of a `concealed.json`."""
    with atomic_file(path) as temporary:
        temporary.write_text(concealed_page(answer), encoding="utf-8")


def concealed_page(answer: Mapping[str, Any]) -> str:
    """The whole page: what would have been found, names given where nothing was put, every trial."""
    wrong = answer["wrong_names"]
    facts = page.facts(
        [
            Fact("trials", f"{answer['done']} of {answer['of']}", f"seed {answer['seed']}"),
            Fact("seal", answer["sha256"][:12] + "…", "SHA-256 of the sealed truth, checked"),
            Fact(
                "wrong names", f"{wrong['hits']} of {wrong['of']}", "new beside the twin's own", _tone(wrong)
            ),
            Fact("twins", str(answer["twins"]), "with nothing concealed"),
        ]
    )
    given = _given(answer)
    names = (
        page.table(("named in twins", "twins"), given)
        if given
        else page.paragraph("No twin was given a name." if answer["twins"] else "No twin came to a verdict.")
    )
    sections = [
        concealed_section(answer, facts),
        Section(
            "Where nothing was put",
            names,
            "What the recordings are found to hold by themselves, or are taken to.",
        ),
        Section("All trials", page.fold("Every trial", _trials(answer))),
        Section("Recordings", page.bullets(answer["recordings"])),
    ]
    lead = (
        f"Physics of known size, concealed in stretches of {answer['seconds']:g} s "
        f"of {counted(len(answer['recordings']), 'recording')}; the "
        "truth was sealed before any diagnosis and opened after their verdicts were written."
    )
    return page.page("What would have been found", lead, sections)


def concealed_section(answer: Mapping[str, Any], before: str = "") -> Section:
    """The curves and their table as a section of a page."""
    rows = [(c["words"], _names(c), _from(c), _twins(c)) for c in answer["curves"]]
    heads = ("concealed", "right name", "found from", "this name in twins")
    body = page.figure(found_by_size(answer), _EXPLAINED) + page.table(heads, rows)
    lead = (
        f"What size of known physics the diagnosis found in these recordings ({answer['done']} blind trials)."
    )
    return Section("Found when concealed", before + body, lead)


def found_by_size(answer: Mapping[str, Any]) -> Any:
    """Share found, and share given a wrong name, against the size concealed: one small figure for each physics."""
    shown = answer["curves"]
    across = max(min(_COLUMNS, len(shown)), 1)
    rows = max(-(-len(shown) // across), 1)
    drawn_px = 250 * rows - 20
    fig = make_subplots(
        rows,
        across,
        subplot_titles=[c["words"] for c in shown],
        figure=style.figure(
            drawn_px + 154, margin={"l": 56, "r": 44, "t": 104, "b": 50}, legend={"y": 1.0 + 52 / drawn_px}
        ),  # between legend and figure, as between rows, lie two lines of a title
        vertical_spacing=100 / drawn_px,
    )
    for k, c in enumerate(shown):
        # a wrong name is hollow and wider: where both are at one place, both show
        found = ("found", style.PREDICTED, "found", {"symbol": "circle"})
        wrong = ("wrong name", style.CABLE_H, "wrong_name", {"symbol": "circle-open", "size": 11})
        for label, colour, key, marker in (found, wrong):
            rates = [p[key] for p in c["points"]]
            fig.add_scatter(
                x=[p["size"] for p in c["points"]],
                y=[_percent(r["share"]) for r in rates],
                error_y=_bars(rates) if key == "found" else None,
                mode="lines+markers",
                name=label,
                line_color=colour,
                marker=marker,
                hovertext=[f"{r['hits']} of {r['of']}" for r in rates],
                showlegend=k == 0,
                row=k // across + 1,
                col=k % across + 1,
            )
        fig.update_xaxes(title_text=c["unit"], type="log", row=k // across + 1, col=k % across + 1)
    fig.update_yaxes(range=[-6, 106], ticksuffix=" %")
    return fig


def _trials(answer: Mapping[str, Any]) -> str:
    heads = (
        "trial",
        "piece",
        "concealed",
        "size",
        "found",
        "new names",
        "all names",
        "confidence",
        "time / s",
        "remark",
    )
    alone = {r["round"] for r in answer["rows"] if r["physics"] == "twin" and r["failed"]}
    rows = [
        (
            r["number"],
            r["round"],
            r["words"],
            "" if r["size"] is None else _size(r["size"], r["unit"]),
            "" if r["physics"] == "twin" or r["round"] in alone else "yes" if r["found"] else "no",
            ", ".join(r["new"]),
            ", ".join(r["named"]),
            r["confidence"],
            float("nan") if r["seconds"] is None else r["seconds"],
            r["failed"] or ("named in the twin too, with another value" if r.get("grown") else ""),
        )
        for r in answer["rows"]
    ]
    return page.table(heads, rows)


def _size(value: float, unit: str) -> str:
    return page.number(value, unit, digits=2)


def _names(curve: Mapping[str, Any]) -> str:
    return ", ".join(plain(n) for n in curve["names"]) or "none: located, or calibrated away"


def _from(curve: Mapping[str, Any]) -> str:
    if curve["found_from"] is None:
        return f"not up to {_size(curve['points'][-1]['size'], curve['unit'])}"
    return _size(curve["found_from"], curve["unit"])


def _twins(curve: Mapping[str, Any]) -> str:
    r = curve["named_in_twins"]
    return f"{r['hits']} of {r['of']}" if curve["names"] else "–"


def _tone(rate: Mapping[str, Any]) -> Any:
    return "good" if not rate["hits"] else "warn"


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def _bars(rates: list[Mapping[str, Any]]) -> dict[str, Any]:
    """Error bars of rates as JSON has them, in %."""
    up = [100.0 * (r["interval_95"][1] - r["share"]) if r["of"] else 0.0 for r in rates]
    down = [100.0 * (r["share"] - r["interval_95"][0]) if r["of"] else 0.0 for r in rates]
    return {"type": "data", "symmetric": False, "array": up, "arrayminus": down, "thickness": 1, "width": 3}
