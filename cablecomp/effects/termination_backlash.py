"""Termination backlash: clearance at a hub key or crimp, taken up to either side by the sign of the load."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment, term, wrap_deflection

# Moment, as a share of R T0, within which the clearance is crossed: a step that is smooth can be fitted.
TRANSITION = 0.0005


@term(parameters=("gap", "width"))
def _cross(c: Any, p: Any, s: Any) -> None:
    """p: gap [rad], width of the transition [N m]."""
    c.reading += 0.5 * p.gap * math.tanh((c.load - c.moment) / p.width)


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(terms=_cross(gap=values["gap_rad"], width=TRANSITION * pretension_moment(config)))


EFFECT = Effect(
    id="termination_backlash",
    statement="A hub key, pin or crimp has clearance: the joint falls from one flank to the other where "
    "the load changes sign.",
    equation="q_out = q_drive + (b/2) tanh(M/(0.0005 R T0)), M the moment in the load path: sgn M with a "
    "narrow transition",
    source="dead zone in the load path, seen from the load: M. Nordin and P.-O. Gutman, Controlling "
    "mechanical systems with backlash: a survey, Automatica 38 (2002)",
    parameters=(
        Parameter(
            "gap_rad",
            "rad",
            0.0,
            1e-4,
            3.0,
            "b, total clearance",
            log=True,
            scale=wrap_deflection,
            minimum=0.0,
            maximum=0.5,
        ),
    ),
    acts_through=("load", "load_direction"),
    bounded=True,
    change=_change,
    rank=5,
)
