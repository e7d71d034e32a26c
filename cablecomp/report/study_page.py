"""The study of the thesis's open questions as a page and as a table for the terminal."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from plotly.subplots import make_subplots
from rich.table import Table
from rich.text import Text

from cablecomp.recording.atomic import atomic_directory
from cablecomp.report import page, style
from cablecomp.report.page import Section
from cablecomp.thesis.bench.cycle import Signature
from cablecomp.thesis.bench.study import QUESTIONS, THESIS, Finding, Study, answers

_LEAD = (
    "Snow's thesis (MIT/WHOI, 1993) reports four things of its bench and leaves them open: true mu of loading and "
    "unloading differ with the sign of M_pk; acting mu differ the other way; acting mu exceed true mu; deflection "
    "goes on after the load stops. Here its bench cycles are simulated on a plant with one suspect switched on, and "
    "evaluated the thesis's way by someone who knows nothing of it."
)
_NUMBERS = (
    ("true_up", "true, loading/unloading, M_pk > 0"),
    ("true_down", "true, loading/unloading, M_pk < 0"),
    ("acting_up", "acting, loading/unloading, M_pk > 0"),
    ("acting_down", "acting, loading/unloading, M_pk < 0"),
    ("lag_loading", "acting/true, loading"),
    ("lag_unloading", "acting/true, unloading"),
)
_MORE = (
    ("creep_loading", "creep at the peak"),
    ("creep_unloading", "creep back at zero"),
    ("scatter", "scatter over T0"),
    ("closed", "true, closed circuit"),
)
_COLOURS = {"yes": "green", "no": "dim", "opposite": "red"}


def study_table(study: Study) -> Table:
    """What reproduces what, for the terminal; combinations first, best first."""
    every = (*study.together, *study.findings)
    answered = dict(zip(QUESTIONS, zip(*(answers(f) for f in every), strict=True), strict=True))
    table = Table(
        title="What the thesis saw and left open: which physics gives it?", title_justify="left", box=None,
        padding=(0, 1, 0, 0),
    )  # fmt: skip
    table.add_column("switched on", no_wrap=True)
    table.add_column("size")
    for name in QUESTIONS:
        table.add_column(name, min_width=max(map(len, " ".join(answered[name]).split())))
    table.add_column("misfit", justify="right")
    for finding in every:
        words = [Text(word, _COLOURS.get(word, "yellow")) for word in answers(finding)]
        name, size = finding.name.replace(" + ", " +\n"), _size(finding).replace(", ", "\n")
        table.add_row(name, size, *words, f"{finding.misfit:.1f}")
    table.add_row("nothing", "", *("no" for _ in QUESTIONS), f"{study.plain_misfit:.1f}", style="dim")
    return table


def write_study(study: Study, out: Path, command: str) -> Path:
    """Write `out`/study.html and return its path; raises InputError where it cannot be written."""
    with atomic_directory(out) as folder:
        (folder / "study.html").write_text(study_page(study, command), encoding="utf-8")
    return out / "study.html"


def study_page(study: Study, command: str) -> str:
    """The whole page: answers, the figure of ratios, creep, all numbers, the command."""
    every = (*study.together, *study.findings)
    rows = [(f.name, f.label, _size(f), f.plausible, *answers(f), round(f.misfit, 1)) for f in every]
    heads = ("switched on", "what it is", "size", "plausible on that bench", *QUESTIONS, "misfit")
    sections = [
        Section(
            "What reproduces what",
            page.table(heads, rows),
            "Each at the size that comes nearest to the thesis's ratios. Yes: signs right for either sign of M_pk and "
            f"size within a factor of 2. Misfit: squared distance in standard deviations; with nothing switched on "
            f"{study.plain_misfit:.0f}.",
        ),
        Section(
            "Ratios",
            page.figure(
                ratios_figure(study),
                "Line: the thesis's number (Table 3.1, trials 136 to 150); shaded: the side it reports without a "
                "number (M_pk < 0). Dotted: the plain drive.",
                least_px=1100,
            ),
        ),
        Section(
            "Creep after the load has stopped",
            page.figure(
                creep_figure(study),
                "Share of the cycle's deflection that follows after the load has stopped. A viscous wrap creeps "
                "roughly with the logarithm of time until it has settled; an event in the hold is a step.",
            ),
        ),
        Section("All numbers", _numbers(every), "The plant's; below each, the observer's own equations."),
        Section("Reproduce", page.code(command)),
    ]
    return page.page("The thesis's open questions", _LEAD, sections)


def ratios_figure(study: Study) -> Any:
    """Six ratios of coefficients of friction, a row for each suspect, the thesis's value as a line."""
    shown = [*study.findings[::-1], *study.together[::-1]]  # drawn from below
    names = [f.name for f in shown]
    fig = make_subplots(
        1, 6, shared_yaxes=True, horizontal_spacing=0.012, subplot_titles=[_wrapped(t) for _, t in _NUMBERS]
    )
    fig.update_layout(template=style.template(), height=110 + 24 * len(shown), showlegend=False)
    fig.update_layout(margin={"l": 330, "r": 44, "t": 96, "b": 40})
    fig.update_annotations(font_size=12)
    for k, (key, _) in enumerate(_NUMBERS, start=1):
        values = [getattr(f.signature, key) for f in shown]
        target = getattr(THESIS, key)
        low, high = min(*values, 0.86), max(*values, 1.14)
        pairs = [len(f.sizes) > 1 for f in shown]
        marker = {"size": 9, "color": [style.CABLE_L if pair else style.PREDICTED for pair in pairs]}
        fig.add_scatter(
            x=values, y=names, mode="markers", marker=marker, cliponaxis=False, row=1, col=k,
            hovertemplate="%{y}: %{x:.3f}<extra></extra>",
        )  # fmt: skip
        if math.isnan(target):
            side = (low - 0.03, 1.0) if key == "true_down" else (1.0, high + 0.03)
            fig.add_vrect(*side, fillcolor=style.BOUNDS, line_width=0, row=1, col=k)
        else:
            fig.add_vline(target, line={"color": style.RESIDUAL, "width": 2}, row=1, col=k)
        fig.add_vline(1.0, line={"color": style.MUTED, "width": 1, "dash": "dot"}, row=1, col=k)
        fig.update_xaxes(range=[low - 0.03, high + 0.03], nticks=5, row=1, col=k)
    return fig


def creep_figure(study: Study) -> Any:
    """Creep over the logarithm of time, at the peak and back at zero; named where there is any."""
    fig = make_subplots(
        1, 2, shared_yaxes=True, horizontal_spacing=0.03,
        subplot_titles=("load held at the peak", "load held at zero after unloading"),
    )  # fmt: skip
    fig.update_layout(template=style.template(), height=460)
    fig.update_layout(
        legend={"orientation": "v", "x": 1.02, "xanchor": "left", "y": 1.0, "yanchor": "top"},
        margin={"r": 330, "t": 44},
    )
    fig.update_annotations(font_size=13)
    number = 0
    for finding in (*study.together, *study.findings):
        trace = finding.traces
        moving = bool(max(abs(trace.loaded[-1]), abs(trace.unloaded[-1])) > 0.01)
        colour = style.SERIES[number % len(style.SERIES)] if moving else style.RULE
        number += moving
        since = trace.since_s[1:]
        for col, values in ((1, trace.loaded), (2, trace.unloaded)):
            fig.add_scatter(
                x=since, y=100.0 * values[1:], name=finding.name.replace(" + ", " +<br>"), mode="lines",
                legendgroup=finding.name,
                showlegend=moving and col == 1, line={"color": colour, "width": 2 if moving else 1},
                hovertemplate=f"{finding.name}: %{{y:.2f}} %<extra></extra>", row=1, col=col,
            )  # fmt: skip
    fig.update_xaxes(type="log", title_text=style.label("time since the load stopped", "s"))
    fig.update_yaxes(title_text="creep / % of the deflection", row=1, col=1)
    return fig


def _numbers(every: tuple[Finding, ...]) -> str:
    heads = ("switched on", *(title for _, title in (*_NUMBERS, *_MORE)))
    rows: list[tuple[object, ...]] = [("thesis", *_cells(THESIS))]
    for f in every:
        rows.append((f.name, *_cells(f.signature)))
        if f.other is not None:
            rows.append(("observer", *_cells(f.other)))
    return page.table(heads, rows)


def _cells(s: Signature) -> tuple[str, ...]:
    unknown = {"true_down": "below 1", "acting_down": "above 1"}
    found = []
    for key, _ in (*_NUMBERS, *_MORE):
        value = getattr(s, key)
        found.append(unknown.get(key, "seen") if math.isnan(value) else f"{value:.3f}")
    return tuple(found)


def _size(finding: Finding) -> str:
    return ", ".join(f"{x:.2g} {unit}" for x, unit in zip(finding.sizes, finding.units, strict=True))


def _wrapped(title: str) -> str:
    return title.replace(", ", "<br>")
