"""Pressure-dependent friction: the coefficient falls as the cable is pressed harder against the pulley."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Floats, Parameter, Restated


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    exponent = values["exponent"]

    def factor(tau: Floats) -> Floats:
        return np.asarray(tau**-exponent, dtype=np.float64)

    return Change(tension_factor=factor)


def _at_pretension(values: Mapping[str, float], factor: float) -> Restated:
    """mu0 (T/T0)^-n keeps its values: mu0 -> mu0 t^-n, t = T0'/T0."""
    return Restated(values, mu=factor ** -values["exponent"])


EFFECT = Effect(
    id="pressure_dependent_friction",
    statement="The coefficient of friction falls (or rises) with the pressure between cable and pulley, as "
    "polymer coats do.",
    equation="mu = mu0 (T/T0)^-n at every place; pressure goes with T/R",
    source="n = 1/3 for elastic contact of a soft coat (F. P. Bowden and D. Tabor, The Friction and "
    "Lubrication of Solids, 1950); capstans with mu as a power of pressure: H. G. Howell, J. "
    "Textile Inst. 44 (1953)",
    parameters=(
        Parameter(
            "exponent",
            "-",
            0.0,
            -0.4,
            0.8,
            "n, 1/3 for elastic contact",
            minimum=-0.9,
            maximum=0.9,
        ),
    ),
    acts_through=("load", "load_direction", "reversal"),
    bounded=True,
    change=_change,
    at_pretension=_at_pretension,
)
