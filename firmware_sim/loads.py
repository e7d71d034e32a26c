"""What acts on a joint from outside, as a function of time: torque on the link, temperature, a neighbour's
torque."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from random import Random
from typing import Any

from firmware_sim.errors import SimError

TARGETS = ("torque_Nm", "temperature_degC", "other")


@dataclass(frozen=True)
class Load:
    """Adds to `target` between `start_s` and `stop_s`; `shape` says how.

    constant: `amplitude`; sine: `amplitude sin(2π t/period_s + phase_rad)`; ramp: from 0 to `amplitude`
    within `period_s`,
    held from there on; trapezoid: up, hold, down, hold, a quarter of `period_s` each; steps: a level drawn
    evenly from
    ±`amplitude` every `period_s`, reached within `rise_s`, the same for the same `seed`.
    """

    target: str = "torque_Nm"
    shape: str = "constant"
    amplitude: float = 0.0
    period_s: float = 1.0
    phase_rad: float = 0.0
    rise_s: float = 0.02
    start_s: float = 0.0
    stop_s: float = math.inf
    seed: int = 0

    def __post_init__(self) -> None:
        for key, value, accepted in (("target", self.target, TARGETS), ("shape", self.shape, tuple(SHAPES))):
            if value not in accepted:
                raise SimError(f"load: {key} {value!r}; one of {', '.join(accepted)} is accepted")
        if not (self.period_s > 0.0 and self.rise_s >= 0.0 and self.start_s < self.stop_s):
            raise SimError("load: period_s above 0, rise_s of 0 or more, start_s before stop_s are accepted")

    def value(self, time_s: float) -> float:
        """What it adds at this time."""
        if not self.start_s <= time_s < self.stop_s:
            return 0.0
        return self.amplitude * SHAPES[self.shape](self, time_s - self.start_s)

    def _level(self, number: int) -> float:
        return Random(f"{self.seed}:{number}").uniform(-1.0, 1.0) if number >= 0 else 0.0


def _constant(load: Load, t: float) -> float:
    return 1.0


def _sine(load: Load, t: float) -> float:
    return math.sin(2.0 * math.pi * t / load.period_s + load.phase_rad)


def _ramp(load: Load, t: float) -> float:
    return min(t / load.period_s, 1.0)


def _trapezoid(load: Load, t: float) -> float:
    quarter = 4.0 * (t / load.period_s % 1.0)
    return min(quarter, 1.0, max(3.0 - quarter, 0.0))


def _steps(load: Load, t: float) -> float:
    number = math.floor(t / load.period_s)
    before, after = load._level(number - 1), load._level(number)
    into = t - number * load.period_s
    share = 1.0 if load.rise_s == 0.0 else min(into / load.rise_s, 1.0)
    return before + share * (after - before)


SHAPES = {"constant": _constant, "sine": _sine, "ramp": _ramp, "trapezoid": _trapezoid, "steps": _steps}


def load_from(table: dict[str, Any], where: str) -> Load:
    """A load from a table of a scenario; raises SimError."""
    known = {f.name: f.type for f in fields(Load)}
    for key, value in table.items():
        if key not in known:
            raise SimError(
                f"{where}: [[load]] has unknown key `{key}`; one of {', '.join(known)} is accepted"
            )
        if (known[key] == "str") is not isinstance(value, str):
            raise SimError(f"{where}: [[load]] key `{key}` is {value!r}; a {known[key]} is accepted")
    return Load(**table)
