"""Figures 2.7 and 2.8: one wrapped cable on a pulley that does not turn."""

from __future__ import annotations

import math

import numpy as np

from cablecomp.report import style
from cablecomp.report.theory_common import THESIS, Figure, Subject, canvas, hover, line, marker, own_line, si
from cablecomp.thesis.closed_forms import wrap
from cablecomp.thesis.closed_forms.closed import closed_tensions_loading


def figures(subject: Subject) -> list[Figure]:
    """Both figures of chapter 2 for the output pulley of the joint."""
    return [elongation(subject), stiffness(subject)]


def elongation(subject: Subject) -> Figure:
    """Elongation of the wrapped cable against tension (2.7)."""
    tau = np.concatenate([np.linspace(0.005, 1.0, 160), np.linspace(1.0, _top(subject), 160)])
    shape = wrap.loading_shape(tau)
    fig = canvas("elongation · EA μ / (R T₀)", "tension T / T₀")
    line(fig, shape, tau, "wrap without end", THESIS, width=2.4, dash="dash")
    part = subject.output_stage
    c = part.mu_output * part.wrap_output_rad
    scale = part.output_radius_m * part.pretension_N / (part.EA_N * part.mu_output)
    own = wrap.loading_shape(tau, c)
    own_line(
        fig, own, tau, f"output pulley, {part.wrap_output_rad:g} rad of wrap",
        customdata=si(own * scale * 1e6, tau * part.pretension_N),
        hovertemplate=hover("elongation", "T/T₀", "µm", "N"),
    )  # fmt: skip
    for value, name in zip(_range(subject), ("eased", "tightened"), strict=True):
        marker(fig, float(wrap.loading_shape(value, c)), value, f"{name} at the greatest load")
    fig.update_yaxes(range=[0.0, float(tau[-1])])
    fig.update_xaxes(range=[-1.15 * min(2.2, float(-own[0])), 1.1 * float(own[-1])])
    return Figure(
        "2.7",
        "Elongation of wrapped cable",
        fig,
        "Tightened cable moves little, eased cable much: the affected angle grows without bound as the "
        "tension goes to zero, until it reaches the termination (the solid line leaves the dashed one).",
    )


def stiffness(subject: Subject) -> Figure:
    """Stiffness of the wrapped cable against tension (2.8)."""
    part = subject.output_stage
    c = part.mu_output * part.wrap_output_rad
    fig = canvas("tension T / T₀", "stiffness · R / (EA μ)")
    top = max(4.0, _top(subject))
    for first, (low, high) in enumerate(((0.01, 0.9999), (1.0001, top))):
        tau = np.linspace(low, high, 200)
        with np.errstate(divide="ignore"):
            plain, own = 1.0 / wrap.loading_shape_slope(tau), 1.0 / wrap.loading_shape_slope(tau, c)
        shown = not first
        line(fig, tau, plain, "wrap without end", THESIS, width=2.4, dash="dash", showlegend=shown)
        scale = part.EA_N * part.mu_output / part.output_radius_m
        own_line(
            fig, tau, own, "output pulley of this joint", showlegend=shown,
            customdata=si(tau * part.pretension_N, own * scale / 1e6),
            hovertemplate=hover("T/T₀", "stiffness", "N", "MN/m"),
        )  # fmt: skip
    fig.add_hline(y=1.0, line={"color": style.MUTED, "width": 1, "dash": "dot"})
    fig.update_yaxes(range=[0.0, 10.0])
    fig.update_xaxes(range=[0.0, top])
    return Figure(
        "2.8",
        "Stiffness of wrapped cable",
        fig,
        "Infinite at the pretension, soft away from it: towards EA μ/R as the cable is tightened, towards "
        "zero as it is eased. In a drive the free span's compliance comes on top.",
    )


def _range(subject: Subject) -> tuple[float, float]:
    if subject.circuit == "open":
        return max(0.02, 1.0 / (1.0 + subject.m_peak)), 1.0 + subject.m_peak
    tau = closed_tensions_loading(subject.m_peak, subject.stage)
    return float(tau.l), float(tau.h)


def _top(subject: Subject) -> float:
    return max(3.0, 1.25 * math.ceil(10 * _range(subject)[1]) / 10)
