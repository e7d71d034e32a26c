"""Unseen weight in other forms: held by a spring, on a linkage, on a base that tilts or leans, picked up and put
down in turn or as it comes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import LEAN, OTHER, TILT, TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import held, ramp
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


def _sorted(build: Build, p: Mapping[str, float]) -> None:
    _weight(build, p)

    def fill(inputs: Floats) -> None:
        time = inputs[:, TIME]
        there = np.zeros(len(time))
        for k in range(int((float(time[-1]) - p["start_s"]) / p["period_s"]) + 2):
            # multiples of the golden ratio and of the square root of 2: no time and no weight comes twice
            later, lighter = (0.618034 * k) % 1.0, (0.414214 * k) % 1.0
            begin = p["start_s"] + (k + p["uneven"] * later) * p["period_s"]
            end = begin + p["held"] * (1.0 - 0.5 * p["uneven"] * lighter) * p["period_s"]
            lifted = ramp(time, begin, p["lift_s"]) - ramp(time, end, p["lift_s"])
            there += (1.0 - p["unlike"] * lighter) * lifted
        inputs[:, LEAN] = 1.0 - there

    build.schedules.append(fill)


SORTED = form(
    "gravity_load",
    "sorted",
    "Payloads of unlike weights that are picked up at uneven times, held for unlike times and put down: the cables "
    "carry M − m_k g l sin(q + φ) while the k-th is held, and M else.",
    (
        _MOMENT,
        _PHASE,
        Parameter("start_s", "when the first is picked up", 0.0),
        Parameter("period_s", "from one to the next, on an average", 10.0, 0.1),
        Parameter("held", "share of that for which the first is held", 0.5, 0.05, 0.6),
        Parameter("uneven", "share of the period by which the times differ", 0.4, 0.0, 0.4),
        Parameter("unlike", "by what share of the heaviest the weights differ", 0.5, 0.0, 1.0),
        Parameter("lift_s", "within which the weight is taken up or set down", 0.3, 1e-3),
    ),
    (*_ACTS, "time"),
    _sorted,
)

KINDS: tuple[EffectKind, ...] = (SPRUNG, LINKAGE, TILTING, LEANING, PICKED_UP, SORTED)
