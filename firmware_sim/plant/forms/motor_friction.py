"""Friction of the motor in other forms: LuGre with Stribeck's fall and a viscous part, a gear's share of the torque
that it passes on, a drag that changes over a turn."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import MIN_PRESLIDING_RAD, Build
from firmware_sim.plant.columns import TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.effects.motor import contact_stretch, held_back
from firmware_sim.plant.records import Floats

_TORQUE = Parameter("torque_Nm", "τ_m", low=0.0, neutral=0.0)
_REACH = Parameter("presliding_rad", "δ, turn of the motor within which friction builds up", 1e-4, 0.0, 0.1)
_ACTS = ("reversal", "velocity")


def _reach(p: Mapping[str, float]) -> float:
    return max(p["presliding_rad"], MIN_PRESLIDING_RAD)


def bristles(angle: Floats, time_s: Floats, reach_rad: float, gain: float, speed_rad_s: float) -> Floats:
    """LuGre's mean bend z of bristles over their reach: ż = v/δ − |v| z/(δ g), g = 1 + s e^(−(v/v_s)²), the speed
    constant from each sample to the next; unbent at the first."""
    z, result = 0.0, np.zeros_like(angle)
    steps = zip(np.diff(angle).tolist(), np.diff(time_s).tolist(), strict=True)
    for k, (turn, h) in enumerate(steps, start=1):
        lets_go = 1.0 + gain * math.exp(-((turn / h / speed_rad_s) ** 2))
        end = math.copysign(lets_go, turn)
        z = end + (z - end) * math.exp(-abs(turn) / (reach_rad * lets_go))
        result[k] = z
    return result


def _lugre(build: Build, p: Mapping[str, float]) -> None:
    def drag(inputs: Floats, angle: Floats, cable: Floats) -> Floats:
        time = inputs[:, TIME]
        z = bristles(angle, time, _reach(p), p["stribeck_gain"], p["stribeck_rad_s"])
        speed = np.concatenate([[0.0], np.diff(angle) / np.diff(time)])
        return np.asarray(p["torque_Nm"] * z + p["viscous_Nms_per_rad"] * speed)

    held_back(build, drag)


LUGRE = form(
    "motor_friction",
    "lugre",
    "LuGre: bristles that bend by z and let go at (1 + s e^(−(v/v_s)²)) τ_m, and a viscous part σ2 v.",
    (
        _TORQUE,
        _REACH,
        Parameter("stribeck_gain", "s", 0.3, 0.0, 3.0),
        Parameter("stribeck_rad_s", "v_s", 0.1, 1e-6),
        Parameter("viscous_Nms_per_rad", "σ2", 0.0, 0.0, neutral=0.0),
    ),
    _ACTS,
    _lugre,
)


def _gear(build: Build, p: Mapping[str, float]) -> None:
    held_back(
        build,
        lambda inputs, angle, cable: (
            (p["torque_Nm"] + p["share"] * np.abs(cable)) * contact_stretch(angle, _reach(p))
        ),
    )


GEAR = form(
    "motor_friction",
    "gear",
    "A gear's teeth rub as they press: τ_m + k |torque passed on to the cable|, by a contact that yields.",
    (_TORQUE, _REACH, Parameter("share", "k", 0.0, 0.0, 1.0, neutral=0.0)),
    (*_ACTS, "load"),
    _gear,
)


def _uneven(build: Build, p: Mapping[str, float]) -> None:
    def drag(inputs: Floats, angle: Floats, cable: Floats) -> Floats:
        over_a_turn = 1.0 + p["unevenness"] * np.cos(p["order"] * angle - p["phase_rad"])
        return np.asarray(p["torque_Nm"] * over_a_turn * contact_stretch(angle, _reach(p)))

    held_back(build, drag)


UNEVEN = form(
    "motor_friction",
    "uneven",
    "A bent shaft rubs harder in places: τ_m (1 + a cos(n q_in − φ)), by a contact that yields.",
    (
        _TORQUE,
        _REACH,
        Parameter("unevenness", "a", 0.5, -1.0, 1.0),
        Parameter("order", "n, periods per turn of the motor", 1.0, 0.1, 1e3),
        Parameter("phase_rad", "φ", 0.0),
    ),
    (*_ACTS, "motor_angle"),
    _uneven,
)

KINDS: tuple[EffectKind, ...] = (LUGRE, GEAR, UNEVEN)
