"""Pulley run-out: the output pulley turns about a point beside its centre."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, drum_radius, pretension_moment, term
from cablecomp.mechanics.layout import (
    X_JOINT,
    X_LENGTH_H,
    X_LENGTH_L,
    X_LOAD,
    X_MOMENT,
    X_MOMENT_SLOPE,
)


@term(parameters=4)
def _wind(c: Any, p: Any, s: Any) -> None:
    """p: eccentricity [m], phase [rad], R [m], moment that holds the pretension [N m] (open circuit: R T0).

    Lever arm and wound length belong together (virtual work): the cables feel M R/(R + e cos(x + φ)).
    """
    angle = c[X_JOINT] + p[1]
    wound = p[0] * (math.sin(angle) - math.sin(p[1]))
    c[X_LENGTH_H] += wound
    c[X_LENGTH_L] -= wound
    arm = p[0] * math.cos(angle)
    whole = c[X_LOAD] - c[X_MOMENT] + p[3]
    c[X_MOMENT] += whole * arm / (p[2] + arm)
    c[X_MOMENT_SLOPE] -= whole * p[0] * math.sin(angle) * p[2] / (p[2] + arm) ** 2


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    hanging = pretension_moment(config) if config.drive.circuit == "open" else 0.0
    return Change(terms=_wind(values["eccentricity_m"], values["phase_rad"], drum_radius(config), hanging))


EFFECT = Effect(
    id="pulley_runout",
    statement="The output pulley (or its encoder) is mounted off centre: the transmission swings once per "
    "turn.",
    equation="wound length = R q + e (sin(q + φ) - sin φ), lever arm R + e cos(q + φ)",
    source="kinematics of an eccentric drum: distance of the cable's line from the axis, integrated over "
    "the turn",
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
            "phase_rad", "rad", 0.0, -math.pi, math.pi, "φ, its direction at joint angle zero", shape=True
        ),
    ),
    acts_through=("joint_angle", "motor_angle"),
    bounded=False,
    change=_change,
    rank=20,
)
