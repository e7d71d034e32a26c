"""Gravity load: the link's weight, which the torque channel does not contain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment, term


@term(parameters=("moment", "phase"))
def _weigh(c: Any, p: Any, s: Any) -> None:
    """p: greatest moment [N m], phase [rad]."""
    angle = c.joint + p.phase
    c.moment += p.moment * math.sin(angle)
    c.moment_slope += p.moment * math.cos(angle)


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(terms=_weigh(moment=values["moment_Nm"], phase=values["phase_rad"]))


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
        Parameter("phase_rad", "rad", 0.0, -math.pi, math.pi, "φ, angle from the hanging rest", role="phase"),
    ),
    acts_through=("joint_angle", "motor_angle"),
    bounded=False,
    change=_change,
)
