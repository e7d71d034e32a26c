"""Gravity load: the link's weight, which the torque channel does not contain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment, term
from cablecomp.mechanics.layout import X_JOINT, X_MOMENT, X_MOMENT_SLOPE


@term(parameters=2)
def _weigh(c: Any, p: Any, s: Any) -> None:
    """p: greatest moment [N m], phase [rad]."""
    angle = c[X_JOINT] + p[1]
    c[X_MOMENT] += p[0] * math.sin(angle)
    c[X_MOMENT_SLOPE] += p[0] * math.cos(angle)


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(terms=_weigh(values["moment_Nm"], values["phase_rad"]))


EFFECT = Effect(
    id="gravity_load",
    statement="The link's weight turns the joint, more or less by its position; the torque channel does "
    "not show it.",
    equation="M_cable = M - m g l sin(q_out + φ)",
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
        Parameter("phase_rad", "rad", 0.0, -math.pi, math.pi, "φ, angle from the hanging rest", shape=True),
    ),
    acts_through=("joint_angle", "motor_angle"),
    bounded=False,
    change=_change,
)
