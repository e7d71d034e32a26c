"""What holds the motor's shaft back between its torque sensor and the cable: the motor feels it, the joint does not."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from firmware_sim.plant.assembly import MIN_PRESLIDING_RAD, Build
from firmware_sim.plant.columns import MOTOR_NM, MOTOR_TRUE
from firmware_sim.plant.effects.base import EffectKind, Parameter
from firmware_sim.plant.records import Floats

Drag = Callable[[Floats, Floats, Floats], Floats]
"""Torque (N·m) that the motor needs beside the cable's, from the inputs, its true angle and the cable's torque."""


def held_back(build: Build, drag: Drag) -> None:
    """Add to what the motor's torque channel shows; what turns as prescribed turns whatever holds it back."""

    def read(inputs: Floats, outputs: Floats) -> None:
        outputs[:, MOTOR_NM] += drag(inputs, outputs[:, MOTOR_TRUE], outputs[:, MOTOR_NM].copy())

    build.encoders.append(read)


def contact_stretch(angle: Floats, reach_rad: float) -> Floats:
    """Stretch of a contact that holds until it is stretched by `reach_rad` and then is dragged along, over that reach:
    (q − a)/δ, with the contact's place a within q ± δ; unstretched at the first angle."""
    place = float(angle[0])
    result = np.empty_like(angle)
    for k, q in enumerate(angle.tolist()):
        place = min(max(place, q - reach_rad), q + reach_rad)
        result[k] = (q - place) / reach_rad
    return result


def _friction(build: Build, p: Mapping[str, float]) -> None:
    reach = max(p["presliding_rad"], MIN_PRESLIDING_RAD)
    if build.dynamic:
        build.shafts[0]["coulomb_Nm"], build.shafts[0]["presliding"] = p["torque_Nm"], reach
        return
    held_back(build, lambda inputs, angle, cable: p["torque_Nm"] * contact_stretch(angle, reach))


MOTOR_FRICTION = EffectKind(
    "motor_friction",
    "The motor's bearings and gear hold back with up to τ_m between torque sensor and cable: a contact that yields, "
    "stretched by presliding_rad when it does.",
    (
        Parameter("torque_Nm", "τ_m", low=0.0),
        Parameter("presliding_rad", "turn of the motor within which friction builds up", 1e-4, 0.0, 0.1),
    ),
    ("reversal", "velocity"),
    _friction,
)

KINDS = (MOTOR_FRICTION,)
