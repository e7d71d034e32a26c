"""A groove that is rough in places, in other forms: a patch, ripples, the input drum's groove, a burr, a
polished part, a fleet angle."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.records import GROOVE_LOW, GROOVE_POINTS, GROOVE_STEP

_ANGLES = GROOVE_LOW + GROOVE_STEP * np.arange(GROOVE_POINTS)
_HEIGHT = Parameter("height", "growth of mu at its middle", low=-0.95, high=10.0, neutral=0.0)
_PLACE = Parameter("place_rad", "joint angle at which the cable departs in its middle", 0.0)
_WIDTH = Parameter("width_rad", "its standard width", 0.4, 0.1, 10.0)
_ACTS = ("joint_angle", "motor_angle")


def _patch(build: Build, p: Mapping[str, float]) -> None:
    build.cables["grooved"] = 1
    away = (_ANGLES - p["place_rad"]) / p["width_rad"]
    for k in range(len(build.cables)):
        if build.cables[k]["shaft_out"] == build.output:
            build.grooves[2 * k] = 1.0 + p["height"] * np.exp(-0.5 * away**2)


PATCH = form(
    "position_dependent_friction",
    "patch",
    "A dirty stretch of the output drum's groove: mu (1 + h e^(−(q − q_p)²/2w²)) where the cable departs at q.",
    (_HEIGHT, _PLACE, _WIDTH),
    _ACTS,
    _patch,
)


def _threaded(build: Build, p: Mapping[str, float]) -> None:
    build.cables["grooved"] = 1
    for k in range(len(build.cables)):
        if build.cables[k]["shaft_out"] == build.output:
            build.grooves[2 * k] = 1.0 + p["amplitude"] * np.cos(p["order"] * _ANGLES - p["phase_rad"])


THREADED = form(
    "position_dependent_friction",
    "threaded",
    "A groove that is rough again and again, as a tool's chatter leaves it: mu (1 + a cos(k q − φ)).",
    (
        Parameter("amplitude", "a", low=-0.95, high=0.95, neutral=0.0),
        Parameter("order", "k", 4.0, 0.0, 50.0),
        Parameter("phase_rad", "φ", 0.0),
    ),
    _ACTS,
    _threaded,
)


def _input(build: Build, p: Mapping[str, float]) -> None:
    build.cables["grooved"] = 1
    for k in range(len(build.cables)):
        if build.cables[k]["shaft_in"] == 0:
            build.grooves[2 * k + 1] = 1.0 + p["amplitude"] * np.cos(_ANGLES - p["phase_rad"])


INPUT_DRUM = form(
    "position_dependent_friction",
    "input_drum",
    "The input drum's groove is rougher in places: mu (1 + a cos(q_in − φ)) where the cable departs at q_in.",
    (Parameter("amplitude", "a", low=-0.95, high=0.95, neutral=0.0), Parameter("phase_rad", "φ", 0.0)),
    ("motor_angle", "joint_angle"),
    _input,
)


def _burr(build: Build, p: Mapping[str, float]) -> None:
    _patch(build, p)
    build.cables["grain"] = p["grain"]


BURR = form(
    "position_dependent_friction",
    "burr",
    "A burred stretch of the groove: the patch counts (1 + g) times when the cable slides off the drum there, "
    "(1 − g) times when it slides on.",
    (_HEIGHT, _PLACE, _WIDTH, Parameter("grain", "g", 0.7, -0.95, 0.95)),
    (*_ACTS, "load_direction"),
    _burr,
)


def _polished(build: Build, p: Mapping[str, float]) -> None:
    build.cables["grooved"] = 1
    beyond = 0.5 * (1.0 + np.tanh((_ANGLES - p["place_rad"]) / p["width_rad"]))
    for k in range(len(build.cables)):
        if build.cables[k]["shaft_out"] == build.output:
            build.grooves[2 * k] = 1.0 + p["height"] * beyond


POLISHED = form(
    "position_dependent_friction",
    "polished",
    "A groove worn smooth as far as the joint used to go: mu (1 + h (1 + tanh((q − q_p)/w))/2).",
    (
        Parameter("height", "h, growth of mu beyond that place", low=-0.95, high=10.0, neutral=0.0),
        _PLACE,
        Parameter("width_rad", "w, within which it changes", 0.1, 0.05, 10.0),
    ),
    _ACTS,
    _polished,
)


def _fleet(build: Build, p: Mapping[str, float]) -> None:
    build.cables["grooved"] = 1
    away = np.abs(_ANGLES - p["place_rad"])
    for k in range(len(build.cables)):
        if build.cables[k]["shaft_out"] == build.output:
            build.grooves[2 * k] = 1.0 + p["growth_per_rad"] * away


FLEET_ANGLE = form(
    "position_dependent_friction",
    "fleet_angle",
    "A cable that wanders along the drum and rubs at the groove's flank by its fleet angle: mu (1 + g |q − q_a|), in "
    "line where the joint stands at q_a.",
    (
        Parameter("growth_per_rad", "g", low=0.0, high=10.0, neutral=0.0),
        Parameter("place_rad", "q_a", 0.0),
    ),
    _ACTS,
    _fleet,
)

KINDS: tuple[EffectKind, ...] = (PATCH, THREADED, INPUT_DRUM, BURR, POLISHED, FLEET_ANGLE)
