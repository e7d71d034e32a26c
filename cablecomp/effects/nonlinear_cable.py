"""Nonlinear cable: a stranded cable stiffens as it is pulled."""

from __future__ import annotations

from collections.abc import Mapping

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, Restated
from cablecomp.mechanics.tables import LEAST_STIFFNESS


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(stiffening=values["stiffening"], steady=values["steady"])


def _at_pretension(values: Mapping[str, float], factor: float) -> Restated:
    """1/EA(T) keeps its values: b -> b t/g, g = 1 + b (t - 1), w -> w/c, EA -> EA/c, c = w + (1 - w)/g, t = T0'/T0."""
    gain = max(1.0 + values["stiffening"] * (factor - 1.0), LEAST_STIFFNESS)
    steady = values.get("steady", 0.0)
    compliance = steady + (1.0 - steady) / gain
    share = {"steady": steady / compliance} if steady else {}
    return Restated({"stiffening": values["stiffening"] * factor / gain, **share}, EA=1.0 / compliance)


EFFECT = Effect(
    id="nonlinear_cable",
    statement="The stranded cable is stiffer the more it is pulled, because its wires bed down; where a share of its "
    "compliance is the wires' own, it becomes no stiffer than these.",
    equation="1/EA(T) = (w + (1 - w)/(1 + b (T/T0 - 1)))/EA, EA(T) the tangent stiffness dT/dε; w = 0: linear in T",
    source="G. A. Costello, Theory of Wire Rope, 1990: strands stiffen as contact between wires builds up; "
    "linear in tension as first order, two compliances in series as the next",
    parameters=(
        Parameter(
            "stiffening",
            "-",
            0.0,
            -0.5,
            0.9,
            "b, share of EA gained per pretension (of what is not steady)",
            minimum=-0.6,
            maximum=0.95,
        ),
        Parameter(
            "steady",
            "-",
            0.0,
            0.0,
            0.95,
            "w, share of the compliance at T0 that the tension does not change",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=0.98,
            tries=(0.4, 0.7),
        ),
    ),
    acts_through=("load",),
    bounded=True,
    change=_change,
    at_pretension=_at_pretension,
)
