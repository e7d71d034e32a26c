"""Crosstalk: a neighbouring joint loads this one's cables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, term


@term(parameters=("load_coefficient", "channel"))
def _leak(c: Any, p: Any, s: Any) -> None:
    """p: load coefficient [N m per unit of the channel], place of the channel among the others."""
    other = c.other[int(p.channel)]
    if not math.isnan(other):
        c.moment -= p.load_coefficient * other


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(terms=_leak(load_coefficient=values["load_coefficient"], channel=values["channel"]))


EFFECT = Effect(
    id="crosstalk",
    statement="A neighbouring joint loads this joint's cables: what the other does appears here.",
    equation="M_cable = M + k other(t)",
    source="cables routed past or over a neighbouring axis carry part of its load; linear as first order",
    parameters=(
        Parameter("load_coefficient", "N m/unit", 0.0, -1.0, 1.0, "k, moment per unit of the other channel"),
    ),
    acts_through=("other",),
    bounded=True,
    change=_change,
    texts=("channel",),
)
