"""Figures of the replay page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from cablecomp.recording.replay_summary import ReplaySummary
from cablecomp.recording.snapshots import BACK, END, GREATEST_LOAD, LEAST_LOAD, START, Snapshot, WrapProfile
from cablecomp.recording.table import FloatArray
from cablecomp.report import style
from cablecomp.report.replay_display import Display

_MEASURED: Final = style.translucent(style.MEASURED, 0.5)  # broad and pale, so that a prediction on it shows
_TIME: Final = style.label("time", "s")
_INSTANT_COLOURS: Final = {
    START: style.FAINT,
    GREATEST_LOAD: style.RESIDUAL,
    BACK: style.LOAD,
    LEAST_LOAD: style.PREDICTED,
    END: style.CABLE_L,
}


class Scale(NamedTuple):
    """shown = factor * value in rad, in `unit`."""

    factor: float
    unit: str


def scale(size_rad: float) -> Scale:
    """Return the unit (rad, mrad, µrad) in which angles up to `size_rad` read well."""
    for factor, unit in ((1.0, "rad"), (1e3, "mrad")):
        if size_rad * factor >= 0.5:
            return Scale(factor, unit)
    return Scale(1e3, "mrad") if size_rad >= 2e-5 else Scale(1e6, "µrad")


def over_time(display: Display, summary: ReplaySummary) -> Any:
    """Measured and predicted deflection with the band of bounds, and the load below, over one time axis."""
    rows, unit = display.rows, scale(summary.deflection_range_rad)
    loaded = display.has("load_Nm")
    fig = _stack([0.68, 0.32] if loaded else [1.0], 560 if loaded else 420)
    time, low, high = rows["time_s"], rows["deflection_low_rad"], rows["deflection_high_rad"]
    if display.has("deflection_low_rad"):
        edge = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip", "legendgroup": "bounds"}
        fig.add_scatter(x=time, y=_small(high * unit.factor), showlegend=False, row=1, col=1, **edge)
        fig.add_scatter(
            x=time, y=_small(low * unit.factor), name="guaranteed bounds",
            fill="tonexty", fillcolor=style.BOUNDS, row=1, col=1, **edge,
        )  # fmt: skip
    style.curve(fig, time, rows["deflection_measured_rad"] * unit.factor, "measured", _MEASURED, 3.2, row=1)
    style.curve(fig, time, rows["deflection_rad"] * unit.factor, "predicted", style.PREDICTED, 1.4, row=1)
    style.axes(fig, "", style.label("deflection", unit.unit), row=1, col=1)
    shown = [rows[name] * unit.factor for name in ("deflection_measured_rad", "deflection_rad")]
    style.keep_range(fig, shown, row=1)
    if loaded:
        style.curve(fig, time, rows["load_Nm"], "load", style.LOAD, 1.3, row=2)
        _mark_instants(fig, summary.snapshots)
        style.axes(fig, "", style.label("load", "N·m"), row=2, col=1)
    fig.update_xaxes(title_text=_TIME, row=2 if loaded else 1, col=1)
    fig.update_layout(hovermode="x")
    return fig


def loop(display: Display, summary: ReplaySummary) -> Any:
    """Deflection against load: measured, predicted, and the best straight line."""
    rows, unit = display.rows, scale(summary.deflection_range_rad)
    fig = style.figure(460)
    load, measured = rows["load_Nm"], rows["deflection_measured_rad"]
    style.curve(fig, load, measured * unit.factor, "measured", _MEASURED, 3.0)
    slope, offset = summary.baseline_linear_slope_rad_per_Nm, summary.baseline_linear_offset_rad
    if slope is not None and offset is not None:
        ends = np.array([np.nanmin(load), np.nanmax(load)])
        line = (offset + slope * ends) * unit.factor
        style.curve(fig, ends, line, "best straight line", style.BASELINE, 1.6, dash="dash")
    style.curve(fig, load, rows["deflection_rad"] * unit.factor, "predicted", style.PREDICTED, 1.3)
    return style.axes(fig, style.label("load", "N·m"), style.label("deflection", unit.unit))


def residual_over_time(display: Display, unit: Scale) -> Any:
    """Measured minus predicted joint position over time."""
    rows = display.rows
    fig = style.figure(320)
    style.curve(fig, rows["time_s"], rows["residual_rad"] * unit.factor, "residual", style.RESIDUAL, 1.1)
    fig.update_layout(showlegend=False)
    return style.axes(fig, _TIME, style.label("measured − predicted", unit.unit))


def histogram(display: Display, unit: Scale) -> Any:
    """How often each size of residual occurs, with the normal curve of equal mean and spread."""
    assert display.histogram is not None
    edges, counts = display.histogram
    filled = np.flatnonzero(counts)
    first, last = int(filled[0]), int(filled[-1]) + 1
    centres = 0.5 * (edges[1:] + edges[:-1]) * unit.factor
    share = 100.0 * counts / counts.sum()
    fig = style.figure(340, bargap=0.04)
    fig.add_bar(
        x=_small(centres[first:last]), y=_small(share[first:last]), name="residual",
        marker_color=style.translucent(style.RESIDUAL, 0.75),
    )  # fmt: skip
    mean = float((centres * share).sum() / 100.0)
    sd = math.sqrt(float((np.square(centres - mean) * share).sum()) / 100.0)
    if sd > 0.0:
        x = np.linspace(centres[first], centres[last - 1], 200)
        width = float(centres[1] - centres[0])
        bell = 100.0 * width / (sd * math.sqrt(2.0 * math.pi)) * np.exp(-0.5 * np.square((x - mean) / sd))
        style.curve(fig, x, bell, "normal curve", style.MEASURED, 1.4, dash="dot")
    return style.axes(fig, style.label("residual", unit.unit), style.label("share of samples", "%"))


def spectra(display: Display, unit: Scale) -> Any:
    """Amplitude spectral density of the measured deflection and of what the prediction leaves of it."""
    fig = style.figure(340)
    for density, name, colour in (
        (display.deflection_density, "measured deflection", style.MEASURED),
        (display.residual_density, "residual", style.RESIDUAL),
    ):
        if density is not None:
            keep = _log_spaced(density.frequency_Hz)
            style.curve(
                fig, density.frequency_Hz[keep], density.amplitude[keep] * unit.factor, name, colour, 1.4
            )
    fig.update_xaxes(type="log", dtick=1)
    fig.update_yaxes(type="log", dtick=1, exponentformat="power")
    return style.axes(fig, style.label("frequency", "Hz"), style.label("density", f"{unit.unit}/√Hz"))


def tensions(display: Display) -> Any:
    """Tension of the output stage's cables over time, predicted, and measured where recorded."""
    rows = display.rows
    fig = style.figure(320)
    for cable, colour in (("h", style.CABLE_H), ("l", style.CABLE_L)):
        if display.has(f"tension_{cable}_measured_N"):
            faint = style.translucent(colour, 0.35)
            measured = rows[f"tension_{cable}_measured_N"]
            style.curve(fig, rows["time_s"], measured, f"{cable}, measured", faint, 3.2)
        if display.has(f"tension_{cable}_N"):
            style.curve(fig, rows["time_s"], rows[f"tension_{cable}_N"], f"{cable}, predicted", colour, 1.3)
    return style.axes(fig, _TIME, style.label("tension", "N"))


def profiles(snapshots: Sequence[Snapshot]) -> Any:
    """Tension along each wrap at the chosen instants."""
    names = [profile.name for profile in snapshots[0].profiles]
    columns = min(2, len(names))
    lines = -(-len(names) // columns)
    fig = make_subplots(
        rows=lines, cols=columns, subplot_titles=names, shared_yaxes=True,
        vertical_spacing=0.24 / lines, horizontal_spacing=0.06,
    )  # fmt: skip
    fig.update_layout(template=style.template(), height=90 + 290 * lines, legend={"y": 1.03 + 0.07 / lines})
    for instant, snapshot in enumerate(snapshots):
        colour = _colour(snapshot)
        for k, profile in enumerate(snapshot.profiles):
            angle, tension = _capstan(profile)
            fig.add_scatter(
                x=_small(angle), y=_small(tension), mode="lines",
                line={"color": colour, "width": 2}, name=instant_name(snapshot),
                legendgroup=str(instant), showlegend=k == 0,
                row=k // columns + 1, col=k % columns + 1,
            )  # fmt: skip
    fig.update_xaxes(title_text=style.label("angle from the termination", "rad"), row=lines)
    for line in range(lines):
        fig.update_yaxes(title_text=style.label("tension", "N"), row=line + 1, col=1)
    return fig


def instant_name(snapshot: Snapshot) -> str:
    """Return how a chosen instant is called on the page."""
    load = "" if snapshot.load_Nm is None else f", {snapshot.load_Nm:.3g} N·m"
    return f"{snapshot.label} ({snapshot.time_s:.4g} s{load})".replace("-", "−")


def _capstan(profile: WrapProfile, points: int = 12) -> tuple[FloatArray, FloatArray]:
    """Angle and tension drawn between the points of a profile, where tension grows or falls exponentially."""
    angle, tension = np.asarray(profile.angle_rad), np.asarray(profile.tension_N)
    knots = np.arange(len(angle), dtype=np.float64)
    dense = np.linspace(0.0, len(angle) - 1.0, (len(angle) - 1) * points + 1)
    if len(angle) < 2 or tension.min() <= 0.0:
        return angle, tension
    return np.interp(dense, knots, angle), np.exp(np.interp(dense, knots, np.log(tension)))


def _colour(snapshot: Snapshot) -> str:
    return _INSTANT_COLOURS[snapshot.label.split(",")[0]]


def _stack(heights: list[float], height: int) -> Any:
    fig = make_subplots(
        rows=len(heights), cols=1, shared_xaxes=True, row_heights=heights, vertical_spacing=0.06
    )
    fig.update_layout(template=style.template(), height=height)
    return fig


def _mark_instants(fig: Any, snapshots: Sequence[Snapshot]) -> None:
    for snapshot in snapshots:
        colour = _colour(snapshot)
        fig.add_scatter(
            x=[snapshot.time_s], y=[snapshot.load_Nm], mode="markers", showlegend=False,
            name=instant_name(snapshot), row=2, col=1,
            marker={"size": 9, "color": colour, "line": {"color": "white", "width": 1.5}},
        )  # fmt: skip


def _log_spaced(frequency: FloatArray, points: int = 400) -> NDArray[np.intp]:
    wanted = np.geomspace(frequency[0], frequency[-1], points)
    return np.unique(np.searchsorted(frequency, wanted).clip(0, len(frequency) - 1))


def _small(values: FloatArray) -> NDArray[np.float32]:
    return values.astype(np.float32)
