"""Bearing friction in other forms: Dahl, LuGre with Stribeck's fall and a viscous part, unlike by direction, growing
with the moment."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import MIN_PRESLIDING_RAD, Build
from firmware_sim.plant.columns import BEARING_TORQUE, JOINT_TORQUE
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.records import Floats

_TORQUE = Parameter("torque_Nm", "τ_b", low=0.0, neutral=0.0)
_PRESLIDING = Parameter("presliding_rad", "z0, turn within which friction builds up", 1e-5, 0.0, 0.1)
_ACTS = ("reversal", "velocity")


def _coulomb(build: Build, p: Mapping[str, float], kind: int) -> None:
    shaft = build.shafts[build.output]
    shaft["coulomb_Nm"], shaft["friction_kind"] = p["torque_Nm"], kind
    shaft["presliding"] = max(p["presliding_rad"], MIN_PRESLIDING_RAD)


def _dahl(build: Build, p: Mapping[str, float]) -> None:
    _coulomb(build, p, 1)


DAHL = form(
    "bearing_friction",
    "dahl",
    "Dahl's law: τ = τ_b z/z0 with dz = dq − |dq| z/z0, which comes to its limit ever more slowly.",
    (_TORQUE, _PRESLIDING),
    _ACTS,
    _dahl,
)


def _lugre(build: Build, p: Mapping[str, float]) -> None:
    _coulomb(build, p, 2)
    shaft = build.shafts[build.output]
    shaft["stribeck_gain"], shaft["stribeck_speed"] = p["stribeck_gain"], p["stribeck_rad_s"]
    shaft["bristle_damping"] = p["bristle_damping_Nms_per_rad"]
    shaft["viscous"] += p["viscous_Nms_per_rad"]


LUGRE = form(
    "bearing_friction",
    "lugre",
    "LuGre: bristles that bend (τ_b z/z0 + σ1 ż), let go at (1 + g e^(−(v/v_s)²)) τ_b, and a viscous part σ2 v.",
    (
        _TORQUE,
        _PRESLIDING,
        Parameter("stribeck_gain", "g", 0.3, 0.0, 3.0),
        Parameter("stribeck_rad_s", "v_s", 0.05, 1e-6),
        Parameter("bristle_damping_Nms_per_rad", "σ1", 0.0, 0.0, neutral=0.0),
        Parameter("viscous_Nms_per_rad", "σ2", 0.0, 0.0, neutral=0.0),
    ),
    _ACTS,
    _lugre,
)


def _unlike(build: Build, p: Mapping[str, float]) -> None:
    _coulomb(build, p, 0)
    build.shafts[build.output]["coulomb_skew"] = p["skew"]


UNLIKE = form(
    "bearing_friction",
    "unlike_ways",
    "A lip seal: τ_b (1 + s) turning forward, τ_b (1 − s) turning back, with a presliding spring.",
    (_TORQUE, _PRESLIDING, Parameter("skew", "s", 0.4, -0.95, 0.95)),
    _ACTS,
    _unlike,
)


def _by_moment(build: Build, p: Mapping[str, float]) -> None:
    _coulomb(build, p, 0)

    def fill(inputs: Floats) -> None:
        inputs[:, BEARING_TORQUE] += p["moment_coefficient"] * np.abs(inputs[:, JOINT_TORQUE])

    build.schedules.append(fill)


BY_MOMENT = form(
    "bearing_friction",
    "by_moment",
    "A crossed-roller or four-point bearing that the link's load tilts: it holds back with up to τ_b + k |M|, by a "
    "presliding spring.",
    (_TORQUE, _PRESLIDING, Parameter("moment_coefficient", "k", 0.0, 0.0, 1.0, neutral=0.0)),
    (*_ACTS, "load"),
    _by_moment,
)

KINDS: tuple[EffectKind, ...] = (DAHL, LUGRE, UNLIKE, BY_MOMENT)
