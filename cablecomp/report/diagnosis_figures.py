"""Figures of the diagnosis page. Angles of a page stand in one unit, `unit`."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from plotly.subplots import make_subplots

from cablecomp.diagnosis.locate.covariates import UNITS
from cablecomp.diagnosis.result import Tested, Traces
from cablecomp.report import style
from cablecomp.report.diagnosis_words import covariate as words
from cablecomp.report.diagnosis_words import plain
from cablecomp.report.replay_figures import Scale
from cablecomp.signal.smoothing import FloatArray

BEFORE: Final = style.RESIDUAL
AFTER: Final = style.PREDICTED
_OUTCOMES: Final = {
    "named": style.CABLE_L,
    "candidate": style.WARN,
    "not needed": style.translucent(style.BASELINE, 0.6),
}
_MEASURED: Final = style.translucent(style.MEASURED, 0.45)
_UNSEEN: Final = style.translucent(style.LOAD, 0.10)
_TIME: Final = style.label("time", "s")
_MOST_INTERVALS: Final = 40
_MOST_TRIED: Final = 24
_BESIDE: Final = 24
"""Letters of an axis' name beside a low figure, after which it goes on in a new line."""


def unit_of(covariate: str) -> str:
    """Return a covariate's unit."""
    return UNITS.get(covariate, "")


_END: Final = 0.35
"""Share of a recording that is shown at a glance: its end."""


def _end_of(trace: Traces) -> Any:
    time = trace.covariates["time"]
    return time >= time[-1] - _END * (time[-1] - time[0])


def end_is_shaded(trace: Traces) -> bool:
    """Whether nothing was fitted to a stretch of the end that is shown at a glance."""
    return bool(_stretches(trace, _end_of(trace)))


def at_a_glance(trace: Traces, unit: Scale) -> Any:
    """Deflection over the end of a recording: measured, before, after; the errors below."""
    shown = _end_of(trace)
    fig = make_subplots(rows=2, cols=1, shared_xaxes=True, row_heights=[0.6, 0.4], vertical_spacing=0.06)
    fig.update_layout(template=style.template(), height=400, margin={"l": 60, "r": 44, "t": 34, "b": 46})
    _deflections(fig, trace, shown, unit)
    _residuals(fig, trace, shown, unit, row=2)
    unseen = _stretches(trace, shown)
    fig.update_layout(shapes=[*_bands(unseen, _UNSEEN, 1), *_bands(unseen, _UNSEEN, 2)])
    style.axes(fig, "", style.label("deflection", unit.unit), row=1, col=1)
    return style.axes(fig, _TIME, style.label("error", unit.unit), row=2, col=1)


def shares(mismatch: Sequence[Mapping[str, Any]]) -> Any:
    """Share of the mismatch that each covariate accounts for, ranked; pale bars are not beyond chance."""
    shown = list(mismatch)[:9][::-1]
    fig = style.figure(80 + 34 * len(shown), margin={"l": 190, "r": 44, "t": 30, "b": 46})
    colours = [BEFORE if e["p_value"] < 0.05 else style.translucent(style.BASELINE, 0.6) for e in shown]
    fig.add_bar(
        x=[100.0 * e["share"] for e in shown],
        y=[words(e["covariate"]) for e in shown],
        orientation="h",
        marker_color=colours,
        text=[f"{100.0 * e['share']:.0f} %   p {_p(e['p_value'])}" for e in shown],
        textposition="outside",
        cliponaxis=False,
        hovertext=[e.get("how", "") for e in shown],
    )
    fig.update_xaxes(range=[0, 128], tickvals=[0, 25, 50, 75, 100])
    fig.update_layout(bargap=0.35)
    return style.axes(fig, style.label("share of the mismatch's energy", "%"), "")


def overlay(trace: Traces, intervals: Sequence[Sequence[float]], unit: Scale) -> Any:
    """Deflection over time: measured, before, after; residuals below with the intervals of the mismatch; the load."""
    time, load = trace.covariates["time"], trace.covariates["load"]
    loaded = bool(np.ptp(load) > 0.0)
    rows = 3 if loaded else 2
    heights = [0.46, 0.32, 0.22] if loaded else [0.58, 0.42]
    fig = make_subplots(rows=rows, cols=1, shared_xaxes=True, row_heights=heights, vertical_spacing=0.05)
    fig.update_layout(template=style.template(), height=640 if loaded else 520, hovermode="x")
    everything = np.ones(len(time), dtype=np.bool_)
    _deflections(fig, trace, everything, unit)
    _residuals(fig, trace, everything, unit, row=2)
    if loaded:
        style.curve(fig, time, load, "load", style.LOAD, 1.3, row=3)
        style.axes(fig, "", style.label("load", "N·m"), row=3, col=1)
    where = _bands(list(intervals)[:_MOST_INTERVALS], style.translucent(BEFORE, 0.10), 2)
    fig.update_layout(shapes=[*where, *_bands(_stretches(trace, everything), _UNSEEN, 1)])
    style.axes(fig, "", style.label("deflection", unit.unit), row=1, col=1)
    style.axes(fig, "", style.label("error", unit.unit), row=2, col=1)
    fig.update_xaxes(title_text=_TIME, row=rows, col=1)
    return fig


def loops(trace: Traces, unit: Scale) -> Any:
    """Deflection against load (or motor angle, where that is what moves), before on the left, after on the right."""
    deflection = trace.measured_rad - trace.rigid_rad
    moves = (
        np.ptp(trace.rigid_rad) > np.ptp(deflection[np.isfinite(deflection)])
        or not np.ptp(trace.covariates["load"]) > 0.0
    )
    name = "motor_angle" if moves else "load"
    x = trace.covariates[name]
    fig = make_subplots(rows=1, cols=2, shared_yaxes=True, horizontal_spacing=0.04)
    fig.update_layout(template=style.template(), height=430)
    pairs = ((trace.before_rad, "before", BEFORE), (trace.after_rad, "after", AFTER))
    for column, (values, label, colour) in enumerate(pairs, start=1):
        first = column == 1
        measured = deflection * unit.factor
        style.curve(fig, x, measured, "measured", _MEASURED, 3.0, row=1, col=column, legend=first)
        predicted = (values - trace.rigid_rad) * unit.factor
        style.curve(fig, x, predicted, label, colour, 1.3, row=1, col=column)
        y = style.label("deflection", unit.unit) if first else ""
        style.axes(fig, style.label(words(name), unit_of(name)), y, row=1, col=column)
    return fig


def energy_map(traces: Sequence[Traces], covariate: str, floor_rad: float) -> Any:
    """RMS residual over time and a covariate, in noise floors, before (above) and after (below), one colour scale."""
    seen = np.isfinite(_joined(traces, "before_rad"))
    time = np.concatenate([t.covariates["time"] for t in traces])[seen]
    values = np.concatenate([t.covariates[covariate] for t in traces])[seen]
    maps = []
    edges_t, edges_c = np.linspace(time.min(), time.max(), 61), _edges(values)
    for key in ("before_rad", "after_rad"):
        residual = _joined(traces, key)[seen]
        power, _, _ = np.histogram2d(time, values, bins=(edges_t, edges_c), weights=residual**2)
        count, _, _ = np.histogram2d(time, values, bins=(edges_t, edges_c))
        with np.errstate(invalid="ignore", divide="ignore"):
            maps.append(np.sqrt(power / np.where(count > 0, count, np.nan)).T / floor_rad)
    top = float(np.nanquantile(maps[0], 0.98))
    fig = make_subplots(
        rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.08, subplot_titles=("before", "after")
    )
    fig.update_layout(template=style.template(), height=460, margin={"l": 64, "r": 44, "t": 40, "b": 50})
    for row, energy in enumerate(maps, start=1):
        fig.add_heatmap(
            x=np.round(0.5 * (edges_t[1:] + edges_t[:-1]), 4),
            y=np.round(0.5 * (edges_c[1:] + edges_c[:-1]), 6),
            z=np.round(energy, 3).astype(np.float32),
            zmin=0.0,
            zmax=max(top, 2.0),
            colorscale=style.SEQUENCE,
            showscale=row == 1,
            colorbar={"title": {"text": "× noise"}, "len": 1.0, "y": 0.5, "thickness": 14},
            hoverongaps=False,
            row=row,
            col=1,
        )
        x = _TIME if row == 2 else ""
        y = textwrap.wrap(style.label(words(covariate), unit_of(covariate)), _BESIDE)
        style.axes(fig, x, "<br>".join(y), row=row, col=1)
    return fig


def along(traces: Sequence[Traces], covariate: str, floor_rad: float, unit: Scale) -> Any:
    """Mean residual of what was fitted along a covariate, loading and unloading apart, before and after, with the
    floor."""
    fitted = np.concatenate([np.asarray(t.counted) for t in traces])
    values = np.concatenate([t.covariates[covariate] for t in traces])
    direction = np.concatenate(
        [t.covariates.get("load_direction", np.zeros(len(t.measured_rad))) for t in traces]
    )
    fig = style.figure(460, margin={"l": 64, "r": 44, "t": 60, "b": 50})
    fig.add_hrect(
        y0=-floor_rad * unit.factor,
        y1=floor_rad * unit.factor,
        fillcolor=style.translucent(style.MUTED, 0.15),
        line_width=0,
    )
    groups = [("loading", direction > 0.0, "solid"), ("unloading", direction < 0.0, "dot")]
    if covariate == "load_direction" or not np.any(direction != 0.0):
        groups = [("", np.ones(len(values), dtype=np.bool_), "solid")]
    for key, name, colour in (("before_rad", "before", BEFORE), ("after_rad", "after", AFTER)):
        residual = _joined(traces, key)
        for way, rows, dash in groups:
            mask = rows & fitted & np.isfinite(residual)
            if np.count_nonzero(mask) < 20:
                continue
            centres, means = _binned(values[mask], residual[mask])
            label = f"{name}, {way}" if way else name
            fig.add_scatter(
                x=centres, y=means * unit.factor, name=label, mode="lines+markers",
                line={"color": colour, "width": 2, "dash": dash}, marker={"size": 5, "color": colour},
            )  # fmt: skip
    return style.axes(
        fig,
        style.label(words(covariate), unit_of(covariate)),
        style.label("mean error", unit.unit),
    )


def tried(entries: Sequence[Tested], rounds: Mapping[str, int]) -> Any:
    """Share of what was left that each hypothesis takes off data left out, none where it adds to it; of one that was
    fitted twice beside the same model the better fit.

    `rounds`: number of the model that it stood beside.
    """
    ranked = sorted(entries, key=lambda t: (rounds[t.beside], t.heldout_gain))
    best = {(rounds[t.beside], t.name): t for t in ranked}
    shown = sorted(best.values(), key=lambda t: (rounds[t.beside], -t.heldout_gain))[:_MOST_TRIED][::-1]
    fig = style.figure(96 + 24 * len(shown), margin={"l": 270, "r": 50, "t": 50, "b": 46})
    for outcome, colour in _OUTCOMES.items():
        own = [t for t in shown if t.outcome == outcome]
        if own:
            fig.add_bar(
                x=[100.0 * max(t.heldout_gain, 0.0) for t in own],
                y=[f"{rounds[t.beside]} · {plain(t.name)}" for t in own],
                orientation="h",
                marker_color=colour,
                name=outcome,
                text=[f"z {t.z:.1f}" for t in own],
                textposition="outside",
                cliponaxis=False,
                hovertext=[f"beside {t.beside}" for t in own],
            )
    order = [f"{rounds[t.beside]} · {plain(t.name)}" for t in shown]
    fig.update_yaxes(categoryorder="array", categoryarray=order)
    fig.update_xaxes(range=[0, 112])
    fig.update_layout(bargap=0.3, showlegend=True)
    return style.axes(fig, style.label("taken off what was left, data left out", "%"), "")


def dependence(points: Mapping[str, float], parameter: str, on: str) -> Any:
    """Values of a parameter by session as dots; over a condition, whose values are the keys, the law as a line: no
    recording has a value of its own there."""
    fig = style.figure(320)
    if on == "session":
        fig.add_scatter(
            x=list(points), y=list(points.values()), mode="markers", marker={"size": 9, "color": AFTER}
        )
    else:
        x = np.array([float(k) for k in points])
        order = np.argsort(x)
        y = np.array(list(points.values()))
        fig.add_scatter(x=x[order], y=y[order], mode="lines", line={"color": AFTER, "width": 2})
    return style.axes(fig, on, parameter)


def residual(trace: Traces, key: str) -> FloatArray:
    """Measured minus predicted, `key` one of `before_rad`, `after_rad`; NaN where nothing was measured."""
    return np.asarray(trace.measured_rad - getattr(trace, key), dtype=np.float64)


def not_fitted(trace: Traces) -> Any:
    """Rows that were measured and that nothing was fitted to."""
    return ~np.asarray(trace.counted) & np.isfinite(trace.measured_rad)


def _deflections(fig: Any, trace: Traces, shown: Any, unit: Scale) -> None:
    x = trace.covariates["time"][shown]
    for values, name, colour, width in (
        (trace.measured_rad, "measured", _MEASURED, 3.4),
        (trace.before_rad, "before", BEFORE, 1.3),
        (trace.after_rad, "after", AFTER, 1.5),
    ):
        style.curve(fig, x, ((values - trace.rigid_rad) * unit.factor)[shown], name, colour, width, row=1)


def _residuals(fig: Any, trace: Traces, shown: Any, unit: Scale, row: int) -> None:
    x = trace.covariates["time"][shown]
    for key, colour in (("before_rad", BEFORE), ("after_rad", AFTER)):
        y = (residual(trace, key) * unit.factor)[shown]
        style.curve(fig, x, y, f"error {key[:-4]}", colour, 1.0, row=row, legend=False)


def _joined(traces: Sequence[Traces], key: str) -> FloatArray:
    return np.concatenate([residual(t, key) for t in traces])


def _edges(values: FloatArray) -> FloatArray:
    low, high = np.quantile(values, (0.005, 0.995))
    if high <= low:
        low, high = low - 0.5, high + 0.5
    return np.linspace(low, high, 31)


def _binned(values: FloatArray, residual: FloatArray) -> tuple[FloatArray, FloatArray]:
    distinct = np.unique(values)
    if len(distinct) <= 3:
        means = [float(np.mean(residual[values == value])) for value in distinct]
        return distinct, np.array(means)
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, 33)))
    index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    count = np.bincount(index, minlength=len(edges) - 1)
    used = count > 3
    centres = np.bincount(index, values, len(edges) - 1)[used] / count[used]
    return centres, np.bincount(index, residual, len(edges) - 1)[used] / count[used]


def _bands(stretches: Sequence[Sequence[float]], colour: str, row: int) -> list[dict[str, Any]]:
    """Stretches of time shaded over the height of one row (shapes at once: one at a time takes plotly a second)."""
    axis = "" if row == 1 else str(row)
    return [
        {
            "type": "rect", "x0": begin, "x1": end, "xref": f"x{axis}", "y0": 0, "y1": 1, "yref": f"y{axis} domain",
            "fillcolor": colour, "line": {"width": 0}, "layer": "below",
        }
        for begin, end in stretches
    ]  # fmt: skip


def _stretches(trace: Traces, shown: Any) -> list[tuple[float, float]]:
    """Times of the stretches that nothing was fitted to; a reading that is missing there interrupts none."""
    whole = trace.covariates["time"]
    read = np.isfinite(trace.measured_rad) & shown
    out = np.concatenate(([False], not_fitted(trace)[read], [False]))
    starts = np.flatnonzero(out[1:] & ~out[:-1])
    ends = np.flatnonzero(out[:-1] & ~out[1:]) - 1
    time = whole[read]
    long = 0.01 * float(whole[-1] - whole[0])  # a reading set aside is no stretch
    found = [(float(time[a]), float(time[b])) for a, b in zip(starts, ends, strict=True)]
    return [(a, b) for a, b in found if b - a > long]


def _p(value: float) -> str:
    return "< 0.001" if value < 0.0015 else f"= {value:.2g}"
