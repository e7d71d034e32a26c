"""Figures 4.13 to 4.15: what the approximate models are worth."""

from __future__ import annotations

import numpy as np

from cablecomp.report import style
from cablecomp.report.theory_common import Array, Figure, Subject, canvas, family, own_line
from cablecomp.thesis.closed_forms.closed import closed_loading_normalised, unending_stage
from cablecomp.thesis.closed_forms.models import ModelName, choose_model, model_normalised

GFS = (0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
_TITLES: dict[ModelName, str] = {
    "I": "free spans alone (GF → ∞, wraps left out)",
    "II": "wraps and spans with the tensions of GF → ∞",
    "III": "wraps and spans with the tensions of GF → 0",
}
_RANGES: dict[ModelName, list[float]] = {"I": [-100.0, 20.0], "II": [-40.0, 20.0], "III": [-10.0, 40.0]}
_NUMBERS: dict[ModelName, str] = {"I": "4.13", "II": "4.14", "III": "4.15"}


def figures(subject: Subject) -> list[Figure]:
    """The errors of models I, II and III during loading."""
    return [error(subject, "I"), error(subject, "II"), error(subject, "III")]


def error(subject: Subject, name: ModelName) -> Figure:
    """Relative error of one model's deflection against the exact one (4.13, 4.14, 4.15)."""
    limit = 4.0 if name == "III" else 2.0
    m = np.linspace(0.005, limit, 240)

    def of(GF: float) -> Array:
        exact = closed_loading_normalised(m, unending_stage(GF))
        return np.asarray(100.0 * (model_normalised(name, m, GF) / exact - 1.0))

    fig = canvas("moment m = M / (R T₀)", "error of the deflection / %")
    family(fig, GFS, lambda GF: (m, of(GF)))
    own = of(subject.stage.GF)
    own_line(fig, m, own, subject.label)
    for level in (-15.0, 15.0):
        fig.add_hline(y=level, line={"color": style.FAINT, "width": 1, "dash": "dot"})
    fig.update_yaxes(range=_RANGES[name])
    fig.update_xaxes(range=[0.0, limit])
    here = m <= max(m[0], min(subject.m_peak, limit))
    worst = float(own[here][np.argmax(np.abs(own[here]))])
    choice = choose_model(subject.stage.GF).name
    advice = (
        "the model recommended for this joint" if choice == name else f"model {choice} is recommended here"
    )
    return Figure(
        _NUMBERS[name],
        f"Error of model {name}",
        fig,
        f"Model {name}: {_TITLES[name]}. Up to this joint's greatest load it is at worst {worst:.1f} % off; "
        f"{advice}. Dotted: 15 %.",
    )
