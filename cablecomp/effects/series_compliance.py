"""Series compliance: torque sensor, coupling and mount give way in proportion to the load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, term, wrap_compliance


@term(parameters=("compliance",))
def _give_way(c: Any, p: Any, s: Any) -> None:
    c.reading += p.compliance * (c.load - c.moment)


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(terms=_give_way(compliance=values["compliance_rad_per_Nm"]))


EFFECT = Effect(
    id="series_compliance",
    statement="Something in series with the joint (torque sensor, coupling, mount) yields in proportion to "
    "the load.",
    equation="q_out = q_drive + c_s M, M the moment in the load path",
    source="Snow 1993, App. A.3",
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
    ),
    acts_through=("load",),
    bounded=True,
    change=_change,
    rank=5,
)
