"""What the theory figures share: the joint as one stage, curves by GF, the joint's own curve, markers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import plotly.graph_objects as go
from plotly.colors import sample_colorscale

from cablecomp.config import JointConfig, Stage
from cablecomp.report import style
from cablecomp.thesis.closed_forms.series import acting_stages
from cablecomp.thesis.closed_forms.stage import EquivalentStage
from cablecomp.thesis.design import design_sheet

Array = npt.NDArray[np.float64]

OWN = style.RESIDUAL
THESIS = style.BASELINE
HEIGHT = 400


@dataclass(frozen=True)
class Subject:
    """The joint that the figures are drawn for, as one stage with its finite wraps."""

    name: str
    circuit: str
    stage: EquivalentStage
    """The equivalent stage; the output stage of closed stages in series."""
    output_stage: Stage
    m_peak: float
    """Dimensionless greatest load of that stage."""
    what: str
    """Which stage is shown, in words."""

    @property
    def plain(self) -> EquivalentStage:
        """The stage with wraps that never end, as in the thesis."""
        return self.stage.unending()

    @property
    def label(self) -> str:
        return "this joint"


@dataclass(frozen=True)
class Figure:
    """One figure of the thesis, drawn for the joint."""

    number: str
    title: str
    figure: Any
    caption: str


def subject_of(config: JointConfig, load_max_Nm: float | None = None) -> Subject:
    """The joint of `config` up to `load_max_Nm` (default: its limit), N m; raises InputError as
    `design_sheet` does.
    """
    sheet = design_sheet(config, load_max_Nm)
    last = acting_stages(config.drive)[-1]
    if sheet.equivalent is None:
        what = "the output stage of its stages in series"
    elif len(config.drive.stage) > 1:
        what = f"the equivalent of its {len(config.drive.stage)} stages"
    else:
        what = "its single stage"
    m_peak = last.ratio * sheet.load_max_Nm / last.stage.moment_scale_Nm
    return Subject(config.name, sheet.circuit, last.stage, config.drive.stage[-1], m_peak, what)


def canvas(x: str, y: str, **layout: Any) -> Any:
    """An empty figure with titled axes."""
    layout.setdefault("margin", {"l": 64, "r": 28, "t": 74, "b": 52})  # the mode bar above the legend
    return style.axes(style.figure(HEIGHT, **layout), x, y)


def colour_of(position: float) -> str:
    """Colour of a curve in an ordered family, `position` 0 to 1."""
    return str(sample_colorscale(style.SEQUENCE, [0.85 * position])[0])


def line(fig: Any, x: Array, y: Array, name: str, colour: str, **options: Any) -> None:
    """Add a curve; `options` as `go.Scatter` takes them, with `width` and `dash` for the line."""
    width, dash = options.pop("width", 1.8), options.pop("dash", "solid")
    where = options.pop("where", {})
    trace = go.Scatter(
        x=x, y=y, name=name, mode="lines", line={"color": colour, "width": width, "dash": dash}, **options
    )
    fig.add_trace(trace, **where)


def own_line(fig: Any, x: Array, y: Array, name: str, **options: Any) -> None:
    """Add the joint's own curve: on top, heavier."""
    line(fig, x, y, name, OWN, width=3.2, **options)


def marker(fig: Any, x: float, y: float, text: str, **options: Any) -> None:
    """Mark a point of the joint with a short text beside it."""
    place = options.pop("place", "middle right")
    where = options.pop("where", {})
    fig.add_trace(
        go.Scatter(
            x=[x], y=[y], mode="markers+text", text=[text], textposition=place, showlegend=False,
            marker={"color": OWN, "size": 9, "line": {"color": style.PAPER, "width": 1.5}},
            textfont={"size": 12, "color": OWN}, hoverinfo="skip", cliponaxis=False, **options,
        ),
        **where,
    )  # fmt: skip


def family(
    fig: Any,
    GFs: Sequence[float],
    curve: Callable[[float], tuple[Array, Array]],
    **options: Any,
) -> None:
    """Add the thesis's curves for several GF, coloured in their order."""
    for i, GF in enumerate(GFs):
        x, y = curve(GF)
        name = "GF = ∞" if math.isinf(GF) else f"GF = {GF:g}"
        line(fig, x, y, name, colour_of(i / max(1, len(GFs) - 1)), **options)


def hover(x: str, y: str, unit_x: str, unit_y: str) -> str:
    """Hover text of a curve whose `customdata` holds its SI values: (x, y)."""
    return (
        f"{x} %{{x:.4g}}, {y} %{{y:.4g}}<br>%{{customdata[0]:.4g}} {unit_x}, %{{customdata[1]:.4g}} {unit_y}"
    )


def si(x: Array, y: Array) -> Array:
    """SI values for `hover`, one row a point."""
    return np.column_stack([x, y])
