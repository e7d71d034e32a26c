"""Gravity load: the link's weight, or a payload that is picked up and put down, which the torque channel does not
contain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment
from cablecomp.effects.compiled_term import term
from cablecomp.errors import InputError

LIFT_S: Final = 0.3
"""Within which a payload is usually taken up or set down."""


@term(
    parameters=(
        *("moment", "phase", "growth", "tilt", "lean", "upright", "channel"),
        *("period", "picked_up", "held", "always", "lift"),
    )
)
def _weigh(c: Any, p: Any, s: Any) -> None:
    """p: greatest moment [N m], phase [rad], by what share it grows with the joint's angle [1/rad], turn of the base
    about the joint's axis and of that axis out of the level [rad per unit of the channel], its slope where the channel
    is 0 [rad], the channel's place among the others (-1: none); from one picking up to the next [s] (0: nothing is),
    when one was [s], share of that time for which it is held, share of the moment that is always there, within which it
    is taken up or set down [s]."""
    angle, slope = c.joint + p.phase, p.upright
    if p.channel >= 0.0:
        other = c.other[int(p.channel)]
        if not math.isnan(other):
            angle += p.tilt * other
            slope += p.lean * other
    moment = p.moment * math.cos(slope)
    if p.period > 0.0:
        since = (c.time - p.picked_up) % p.period
        taken = min(since / p.lift, 1.0) - min(max((since - p.held * p.period) / p.lift, 0.0), 1.0)
        # and what of the time before is not set down yet
        taken += max(1.0 - (since + (1.0 - p.held) * p.period) / p.lift, 0.0)
        moment *= p.always + (1.0 - p.always) * max(taken, 0.0)
    lever = moment * (1.0 + p.growth * c.joint)
    c.moment += lever * math.sin(angle)
    c.moment_slope += lever * math.cos(angle) + moment * p.growth * math.sin(angle)


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
        growth=values["growth_per_rad"],
        tilt=values["tilt_rad_per_unit"],
        lean=values["lean_rad_per_unit"],
        upright=values["upright_rad"],
        channel=values["channel"],
        period=values["period_s"],
        picked_up=values["picked_up_s"],
        held=values["held"],
        always=values["always"],
        lift=values["lift_s"],
    )
    return Change(terms=weight)


EFFECT = Effect(
    id="gravity_load",
    statement="The link's weight turns the joint, more or less by its position, and by how another "
    "joint has turned its base about this joint's axis or out of its plane; on a linkage its lever grows or shrinks on "
    "the way; a payload is picked up and put down. The torque channel does not show it.",
    equation="M_cable = M - m g l (a + (1 - a) g(t)) (1 + p q_out) cos(l0 + l other(t)) sin(q_out + φ + t other(t)), "
    "g = 1 for h P from t_p, t_p + P, ... on, and 0 else; P = 0: g = 1",
    source="statics of a pendulum, of which the share across a leaning axis turns it; a linkage's lever to first order "
    "in the joint's angle; a payload that is handled again and again, or once (P longer than the recording)",
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
            "growth_per_rad",
            "1/rad",
            0.0,
            -20.0,
            20.0,
            "p, share by which its lever grows per radian of the joint, as on a linkage",
            role="shape",
            omitted=0.0,
            of_known_drive=True,
            tries=(-1.0, 1.0),
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
        Parameter(
            "period_s",
            "s",
            0.0,
            1.0,
            3600.0,
            "P, from one picking up of a payload to the next; 0: the weight is always there",
            log=True,
            role="cycle",
            omitted=0.0,
            minimum=0.0,
        ),
        Parameter(
            "picked_up_s",
            "s",
            0.0,
            0.0,
            3600.0,
            "t_p, when it is picked up, once",
            role="cycle start",
            omitted=0.0,
        ),
        Parameter(
            "held",
            "-",
            0.5,
            0.05,
            0.95,
            "h, share of P for which it is held",
            role="cycle",
            omitted=0.5,
            minimum=0.0,
            maximum=1.0,
        ),
        Parameter(
            "always",
            "-",
            0.0,
            0.0,
            0.9,
            "a, share of the moment that is there without it",
            role="cycle",
            omitted=0.0,
            minimum=0.0,
            maximum=1.0,
        ),
        Parameter(
            "lift_s",
            "s",
            LIFT_S,
            0.05,
            2.0,
            "within which it is taken up or set down",
            log=True,
            role="cycle",
            held=True,
            omitted=LIFT_S,
            minimum=1e-3,
        ),
    ),
    acts_through=("joint_angle", "motor_angle", "other"),
    texts=("channel",),
    texts_optional=True,
    channel_ends="_rad",  # a base is turned by an angle: what may be anything else is a neighbour's load
    felt_by_motor=True,
    bounded=False,
    change=_change,
    tries=tuple({"lean_rad_per_unit": turn, "upright_rad": 0.7} for turn in (-0.8, 0.8)),
)
