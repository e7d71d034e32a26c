"""`report.html` of a run: what was asked, what the joint did, what the observer said, how time and data
were kept.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from plotly.subplots import make_subplots

from cablecomp.durable import write_durably
from cablecomp.report import page, style
from cablecomp.report.page import Fact, Section
from cablecomp.report.run_data import Floats, RunData, load_run
from cablecomp.runtime.results import JointResult, RunReport

TIME = style.label("time", "s")
_POINTS: Final = 4000
"""Rows that are drawn, of all joints together."""
TOLD: Final = "The load was found from both encoders: the joint's is no test of the prediction."
BAND = "The band holds the truth whatever went before the run; where it is wider than the curves it is cut."


def write_run_page(report: RunReport, config_text: str) -> Path:
    """Write the page beside the run's files and return its path."""
    assert report.folder is not None
    path = report.folder / "report.html"
    write_durably(path, run_page(report, config_text).encode())
    return path


def run_page(report: RunReport, config_text: str) -> str:
    """The page of one run as HTML that opens offline."""
    names = ", ".join(joint.name for joint in report.joints)
    lead = f"{report.timing.ticks} ticks at {report.timing.asked_Hz:g} Hz; ended: {report.stop_reason}."
    return page.page(f"Run: {names}", lead, _sections(report, config_text))


def run_facts(joint: JointResult) -> list[Fact]:
    """Cards of one joint."""
    if _forced(joint):
        true = "" if np.isnan(joint.true_torque_Nm) else f"true: {page.number(joint.true_torque_Nm, 'N·m')}"
        facts = [Fact("joint torque error, RMS", page.number(joint.torque_Nm, "N·m"), true)]
    else:
        true = "" if np.isnan(joint.true_position_rad) else f"true: {_angle(joint.true_position_rad)}"
        facts = [Fact("joint position error, RMS", _angle(joint.position_rad), true)]
    if not np.isnan(joint.residual_rad):
        what = "joint encoder less prediction"
        facts.append(Fact("prediction residual, RMS", _angle(joint.residual_rad), what))
    facts.append(Fact("deflection, RMS", _angle(joint.deflection_rad), "what the motor has to make up for"))
    trouble = sum(n for phase, n in joint.phases.items() if phase != "normal")
    tone: page.Tone = "bad" if joint.phases.get("stopped", 0) else "warn" if trouble else "good"
    facts.append(Fact("cycles with stale data", str(trouble), f"of {sum(joint.phases.values())}", tone))
    return facts


def position_figure(data: RunData) -> Any:
    """Asked and measured joint position (predicted, where no encoder is read), error, load, over time."""
    fig = stack([0.45, 0.3, 0.25], 640)
    time, name = data.time_s, "measured" if data.is_measured else "predicted"
    curve(fig, time, 1e3 * data.asked_rad, "asked", style.BASELINE, 1, 3.0)
    curve(fig, time, 1e3 * data.joint_rad, name, style.PREDICTED, 1)
    curve(fig, time, 1e3 * data.error_rad(), "error", style.RESIDUAL, 2)
    curve(fig, time, data.column("joint_torque_Nm"), "load", style.LOAD, 3)
    style.axes(fig, "", style.label("joint position", "mrad"), row=1, col=1)
    style.axes(fig, "", style.label("error", "mrad"), row=2, col=1)
    style.axes(fig, TIME, style.label("load", "N·m"), row=3, col=1)
    error = np.abs(1e3 * data.error_rad()[data.controlled])
    if len(error):
        top = 1.15 * float(np.nanmax(error)) + 1e-6
        fig.update_yaxes(range=[-top, top], row=2, col=1)
    return fig


def torque_figure(data: RunData) -> Any:
    """Asked and found load, error, joint position, over time: what force mode is about."""
    fig = stack([0.45, 0.3, 0.25], 640)
    time, found = data.time_s, data.cycles["load_estimate_Nm"]
    asked = np.where(data.cycles["controlled"] > 0.0, data.cycles["reference_torque_Nm"], np.nan)
    curve(fig, time, asked, "asked", style.BASELINE, 1, 3.0)
    curve(fig, time, found, "found", style.LOAD, 1)
    curve(fig, time, found - asked, "error", style.RESIDUAL, 2)
    curve(fig, time, 1e3 * data.joint_rad, "joint position", style.PREDICTED, 3)
    style.keep_range(fig, [(found - asked)[data.controlled]], row=2)
    style.axes(fig, "", style.label("load", "N·m"), row=1, col=1)
    style.axes(fig, "", style.label("error", "N·m"), row=2, col=1)
    style.axes(fig, TIME, style.label("joint position", "mrad"), row=3, col=1)
    return fig


def deflection_figure(data: RunData, tested: bool = True) -> Any:
    """Predicted deflection with its bounds, what the motor made up for, residual; `tested` False: the joint encoder
    told the load, which leaves none."""
    fig = stack([0.62, 0.38], 520) if tested else stack([1.0], 360)
    time, p = data.time_s, data.prediction
    low, high = 1e3 * p["deflection_low_rad"], 1e3 * p["deflection_high_rad"]
    if np.any(np.isfinite(low)):
        edge = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
        fig.add_scatter(x=time, y=high, showlegend=False, row=1, col=1, **edge)
        fig.add_scatter(
            x=time,
            y=low,
            name="guaranteed bounds",
            fill="tonexty",
            fillcolor=style.BOUNDS,
            row=1,
            col=1,
            **edge,
        )
    measured = 1e3 * (p["deflection_rad"] + p["residual_rad"])
    pale = style.translucent(style.MEASURED, 0.45)
    if tested:
        curve(fig, time, measured, "measured", pale, 1, 3.0)
    curve(fig, time, 1e3 * p["deflection_rad"], "predicted", style.PREDICTED, 1)
    curve(fig, time, 1e3 * data.cycles["deflection_ahead_rad"], "made up for", style.CABLE_L, 1)
    style.keep_range(fig, [measured, 1e3 * p["deflection_rad"]], row=1)
    style.axes(fig, "" if tested else TIME, style.label("deflection", "mrad"), row=1, col=1)
    if tested:
        curve(fig, time, 1e3 * p["residual_rad"], "residual", style.RESIDUAL, 2)
        style.keep_range(fig, [1e3 * p["residual_rad"][data.controlled]], row=2)
        style.axes(fig, TIME, style.label("residual", "mrad"), row=2, col=1)
    return fig


def tension_figure(data: RunData) -> Any:
    """Tensions of the output stage's cables, and the load-deflection loop beside them."""
    fig = make_subplots(rows=1, cols=2, horizontal_spacing=0.12)
    fig.update_layout(template=style.template(), height=380)
    p = data.prediction
    curve(fig, data.time_s, p["tension_h_N"], "cable h", style.CABLE_H, 1)
    curve(fig, data.time_s, p["tension_l_N"], "cable l", style.CABLE_L, 1)
    load = data.column("joint_torque_Nm")
    fig.add_scatter(
        x=1e3 * p["deflection_rad"],
        y=load,
        mode="lines",
        name="loop",
        line={"color": style.PREDICTED, "width": 1},
        row=1,
        col=2,
    )
    style.axes(fig, TIME, style.label("tension", "N"), row=1, col=1)
    style.axes(fig, style.label("deflection", "mrad"), style.label("load", "N·m"), row=1, col=2)
    return fig


def stack(heights: list[float], height: int) -> Any:
    """Plots one above the other over one time axis."""
    fig = make_subplots(
        rows=len(heights), cols=1, shared_xaxes=True, row_heights=heights, vertical_spacing=0.05
    )
    fig.update_layout(template=style.template(), height=height, hovermode="x")
    return fig


def curve(fig: Any, x: Floats, y: Floats, name: str, colour: str, row: int, width: float = 1.3) -> None:
    """One line, if it has any number in it."""
    if np.any(np.isfinite(y)):
        fig.add_scatter(
            x=np.round(x, 5),
            y=y.astype(np.float32),
            mode="lines",
            name=name,
            line={"color": colour, "width": width},
            row=row,
            col=1,
        )


def timing_section(report: RunReport) -> Section:
    """How time and data were kept."""
    return Section("Timing and data", page.table(("what", "how"), report.timing.rows()))


def _sections(report: RunReport, config_text: str) -> Iterator[Section]:
    for joint in report.joints:
        yield Section(joint.name, page.facts(run_facts(joint)))
        if report.folder is None:
            continue
        folder = report.folder if len(report.joints) == 1 else report.folder / joint.name
        if not (folder / "recording.csv").exists():  # stopped before its first sample
            continue
        data = load_run(folder, max(_POINTS // len(report.joints), 400))
        if data.rows == 0:  # a disk that was full from the beginning
            continue
        if _forced(joint):
            yield Section(f"{joint.name}: load", page.figure(torque_figure(data)))
        else:
            yield Section(f"{joint.name}: position", page.figure(position_figure(data)))
        tested = not np.isnan(joint.residual_rad)
        lead = BAND if tested or np.all(np.isnan(data.joint_rad)) else f"{TOLD} {BAND}"
        yield Section(f"{joint.name}: deflection", page.figure(deflection_figure(data, tested)), lead)
        yield Section(f"{joint.name}: cables", page.figure(tension_figure(data)))
    yield timing_section(report)
    if report.events:
        rows = [(round(t, 4), j, w) for t, j, w in report.events]
        yield Section("Events", page.table(("time / s", "joint", "what"), rows))
    yield Section("Configuration", page.fold("joint.toml", page.code(config_text)))


def _forced(joint: JointResult) -> bool:
    """Whether torque was asked for, and no position."""
    return not np.isnan(joint.torque_Nm)


def _angle(value: float) -> str:
    return page.number(1e3 * value, "mrad")
