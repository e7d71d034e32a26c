"""Position-dependent friction: a worn or dirty stretch of the groove of the output or of the input drum."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Floats, Parameter
from cablecomp.effects.shared_shapes import repeated
from cablecomp.mechanics.change import Factor, Law, Product


def _groove(values: Mapping[str, float]) -> Factor | None:
    """Of the output drum: the wave, and the patch."""
    wave = _wave(values["amplitude"], values["phase_rad"], values["order"])
    if values["patch"] == 0.0:
        return wave
    patch = Law(_rough, (values["patch"], values["place_rad"], values["width_rad"]))
    return patch if wave is None else Product((patch, wave))


def _wave(amplitude: float, phase_rad: float, order: float = 1.0) -> Factor | None:
    return Law(_uneven, (amplitude, phase_rad, order)) if amplitude else None


def _uneven(angle: Floats, amplitude: float, phase_rad: float, order: float) -> Floats:
    return np.asarray(1.0 + amplitude * np.cos(order * angle - phase_rad), dtype=np.float64)


def _rough(angle: Floats, height: float, place: float, width: float) -> Floats:
    return np.asarray(1.0 + height / (1.0 + ((angle - place) / width) ** 4), dtype=np.float64)


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(
        joint_angle_factor=_groove(values),
        motor_angle_factor=_wave(values["input_amplitude"], values["input_phase_rad"]),
    )


EFFECT = Effect(
    id="position_dependent_friction",
    statement="A drum's groove is rougher in one place than in another, so that friction depends "
    "on where the joint stands.",
    equation="output drum: mu = mu0 (1 + a cos(k q - φ)) for the place of the groove that the cable leaves when the "
    "joint stands at q, beside it 1 + h/(1 + ((q - p)/w)^4) for a patch; input drum: 1 + a_in cos(q_m - φ_in), q_m "
    "the motor's angle",
    source="one harmonic of a friction coefficient that varies along the groove, the first or, where a tool has "
    "chattered, a higher one; position-dependent "
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
            "φ, k times the joint angle of a roughest place",
            role="phase",
            omitted=0.0,
            of="amplitude",
        ),
        repeated("k, how often a turn of the drum repeats it", tries=(2.5, 4.0, 5.5, 7.0), of="amplitude"),
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
        Parameter(
            "patch",
            "-",
            0.0,
            -0.8,
            4.0,
            "h, how much more friction amid a patch of the output drum's groove (below 0: less)",
            minimum=-0.95,
            maximum=20.0,
            omitted=0.0,
            of_known_drive=True,
        ),
        Parameter(
            "place_rad",
            "rad",
            0.0,
            -math.pi,
            math.pi,
            "p, joint angle at which the cable leaves the groove in the middle of the patch",
            role="place",
            omitted=0.0,
            of="patch",
        ),
        Parameter(
            "width_rad",
            "rad",
            0.2,
            0.1,
            1.5,
            "w, half width of the patch",
            log=True,
            role="shape",
            omitted=0.3,
            minimum=0.05,
            of="patch",
        ),
    ),
    acts_through=("joint_angle", "motor_angle"),
    bounded=True,
    change=_change,
)
