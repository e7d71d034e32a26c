"""Routing friction: the cable slides over fixed guides, idlers or through a sheath between the pulleys."""

from __future__ import annotations

from collections.abc import Mapping

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter

FRICTIONLESS = 1e-5  # below, a guide is nothing but more free cable
LEAST_PLACE = (
    1e-6  # share of the free cable beside the joint's drum: all of it stuck, the joint would not give
)


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    angle, arc = values["mu_angle"], values["arc_length_m"]
    if angle < FRICTIONLESS:
        return Change(extra_length_m=arc)
    return Change(
        guide_angle=angle,
        guide_length_m=arc,
        guide_skew=values["skew"],
        guide_place=max(values["place"], LEAST_PLACE),
        guide_spread=values["spread"],
    )


EFFECT = Effect(
    id="routing_friction",
    statement="The cable rubs on fixed guides, idlers or a sheath between the "
    "pulleys; tension is lost over the bends in "
    "the direction of sliding, and motion is lost at each reversal until all of the path slides the other way.",
    equation="ln(T_out/T_in) = -+ mu Theta (1 + s) while sliding in cable h, (1 - s) in l; in between the guide's "
    "tension profile sticks, clamped from both ends; cable on both sides of the path and between its guides yields",
    source="capstan law (Euler-Eytelwein); Kaneko et al. 1991; profile law of a doubly free arc",
    parameters=(
        Parameter(
            "mu_angle",
            "-",
            0.0,
            0.0,
            5.0,
            "friction coefficient times total bend angle of the path",
            minimum=0.0,
        ),
        Parameter(
            "arc_length_m",
            "m",
            0.0,
            0.0,
            4.0,
            "length of cable lying on guides or in the sheath",
            role="length",
            scale=lambda config: config.drive.stage[-1].free_length_m,
            minimum=0.0,
        ),
        Parameter(
            "skew",
            "-",
            0.0,
            -0.95,
            0.95,
            "s, how unlike the paths of the two cables are",
            role="shape",
            omitted=0.0,
            minimum=-0.99,
            maximum=0.99,
            tries=(-0.6, 0.6),
        ),
        Parameter(
            "place",
            "-",
            0.5,
            0.02,
            0.98,
            "share of the free cable that lies between path and joint, the rest between path and motor",
            role="shape",
            omitted=0.5,
            minimum=0.0,
            maximum=0.98,
            tries=(0.15, 0.35, 0.65, 0.85),
            of_known_drive=True,  # of the jaw two of them took the place of what another posture needs
        ),
        Parameter(
            "spread",
            "-",
            0.0,
            0.0,
            0.9,
            "share of the free cable that lies between guides: they rub as one path that is so much longer",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=0.98,
            tries=(0.5,),
            of_known_drive=True,
        ),
    ),
    acts_through=("reversal", "load_direction", "velocity", "load"),
    bounded=False,
    posture=True,
    change=_change,
)
