"""Unseen weight in other forms: held by a spring, on a linkage, on a base that tilts or leans, picked up and put
down."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import LEAN, OTHER, TILT, TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import held
from firmware_sim.plant.records import Floats

_MOMENT = Parameter("moment_Nm", "m g l", neutral=0.0)
_PHASE = Parameter("phase_rad", "φ", 0.0)
_ACTS = ("joint_angle", "motor_angle")
_FAR = 1e6  # so strong that the spring is a straight one


def _weight(build: Build, p: Mapping[str, float]) -> None:
    shaft = build.shafts[build.output]
    shaft["gravity_Nm"], shaft["gravity_phase"] = p["moment_Nm"], p["phase_rad"]


def _sprung(build: Build, p: Mapping[str, float]) -> None:
    _weight(build, p)
    if p["spring_share"] * p["moment_Nm"] != 0.0:
        shaft = build.shafts[build.output]
        rate = p["spring_share"] * abs(p["moment_Nm"])
        shaft["spring_rate"], shaft["spring_Nm"] = rate, _FAR * rate


SPRUNG = form(
    "gravity_load",
    "sprung",
    "A weight with a spring beside it: the cables carry M − m g l sin(q + φ) − s m g l q.",
    (_MOMENT, _PHASE, Parameter("spring_share", "s, spring rate over m g l", 0.5, 0.0, 3.0)),
    _ACTS,
    _sprung,
)


def _linkage(build: Build, p: Mapping[str, float]) -> None:
    _weight(build, p)
    shaft = build.shafts[build.output]
    shaft["gravity_second"], shaft["gravity_second_phase"] = p["second"], p["second_phase_rad"]


LINKAGE = form(
    "gravity_load",
    "linkage",
    "A weight on a linkage: the cables carry M − m g l (sin(q + φ) + s sin(2q + ψ)).",
    (
        _MOMENT,
        _PHASE,
        Parameter("second", "s", 0.4, -1.0, 1.0),
        Parameter("second_phase_rad", "ψ", 0.0),
    ),
    _ACTS,
    _linkage,
)


def _tilting(build: Build, p: Mapping[str, float]) -> None:
    _weight(build, p)

    def fill(inputs: Floats) -> None:
        inputs[:, TILT] = p["tilt_rad_per_unit"] * inputs[:, OTHER]

    build.schedules.append(fill)


TILTING = form(
    "gravity_load",
    "tilting_base",
    "A weight on a base that a neighbouring joint turns: the cables carry M − m g l sin(q + φ + t · other_1).",
    (_MOMENT, _PHASE, Parameter("tilt_rad_per_unit", "t", 0.0)),
    (*_ACTS, "other:1"),
    _tilting,
)


def _leaning(build: Build, p: Mapping[str, float]) -> None:
    _weight(build, p)

    def fill(inputs: Floats) -> None:
        inputs[:, LEAN] = 1.0 - np.cos(p["upright_rad"] + p["lean_rad_per_unit"] * inputs[:, OTHER])

    build.schedules.append(fill)


LEANING = form(
    "gravity_load",
    "leaning_base",
    "A weight on a base that a neighbouring joint leans out of its plane: the cables carry "
    "M − m g l cos(l0 + l · other_1) sin(q + φ).",
    (
        _MOMENT,
        _PHASE,
        Parameter("lean_rad_per_unit", "l", 0.0),
        Parameter("upright_rad", "l0", 0.0),
    ),
    (*_ACTS, "other:1"),
    _leaning,
)


def _picked_up(build: Build, p: Mapping[str, float]) -> None:
    _weight(build, p)

    def fill(inputs: Floats) -> None:
        there = held(inputs[:, TIME], p["start_s"], p["period_s"], p["held"], p["lift_s"])
        inputs[:, LEAN] = (1.0 - p["share"]) * (1.0 - there)

    build.schedules.append(fill)


PICKED_UP = form(
    "gravity_load",
    "picked_up",
    "A payload that is picked up and put down again and again: the cables carry "
    "M − m g l (s + (1 − s) h(t)) sin(q + φ), h = 1 while it is held and 0 else.",
    (
        _MOMENT,
        _PHASE,
        Parameter("share", "s, of the weight that is always there", 0.2, 0.0, 1.0),
        Parameter("start_s", "when it is picked up, once", 0.0),
        Parameter("period_s", "from one time to the next", 10.0, 0.1),
        Parameter("held", "share of the period", 0.5, 0.05, 0.9),
        Parameter("lift_s", "within which the weight is taken up or set down", 0.3, 1e-3),
    ),
    (*_ACTS, "time"),
    _picked_up,
)

KINDS: tuple[EffectKind, ...] = (SPRUNG, LINKAGE, TILTING, LEANING, PICKED_UP)
