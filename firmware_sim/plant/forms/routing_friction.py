"""Routing friction in other forms: several guides, a path unlike for the two cables, a greased sheath, one whose bend
changes, a wiper."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import MU_GUIDE, OTHER
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.records import Floats

_ANGLE = Parameter("mu_angle", "mu Θ of all guides together", low=0.0, high=8.0, neutral=0.0)
_ARC = Parameter("arc_length_m", "cable lying on guides, in addition to the free length", 1e-3, 1e-6, 10.0)
_FIRST = Parameter("first", "share of the free length before the first guide", 0.5, 0.05, 0.95)
_ACTS = ("motor_angle", "reversal", "velocity")


def _guides(build: Build, p: Mapping[str, float], count: int = 1) -> None:
    build.cables["guide_arc_m"], build.cables["guide_count"] = p["arc_length_m"], count
    build.cables["guide_mu_per_m"] = p["mu_angle"] / p["arc_length_m"]
    build.cables["guide_first"] = p["first"]


def _several(build: Build, p: Mapping[str, float]) -> None:
    _guides(build, p, round(p["count"]))


SEVERAL_GUIDES = form(
    "routing_friction",
    "several_guides",
    "Several guides of equal bend with free spans between: each sticks and slides for itself.",
    (_ANGLE, _ARC, Parameter("count", "number of guides", 3.0, 2.0, 5.0), _FIRST),
    _ACTS,
    _several,
)


def _unlike(build: Build, p: Mapping[str, float]) -> None:
    _guides(build, p)
    build.cables["guide_mu_per_m"] *= 1.0 + p["skew"] * build.cables["sign"]


UNLIKE_PATHS = form(
    "routing_friction",
    "unlike_paths",
    "The two cables run over different guides: mu Θ (1 + s) for cable h, (1 − s) for l, anywhere in the free span.",
    (_ANGLE, _ARC, Parameter("skew", "s", 0.5, -1.0, 1.0), _FIRST),
    _ACTS,
    _unlike,
)


def _greased(build: Build, p: Mapping[str, float]) -> None:
    _guides(build, p)
    build.cables["viscous_guide"] = p["viscous_Ns_per_m"] / p["arc_length_m"]


GREASED = form(
    "routing_friction",
    "greased",
    "A greased sheath: Coulomb friction over the bend, and c v besides, v the speed of the cable in it.",
    (_ANGLE, _ARC, Parameter("viscous_Ns_per_m", "c", 0.0, 0.0, neutral=0.0), _FIRST),
    _ACTS,
    _greased,
)


def _bending(build: Build, p: Mapping[str, float]) -> None:
    _guides(build, p)
    per_unit = p["mu_angle_per_unit"] / max(p["mu_angle"], 1e-9)

    def fill(inputs: Floats) -> None:
        inputs[:, MU_GUIDE] = per_unit * inputs[:, OTHER]

    build.schedules.append(fill)


BENDING = form(
    "routing_friction",
    "bending",
    "The sheath's bend changes, and its friction with it: mu Θ = mu_angle + mu_angle_per_unit · other_1.",
    (_ANGLE, _ARC, Parameter("mu_angle_per_unit", "growth with the channel other_1", 0.0, 0.0, 8.0), _FIRST),
    (*_ACTS, "other:1"),
    _bending,
)


def _wiped(build: Build, p: Mapping[str, float]) -> None:
    _guides(build, {**p, "mu_angle": max(p["mu_angle"], 1e-9)})
    build.cables["guide_hold_N"] = p["hold_N"]


WIPER = form(
    "routing_friction",
    "wiper",
    "A wiper or seal that presses by itself, as a cable too stiff for its sheath does: it holds W at any tension, and "
    "mu T per radian of the bend besides.",
    (
        Parameter("hold_N", "W", low=0.0, neutral=0.0),
        Parameter("mu_angle", "mu Θ of the bend besides", 0.0, 0.0, 8.0, neutral=0.0),
        _ARC,
        _FIRST,
    ),
    _ACTS,
    _wiped,
)

KINDS: tuple[EffectKind, ...] = (SEVERAL_GUIDES, UNLIKE_PATHS, GREASED, BENDING, WIPER)
