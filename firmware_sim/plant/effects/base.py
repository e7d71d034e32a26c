"""What an effect of the plant consists of."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.errors import PlantError


@dataclass(frozen=True)
class Parameter:
    """One parameter: its name ends in its unit where it has one; `default` None means that it must be
    given. Where a `neutral` value is stated, it switches the law off."""

    name: str
    meaning: str
    default: float | None = None
    low: float = -math.inf
    high: float = math.inf
    neutral: float | None = None


@dataclass(frozen=True)
class EffectKind:
    """One piece of physics beyond the plain drive, and how it is put into the plant.

    `listed` says whether it belongs to the catalogue of known effects; `covariates` are the quantities
    through which it acts, the strongest first, in the names that a diagnosis uses. `nearest` are the ids of known
    effects that it resembles most: of a form that is the effect whose form it is.
    """

    id: str
    statement: str
    parameters: tuple[Parameter, ...]
    covariates: tuple[str, ...]
    apply: Callable[[Build, Mapping[str, float]], None]
    listed: bool = True
    nearest: tuple[str, ...] = ()

    @property
    def effect(self) -> str:
        """The effect without the form."""
        return self.id.partition(":")[0]

    @property
    def form(self) -> str:
        """The name of the form; empty for the law that the id alone stands for."""
        return self.id.partition(":")[2]

    def values(self, given: Mapping[str, float]) -> dict[str, float]:
        """All parameters, defaults filled in; raises PlantError for an unknown, missing or impossible one."""
        known = {p.name: p for p in self.parameters}
        for name in given:
            if name not in known:
                raise PlantError(
                    f"effect {self.id}: unknown parameter `{name}`; accepted are {', '.join(known)}"
                )
        result: dict[str, float] = {}
        for name, parameter in known.items():
            value = given.get(name, parameter.default)
            if value is None:
                raise PlantError(f"effect {self.id}: missing parameter `{name}` ({parameter.meaning})")
            number = float(value) if isinstance(value, (int, float)) else math.nan
            if not (math.isfinite(number) and parameter.low <= number <= parameter.high):
                raise PlantError(
                    f"effect {self.id}: `{name}` is {value!r}; "
                    f"a number from {parameter.low:g} to {parameter.high:g} is accepted"
                )
            result[name] = number
        return result


def form(
    effect: str,
    name: str,
    statement: str,
    parameters: tuple[Parameter, ...],
    covariates: tuple[str, ...],
    apply: Callable[[Build, Mapping[str, float]], None],
) -> EffectKind:
    """Another form of a known effect's law, which goes by `effect:name`."""
    return EffectKind(f"{effect}:{name}", statement, parameters, covariates, apply, False, (effect,))
