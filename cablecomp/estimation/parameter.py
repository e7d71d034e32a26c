"""Free parameters of a fit: how each enters the drive, where it may lie, and where it likely does.

Names are those of the configuration (`cablecomp.config.with_values`): a key of `[[drive.stage]]`, of `[sensors]`, or
`effect.ID.KEY`. `NAME@SESSION` is that session's own value; `NAME~CONDITION` is what NAME gains per unit of a
condition.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import exp, inf, log
from types import MappingProxyType

from cablecomp.config import JointConfig
from cablecomp.effects import Effect, catalogue
from cablecomp.effects import Parameter as EffectParameter
from cablecomp.estimation.limits import DECADES, EXACT, INSTANT_REACH_S, INSTANT_STEP_S, OWN_SD, STEP

DECADE = log(10.0)
"""Prior sd, in the logarithm, of what is known by order of magnitude."""

NAMES = 1024
"""Names whose parts are at hand: every run of a drive asks for those of all that is free."""


@lru_cache(NAMES)
def parts_of(name: str) -> tuple[str, str, str]:
    """A parameter's name without session or condition, then the one or the other, or "": `@` and `~` may stand in a
    session's own name, which is a folder's."""
    base, _, session = name.partition("@")
    if "~" not in base:
        return base, session, ""
    base, _, condition = name.partition("~")
    return base, "", condition


@dataclass(frozen=True)
class Parameter:
    """One free parameter, fitted as x: value = exp(x) if `log`, else `scale` x.

    `start`, `low`, `high` in the parameter's unit; `centre` and `sd`: its prior, sd in x (infinite = none).
    """

    name: str
    start: float
    low: float
    high: float
    log: bool
    scale: float = 1.0
    centre: float = 0.0
    sd: float = inf

    def x(self, value: float) -> float:
        """The coordinate of a value, inside the bounds."""
        value = min(max(value, self.low), self.high)
        return log(value) if self.log else value / self.scale

    def value(self, x: float) -> float:
        """The value at a coordinate."""
        return exp(x) if self.log else self.scale * x

    def slope(self, x: float) -> float:
        """d value / d x."""
        return exp(x) if self.log else self.scale

    @property
    def centre_x(self) -> float:
        """Coordinate of the prior's centre."""
        return log(self.centre) if self.log else self.centre / self.scale

    @property
    def base(self) -> str:
        """The name without session or condition."""
        return parts_of(self.name)[0]

    @property
    def session(self) -> str | None:
        """The session whose own value this is, or None."""
        return parts_of(self.name)[1] or None

    @property
    def vague(self) -> bool:
        """Whether it is known by order of magnitude only."""
        return DECADE <= self.sd < inf

    @property
    def of_effect(self) -> bool:
        """Whether it is an effect's, and not the drive's own."""
        return self.name.startswith("effect.")

    @property
    def condition(self) -> str | None:
        """The condition that this is a gain by, or None."""
        return parts_of(self.name)[2] or None


def vague_drive(parameters: Sequence[Parameter]) -> bool:
    """Whether the drive is known by order of magnitude only: how much it yields, that is; coefficients of friction that
    no recording has told leave that known."""
    return any(p.vague and not p.of_effect and not p.base.startswith("mu_") for p in parameters)


def of_drive(
    config: JointConfig, further: Mapping[str, float] = MappingProxyType({})
) -> tuple[Parameter, ...]:
    """What `[tolerance]` frees of the drive, its sensors and its effects: log-normal priors, 1 and more = known to a
    decade; normal ones, in the parameter's unit, of zeros and of what an effect may have of either sign.

    `further`: tolerances of what has none there."""
    found = []
    tolerances = {**further, **config.tolerance}
    if not any(name.startswith(("input_radius_m", "output_radius_m")) for name in tolerances):
        tolerances["input_radius_m"] = EXACT
    for name, tolerance in tolerances.items():
        if tolerance <= 0.0:
            continue
        if name.startswith("effect."):
            found += _of_known_effect(name, tolerance, config)
            continue
        key, _, which = name.partition(".")
        stage = config.drive.stage[int(which) - 1 if which else 0]
        nominal = getattr(stage, key, None)
        if nominal is None:
            nominal = getattr(config.sensors, key, None)
        if nominal is None or key.endswith("_offset_rad") or key == "motor_torque_offset_Nm":
            continue  # zeros are found inside of the fit
        nominal = float(nominal)
        if key.endswith("_offset_Nm"):
            found.append(_about(name, nominal, tolerance))
        else:
            found.append(_by_factor(name, nominal, tolerance))
    return tuple(found)


def _by_factor(name: str, nominal: float, tolerance: float) -> Parameter:
    """A value above zero, known to a share of itself; to a decade from 1 on."""
    sd = DECADE if tolerance >= 1.0 else tolerance
    reach = exp(DECADES * DECADE if tolerance >= 1.0 else 6.0 * tolerance)
    return Parameter(name, nominal, nominal / reach, nominal * reach, True, 1.0, nominal, sd)


def _about(name: str, nominal: float, tolerance: float) -> Parameter:
    """A value of either sign, known in its own unit."""
    width = 8.0 * tolerance
    return Parameter(name, nominal, nominal - width, nominal + width, False, tolerance, nominal, 1.0)


def known_by_factor(law: EffectParameter, value: float) -> bool:
    """Whether a tolerance of an effect's value is a share of it: else it is in the value's own unit."""
    return value > 0.0 and law.minimum >= 0.0


def _of_known_effect(name: str, tolerance: float, config: JointConfig) -> list[Parameter]:
    """A parameter of an effect that the joint is known to have, inside what its law can take; none of one that it has
    not."""
    _, identifier, key = name.split(".")
    entry = next((e for e in config.effect if e.id == identifier), None)
    value = None if entry is None else entry.parameters.get(key)
    if not isinstance(value, int | float):
        return []
    law = catalogue()[identifier].parameter(key)
    p = (_by_factor if known_by_factor(law, value) else _about)(name, value, tolerance)
    return [replace(p, low=max(p.low, law.minimum), high=min(p.high, law.maximum))]


def of_effect(effect: Effect, values: Mapping[str, float], config: JointConfig) -> tuple[Parameter, ...]:
    """An effect's parameters from these starting values, bounds those of its law and of its prior range."""
    found = []
    for p in effect.parameters:
        if p.name not in values:
            continue
        found.append(_of_effect(f"effect.{effect.id}.{p.name}", p, values[p.name], config))
    return tuple(found)


def reach_of(amount: EffectParameter, config: JointConfig) -> tuple[float, float]:
    """Between what an effect's amount is looked for, in its unit: beyond what is plausible of it, inside of what its
    law can take."""
    low, high = amount.bounds(config)
    one_sided = amount.log or low >= 0.0
    # a share needs no room for a scale that is known roughly
    most = high * (1.0 if amount.unit == "-" else 10.0)
    return max(0.0 if one_sided else low * 3.0, amount.minimum), min(most, amount.maximum)


def _of_effect(name: str, p: EffectParameter, value: float, config: JointConfig) -> Parameter:
    low, high = p.bounds(config)
    span = max(abs(low), abs(high))
    if p.role == "phase":
        return Parameter(name, value, -20.0, 20.0, False)
    if p.role in ("instant", "cycle start"):
        return Parameter(
            name, value, value - INSTANT_REACH_S, value + INSTANT_REACH_S, False, INSTANT_STEP_S / STEP
        )
    if p.role == "duration":
        return Parameter(name, value, 0.0, max(p.maximum, 3.0 * value), False, INSTANT_STEP_S / STEP)
    if p.shape and p.log:
        return Parameter(name, value, max(low / p.reach, p.minimum, 1e-12), min(high * p.reach, p.maximum), True, 1.0,
                         (low * high) ** 0.5, 1.5 * DECADE)  # fmt: skip
    if p.shape:
        return Parameter(name, value, max(low, p.minimum), min(high, p.maximum), False, max(span, 1e-12))
    least, most = reach_of(p, config)
    scale = abs(value) if value else 0.05 * span
    return Parameter(name, value, least, most, False, max(scale, 1e-300))


def own_of(p: Parameter, sessions: Sequence[str]) -> tuple[Parameter, ...]:
    """One parameter for each session in place of a common one."""
    return tuple(
        Parameter(f"{p.base}@{s}", p.start, p.low, p.high, p.log, p.scale, p.centre, p.sd) for s in sessions
    )


def by_condition(p: Parameter, condition: str, width: float) -> Parameter:
    """What a parameter gains per unit of a condition whose values lie `width` apart."""
    size = max(abs(p.start), p.scale if not p.log else p.start) / max(width, 1e-12)
    return Parameter(f"{p.base}~{condition}", 0.0, -50.0 * size, 50.0 * size, False, size, 0.0, OWN_SD * 10.0)
