"""Figures of the diagnosis page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from plotly.subplots import make_subplots
from scipy.signal import welch

from cablecomp.diagnosis.covariates import UNITS
from cablecomp.report import style
from cablecomp.report.diagnosis_view import FloatArray, Hypothesis, RecordingView
from cablecomp.report.replay_figures import Scale, scale

BEFORE: Final = style.RESIDUAL
AFTER: Final = style.PREDICTED
_MEASURED: Final = style.translucent(style.MEASURED, 0.45)
_HELD: Final = "rgba(107, 79, 187, 0.08)"
_TIME: Final = style.label("time", "s")
_MOST_POINTS: Final = 4_000
_WORDS: Final[Mapping[str, str]] = {
    "load_direction": "direction of the load",
    "load_rate": "rate of the load",
    "dwell": "time since the load stopped",
    "reversal": "load since the last reversal",
    "motor_angle": "motor angle",
    "joint_angle": "joint angle",
}


def words(covariate: str) -> str:
    """Return a covariate's name in plain words."""
    if covariate.startswith("other:"):
        return f"channel {covariate.removeprefix('other:')}"
    return _WORDS.get(covariate, covariate)


def unit_of(covariate: str) -> str:
    """Return a covariate's unit."""
    return UNITS.get(covariate, "")


def shares(mismatch: Sequence[Mapping[str, Any]]) -> Any:
    """Share of the mismatch that each covariate accounts for, ranked; pale bars are not beyond chance."""
    shown = list(mismatch)[:9][::-1]
    fig = style.figure(80 + 34 * len(shown), margin={"l": 190, "r": 40, "t": 30, "b": 46})
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


def overlay(view: RecordingView, intervals: Sequence[Sequence[float]]) -> Any:
    """Deflection over time: measured, before, after; residuals below with the intervals of the
    mismatch; the load.
    """
    time, keep = view.covariates["time"], _thin(view)
    deflection = view.measured_rad - view.rigid_rad
    unit, small = _unit(deflection), _unit(view.residual_before)
    fig = make_subplots(
        rows=3, cols=1, shared_xaxes=True, row_heights=[0.46, 0.32, 0.22], vertical_spacing=0.05
    )
    fig.update_layout(template=style.template(), height=680, hovermode="x")
    x = time[keep]
    for values, name, colour, width in (
        (view.measured_rad, "measured", _MEASURED, 3.4),
        (view.before_rad, "before", BEFORE, 1.3),
        (view.after_rad, "after", AFTER, 1.5),
    ):
        style.curve(fig, x, ((values - view.rigid_rad) * unit.factor)[keep], name, colour, width, row=1)
    style.curve(fig, x, (view.residual_before * small.factor)[keep], "residual before", BEFORE, 1.0, row=2)
    style.curve(fig, x, (view.residual_after * small.factor)[keep], "residual after", AFTER, 1.0, row=2)
    style.curve(fig, x, view.covariates["load"][keep], "load", style.LOAD, 1.3, row=3)
    for begin, end in list(intervals)[:40]:
        fig.add_vrect(x0=begin, x1=end, fillcolor=style.translucent(BEFORE, 0.10), line_width=0, row=2, col=1)
    for begin, end in _stretches(view) if view.heldout.mean() < 0.8 else ():
        fig.add_vrect(x0=begin, x1=end, fillcolor=_HELD, line_width=0, row=1, col=1)
    style.axes(fig, "", style.label("deflection", unit.unit), row=1, col=1)
    style.axes(fig, "", style.label("residual", small.unit), row=2, col=1)
    style.axes(fig, _TIME, style.label("load", "N·m"), row=3, col=1)
    return fig


def loops(view: RecordingView) -> Any:
    """Deflection against load, the measured loop beneath, before on the left, after on the right."""
    keep = _thin(view)
    deflection = view.measured_rad - view.rigid_rad
    unit = _unit(deflection)
    fig = make_subplots(rows=1, cols=2, shared_yaxes=True, horizontal_spacing=0.04)
    fig.update_layout(template=style.template(), height=430)
    load = view.covariates["load"][keep]
    for column, (values, name, colour) in enumerate(
        ((view.before_rad, "before", BEFORE), (view.after_rad, "after", AFTER)), start=1
    ):
        measured = (deflection * unit.factor)[keep]
        style.curve(fig, load, measured, "measured", _MEASURED, 3.0, row=1, col=column, legend=column == 1)
        predicted = ((values - view.rigid_rad) * unit.factor)[keep]
        style.curve(fig, load, predicted, name, colour, 1.3, row=1, col=column)
        style.axes(
            fig,
            style.label("load", "N·m"),
            style.label("deflection", unit.unit) if column == 1 else "",
            row=1,
            col=column,
        )
    return fig


def energy_map(views: Sequence[RecordingView], covariate: str, noise_rad: float) -> Any:
    """RMS residual over time and a covariate, in noise floors, before (above) and after (below), one
    colour scale.
    """
    time = _clock(views)
    values = np.concatenate([view.covariates[covariate] for view in views])
    maps = []
    edges_t, edges_c = np.linspace(time.min(), time.max(), 61), _edges(values)
    for residual in (_joined(views, "residual_before"), _joined(views, "residual_after")):
        power, _, _ = np.histogram2d(time, values, bins=(edges_t, edges_c), weights=residual**2)
        count, _, _ = np.histogram2d(time, values, bins=(edges_t, edges_c))
        with np.errstate(invalid="ignore", divide="ignore"):
            maps.append(np.sqrt(power / np.where(count > 0, count, np.nan)).T / noise_rad)
    top = float(np.nanquantile(maps[0], 0.98))
    fig = make_subplots(
        rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.08, subplot_titles=("before", "after")
    )
    fig.update_layout(template=style.template(), height=520)
    for row, energy in enumerate(maps, start=1):
        fig.add_heatmap(
            x=np.round(0.5 * (edges_t[1:] + edges_t[:-1]), 4),
            y=np.round(0.5 * (edges_c[1:] + edges_c[:-1]), 6),
            z=np.round(energy, 3),
            zmin=0.0,
            zmax=max(top, 2.0),
            colorscale=style.SEQUENCE,
            showscale=row == 1,
            colorbar={"title": {"text": "× noise"}, "len": 1.0, "y": 0.5, "thickness": 14},
            hoverongaps=False,
            row=row,
            col=1,
        )
        style.axes(
            fig, _TIME if row == 2 else "", style.label(words(covariate), unit_of(covariate)), row=row, col=1
        )
    return fig


def along(views: Sequence[RecordingView], covariate: str, noise_rad: float) -> Any:
    """Mean residual along a covariate, loading and unloading apart, before and after, with the floor."""
    values = np.concatenate([view.covariates[covariate] for view in views])
    before, after = _joined(views, "residual_before"), _joined(views, "residual_after")
    direction = np.concatenate(
        [view.covariates.get("load_direction", np.zeros(len(view.measured_rad))) for view in views]
    )
    unit = _unit(before)
    fig = style.figure(420, margin={"l": 64, "r": 24, "t": 74, "b": 52})
    fig.add_hrect(
        y0=-noise_rad * unit.factor,
        y1=noise_rad * unit.factor,
        fillcolor="rgba(100, 116, 139, 0.15)",
        line_width=0,
    )
    groups = [("loading", direction > 0.0, "solid"), ("unloading", direction < 0.0, "dot")]
    if covariate == "load_direction" or not np.any(direction != 0.0):
        groups = [("", np.ones(len(values), dtype=np.bool_), "solid")]
    for residual, name, colour in ((before, "before", BEFORE), (after, "after", AFTER)):
        for way, mask, dash in groups:
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
        style.label("mean residual", unit.unit),
    )


def spectra(views: Sequence[RecordingView], noise_rad: float) -> Any:
    """Amplitude spectral density of the residual before and after, and that of white noise of the
    floor's size.
    """
    fig = style.figure(390)
    longest = max(views, key=lambda view: len(view.measured_rad))
    time = longest.covariates["time"]
    step = float(np.median(np.diff(time)))
    size = int(min(len(time), max(256, len(time) // 8)))
    for residual, name, colour in (
        (longest.residual_before, "before", BEFORE),
        (longest.residual_after, "after", AFTER),
    ):
        frequency, power = welch(residual, 1.0 / step, nperseg=size)
        used = frequency > 0.0
        style.curve(fig, frequency[used], np.sqrt(power[used]), name, colour, 1.5)
    floor = noise_rad * np.sqrt(2.0 * step)
    ends = np.array([1.0 / (size * step), 0.5 / step])
    style.curve(fig, ends, np.full(2, floor), "noise floor, white", style.MUTED, 1.2, dash="dash")
    fig.update_xaxes(type="log")
    fig.update_yaxes(type="log", exponentformat="power")
    return style.axes(fig, style.label("frequency", "Hz"), style.label("residual", "rad/√Hz"))


def hypotheses(entries: Sequence[Hypothesis]) -> Any:
    """Share of the held-out mean square that each hypothesis removes, with two standard deviations."""
    shown = [entry for entry in entries if np.isfinite(entry.heldout_gain)][:20][::-1]
    fig = style.figure(90 + 26 * len(shown), margin={"l": 270, "r": 30, "t": 30, "b": 46})
    colours = {"named": style.CABLE_L, "unnamed": style.translucent(style.BASELINE, 0.75)}
    fig.add_bar(
        x=[100.0 * entry.heldout_gain for entry in shown],
        y=[entry.name.replace("_", " ") for entry in shown],
        orientation="h",
        marker_color=[colours["named" if entry.outcome == "named" else "unnamed"] for entry in shown],
        error_x={
            "type": "data", "array": [200.0 * entry.gain_sd for entry in shown],
            "thickness": 1.2, "width": 3, "color": style.MUTED,
        },
        hovertext=[entry.why for entry in shown],
    )  # fmt: skip
    lowest = min([0.0, *(100.0 * entry.heldout_gain for entry in shown)])
    fig.update_xaxes(range=[max(-30.0, 1.1 * lowest), 104])
    fig.update_layout(bargap=0.3)
    return style.axes(fig, style.label("held-out mean square removed", "%"), "")


def _thin(view: RecordingView) -> slice:
    return slice(None, None, max(1, len(view.measured_rad) // _MOST_POINTS))


def _unit(values: FloatArray) -> Scale:
    return scale(float(np.quantile(np.abs(values), 0.99)))


def _joined(views: Sequence[RecordingView], name: str) -> FloatArray:
    return np.concatenate([getattr(view, name) for view in views])


def _clock(views: Sequence[RecordingView]) -> FloatArray:
    """Times of several recordings one after the other."""
    out, end = [], 0.0
    for view in views:
        time = view.covariates["time"]
        out.append(time if len(views) == 1 else time - time[0] + end)
        end = float(out[-1][-1])
    return np.concatenate(out)


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


def _stretches(view: RecordingView) -> list[tuple[float, float]]:
    """Times of the held-out stretches."""
    held = np.concatenate(([False], view.heldout, [False]))
    starts = np.flatnonzero(held[1:] & ~held[:-1])
    ends = np.flatnonzero(held[:-1] & ~held[1:]) - 1
    time = view.covariates["time"]
    return [(float(time[a]), float(time[b])) for a, b in zip(starts, ends, strict=True)]


def _p(value: float) -> str:
    return "< 0.001" if value < 0.0015 else f"= {value:.2g}"
