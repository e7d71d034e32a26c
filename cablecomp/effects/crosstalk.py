"""Crosstalk: a neighbouring joint loads this one's cables, or turns the joint."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment, term, wrap_deflection
from cablecomp.mechanics.change import Term


@term(parameters=("load_coefficient", "growth", "bend", "channel"))
def _leak(c: Any, p: Any, s: Any) -> None:
    """p: load coefficient [N m per unit of the channel], its growth with the joint's angle [1/rad] and with the channel
    itself [1/unit], place of the channel among the others."""
    other = c.other[int(p.channel)]
    if not math.isnan(other):
        other *= 1.0 + p.bend * other
        c.moment -= p.load_coefficient * (1.0 + p.growth * c.joint) * other
        c.moment_slope -= p.load_coefficient * p.growth * other


@term(parameters=("turn", "bend", "channel"))
def _turn(c: Any, p: Any, s: Any) -> None:
    """p: turn of the joint [rad per unit of the channel], its growth with the channel itself [1/unit], place of the
    channel among the others."""
    other = c.other[int(p.channel)]
    if not math.isnan(other):
        c.reading += p.turn * (1.0 + p.bend * other) * other


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    terms: list[Term] = []
    bend, channel = values["bend_per_unit"], values["channel"]
    if values["load_coefficient"] != 0.0:
        growth = values["growth_per_rad"]
        terms += _leak(load_coefficient=values["load_coefficient"], growth=growth, bend=bend, channel=channel)
    if values["turn_rad_per_unit"] != 0.0:
        terms += _turn(turn=values["turn_rad_per_unit"], bend=bend, channel=channel)
    return Change(terms=tuple(terms))


EFFECT = Effect(
    id="crosstalk",
    statement="A neighbouring joint loads this joint's cables, or turns the joint (its cables pass the other's axis, "
    "or the frame between them gives way): what the other does appears here.",
    equation="M_cable = M + k (1 + p q_out) (1 + b other(t)) other(t); q_out + d (1 + b other(t)) other(t)",
    source="cables routed past or over a neighbouring axis carry part of its load, or lengthen on one side by its "
    "turn, and a frame bends under its load; linear as first order, in the joint's angle too, with which the lever "
    "arm changes; quadratic where it counts more one way than the other",
    parameters=(
        Parameter(
            "load_coefficient",
            "N m/unit",
            0.0,
            -1.0,
            1.0,
            "k, moment per unit of the other channel",
            scale=pretension_moment,
            omitted=0.0,
            by_itself=True,
            per_reading=True,
        ),
        Parameter(
            "turn_rad_per_unit",
            "rad/unit",
            0.0,
            -5.0,
            5.0,
            "d, turn of the joint per unit of the other channel, which loads no cable",
            scale=wrap_deflection,
            omitted=0.0,
            by_itself=True,
            per_reading=True,
        ),
        Parameter(
            "growth_per_rad",
            "1/rad",
            0.0,
            -5.0,
            5.0,
            "p, share by which that grows per radian of the joint",
            role="shape",
            omitted=0.0,
            minimum=-20.0,
            maximum=20.0,
            tries=(-1.0, 1.0),
            of="load_coefficient",
        ),
        Parameter(
            "bend_per_unit",
            "1/unit",
            0.0,
            -100.0,
            100.0,
            "b, share by which that grows per unit of the other channel",
            role="bend",
            omitted=0.0,
            tries=(-0.6, 0.6),
        ),
    ),
    acts_through=("other",),
    bounded=True,
    unbounded_by=("growth_per_rad",),  # the moment then goes by the angle that is solved for
    change=_change,
    texts=("channel",),
)
