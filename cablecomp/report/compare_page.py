"""`report.html` of a comparison: three controllers on one bus under the same motions and loads."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cablecomp.report import page, style
from cablecomp.report.page import Fact, Section
from cablecomp.report.run_data import RunData, load_run
from cablecomp.report.run_page import TIME, curve, deflection_figure, stack, timing_section
from cablecomp.runtime.compare import LINEAR, MOTOR_ALONE, NAMES, OBSERVER, Comparison
from cablecomp.runtime.results import RunReport

_COLOURS = {MOTOR_ALONE: style.BASELINE, LINEAR: style.RESIDUAL, OBSERVER: style.PREDICTED}
_WORDS = {
    MOTOR_ALONE: "motor-side control alone",
    LINEAR: "linear-stiffness compensator",
    OBSERVER: "compensated by the observer",
}


def write_comparison(found: Comparison, out: Path, config_text: str) -> Path:
    """Write the page into `out` and return its path."""
    path = out / "report.html"
    path.write_text(comparison_page(found, out, config_text), encoding="utf-8")
    return path


def comparison_page(found: Comparison, out: Path, config_text: str) -> str:
    """The page as HTML that opens offline."""
    lead = (
        "Three joints of one kind on one bus, same motions, same changing load; the only difference is what "
        "the motor makes up for. The other side of the wire is a simulation with equations of its own."
    )
    return page.page(f"Compensated and not: {found.name}", lead, _sections(found, out, config_text))


def summary_rows(found: Comparison) -> list[tuple[str, str, str, str, str]]:
    """Controller, true joint-side RMS error without and with joint encoder feedback (mrad), and factors
    over the observer's.
    """
    return [
        (_WORDS[name], *_cells(found, name, found.open_loop), *_cells(found, name, found.closed_loop))
        for name in NAMES
    ]


def _cells(found: Comparison, name: str, report: RunReport) -> tuple[str, str]:
    joint = next(j for j in report.joints if j.name == name)
    return f"{1e3 * joint.true_position_rad:.4f}", f"{found.factor(name, report):.1f}×"


HEADERS = ("controller", "RMS error / mrad", "over ours", "with joint feedback / mrad", "over ours")


def _sections(found: Comparison, out: Path, config_text: str) -> Iterator[Section]:
    yield Section("Result", page.facts(_facts(found)) + page.table(HEADERS, summary_rows(found)))
    data = {name: load_run(out / "open-loop" / name, 5000) for name in NAMES}
    yield Section(
        "Joint-side error, motor-side sensing only",
        page.figure(_errors(data)),
        "Joint encoder less what was asked for. No controller sees the joint encoder here.",
    )
    yield Section("What was made up for", page.figure(deflection_figure(data[OBSERVER])))
    yield Section(
        "Load and deflection",
        page.figure(_loop(data[OBSERVER], found)),
        "The loop that the straight line of a linear compensator cannot follow.",
    )
    closed = {name: load_run(out / "closed-loop" / name, 5000) for name in NAMES}
    yield Section(
        "With feedback on the joint encoder, quicker motions",
        page.figure(_errors(closed)),
        "All three have the same feedback on the joint encoder; the motions are three times as fast.",
    )
    yield Section(
        "Force without a torque sensor",
        page.figure(_force(load_run(out / "force", 5000))),
        "Joint torque from both encoders through the inverse, against a wall; the torque sensor looks on.",
    )
    yield Section("Calibration", _calibration(found))
    yield timing_section(found.open_loop)
    yield Section("Configuration", page.fold("joint, calibrated", page.code(config_text)))


def _facts(found: Comparison) -> list[Fact]:
    ours = next(j for j in found.open_loop.joints if j.name == OBSERVER)
    alone, linear = found.factor(MOTOR_ALONE), found.factor(LINEAR)
    return [
        Fact(
            "joint error, compensated", page.number(1e3 * ours.true_position_rad, "mrad"), "RMS, true angle"
        ),
        Fact("below motor-side control", f"{alone:.1f}×", "asked: 20×", "good" if alone >= 20 else "warn"),
        Fact("below linear stiffness", f"{linear:.1f}×", "asked: 8×", "good" if linear >= 8 else "warn"),
        Fact(
            "force error",
            f"{100 * found.force_share:.2f} %",
            f"RMS, of {found.force_range_Nm:.3g} N·m; asked: 3 %",
            "good" if found.force_share < 0.03 else "warn",
        ),
        Fact("step of one joint", _step(found.open_loop), "median; observer and compensator"),
    ]


def _step(report: RunReport) -> str:
    return f"{report.timing.step.p50_s * 1e6:.1f} µs"


def _errors(data: dict[str, RunData]) -> Any:
    fig = stack([0.55, 0.45], 560)
    for name, run in data.items():
        on = run.controlled
        curve(fig, run.time_s[on], 1e3 * run.error_rad()[on], _WORDS[name], _COLOURS[name], 1)
    run = data[OBSERVER]
    curve(fig, run.time_s, run.column("joint_torque_Nm"), "load", style.LOAD, 2)
    curve(fig, run.time_s, run.asked_rad, "asked position (rad)", style.MEASURED, 2)
    style.axes(fig, "", style.label("joint error", "mrad"), row=1, col=1)
    style.axes(fig, TIME, "load / N·m, position / rad", row=2, col=1)
    return fig


def _loop(run: RunData, found: Comparison) -> Any:
    fig = style.figure(440)
    load = run.column("joint_torque_Nm")
    measured = 1e3 * (run.prediction["deflection_rad"] + run.prediction["residual_rad"])
    fig.add_scatter(
        x=measured, y=load, mode="lines", name="measured", line={"color": style.BASELINE, "width": 3}
    )
    fig.add_scatter(
        x=1e3 * run.prediction["deflection_rad"],
        y=load,
        mode="lines",
        name="predicted",
        line={"color": style.PREDICTED, "width": 1},
    )
    ends = np.array([np.nanmin(load), np.nanmax(load)])
    fig.add_scatter(
        x=1e3 * ends / found.linear_Nm_per_rad,
        y=ends,
        mode="lines",
        name="linear stiffness",
        line={"color": style.RESIDUAL, "width": 1.3, "dash": "dash"},
    )
    return style.axes(fig, style.label("deflection", "mrad"), style.label("load", "N·m"))


def _force(run: RunData) -> Any:
    fig = stack([0.65, 0.35], 480)
    on = run.controlled
    time, asked = run.time_s[on], run.cycles["reference_torque_Nm"][on]
    curve(fig, time, asked, "asked", style.BASELINE, 1, 2.5)
    curve(fig, time, run.cycles["load_estimate_Nm"][on], "known from both encoders", style.PREDICTED, 1)
    curve(fig, time, run.column("joint_torque_Nm")[on], "torque sensor, not used", style.MEASURED, 1)
    curve(fig, time, run.column("joint_torque_Nm")[on] - asked, "torque sensor less asked", style.RESIDUAL, 2)
    style.axes(fig, "", style.label("joint torque", "N·m"), row=1, col=1)
    style.axes(fig, TIME, style.label("error", "N·m"), row=2, col=1)
    return fig


def _calibration(found: Comparison) -> str:
    rows = [*found.calibrated.rows, ("best straight line", f"{found.linear_Nm_per_rad:.4g} N·m/rad")]
    return page.table(("parameter", "from one recording of 60 s"), rows) + page.bullets(
        found.calibrated.warnings
    )
