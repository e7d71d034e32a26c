"""Figures 4.4, 4.5 and 4.7 to 4.12: the closed circuit drive."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from plotly.subplots import make_subplots

from cablecomp.report import style
from cablecomp.report.theory_common import (
    HEIGHT,
    OWN,
    THESIS,
    Array,
    Figure,
    Subject,
    canvas,
    family,
    hover,
    line,
    marker,
    own_line,
    si,
)
from cablecomp.thesis.closed_forms import closed
from cablecomp.thesis.closed_forms.stage import (
    EquivalentStage,
    cable_change,
    cable_loading,
    cable_loading_slope,
)

GFS = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, math.inf)


def figures(subject: Subject) -> list[Figure]:
    """The theory figures of chapter 4 for the joint, the models' errors apart."""
    return [
        stiffness_by_pretension(subject),
        cycle_tensions(subject),
        cycle_deflection(subject),
        tension(subject, "4.8"),
        tension(subject, "4.9"),
        affected_wrap(subject),
        deflection(subject, "4.11"),
        deflection(subject, "4.12"),
    ]


def stiffness_by_pretension(subject: Subject) -> Figure:
    """Stiffness under a fixed load against pretension (4.4)."""
    pretension = np.linspace(0.02, 4.0, 240)
    fig = canvas("pretension T₀ R / M", "stiffness k / (EA μ_eff R)")
    for GF, name in ((0.0, "GF = 0"), (0.1, "GF = 0.1"), (1.0, "GF = 1")):
        k = closed.closed_stiffness_normalised(1.0 / pretension, closed.unending_stage(GF))
        line(fig, pretension, k, name, style.SERIES[(0, 2, 3)[(0.0, 0.1, 1.0).index(GF)]])
    stage = subject.stage
    own = closed.closed_stiffness_normalised(1.0 / pretension, stage)
    load = subject.m_peak * stage.moment_scale_Nm
    scale = stage.EA_N * stage.mu_eff * stage.radius_m
    own_line(
        fig, pretension, own, subject.label, customdata=si(pretension * load / stage.radius_m, own * scale),
        hovertemplate=hover("T₀R/M", "stiffness", "N", "N·m/rad"),
    )  # fmt: skip
    now = 1.0 / subject.m_peak
    if now <= 4.0:
        marker(fig, now, float(np.interp(now, pretension, own)), "as configured", place="bottom right")
    fig.update_yaxes(range=[0.0, 1.05 * float(np.max(own[-1:]) + 6.0)])
    return Figure(
        "4.4",
        "Stiffness at a fixed load against pretension",
        fig,
        "More pretension is stiffer, above T₀ = M/(2R) about in proportion: the same load is then a smaller "
        f"m. This joint at its greatest load, {load:.3g} N·m.",
    )


def cycle_tensions(subject: Subject) -> Figure:
    """Tensions while the drive is loaded and unloaded (4.5)."""
    fig = canvas("moment m = M / (R T₀)", "tension T / T₀")
    peak, narrow = subject.m_peak, closed.unending_stage(0.0)
    _cycle(fig, narrow, 4.0, "thesis: GF = 0, m_pk = 4", THESIS, THESIS, visible="legendonly")
    _cycle(fig, narrow, peak, "GF = 0", THESIS, THESIS)
    _cycle(fig, subject.stage, peak, "this joint", style.CABLE_H, style.CABLE_L)
    left = float(closed.closed_tensions_unloading(0.0, peak, subject.stage).h)
    marker(fig, 0.0, left, "")
    return Figure(
        "4.5",
        "Tensions while the drive is loaded and unloaded",
        fig,
        "Solid: loading; dashed: unloading. The eased cable's dips are longer than the tightened cable's "
        f"bumps, so that after unloading the free spans are tighter than they were: {left:.3f} T₀. The "
        "thesis's case, m_pk = 4, is in the legend.",
    )


def _cycle(
    fig: Any, stage: EquivalentStage, peak: float, name: str, tight: str, easy: str, **options: Any
) -> None:
    m = np.linspace(0.0, peak, 160)
    up, down = closed.closed_tensions_loading(m, stage), closed.closed_tensions_unloading(m, peak, stage)
    own = tight != easy
    group = {"legendgroup": name, **options}
    line(fig, m, up.h, f"{name}, cable h" if own else name, tight, width=2.4, **group)
    line(fig, m, up.l, f"{name}, cable l", easy, width=2.4, showlegend=own, **group)
    line(fig, m, down.h, "", tight, dash="dash", showlegend=False, **group)
    line(fig, m, down.l, "", easy, dash="dash", showlegend=False, **group)


def cycle_deflection(subject: Subject) -> Figure:
    """Deflection while loaded and unloaded, exact and with the loading's tensions (4.7)."""
    fig = canvas("deflection · EA μ_eff / T₀", "moment m = M / (R T₀)")
    peak, narrow = subject.m_peak, closed.unending_stage(0.0)
    _loop(fig, narrow, 4.0, "thesis: GF = 0, m_pk = 4", THESIS, visible="legendonly")
    _loop(fig, narrow, peak, "GF = 0", THESIS)
    _loop(fig, subject.stage, peak, subject.label, OWN)
    left = float(closed.closed_unloading_normalised(0.0, peak, subject.stage))
    text = f"{left * subject.stage.angle_scale_rad * 1e3:.3g} mrad left"
    marker(fig, left, 0.0, text, place="bottom right")
    return Figure(
        "4.7",
        "Deflection while the drive is loaded and unloaded",
        fig,
        "Solid: exact; dashed: unloading with the tensions of loading, a shortcut that is about 30 % off in "
        "what is left over at m_pk = 4 (the thesis's case, in the legend) and better at smaller peaks.",
    )


def _loop(fig: Any, stage: EquivalentStage, peak: float, name: str, colour: str, **options: Any) -> None:
    m = np.linspace(0.0, peak, 160)
    up = closed.closed_loading_normalised(m, stage)
    down = closed.closed_unloading_normalised(m[::-1], peak, stage)
    loop = np.concatenate([m, m[::-1]])
    group = {"legendgroup": name, **options}
    line(fig, np.concatenate([up, down]), loop, name, colour, width=3.0 if colour == OWN else 2.2, **group)
    short = _with_loading_tensions(m, peak, stage)
    line(fig, short, m, f"{name}, shortcut", colour, dash="dash", showlegend=False, **group)


def _with_loading_tensions(m: Array, peak: float, stage: EquivalentStage) -> Array:
    """(4-24) with tau_h of (4-15) in place of (4-21)."""
    now, top = closed.closed_tensions_loading(m, stage).h, closed.closed_tensions_loading(peak, stage).h
    return np.asarray(cable_loading(top - 1.0, stage) + cable_change(now, top, stage))


def tension(subject: Subject, number: str) -> Figure:
    """Tension of the eased (4.8) or tightened (4.9) cable against moment during loading."""
    m = np.linspace(0.0, max(4.0, 1.1 * subject.m_peak), 300)
    easing = number == "4.8"
    fig = canvas("moment m = M / (R T₀)", f"tension T{'ₗ' if easing else 'ₕ'} / T₀")

    def of(stage: EquivalentStage) -> Array:
        tau = closed.closed_tensions_loading(m, stage)
        return tau.l if easing else tau.h

    family(fig, GFS, lambda GF: (m, of(closed.unending_stage(GF))))
    own, stage = of(subject.stage), subject.stage
    own_line(
        fig, m, own, subject.label, customdata=si(m * stage.moment_scale_Nm, own * stage.pretension_N),
        hovertemplate=hover("m", "T/T₀", "N·m", "N"),
    )  # fmt: skip
    marker(
        fig,
        subject.m_peak,
        float(np.interp(subject.m_peak, m, own)),
        "greatest load",
        place="top right" if easing else "bottom right",
    )
    caption = (
        "The eased cable never goes slack while wraps are long enough, except for GF → ∞, at m = 2; short "
        "wraps make it slack (solid line of this joint)."
        if easing
        else "The tightened cable bears more than half of the load in a drive with a small GF. For GF → ∞ "
        "the slope doubles at m = 2, where the other cable is slack."
    )
    return Figure(number, f"Tension of the {'eased' if easing else 'tightened'} cable", fig, caption)


def affected_wrap(subject: Subject) -> Figure:
    """Affected angles of wrap of both cables (4.10)."""
    m = np.linspace(0.0, max(4.0, 1.1 * subject.m_peak), 300)
    fig = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.09)
    fig.update_layout(
        template=style.template(), height=HEIGHT + 60, margin={"l": 64, "r": 44, "t": 74, "b": 52}
    )
    least = min(wrap.mu_wrap for wrap in subject.stage.wraps)
    for row, name in ((1, "eased"), (2, "tightened")):
        where = {"row": row, "col": 1}

        def angle(stage: EquivalentStage, row: int = row) -> Array:
            tau = closed.closed_tensions_loading(m, stage)
            with np.errstate(divide="ignore"):
                return np.asarray(-np.log(tau.l) if row == 1 else np.log(tau.h))

        family(
            fig, GFS[:-1], lambda GF: (m, angle(closed.unending_stage(GF))), where=where, showlegend=row == 1
        )
        own_line(fig, m, angle(subject.plain), subject.label, where=where, showlegend=row == 1)
        fig.add_hline(
            y=least, line={"color": OWN, "width": 1.4, "dash": "dot"}, row=row, col=1,
            annotation={"text": "shortest wrap of the joint", "font": {"size": 11, "color": OWN}},
            annotation_position="top left",
        )  # fmt: skip
        fig.update_yaxes(title_text=f"μ θ, {name} cable", range=[0.0, (4.0, 2.0)[row - 1]], **where)
    fig.update_xaxes(title_text="moment m = M / (R T₀)", row=2, col=1)
    return Figure(
        "4.10",
        "Affected angle of wrap",
        fig,
        "The eased cable's affected angle is always the larger. Add it to the wrap that the range of motion "
        "uses, on both pulleys: where it exceeds the wrap that is there (dotted), the cable slips at its "
        "termination.",
    )


def deflection(subject: Subject, number: str) -> Figure:
    """Moment against deflection during loading at two scales (4.11, 4.12)."""
    m = np.linspace(0.0, max(4.0, 1.1 * subject.m_peak), 300)
    fig = canvas("deflection · EA μ_eff / T₀", "moment m = M / (R T₀)")
    GFs = GFS[:-1] if number == "4.11" else (1.0, 3.0, 10.0, 30.0, 100.0)
    family(fig, GFs, lambda GF: (closed.closed_loading_normalised(m, closed.unending_stage(GF)), m))
    stage = subject.stage
    own = closed.closed_loading_normalised(m, stage)
    own_line(
        fig, own, m, subject.label,
        customdata=si(own * stage.angle_scale_rad * 1e3, m * stage.moment_scale_Nm),
        hovertemplate=hover("deflection", "m", "mrad", "N·m"),
    )  # fmt: skip
    reached = float(np.interp(subject.m_peak, m, own))
    reach = 4.0 if number == "4.11" else 200.0
    fig.update_xaxes(range=[0.0, max(reach, 1.05 * reached)])
    marker(
        fig, float(np.interp(subject.m_peak, m, own)), subject.m_peak, "greatest load", place="bottom right"
    )
    slope = 1.0 / cable_loading_slope(1.0, stage) if stage.GF > 0.0 else math.inf
    return Figure(
        number,
        "Deflection while the drive is loaded" + ("" if number == "4.11" else ", large GF"),
        fig,
        f"Every curve begins with the slope 2/GF (here {2.0 * float(slope):.3g}): the free spans alone. A "
        "drive with a small GF is stiffer throughout, and softens.",
    )
