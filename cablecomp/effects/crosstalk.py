"""Crosstalk: a neighbouring joint loads this one's cables, or turns the joint."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment, wrap_deflection
from cablecomp.effects.compiled_term import term
from cablecomp.effects.lag import lagged


@term(
    parameters=("load_coefficient", "growth", "turn", "bend", "slack", "lag", "play", "rubs", "channel"),
    state=("known", "late", "other", "time", "drawn"),
)
def _arrive(c: Any, p: Any, s: Any) -> None:
    """p: load coefficient [N m per unit of the channel], its growth with the joint's angle [1/rad], turn of the joint
    [rad per unit], growth of what arrives with itself [1/unit], what is taken up before anything arrives [unit], lag
    [s], how far it goes before something is drawn along [unit], how much of what arrives is that distance, place of the
    channel among the others; s: whether a reading came before, what had arrived of it late, that reading and its time,
    what was drawn along. The channel goes straight from sample to sample; without a reading nothing arrives."""
    other = c.other[int(p.channel)]
    if math.isnan(other):
        if c.first and c.commit:
            s.known = 0.0
    else:
        late = other
        if p.lag > 0.0 and s.known != 0.0 and not c.first:
            late = lagged(s.late, s.other, other, c.time - s.time, p.lag) if c.time > s.time else s.late
        drawn = late
        if p.play > 0.0 and s.known != 0.0 and not c.first:
            drawn = min(max(s.drawn, late - p.play), late + p.play)
        if c.commit:
            s.known, s.late, s.other, s.time, s.drawn = 1.0, late, other, c.time, drawn
        if p.play > 0.0:
            late = (1.0 - p.rubs) * drawn + p.rubs * (late - drawn)
        arrives = late - min(max(late, -p.slack), p.slack)
        arrives *= 1.0 + p.bend * arrives
        c.moment -= p.load_coefficient * (1.0 + p.growth * c.joint) * arrives
        c.moment_slope -= p.load_coefficient * p.growth * arrives
        c.reading += p.turn * arrives


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(
        terms=_arrive(
            load_coefficient=values["load_coefficient"],
            growth=values["growth_per_rad"],
            turn=values["turn_rad_per_unit"],
            bend=values["bend_per_unit"],
            slack=values["slack_units"],
            lag=values["lag_s"],
            play=values["play_units"],
            rubs=values["rubs"],
            channel=values["channel"],
        )
    )


EFFECT = Effect(
    id="crosstalk",
    statement="A neighbouring joint loads this joint's cables, or turns the joint (its cables pass the other's axis, "
    "or the frame between them gives way): what the other does appears here, at once or through something soft and "
    "damped, all of it or what goes beyond a slack, or through friction: what it draws along, or what that takes.",
    equation="M_cable = M + k (1 + p q_out) (1 + b z) z; q_out + d (1 + b z) z; z = x - clip(x, -s, s), "
    "x = (1 - f) w + f (y - w), w drawn along by y, |y - w| <= r (where r is 0, x = y); t_l dy/dt = other - y",
    source="cables routed past or over a neighbouring axis carry part of its load, or lengthen on one side by its "
    "turn, and a frame bends under its load; linear as first order, in the joint's angle too, with which the lever "
    "arm changes; quadratic where it counts more one way than the other; a first lag for rubber, grease or a sheath "
    "between them; a dead zone where parts touch only beyond a clearance; a play operator (M. A. Krasnosel'skii and "
    "A. V. Pokrovskii, Systems with Hysteresis, 1989) where cables or sheaths that cross rub",
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
        Parameter(
            "lag_s",
            "s",
            0.0,
            0.03,
            3.0,
            "t_l, how late it arrives: 63 % of it after a step of the other; 0: at once",
            log=True,
            role="shape",
            omitted=0.0,
            minimum=0.0,
            tries=(0.1, 0.4),
        ),
        Parameter(
            "slack_units",
            "unit",
            0.0,
            0.0,
            0.9,
            "s, reading of the other up to which nothing arrives",
            role="slack",
            omitted=0.0,
            minimum=0.0,
            tries=(0.35,),
            per_reading=True,
        ),
        Parameter(
            "play_units",
            "unit",
            0.0,
            0.0,
            0.9,
            "r, how far the other goes before it draws along what rubs on it; 0: nothing rubs",
            role="slack",
            omitted=0.0,
            minimum=0.0,
            per_reading=True,
        ),
        Parameter(
            "rubs",
            "-",
            0.0,
            0.0,
            1.0,
            "f, share that goes by the force that this takes rather than by what is drawn along",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=1.0,
        ),
    ),
    acts_through=("other",),
    bounded=True,
    unbounded_by=("growth_per_rad",),  # the moment then goes by the angle that is solved for
    change=_change,
    texts=("channel",),
    tries=tuple({"play_units": r, "rubs": f} for r in (0.06, 0.35) for f in (0.0, 1.0)),
)
