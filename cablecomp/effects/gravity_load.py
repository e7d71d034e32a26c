"""Gravity load: the link's weight, which the torque channel does not contain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment, term
from cablecomp.errors import InputError


@term(parameters=("moment", "phase", "second", "second_phase", "tilt", "lean", "upright", "channel"))
def _weigh(c: Any, p: Any, s: Any) -> None:
    """p: greatest moment [N m], phase [rad], share of it that comes twice a turn, and by how much its phase is
    ahead of the other's [rad], turn of the base about the joint's axis and of that axis out of the level [rad per unit
    of the channel], its slope where the channel is 0 [rad], the channel's place among the others (-1: none)."""
    angle, slope = c.joint + p.phase, p.upright
    if p.channel >= 0.0:
        other = c.other[int(p.channel)]
        if not math.isnan(other):
            angle += p.tilt * other
            slope += p.lean * other
    moment = p.moment * math.cos(slope)
    c.moment += moment * math.sin(angle)
    c.moment_slope += moment * math.cos(angle)
    if p.second != 0.0:
        twice, share = 2.0 * c.joint + p.phase + p.second_phase, moment * p.second
        c.moment += share * math.sin(twice)
        c.moment_slope += 2.0 * share * math.cos(twice)


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    turned = [k for k in ("tilt_rad_per_unit", "lean_rad_per_unit") if values[k] != 0.0]
    if turned and values["channel"] < 0.0:
        raise InputError(
            f"{config.name}: effect `gravity_load` lacks key `channel`, what turns the joint's base by "
            f"`{turned[0]}`: a channel `other_<name>`; add it"
        )
    weight = _weigh(
        moment=values["moment_Nm"],
        phase=values["phase_rad"],
        second=values["second"],
        second_phase=values["second_phase_rad"],
        tilt=values["tilt_rad_per_unit"],
        lean=values["lean_rad_per_unit"],
        upright=values["upright_rad"],
        channel=values["channel"],
    )
    return Change(terms=weight)


EFFECT = Effect(
    id="gravity_load",
    statement="The link's weight turns the joint, more or less by its position, and by how another "
    "joint has turned its base about this joint's axis or out of its plane; on a linkage its lever grows or shrinks on "
    "the way. The torque channel does not show it.",
    equation="M_cable = M - m g l cos(l0 + l other(t)) (sin(q_out + φ + t other(t)) + s sin(2 q_out + φ + ψ))",
    source="statics of a pendulum, of which the share across a leaning axis turns it; a linkage's potential to the "
    "second harmonic of the joint's angle",
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
            "second",
            "-",
            0.0,
            0.0,
            1.0,
            "s, what comes twice a turn over what comes once, as on a linkage",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=1.0,
            of_known_drive=True,
        ),
        Parameter(
            "second_phase_rad",
            "rad",
            0.0,
            -math.pi,
            math.pi,
            "ψ, its phase at joint angle zero, beyond φ",
            role="shape",
            omitted=0.0,
            of_known_drive=True,
        ),
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
        Parameter(
            "lean_rad_per_unit",
            "rad/unit",
            0.0,
            -1.5,
            1.5,
            "l, turn of the joint's axis out of the level per unit of the other channel",
            role="tilt",
            omitted=0.0,
            of_known_drive=True,
        ),
        Parameter(
            "upright_rad",
            "rad",
            0.0,
            -0.5 * math.pi,
            0.5 * math.pi,
            "l0, slope of that axis where the other channel is 0",
            role="shape",
            omitted=0.0,
            of="moment_Nm",
        ),
    ),
    acts_through=("joint_angle", "motor_angle", "other"),
    texts=("channel",),
    texts_optional=True,
    channel_ends="_rad",  # a base is turned by an angle: what may be anything else is a neighbour's load
    felt_by_motor=True,
    bounded=False,
    change=_change,
    tries=(
        *({"lean_rad_per_unit": turn, "upright_rad": 0.7} for turn in (-0.8, 0.8)),
        *({"second": 0.5, "second_phase_rad": 0.25 * math.pi * k} for k in (-3, -1, 1, 3)),
    ),
)
