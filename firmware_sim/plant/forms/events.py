"""What happens to one of two cables, along any course: the forms that slips and breaks have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import JOINT_TORQUE, TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import ramp, schedule, settling, stairs, worked
from firmware_sim.plant.records import Floats

Values: TypeAlias = Mapping[str, float]

BEGINS = Parameter("time_s", "when it begins")
"""What all of them have."""
STEPS = (
    Parameter("duration_s", "from the first step to the last", 15.0, 0.0),
    Parameter("steps", "how many", 3.0, 2.0, 20.0),
)
"""What steps have beside their size and the instant of the first."""
UNEQUAL = (
    Parameter("growth", "of each step over the last", 1.0, 0.05, 20.0),
    Parameter("wait", "for each step over that for the last", 1.0, 0.05, 20.0),
)
"""What steps that are not equal have beside their number and time."""


def equal_stairs(time_s: Floats, p: Values) -> Floats:
    """`stairs` all alike, of an effect's parameters."""
    return stairs(time_s, p["time_s"], p["duration_s"], p["steps"])


def unequal_stairs(time_s: Floats, p: Values) -> Floats:
    """`stairs` of an effect's parameters."""
    return stairs(time_s, p["time_s"], p["duration_s"], p["steps"], p["growth"], p["wait"])


@dataclass(frozen=True)
class Event:
    """What happens to one of the two cables along a course: its size, which cable (1: l), the input column of cable h
    and of l, and what it shows in."""

    effect: str
    size: Parameter
    which: Parameter
    columns: tuple[int, int]
    acts: tuple[str, ...]

    def form(
        self,
        name: str,
        statement: str,
        parameters: tuple[Parameter, ...],
        course: Callable[[Floats, Values], Floats],
    ) -> EffectKind:
        """It along another course, told by these parameters."""

        def happen(build: Build, p: Values) -> None:
            column = self.columns[1 if p[self.which.name] >= 0.5 else 0]
            schedule(build, column, p[self.size.name], lambda t: course(t, p))

        return form(
            self.effect, name, statement, (self.size, BEGINS, *parameters, self.which), self.acts, happen
        )

    def of_cable_l(self, statement: str) -> EffectKind:
        """It at once, of cable l alone."""

        def happen(build: Build, p: Values) -> None:
            schedule(build, self.columns[1], p[self.size.name], lambda t: ramp(t, p["time_s"], 0.0))

        return form(self.effect, "other_cable", statement, (self.size, BEGINS), self.acts, happen)

    def in_steps(self, statement: str) -> EffectKind:
        """It in equal steps."""
        return self.form("in_steps", statement, STEPS, equal_stairs)

    def in_unequal_steps(self, statement: str) -> EffectKind:
        """It in steps of other sizes and waits."""
        return self.form("unequal_steps", statement, (*STEPS, *UNEQUAL), unequal_stairs)

    def for_a_while(self, name: str, statement: str, lasts: Parameter, power: float = 1.0) -> EffectKind:
        """It by a power of the share of its time that is over."""
        return self.form(
            name, statement, (lasts,), lambda t, p: ramp(t, p["time_s"], p["duration_s"]) ** power
        )

    def worked(self, name: str, statement: str) -> EffectKind:
        """It as the load works at it: nothing while that rests, by how far it goes up and down for a while."""
        lasts = Parameter("duration_s", "how long", 15.0, 0.0)
        return self.driven(
            name,
            statement,
            (lasts,),
            lambda u, p: worked(u[:, TIME], u[:, JOINT_TORQUE], p["time_s"], p["duration_s"]),
        )

    def driven(
        self,
        name: str,
        statement: str,
        parameters: tuple[Parameter, ...],
        course: Callable[[Floats, Values], Floats],
        acts: tuple[str, ...] = (),
    ) -> EffectKind:
        """It along a course that follows from all inputs; `acts`: what it shows in besides."""

        def happen(build: Build, p: Values) -> None:
            column = self.columns[1 if p[self.which.name] >= 0.5 else 0]

            def fill(inputs: Floats) -> None:
                inputs[:, column] += p[self.size.name] * course(inputs, p)

            build.schedules.append(fill)

        given = (self.size, BEGINS, *parameters, self.which)
        return form(self.effect, name, statement, given, (*self.acts, *acts), happen)

    def settling(self, statement: str) -> EffectKind:
        """It fast at first and ever more slowly."""
        lag = Parameter("lag_s", "until 63 % of it is gone", 5.0, 0.0)
        return self.form("settling", statement, (lag,), lambda t, p: settling(t, p["time_s"], p["lag_s"]))
