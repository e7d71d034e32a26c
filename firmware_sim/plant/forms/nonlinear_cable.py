"""A cable whose stiffness follows its tension, in other forms: saturating, a power law, a knee, an S."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.records import TENSILE_LOW, TENSILE_POINTS, TENSILE_STEP, Floats

_SUBSTEPS = 8


def tensile_table(stiffness: Callable[[float], float]) -> Floats:
    """T/T0 and its slope over strain · EA/T0, for EA(T)/EA(T0) = `stiffness`(T/T0)/`stiffness`(1).

    dτ/dx = g(τ) from τ(1) = 1 both ways, by classical Runge–Kutta; slack where τ comes to 0.
    """
    whole = stiffness(1.0)

    def slope(tau: float) -> float:
        return stiffness(max(tau, 0.0)) / whole if tau > 0.0 else 0.0

    def step(tau: float, h: float) -> float:
        a = slope(tau)
        b = slope(tau + 0.5 * h * a)
        c = slope(tau + 0.5 * h * b)
        return tau + h / 6.0 * (a + 2.0 * b + 2.0 * c + slope(tau + h * c))

    table = np.zeros((2, TENSILE_POINTS))
    start = round((1.0 - TENSILE_LOW) / TENSILE_STEP)
    for way in (1, -1):
        tau, k = 1.0, start
        while 0 <= k < TENSILE_POINTS:
            table[:, k] = max(tau, 0.0), slope(tau)
            for _ in range(_SUBSTEPS):
                tau = step(tau, way * TENSILE_STEP / _SUBSTEPS)
            k += way
    return table


Stiffness = Callable[[float], float]
"""EA by T/T0, in proportion."""


def _tabled(of: Callable[[Mapping[str, float]], Stiffness]) -> Callable[[Build, Mapping[str, float]], None]:
    def apply(build: Build, p: Mapping[str, float]) -> None:
        build.cables["tabled"] = 1
        build.tensile[:] = tensile_table(of(p))

    return apply


def saturating(p: Mapping[str, float]) -> Stiffness:
    """The stiffness of strands that bed in."""
    return lambda tau: 1.0 - p["softness"] * math.exp(-tau / p["reach"])


SATURATING = form(
    "nonlinear_cable",
    "saturating",
    "Strands bed in, and then are as stiff as they get: EA(T) in proportion to 1 − b e^(−T/(u T0)).",
    (
        Parameter("softness", "b", low=0.0, high=0.95, neutral=0.0),
        Parameter("reach", "u", 0.7, 0.05, 10.0),
    ),
    ("load",),
    _tabled(saturating),
)


def power(p: Mapping[str, float]) -> Stiffness:
    """The stiffness of wires that touch."""
    return lambda tau: (tau + 0.02) ** p["exponent"]


POWER_LAW = form(
    "nonlinear_cable",
    "power_law",
    "Wires that touch as Hertz has it: EA(T) in proportion to (T/T0 + 0.02)^n.",
    (Parameter("exponent", "n", low=-0.5, high=0.8, neutral=0.0),),
    ("load",),
    _tabled(power),
)


def knee(p: Mapping[str, float]) -> Stiffness:
    """The stiffness of a core that carries from some tension on."""
    return lambda tau: 1.0 + p["rise"] * 0.5 * (1.0 + math.tanh((tau - p["place"]) / p["width"]))


KNEE = form(
    "nonlinear_cable",
    "knee",
    "A core that carries only from some tension on: EA(T) rises by the share b around T = u T0.",
    (
        Parameter("rise", "b", low=-0.7, high=4.0, neutral=0.0),
        Parameter("place", "u", 1.2, 0.1, 5.0),
        Parameter("width", "over T0", 0.1, 0.03, 2.0),
    ),
    ("load",),
    _tabled(knee),
)


def s_shaped(p: Mapping[str, float]) -> Stiffness:
    """The stiffness of drawn fibres, which give way at some tension and draw tight beyond."""
    return lambda tau: 1.0 - p["dip"] * math.exp(-(((tau - p["place"]) / p["width"]) ** 2))


S_SHAPED = form(
    "nonlinear_cable",
    "s_shaped",
    "A fibre line (polyester, nylon) whose force bends over its stretch as an S: EA(T) in proportion to "
    "1 − b e^(−((T/T0 − u)/w)²).",
    (
        Parameter("dip", "b", low=0.0, high=0.9, neutral=0.0),
        Parameter("place", "u", 1.1, 0.1, 5.0),
        Parameter("width", "w", 0.3, 0.05, 3.0),
    ),
    ("load",),
    _tabled(s_shaped),
)

KINDS: tuple[EffectKind, ...] = (SATURATING, POWER_LAW, KNEE, S_SHAPED)
