"""A coefficient that falls with pressure, in other forms: with a floor, exponential, worn through, pressed flat, and
one that rises again."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.effects.base import EffectKind, Parameter, form


def _law(kind: int, exponent: str, floor: str | None) -> Callable[[Build, Mapping[str, float]], None]:
    def apply(build: Build, p: Mapping[str, float]) -> None:
        build.cables["pressure_kind"], build.cables["pressure_exponent"] = kind, p[exponent]
        build.cables["pressure_floor"] = 0.0 if floor is None else p[floor]

    return apply


FLOOR = form(
    "pressure_dependent_friction",
    "floor",
    "Adhesion beside friction: mu = mu0 (f + (1 − f) (T/T0)^−n), which does not fall below f mu0.",
    (
        Parameter("exponent", "n", 1.0, 0.2, 4.0),
        Parameter("floor", "f", low=0.1, high=1.0, neutral=1.0),
    ),
    ("load",),
    _law(1, "exponent", "floor"),
)

EXPONENTIAL = form(
    "pressure_dependent_friction",
    "exponential",
    "A coat that softens: mu = mu0 e^(−k (T/T0 − 1)).",
    (Parameter("rate", "k", low=-0.6, high=1.7, neutral=0.0),),
    ("load",),
    _law(2, "rate", None),
)

WORN_THROUGH = form(
    "pressure_dependent_friction",
    "worn_through",
    "A coat that is pressed through around T = (1 + u) T0: mu falls from mu0 to f mu0 there.",
    (
        Parameter("place", "u", 0.2, -0.9, 3.0),
        Parameter("floor", "f", low=0.1, high=3.0, neutral=1.0),
    ),
    ("load",),
    _law(3, "place", "floor"),
)

PRESSED_FLAT = form(
    "pressure_dependent_friction",
    "pressed_flat",
    "A rough coat that is pressed flat, so that its area of contact saturates: mu = mu0 (1 + k)/(1 + k T/T0).",
    (Parameter("rate", "k", low=0.0, high=20.0, neutral=0.0),),
    ("load",),
    _law(4, "rate", None),
)


def _ploughed(build: Build, p: Mapping[str, float]) -> None:
    build.cables["pressure_kind"], build.cables["pressure_exponent"] = 5, p["adhesion"]
    build.cables["pressure_floor"] = p["adhesion"] / p["place"] ** 2


PLOUGHED = form(
    "pressure_dependent_friction",
    "ploughed",
    "Wires that adhere, and plough the drum the deeper they are pressed (Bowden and Tabor's two terms): "
    "mu = mu0 (1 + a (T0/T − 1) + a/u² (T/T0 − 1)), least at T = u T0.",
    (
        Parameter("adhesion", "a", low=0.0, high=5.0, neutral=0.0),
        Parameter("place", "u", 1.0, 0.7, 1.7),
    ),
    ("load",),
    _ploughed,
)

KINDS: tuple[EffectKind, ...] = (FLOOR, EXPONENTIAL, WORN_THROUGH, PRESSED_FLAT, PLOUGHED)
