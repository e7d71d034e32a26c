"""The design of a joint's loops as page and terminal tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table

from cablecomp.control.design import LoopDesign
from cablecomp.control.margins import Loop, shown
from cablecomp.report import page, style
from cablecomp.report.page import Fact, Section


def design_rows(design: LoopDesign) -> list[tuple[str, str]]:
    """Name and value of each designed quantity."""
    s, g = design.stiffness, design.gains
    limit = design.limit_cycle
    return [
        ("loop rate", f"{design.rate_Hz:g} Hz"),
        ("stiffness at zero load", f"{s.zero_Nm_per_rad:.4g} N·m/rad"),
        ("stiffness over the load cycle", f"{s.low_Nm_per_rad:.4g} … {s.high_Nm_per_rad:.4g} N·m/rad"),
        ("width of the hysteresis loop", f"{1e3 * s.width_rad:.3g} mrad"),
        ("link swings at", f"{design.link_Hz[0]:.3g} … {design.link_Hz[1]:.3g} Hz"),
        ("load filter", f"{g.load_filter_Hz:g} Hz, lead {1e3 * g.load_lead_s:.3g} ms"),
        ("compensation error at 0.5 Hz", f"{100 * _error_at(design, 0.5):.2g} % of the deflection"),
        ("motor trim", f"{g.motor_integral_per_s:.3g} /s"),
        ("joint feedback", f"{g.joint_feedback_per_s:.3g} /s"),
        ("force following", f"{g.follow_filter_Hz:g} Hz, lead {1e3 * g.follow_lead_s:.3g} ms"),
        ("force feedback", f"{g.force_feedback_per_s:.3g} /s"),
        ("loss factor of the link's swing", f"{limit.margin:.3g} (feed-forward off: {limit.without:.3g})"),
        (
            "limit cycles",
            ", ".join(f"{1e3 * a:.3g} mrad at {f:.3g} Hz" for a, f in limit.found) or "none predicted",
        ),
    ]


def design_tables(design: LoopDesign) -> RenderableType:
    """What `cablecomp design` prints."""
    head = Table(title=f"Loop design: {design.name}", show_header=False, box=None)
    for name, value in design_rows(design):
        head.add_row(name, value)
    table = Table(title="Margins over the stiffness range")
    for name in MARGINS:
        table.add_column(name, justify="left" if name == "loop" else "right", overflow="fold")
    for loop in design.loops:
        for row in margin_rows(loop):
            table.add_row(*row, style="red" if row[-1] == "no" else "")
    warnings = [f"warning: {line}" for line in design.warnings]
    return Group(head, table, *warnings)


MARGINS = (
    "loop",
    "k / N·m/rad",
    "gain margin",
    "phase margin / °",
    "distance from −1",
    "crosses 1 at / Hz",
    "stable",
)


def margin_rows(loop: Loop) -> list[tuple[str, ...]]:
    """One row for each stiffness."""
    return [
        (
            loop.name if k == 0 else "",
            f"{m.stiffness_Nm_per_rad:.4g}",
            shown(m.gain_margin),
            shown(m.phase_margin_deg),
            shown(m.modulus_margin),
            shown(m.crossover_Hz) if m.crossover_Hz else "–",
            "yes" if m.stable else "no",
        )
        for k, m in enumerate(loop.margins)
    ]


def design_page(design: LoopDesign) -> str:
    """The design as HTML that opens offline."""
    lead = (
        "Gains from the drive's own stiffness range, history included, at the loop's rate; "
        "margins hold from the zero-load stiffness down to the loaded one."
    )
    return page.page(f"Loop design: {design.name}", lead, _sections(design))


def _sections(design: LoopDesign) -> Iterator[Section]:
    worst = min((loop.worst for loop in design.loops), key=lambda m: m.modulus_margin)
    stable = all(loop.worst.stable for loop in design.loops)
    cards = [
        Fact(
            "loops stable",
            "all" if stable else "not all",
            "over the whole range",
            "good" if stable else "bad",
        ),
        Fact("nearest to −1", shown(worst.modulus_margin), f"at {worst.stiffness_Nm_per_rad:.4g} N·m/rad"),
        Fact("loss factor", shown(design.limit_cycle.margin), "of the link's swing, least"),
        Fact("load filter", f"{design.gains.load_filter_Hz:g} Hz"),
    ]
    body = page.facts(cards) + page.table(("quantity", "value"), design_rows(design))
    yield Section("Result", body + page.bullets(design.warnings))
    yield Section("Stiffness", page.columns(page.figure(_loop(design)), page.figure(_stiffness(design))))
    yield Section(
        "Feed-forward on the measured load",
        page.columns(page.figure(_nyquist(design)), page.figure(_compensation(design))),
        "When the link swings on the cable the torque sensor shows it, and the motor answers: the filter is "
        "designed so that this loop keeps away from −1 at every stiffness.",
    )
    yield Section(
        "Hysteresis as a describing function",
        page.columns(page.figure(_describing(design)), page.figure(_loss(design))),
        "First harmonic of load over deflection, by amplitude; below zero loss the swing would grow.",
    )
    rows = [row for loop in design.loops for row in margin_rows(loop)]
    yield Section("Margins", page.table(MARGINS, rows))


def _loop(design: LoopDesign) -> Any:
    s = design.stiffness
    fig = style.figure(400)
    fig.add_scatter(
        x=1e3 * s.deflection_rad,
        y=s.load_Nm,
        mode="lines",
        line={"color": style.PREDICTED},
        name="load cycle",
    )
    return style.axes(fig, style.label("deflection", "mrad"), style.label("load", "N·m"))


def _stiffness(design: LoopDesign) -> Any:
    s = design.stiffness
    fig = style.figure(400)
    fig.add_scatter(
        x=s.load_Nm,
        y=s.stiffness_Nm_per_rad,
        mode="lines",
        line={"color": style.LOAD},
        name="tangent",
    )
    return style.axes(fig, style.label("load", "N·m"), style.label("stiffness", "N·m/rad"))


def _nyquist(design: LoopDesign) -> Any:
    fig = style.figure(420)
    for k, (name, (hertz, value)) in enumerate(design.responses.items()):
        text = [f"{f:.3g} Hz" for f in hertz]
        colour = style.SERIES[k]
        fig.add_scatter(
            x=value.real,
            y=value.imag,
            mode="lines",
            name=name,
            text=text,
            line={"color": colour, "width": 1.3},
        )
    fig.add_scatter(
        x=[-1], y=[0], mode="markers", name="−1", marker={"color": style.CABLE_H, "symbol": "x", "size": 10}
    )
    fig.update_yaxes(scaleanchor="x")
    return style.axes(fig, "real part", "imaginary part")


def _compensation(design: LoopDesign) -> Any:
    fig = style.figure(420)
    x, y = np.array(design.compensation_Hz), 100 * np.array(design.compensation_error)
    fig.add_scatter(x=x, y=y, mode="lines", name="|1 − G|", line={"color": style.RESIDUAL})
    fig.update_xaxes(type="log")
    fig.update_yaxes(type="log")
    return style.axes(fig, style.label("frequency", "Hz"), style.label("deflection not made up for", "%"))


def _describing(design: LoopDesign) -> Any:
    limit = design.limit_cycle
    fig = style.figure(380)
    a = 1e3 * np.array(limit.amplitudes_rad)
    values = np.array(limit.describing_Nm_per_rad)
    fig.add_scatter(
        x=a,
        y=values.real,
        mode="lines+markers",
        name="stiffness (real part)",
        line={"color": style.PREDICTED},
    )
    fig.add_scatter(
        x=a, y=values.imag, mode="lines+markers", name="loss (imaginary part)", line={"color": style.RESIDUAL}
    )
    fig.update_xaxes(type="log")
    return style.axes(fig, style.label("amplitude of deflection", "mrad"), style.label("N(A)", "N·m/rad"))


def _loss(design: LoopDesign) -> Any:
    limit = design.limit_cycle
    fig = style.figure(380)
    a = 1e3 * np.array(limit.amplitudes_rad)
    fig.add_scatter(
        x=a,
        y=np.array(limit.loss_factor),
        mode="lines+markers",
        name="loss factor",
        line={"color": style.CABLE_L},
    )
    fig.update_xaxes(type="log")
    return style.axes(fig, style.label("amplitude of deflection", "mrad"), "loss factor of the link's swing")


def _error_at(design: LoopDesign, hertz: float) -> float:
    return float(np.interp(hertz, design.compensation_Hz, design.compensation_error))
