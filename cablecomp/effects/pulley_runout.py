"""Pulley run-out: the output pulley turns about a point beside its centre, or is out of round."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, drum_radius, pretension_moment
from cablecomp.effects.compiled_term import term
from cablecomp.effects.shared_shapes import repeated


@term(parameters=("eccentricity", "phase", "order", "radius", "hanging"))
def _wind(c: Any, p: Any, s: Any) -> None:
    """p: eccentricity [m], phase [rad], how often a turn, R [m], moment that holds the pretension [N m] (open circuit:
    R T0).

    Lever arm and wound length belong together (virtual work): the cables feel M R/(R + e k cos(k x + φ)).
    """
    angle = p.order * c.joint + p.phase
    wound = p.eccentricity * (math.sin(angle) - math.sin(p.phase))
    c.length_h += wound
    c.length_l -= wound
    arm = p.eccentricity * p.order * math.cos(angle)
    whole = c.load - c.moment + p.hanging
    c.moment += whole * arm / (p.radius + arm)
    c.moment_slope *= p.radius / (p.radius + arm)
    bend = p.eccentricity * p.order**2 * math.sin(angle)
    c.moment_slope -= whole * bend * p.radius / (p.radius + arm) ** 2


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    hanging = pretension_moment(config) if config.drive.circuit == "open" else 0.0
    terms = _wind(
        eccentricity=values["eccentricity_m"],
        phase=values["phase_rad"],
        order=values["order"],
        radius=drum_radius(config),
        hanging=hanging,
    )
    return Change(terms=terms)


EFFECT = Effect(
    id="pulley_runout",
    statement="The output pulley (or its encoder) is mounted off centre: the transmission swings once per "
    "turn; more often where a pulley is out of round or an idler runs out of true.",
    equation="wound length = R q + e (sin(k q + φ) - sin φ), lever arm R + e k cos(k q + φ)",
    source="kinematics of an eccentric drum: distance of the cable's line from the axis, integrated over "
    "the turn; one harmonic of any other",
    parameters=(
        Parameter(
            "eccentricity_m",
            "m",
            0.0,
            1e-6,
            0.03,
            "e, centre to axis",
            log=True,
            scale=drum_radius,
            minimum=-0.01,
            maximum=0.01,
        ),
        Parameter(
            "phase_rad", "rad", 0.0, -math.pi, math.pi, "φ, its direction at joint angle zero", role="phase"
        ),
        repeated(
            "k, how often a turn of the joint repeats it: 2 for a pulley that is oval",
            tries=(2.0, 3.5, 5.0, 6.5, 8.0),
        ),
    ),
    acts_through=("joint_angle", "motor_angle"),
    bounded=False,
    change=_change,
    rank=20,
)
