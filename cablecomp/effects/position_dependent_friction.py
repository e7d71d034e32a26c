"""Position-dependent friction: a worn or dirty stretch of the groove of the output or of the input drum."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Floats, Parameter
from cablecomp.mechanics.change import Factor


def _wave(amplitude: float, phase_rad: float) -> Factor | None:
    def factor(angle: Floats) -> Floats:
        return np.asarray(1.0 + amplitude * np.cos(angle - phase_rad), dtype=np.float64)

    return factor if amplitude else None


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(
        joint_angle_factor=_wave(values["amplitude"], values["phase_rad"]),
        motor_angle_factor=_wave(values["input_amplitude"], values["input_phase_rad"]),
    )


EFFECT = Effect(
    id="position_dependent_friction",
    statement="A drum's groove is rougher in one place than in another, so that friction depends "
    "on where the joint stands.",
    equation="output drum: mu = mu0 (1 + a cos(q - φ)) for the place of the groove that the cable leaves when the "
    "joint stands at q; input drum: the same with a_in, φ_in and the motor's angle",
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
            omitted=0.0,
        ),
        Parameter(
            "phase_rad",
            "rad",
            0.0,
            -math.pi,
            math.pi,
            "φ, joint angle of the roughest place",
            role="phase",
            omitted=0.0,
            of="amplitude",
        ),
        Parameter(
            "input_amplitude",
            "-",
            0.0,
            1e-3,
            0.95,
            "a_in, relative variation on the input drum",
            log=True,
            minimum=-0.98,
            maximum=0.98,
            omitted=0.0,
        ),
        Parameter(
            "input_phase_rad",
            "rad",
            0.0,
            -math.pi,
            math.pi,
            "φ_in, motor angle of the input drum's roughest place",
            role="phase",
            omitted=0.0,
            of="input_amplitude",
        ),
    ),
    acts_through=("joint_angle", "motor_angle"),
    bounded=True,
    change=_change,
)
