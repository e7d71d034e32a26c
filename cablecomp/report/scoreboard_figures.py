"""Figures of the scoreboard of blind trials."""

from __future__ import annotations

from math import isfinite, sqrt
from typing import Any

import numpy as np

from cablecomp.report import style
from cablecomp.trials.scoreboard import Scoreboard
from cablecomp.trials.shares import Rate

RIGHT, WRONG, NEITHER = style.CABLE_L, style.CABLE_H, style.BASELINE
_DECIDABLE = style.PREDICTED


def naming_by_size(board: Scoreboard) -> Any:
    """Share of single effects named rightly and wrongly against their size, with 95 % intervals."""
    fig = style.figure(360)
    series = (
        ("named first, where decidable", _DECIDABLE, [b.right for b in board.by_size]),
        ("located, where decidable", RIGHT, [b.located for b in board.by_size]),
        ("wrong name, all", WRONG, [b.wrong for b in board.by_size]),
    )
    middle = [100.0 * sqrt(b.low * b.high) for b in board.by_size]
    for shift, (label, colour, rates) in zip((0.96, 1.0, 1.04), series, strict=True):
        fig.add_scatter(
            x=[m * shift for m in middle],
            y=[_percent(r.value) for r in rates],
            error_y=_bars(rates),
            mode="lines+markers",
            name=label,
            line_color=colour,
            hovertext=[f"{r.hits} of {r.of}" for r in rates],
        )
    fig.update_xaxes(type="log", tickvals=[2, 3, 5, 10, 20, 40, 60])
    fig.update_yaxes(range=[-3, 103])
    return style.axes(fig, "contribution over loop width / %", "trials / %")


def reliability(board: Scoreboard) -> Any:
    """Share of names that are true against the confidence stated."""
    fig = style.figure(360)
    fig.add_scatter(
        x=[0, 100], y=[0, 100], mode="lines", name="calibrated", line={"color": NEITHER, "dash": "dot"}
    )
    rates = [r for _, _, _, r in board.trust.bins]
    fig.add_scatter(
        x=[100.0 * mean for _, _, mean, _ in board.trust.bins],
        y=[_percent(r.value) for r in rates],
        error_y=_bars(rates),
        mode="markers",
        marker={"size": 10, "color": _DECIDABLE},
        name="effects weighed",
        hovertext=[f"{r.hits:.3g} of {r.of}" for r in rates],
    )
    fig.update_xaxes(range=[0, 103])
    fig.update_yaxes(range=[0, 103])
    return style.axes(fig, style.label("confidence stated", "%"), style.label("names that are true", "%"))


def risk(board: Scoreboard) -> Any:
    """Share of wrong names among those with the highest confidence, or the highest z, against how many of all
    they are."""
    fig, trust = style.figure(360), board.trust
    coverage = [100.0 * c for c in trust.coverage]
    for label, colour, values in (
        ("by confidence", _DECIDABLE, trust.risk),
        ("by z alone", NEITHER, trust.risk_by_z),
    ):
        fig.add_scatter(
            x=coverage, y=[100.0 * v for v in values], mode="lines", name=label, line_color=colour
        )
    return style.axes(fig, style.label("coverage", "%"), style.label("wrong", "%"))


def confusion(board: Scoreboard) -> Any:
    """What was concealed (rows) against what was said first (columns), trials counted."""
    truths = sorted(board.confusion)
    outcomes = sorted(
        {o for line in board.confusion.values() for o in line}, key=lambda o: (o not in truths, o)
    )
    counts = np.array([[board.confusion[t].get(o, 0) for o in outcomes] for t in truths], dtype=float)
    fig = style.figure(260 + 24 * len(truths), margin={"l": 220, "r": 44, "t": 30, "b": 200})
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    fig.add_heatmap(
        z=shares,
        x=outcomes,
        y=truths,
        text=np.where(counts > 0, counts.astype(int).astype(str), ""),
        texttemplate="%{text}",
        colorscale=[[0.0, style.PAPER], [1.0, style.PREDICTED]],
        showscale=False,
        xgap=1,
        ygap=1,
    )
    fig.update_xaxes(tickangle=-90, showgrid=False)
    fig.update_yaxes(autorange="reversed", showgrid=False)
    return fig


def ratios(board: Scoreboard) -> Any:
    """Error left out after modelling over noise, against size."""
    fig = style.figure(360)
    for kind, colour in (("single", _DECIDABLE), ("pair", style.LOAD), ("confounded", style.RESIDUAL)):
        rows = [r for r in board.of_kind(kind) if isfinite(r.heldout_rad) and r.true_rad > 0.0]
        fig.add_scatter(
            x=[100.0 * r.size for r in rows],
            y=[r.heldout_rad / r.true_rad for r in rows],
            mode="markers",
            name=kind,
            marker={"color": colour, "size": 7, "opacity": 0.7},
            hovertext=[f"trial {r.number}: {', '.join(r.truth)}, said {r.outcome}" for r in rows],
        )
    fig.add_hline(y=1.0, line={"color": NEITHER, "dash": "dot"})
    fig.update_xaxes(type="log")
    fig.update_yaxes(type="log")
    return style.axes(fig, "contribution over loop width / %", "error left out / noise")


def deviations(board: Scoreboard) -> Any:
    """Deviation of stated values from the truth in stated standard deviations, beside the normal law."""
    z = np.array([e.z for r in board.rows for e in r.estimates])
    fig = style.figure(360)
    edges = np.linspace(-5.0, 5.0, 41)
    counts, _ = np.histogram(np.clip(z, -4.999, 4.999), edges)
    middle = 0.5 * (edges[:-1] + edges[1:])
    fig.add_bar(x=middle, y=counts, name="stated values", marker_color=style.translucent(_DECIDABLE, 0.5))
    law = len(z) * (edges[1] - edges[0]) * np.exp(-0.5 * middle**2) / sqrt(2.0 * np.pi)
    fig.add_scatter(x=middle, y=law, mode="lines", name="normal law", line_color=style.MEASURED)
    return style.axes(fig, "(stated − true) / stated sd", "values")


def _percent(value: float) -> float | None:
    return 100.0 * value if isfinite(value) else None


def _bars(rates: list[Rate]) -> dict[str, Any]:
    """Error bars of rates, in %."""
    up = [100.0 * (r.interval[1] - r.value) if r.of else 0.0 for r in rates]
    down = [100.0 * (r.value - r.interval[0]) if r.of else 0.0 for r in rates]
    return {"type": "data", "symmetric": False, "array": up, "arrayminus": down, "thickness": 1, "width": 3}
