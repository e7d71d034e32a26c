"""The same cable tightened to another pretension: laws that are stated about T0 are stated about the new one.

A session tightens its cables anew; it does not get other ones. What a law says of a stiffness or of a coefficient at a
tension in newtons stays: EA(T) = EA_0 g(T/T0)/g(1) with T0' = f T0 is EA_0 g(f)/g(1) times g(f T/T0')/g(f).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from firmware_sim.plant import EffectSpec, StageConfig
from firmware_sim.plant.forms.nonlinear_cable import Stiffness, knee, power, s_shaped, saturating

Values = Mapping[str, float]


class About(NamedTuple):
    """A law about f T0: its parameters there, and times how much EA or mu is at f T0 what it is at T0."""

    parameters: dict[str, float]
    EA: float = 1.0
    mu: float = 1.0


def _stiffening(p: Values, f: float) -> About:
    gain = 1.0 + p["stiffening"] * (f - 1.0)
    return About({"stiffening": p["stiffening"] * f / gain}, EA=gain)


def _tabled(of: Callable[[Values], Stiffness], *tensions: str) -> Callable[[Values, float], About]:
    """Of a law that has a stiffness of its own, and these tensions among its parameters."""

    def about(p: Values, f: float) -> About:
        stiffness = of(p)
        there = {name: p[name] / f for name in tensions}
        return About({**p, **there}, EA=stiffness(f) / stiffness(1.0))

    return about


def _pressure(p: Values, f: float) -> About:
    return About(dict(p), mu=f ** -p["exponent"])


def _floor(p: Values, f: float) -> About:
    mu = p["floor"] + (1.0 - p["floor"]) * f ** -p["exponent"]
    return About({**p, "floor": p["floor"] / mu}, mu=mu)


def _worn_through(p: Values, f: float) -> About:
    # the width of its fall stays a share of the pretension
    return About({**p, "place": (1.0 + p["place"]) / f - 1.0})


def _exponential(p: Values, f: float) -> About:
    return About({"rate": p["rate"] * f}, mu=math.exp(-p["rate"] * (f - 1.0)))


def _pressed_flat(p: Values, f: float) -> About:
    return About({"rate": p["rate"] * f}, mu=(1.0 + p["rate"]) / (1.0 + p["rate"] * f))


def _ploughed(p: Values, f: float) -> About:
    a, u = p["adhesion"], p["place"]
    mu = 1.0 + a * (1.0 / f - 1.0) + a / u**2 * (f - 1.0)
    return About({"adhesion": a / (f * mu), "place": u / f}, mu=mu)


ABOUT_T0: Mapping[str, Callable[[Values, float], About]] = {
    "nonlinear_cable": _stiffening,
    "nonlinear_cable:saturating": _tabled(saturating, "reach"),
    # its 0.02 T0, which keeps it from zero, stays that share of the pretension: 1e-3 of T0 at most
    "nonlinear_cable:power_law": _tabled(power),
    "nonlinear_cable:knee": _tabled(knee, "place", "width"),
    "nonlinear_cable:s_shaped": _tabled(s_shaped, "place", "width"),
    "pressure_dependent_friction": _pressure,
    "pressure_dependent_friction:floor": _floor,
    "pressure_dependent_friction:exponential": _exponential,
    "pressure_dependent_friction:worn_through": _worn_through,
    "pressure_dependent_friction:pressed_flat": _pressed_flat,
    "pressure_dependent_friction:ploughed": _ploughed,
}
"""Laws that are stated about T0."""


def tightened(
    stage: StageConfig, specs: Sequence[EffectSpec], factor: float
) -> tuple[StageConfig, list[EffectSpec]]:
    """The stage at `factor` times its pretension, and these effects about that."""
    there = replace(stage, pretension_N=stage.pretension_N * factor)
    found = []
    for spec in specs:
        if spec.id not in ABOUT_T0:
            found.append(spec)
            continue
        about = ABOUT_T0[spec.id](spec.parameters, factor)
        there = replace(
            there,
            EA_N=there.EA_N * about.EA,
            mu_output=there.mu_output * about.mu,
            mu_input=there.mu_input * about.mu,
        )
        found.append(EffectSpec(spec.id, about.parameters))
    return there, found
