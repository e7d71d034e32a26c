"""Position-dependent friction: a worn or dirty stretch of the output drum's groove."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Floats, Parameter


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    amplitude, phase = values["amplitude"], values["phase_rad"]

    def factor(q: Floats) -> Floats:
        return np.asarray(1.0 + amplitude * np.cos(q - phase), dtype=np.float64)

    return Change(joint_angle_factor=factor)


EFFECT = Effect(
    id="position_dependent_friction",
    statement="The output drum's groove is rougher in one place than in another, so that friction depends "
    "on where the joint stands.",
    equation="mu = mu0 (1 + a cos(q - φ)) for the place of the groove that the cable leaves when the joint "
    "stands at q",
    source="first harmonic of a friction coefficient that varies along the groove; position-dependent "
    "friction of joints: B. Armstrong-Hélouvry, Control of Machines with Friction, 1991",
    parameters=(
        Parameter(
            "amplitude",
            "-",
            0.0,
            1e-3,
            0.95,
            "a, relative variation",
            log=True,
            minimum=-0.98,
            maximum=0.98,
        ),
        Parameter(
            "phase_rad",
            "rad",
            0.0,
            -math.pi,
            math.pi,
            "φ, joint angle of the roughest place",
            role="phase",
        ),
    ),
    acts_through=("joint_angle", "motor_angle"),
    bounded=True,
    change=_change,
)
