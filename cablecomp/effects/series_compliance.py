"""Series compliance: torque sensor, coupling and mount give way with the load, or more one way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, term, wrap_compliance


@term(parameters=("compliance", "skew"))
def _give_way(c: Any, p: Any, s: Any) -> None:
    path = c.load - c.moment
    c.reading += p.compliance * (path + p.skew * abs(path))


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(terms=_give_way(compliance=values["compliance_rad_per_Nm"], skew=values["skew"]))


EFFECT = Effect(
    id="series_compliance",
    statement="Something in series with the joint (torque sensor, coupling, mount) yields in proportion to "
    "the load.",
    equation="q_out = q_drive + c_s (M + s |M|), M the moment in the load path, -1 <= s <= 1",
    source="Snow 1993, App. A.3; a mount that rests on a stop yields one way alone (s = 1 or -1)",
    parameters=(
        Parameter(
            "compliance_rad_per_Nm",
            "rad/(N m)",
            0.0,
            1e-4,
            3.0,
            "c_s, added compliance",
            log=True,
            scale=wrap_compliance,
            minimum=0.0,
        ),
        Parameter(
            "skew",
            "-",
            0.0,
            -1.0,
            1.0,
            "s, how much softer it is to loads above zero than below: 1 rests on a stop for loads below zero",
            role="shape",
            omitted=0.0,
            minimum=-1.0,
            maximum=1.0,
            tries=(-0.7, 0.7),
        ),
    ),
    acts_through=("load",),
    bounded=True,
    change=_change,
    rank=5,
)
