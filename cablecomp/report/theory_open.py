"""Figures 3.2 to 3.4: the open circuit drive, or one cable of a closed one."""

from __future__ import annotations

from typing import Any

import numpy as np

from cablecomp.report.theory_common import (
    THESIS,
    Array,
    Figure,
    Subject,
    canvas,
    colour_of,
    family,
    hover,
    line,
    own_line,
    si,
)
from cablecomp.thesis.closed_forms import open as open_
from cablecomp.thesis.closed_forms.stage import cable_loading

GFS = (0.0, 0.1, 1.0, 3.0, 30.0)


def figures(subject: Subject) -> list[Figure]:
    """The theory figures of chapter 3 for the joint."""
    return [loading(subject), stiffness(subject), unloading(subject)]


def loading(subject: Subject) -> Figure:
    """Moment against deflection during loading (3.2)."""
    m = _loads(subject)
    fig = canvas("deflection · EA μ_eff / T₀", "moment m = M / (R T₀)")
    family(fig, GFS, lambda GF: (open_.open_loading_normalised(m, GF), m))
    own = cable_loading(m, subject.stage)
    _own(fig, subject, own, m)
    fig.update_xaxes(range=[-2.0, 5.0])
    return Figure(
        "3.2",
        "Deflection of an open circuit while it is loaded",
        fig,
        "Softening, and more so where the moment eases the cable (m < 0). A large GF means a soft and "
        "nearly linear drive, a small one a stiff drive that softens.",
    )


def stiffness(subject: Subject) -> Figure:
    """Stiffness against moment during loading (3.3)."""
    m = np.linspace(-0.995, max(4.0, 1.1 * subject.m_peak), 700)
    fig = canvas("moment m = M / (R T₀)", "stiffness k / (EA μ_eff R)")
    family(fig, GFS[1:], lambda GF: (m, open_.open_stiffness_normalised(m, GF)))
    stage = subject.stage
    k = open_.open_stiffness_Nm_per_rad(m * stage.moment_scale_Nm, stage)
    scale = stage.EA_N * stage.mu_eff * stage.radius_m
    own_line(
        fig, m, k / scale, subject.label, customdata=si(m * stage.moment_scale_Nm, k),
        hovertemplate=hover("m", "stiffness", "N·m", "N·m/rad"),
    )  # fmt: skip
    fig.update_yaxes(type="log", range=[-1.7, 2.0])
    return Figure(
        "3.3",
        "Stiffness of an open circuit while it is loaded",
        fig,
        "At zero load the free span alone gives way, EA R²/L; under load the wraps join in. For large "
        "moments the stiffness tends to EA μ_eff R/(1 + GF).",
    )


def unloading(subject: Subject) -> Figure:
    """Moment against deflection after reversals (3.4)."""
    m = _loads(subject, 4.0)
    fig = canvas("deflection · EA μ_eff / T₀", "moment m = M / (R T₀)")
    _loops(fig, m, 0.0, (1.0, 2.0, 3.0, 4.0, -0.6, -0.75), own=False)
    GF = subject.stage.GF
    _loops(fig, m, GF, _own_peaks(subject), own=True)
    low, high = -0.8, max(1.5, 1.3 * subject.m_peak)
    fig.update_yaxes(range=[low - 0.15, high])
    reach = [float(open_.open_loading_normalised(x, GF)) for x in (low, high)]
    fig.update_xaxes(range=[1.1 * reach[0], 1.1 * reach[1]])
    return Figure(
        "3.4",
        "Deflection of an open circuit while it is unloaded",
        fig,
        "Every reversal leaves the loading curve on a curve of its own (dashed) and returns to it at "
        "m = −m_pk/(1 + m_pk), where the tension bump is erased. Grey: wrapped cable alone, GF = 0, with the "
        "thesis's peaks; zoom out for those above this joint's loads.",
    )


def _loops(fig: Any, m: Array, GF: float, peaks: tuple[float, ...], *, own: bool) -> None:
    loaded = open_.open_loading_normalised(m, GF)
    if own:
        own_line(fig, loaded, m, "this joint")
    else:
        line(fig, loaded, m, "GF = 0", THESIS, width=2.2)
    for i, peak in enumerate(peaks):
        back = np.linspace(peak, float(open_.open_erasing_moment(peak)), 120)
        x = open_.open_unloading_normalised(back, peak, GF)
        colour = colour_of(0.1 + 0.35 * i) if own else THESIS
        line(fig, x, back, f"back from {peak:.2g}", colour, dash="dash", showlegend=own, width=2.0)


def _own_peaks(subject: Subject) -> tuple[float, ...]:
    peak = subject.m_peak
    return (0.5 * peak, peak, -0.9 * peak / (1.0 + peak))


def _loads(subject: Subject, least: float = 3.5) -> Array:
    return np.concatenate(
        [np.linspace(-0.995, 0.0, 200), np.linspace(0.0, max(least, 1.1 * subject.m_peak), 300)[1:]]
    )


def _own(fig: Any, subject: Subject, x: Array, m: Array) -> None:
    stage = subject.stage
    own_line(
        fig, x, m, subject.label, customdata=si(x * stage.angle_scale_rad * 1e3, m * stage.moment_scale_Nm),
        hovertemplate=hover("deflection", "m", "mrad", "N·m"),
    )  # fmt: skip
