"""One look for every figure and page: colours by meaning, fonts, axes that carry their unit."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

FONT: Final = "Inter, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
MONO: Final = "'JetBrains Mono', 'SF Mono', Consolas, 'Liberation Mono', monospace"
INK: Final = "#1f2a37"
MUTED: Final = "#64748b"
RULE: Final = "#e2e8f0"
PAPER: Final = "#ffffff"
FAINT: Final = "#94a3b8"
_ZERO: Final = "#cbd5e1"

GOOD, WARN, BAD = "#0b8a6f", "#b7791f", "#c8102e"

MEASURED: Final = "#334155"
PREDICTED: Final = "#0f6fc6"
BOUNDS: Final = "rgba(15, 111, 198, 0.16)"
RESIDUAL: Final = "#c2410c"
BASELINE: Final = "#9aa5b1"
LOAD: Final = "#6b4fbb"
CABLE_H: Final = "#c8102e"
CABLE_L: Final = "#0b8a6f"

SERIES: Final = ("#0f6fc6", "#c2410c", "#0b8a6f", "#6b4fbb", "#b7791f", "#c8102e", "#0891b2", "#64748b")
"""Colours for curves without a meaning of their own, told apart by colour-blind readers as well."""

_DARK: Final = {
    INK: "#e5e9f0", MUTED: "#9aa8ba", RULE: "#2b3442", PAPER: "#151b24", FAINT: "#8392a7", _ZERO: "#475569",
    MEASURED: "#cbd5e1", PREDICTED: "#4da3f5", RESIDUAL: "#fb8a4b", BASELINE: "#7b8794", LOAD: "#a78bfa",
    CABLE_H: "#f87171", CABLE_L: "#34d399", WARN: "#e0a83a", "#0891b2": "#22c1dc",
}  # fmt: skip
"""What each colour becomes on a dark ground."""

SEQUENCE: Final = "Viridis"
"""Colour scale for an ordered quantity (time, load level)."""


def variables() -> str:
    """Return the colours and fonts as CSS variables: light, dark where the reader prefers it, light on paper."""
    light = {
        "ink": INK, "muted": MUTED, "rule": RULE, "paper": PAPER, "faint": FAINT, "accent": PREDICTED,
        "good": GOOD, "warn": WARN, "bad": BAD,
    }  # fmt: skip
    dark = {name: _DARK[colour] for name, colour in light.items()}
    light |= {"ground": "#f4f6f9", "soft": "#f8fafc"}
    dark |= {"ground": "#0d1117", "soft": "#1b2330"}
    return (
        f":root {{ color-scheme: light dark; --font: {FONT}; --mono: {MONO}; {_css(light)} }}\n"
        f"@media (prefers-color-scheme: dark) {{ :root {{ {_css(dark)} }} }}\n"
        f"@media print {{ :root {{ color-scheme: light; {_css(light)} }} }}\n"
    )


def _css(colours: dict[str, str]) -> str:
    return " ".join(f"--{name}: {colour};" for name, colour in colours.items())


def dark_colours() -> dict[str, str]:
    """Return what each colour of a figure becomes on a dark ground: `#rrggbb`, and the head of `rgba(r, g, b`."""
    heads = {_head(light): _head(dark) for light, dark in _DARK.items()}
    return {**_DARK, **heads}


def _head(colour: str) -> str:
    return translucent(colour, 0.0).rpartition(",")[0]


def translucent(colour: str, alpha: float) -> str:
    """Return `#rrggbb` as `rgba(r, g, b, alpha)`; `alpha` between 0 and 1."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, {alpha:g})"


def keep_range(fig: Any, curves: Iterable[NDArray[np.float64]], row: int | None = None) -> None:
    """Let the y axis span `curves` and a margin: a band around them does not flatten them, it is cut."""
    values = np.concatenate([np.ravel(c) for c in curves])
    values = values[np.isfinite(values)]
    if not len(values):
        return
    low, high = float(values.min()), float(values.max())
    room = 0.35 * (high - low) or 1e-3 * max(abs(high), 1e-9)
    where = {} if row is None else {"row": row, "col": 1}
    fig.update_yaxes(range=[low - room, high + room], **where)


def label(quantity: str, unit: str) -> str:
    """Return an axis title such as `deflection / mrad`; an empty unit gives the quantity alone."""
    return f"{quantity} / {unit}" if unit else quantity


def template() -> Any:
    """Return the plotly template that every figure uses."""
    axis = {
        "showline": True,
        "linecolor": MUTED,
        "linewidth": 1,
        "gridcolor": RULE,
        "zeroline": True,
        "zerolinecolor": _ZERO,
        "zerolinewidth": 1,
        "ticks": "outside",
        "tickcolor": MUTED,
        "ticklen": 4,
        "title": {"font": {"size": 14, "color": INK}, "standoff": 8},
        "tickfont": {"size": 12, "color": MUTED},
        "automargin": True,
    }
    return go.layout.Template(
        layout={
            "font": {"family": FONT, "size": 13, "color": INK},
            "colorway": list(SERIES),
            "paper_bgcolor": PAPER,
            "plot_bgcolor": PAPER,
            "xaxis": axis,
            "yaxis": axis,
            "legend": {
                "orientation": "h",
                "x": 0,
                "xanchor": "left",
                "y": 1.02,
                "yanchor": "bottom",
                "traceorder": "normal",
            },
            "margin": {"l": 64, "r": 44, "t": 40, "b": 52},
            "modebar": {"orientation": "v"},  # in the margin, on neither legend nor curves
            "hovermode": "closest",
            "hoverlabel": {"font": {"family": FONT, "size": 12}},
        }
    )


def figure(height: int = 380, **layout: Any) -> Any:
    """Return an empty plotly figure in the common look; `height` in pixels, `layout` as plotly takes it."""
    return go.Figure(layout={"template": template(), "height": height, **layout})


def axes(fig: Any, x: str, y: str, **where: Any) -> Any:
    """Title the axes of `fig` (see `label`) and return it; `where` may be `row=`, `col=` of a subplot."""
    fig.update_xaxes(title_text=x, **where)
    fig.update_yaxes(title_text=y, **where)
    return fig


def curve(
    fig: Any,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    name: str,
    colour: str,
    width: float,
    *,
    dash: str = "solid",
    legend: bool = True,
    row: int | None = None,
    col: int = 1,
) -> None:
    """Draw y over x as a line, in a subplot if `row` is given; what is unknown throughout is left out."""
    if np.isnan(y).all():
        return
    fig.add_scatter(
        x=x,
        y=y.astype(np.float32),  # enough for a screen, half the page
        name=name,
        mode="lines",
        showlegend=legend,
        line={"color": colour, "width": width, "dash": dash},
        **({} if row is None else {"row": row, "col": col}),
    )
