"""Nonlinear cable: a stranded cable stiffens as it is pulled."""

from __future__ import annotations

from collections.abc import Mapping

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, Restated
from cablecomp.errors import InputError
from cablecomp.mechanics.tables import LEAST_STIFFNESS, knee_area


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    if values["again"] and not values["knee"]:
        raise InputError(
            f"{config.name}: effect `nonlinear_cable` has `again` and no `knee`; what is stiff again has to give way "
            "before: give `knee` as well, or leave out `again`"
        )
    knee, again = _knees(values)
    return Change(stiffening=values["stiffening"], steady=values["steady"], knee=knee, again=again)


def _knees(values: Mapping[str, float]) -> tuple[float, float]:
    """T/T0 of the knee and of where it is stiff again, 0 where there is none: what is so before it gives way never
    gives way."""
    knee, again = values.get("knee", 0.0), values.get("again", 0.0)
    return knee, max(again, 1.0) * knee if again else 0.0


def _at_pretension(values: Mapping[str, float], factor: float) -> Restated:
    """1/EA(T) keeps its values: b -> b t/g, g = 1 + b (t - 1), w -> w/c, EA -> EA/c, c = w + (1 - w)/g, t = T0'/T0;
    with a knee g = (1 - b S(1))/(1 - b S(t)), b stays and u -> u/t, r stays."""
    b, steady = values["stiffening"], values.get("steady", 0.0)
    knee, again = _knees(values)
    if knee:
        here, there = (knee_area(knee, again, tau)[1] for tau in (1.0, factor))
        gain = (1.0 - b * here) / (1.0 - b * there)
        law = {"stiffening": b, "knee": knee / factor}
    else:
        gain = max(1.0 + b * (factor - 1.0), LEAST_STIFFNESS)
        law = {"stiffening": b * factor / gain}
    compliance = steady + (1.0 - steady) / gain
    share = {"steady": steady / compliance} if steady else {}
    return Restated({**law, **share}, EA=1.0 / compliance)


EFFECT = Effect(
    id="nonlinear_cable",
    statement="The stranded cable is stiffer the more it is pulled, because its wires bed down; where a share of its "
    "compliance is the wires' own, it becomes no stiffer than these. Or all at once: a core or a cover that carries "
    "from some tension on, or yields; or drawn fibres that give way at some tension and draw tight beyond.",
    equation="1/EA(T) = (w + (1 - w)/(1 + b (T/T0 - 1)))/EA, EA(T) the tangent stiffness dT/dε; w = 0: linear in T; "
    "with a knee (w + (1 - w) (1 - b S(T))/(1 - b S(T0)))/EA, S rises straight from 0 at 0.75 u T0 to 1 at 1.25 u T0; "
    "stiff again at r u T0, S falls from 1 to 0 about u T0 and rises to 1 alike about r u T0",
    source="G. A. Costello, Theory of Wire Rope, 1990: strands stiffen as contact between wires builds up; "
    "linear in tension as first order, two compliances in series as the next; a knee as three straight lines; ropes of "
    "polyester and nylon, whose force bends over their stretch as an S: H. A. McKenna, J. W. S. Hearle and N. O'Hear, "
    "Handbook of Fibre Rope Technology, 2004",
    parameters=(
        Parameter(
            "stiffening",
            "-",
            0.0,
            -0.5,
            0.9,
            "b, share of EA gained per pretension (of what is not steady); of compliance lost at the knee",
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
        Parameter(
            "knee",
            "-",
            0.0,
            0.3,
            3.0,
            "u, T/T0 around which the compliance falls by the share b; 0: no knee, EA(T) grows all along",
            log=True,
            role="shape",
            omitted=0.0,
            of_known_drive=True,
            minimum=0.0,
            maximum=10.0,
            tries=(0.75, 1.0, 1.3),
        ),
        Parameter(
            "again",
            "-",
            0.0,
            1.2,
            4.0,
            "r, over the knee's tension that around which it is stiff again, soft between; 0: the knee alone",
            log=True,
            role="shape",
            omitted=0.0,
            of_known_drive=True,
            minimum=0.0,
            maximum=10.0,
        ),
    ),
    acts_through=("load",),
    bounded=True,
    change=_change,
    tries=tuple({"knee": u, "again": r} for u in (0.5, 0.75, 1.0) for r in (1.7, 2.5)),
    at_pretension=_at_pretension,
)
