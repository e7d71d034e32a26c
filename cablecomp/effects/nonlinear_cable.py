"""Nonlinear cable: a stranded cable stiffens as it is pulled."""

from __future__ import annotations

from collections.abc import Mapping

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, Restated


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(stiffening=values["stiffening"])


def _at_pretension(values: Mapping[str, float], factor: float) -> Restated:
    """EA (1 + b (T/T0 - 1)) keeps its values: EA -> EA g, b -> b t/g, g = 1 + b (t - 1), t = T0'/T0."""
    gain = max(1.0 + values["stiffening"] * (factor - 1.0), 0.05)
    return Restated({"stiffening": values["stiffening"] * factor / gain}, EA=gain)


EFFECT = Effect(
    id="nonlinear_cable",
    statement="The stranded cable is stiffer the more it is pulled, because its wires bed down.",
    equation="EA(T) = EA (1 + b (T/T0 - 1)), the tangent stiffness dT/dε",
    source="G. A. Costello, Theory of Wire Rope, 1990: strands stiffen as contact between wires builds up; "
    "linear in tension as first order",
    parameters=(
        Parameter(
            "stiffening",
            "-",
            0.0,
            -0.5,
            0.9,
            "b, share of EA gained per pretension",
            minimum=-0.6,
            maximum=0.95,
        ),
    ),
    acts_through=("load",),
    bounded=True,
    change=_change,
    at_pretension=_at_pretension,
)
