"""Gravity load: the link's weight, which the torque channel does not contain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment, term
from cablecomp.errors import InputError


@term(parameters=("moment", "phase", "tilt", "channel"))
def _weigh(c: Any, p: Any, s: Any) -> None:
    """p: greatest moment [N m], phase [rad], turn of the base [rad per unit of the channel], the channel's place among
    the others (-1: none)."""
    angle = c.joint + p.phase
    if p.channel >= 0.0:
        other = c.other[int(p.channel)]
        if not math.isnan(other):
            angle += p.tilt * other
    c.moment += p.moment * math.sin(angle)
    c.moment_slope += p.moment * math.cos(angle)


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    if values["tilt_rad_per_unit"] != 0.0 and values["channel"] < 0.0:
        raise InputError(
            f"{config.name}: effect `gravity_load` lacks key `channel`, what turns the joint's base by "
            "`tilt_rad_per_unit`: a channel `other_<name>`; add it"
        )
    weight = _weigh(
        moment=values["moment_Nm"],
        phase=values["phase_rad"],
        tilt=values["tilt_rad_per_unit"],
        channel=values["channel"],
    )
    return Change(terms=weight)


EFFECT = Effect(
    id="gravity_load",
    statement="The link's weight turns the joint, more or less by its position, and by how another "
    "joint has turned its base; the torque channel does not show it.",
    equation="M_cable = M - m g l sin(q_out + φ + t other(t))",
    source="statics of a pendulum",
    parameters=(
        Parameter(
            "moment_Nm",
            "N m",
            0.0,
            1e-4,
            1.5,
            "m g l, greatest moment of the weight",
            log=True,
            scale=pretension_moment,
        ),
        Parameter("phase_rad", "rad", 0.0, -math.pi, math.pi, "φ, angle from the hanging rest", role="phase"),
        Parameter(
            "tilt_rad_per_unit",
            "rad/unit",
            0.0,
            -1.5,
            1.5,
            "t, turn of the joint's base about its axis per unit of the other channel",
            role="tilt",
            omitted=0.0,
        ),
    ),
    acts_through=("joint_angle", "motor_angle", "other"),
    texts=("channel",),
    texts_optional=True,
    channel_ends="_rad",  # a base is turned by an angle: what may be anything else is a neighbour's load
    bounded=False,
    change=_change,
)
