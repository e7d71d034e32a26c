"""`report.html` of a comparison: three controllers on one bus under the same motions and loads."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from cablecomp.report import page, style
from cablecomp.report.page import Fact, Section
from cablecomp.report.run_data import RunData, load_run
from cablecomp.report.run_page import TIME, curve, deflection_figure, stack, timing_section
from cablecomp.runtime.compare import LINEAR, MOTOR_ALONE, NAMES, OBSERVER, QUICK, Comparison
from cablecomp.runtime.results import RunReport

_COLOURS = {MOTOR_ALONE: style.BASELINE, LINEAR: style.RESIDUAL, OBSERVER: style.PREDICTED}
_POINTS: Final = 2400
"""Rows of a run that are drawn."""
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
    error = _true(report, name)
    at_noise = error < _AT_NOISE * found.encoder_noise_rad
    return f"{1e3 * error:.4f}", "at the noise" if at_noise else f"{found.factor(name, report):.1f}×"


def _true(report: RunReport, name: str) -> float:
    return next(j.true_position_rad for j in report.joints if j.name == name)


def feedback_words(found: Comparison) -> str:
    """What feedback on the joint encoder leaves of the difference, and why."""
    noise, ours = found.encoder_noise_rad, _true(found.closed_loop, OBSERVER)
    words = (
        f"All three have the same feedback on the joint encoder; the motions "
        f"are {QUICK:g} times as fast. The encoder's "
        f"noise and resolution come to {1e3 * noise:.4f} mrad RMS."
    )
    if max(ours, _true(found.closed_loop, LINEAR)) < _AT_NOISE * noise:
        words += (
            " Feedback passes that noise on, and both compensators sit at it: "
            "there is nothing left to tell them apart by. "
            "They part where no joint encoder closes the loop (above)."
        )
    return words


_AT_NOISE: Final = 1.6
"""Times the encoder's noise below which an error says nothing of the compensator: feedback adds some to what it
reads."""
HEADERS = ("controller", "RMS error / mrad", "over ours", "with joint feedback / mrad", "over ours")


def _sections(found: Comparison, out: Path, config_text: str) -> Iterator[Section]:
    yield Section("Result", page.facts(_facts(found)) + page.table(HEADERS, summary_rows(found)))
    data = {name: load_run(out / "open-loop" / name, _POINTS) for name in NAMES}
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
    closed = {name: load_run(out / "closed-loop" / name, _POINTS) for name in NAMES}
    yield Section(
        "With feedback on the joint encoder, quicker motions",
        page.figure(_errors(closed)),
        feedback_words(found),
    )
    yield Section(
        "Force without a torque sensor",
        page.figure(_force(load_run(out / "force", _POINTS))),
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
            "joint error, compensated",
            page.number(1e3 * ours.true_position_rad, "mrad"),
            "RMS, true angle, motor-side sensing alone",
        ),
        Fact("below motor-side control", f"{alone:.1f}×", "its RMS error over ours", _tone(alone)),
        Fact("below linear stiffness", f"{linear:.1f}×", "its RMS error over ours", _tone(linear)),
        Fact(
            "force error",
            f"{100 * found.force_share:.2f} %",
            f"RMS, of the range of {found.force_range_Nm:.3g} N·m",
        ),
        Fact("step of one joint", _step(found.open_loop), "median; observer and compensator"),
    ]


def _tone(factor: float) -> page.Tone:
    return "good" if factor > 1.0 else "warn"


def _step(report: RunReport) -> str:
    return f"{report.timing.step.p50_s * 1e6:.1f} µs"


def _errors(data: dict[str, RunData]) -> Any:
    fig = stack([0.46, 0.27, 0.27], 640)
    for name, run in data.items():
        on = run.controlled
        curve(fig, run.time_s[on], 1e3 * run.error_rad()[on], _WORDS[name], _COLOURS[name], 1)
    run = data[OBSERVER]
    curve(fig, run.time_s, run.column("joint_torque_Nm"), "load", style.LOAD, 2)
    curve(fig, run.time_s, 1e3 * run.asked_rad, "asked position", style.MEASURED, 3)
    style.axes(fig, "", style.label("joint error", "mrad"), row=1, col=1)
    style.axes(fig, "", style.label("load", "N·m"), row=2, col=1)
    style.axes(fig, TIME, style.label("position", "mrad"), row=3, col=1)
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
