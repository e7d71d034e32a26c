"""Parameters that a calibration may move: their names, how they enter a configuration, their priors and
bounds.

Names: a key of `[[drive.stage]]` moves that value of every stage by one common factor (`EA_N`), `EA_N.2` that
of stage 2 alone; a key of `[sensors]` (`joint_position_offset_rad`); `effect.ID.PARAMETER` a parameter of the
effect ID. `joint_position_offset_rad[k]` is the offset of recording k alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, inf, log
from typing import Final

from cablecomp.config import JointConfig, with_values
from cablecomp.config.values import SENSOR_KEYS, STAGE_KEYS, effect_name
from cablecomp.errors import InputError

__all__ = ["OFFSET", "Parameter", "free_parameters", "with_values"]

OFFSET: Final = "joint_position_offset_rad"
_ORDER_OF_MAGNITUDE: Final = log(10.0)


@dataclass(frozen=True)
class Parameter:
    """One free parameter. It is fitted as x: value = `nominal exp(unit x)` if `logarithmic`, else `nominal +
    unit x`.

    `prior_sd`: 1-sigma of the prior in x (infinite = none); `low`, `high`: bounds in x.
    """

    name: str
    nominal: float
    unit: float
    logarithmic: bool
    prior_sd: float
    low: float
    high: float

    def value(self, x: float) -> float:
        """The parameter's value in its own unit."""
        return self.nominal * exp(self.unit * x) if self.logarithmic else self.nominal + self.unit * x

    def slope(self, x: float) -> float:
        """d value / d x."""
        return self.unit * self.value(x) if self.logarithmic else self.unit


def free_parameters(
    config: JointConfig, names: Sequence[str] | None, bounds: Mapping[str, tuple[float, float]] | None = None
) -> tuple[Parameter, ...]:
    """The parameters to fit: `names`, or those that [tolerance] holds and the joint encoder's offset.

    Prior of a positive quantity with tolerance s < 1: normal in its logarithm with sd s, bounds at 5 sd; with
    s >= 1 (known by order of magnitude only): sd ln 10. Without an entry in [tolerance]: no prior, a factor
    of 10 either way. Additive ones: prior only if [tolerance] gives one, in the parameter's own unit.
    `bounds`: own limits by name, in the parameter's unit. Raises InputError for a name that is none.
    """
    if names is None:
        names = (*(k for k, s in config.tolerance.items() if s > 0.0), OFFSET)
    found = tuple(_parameter(config, name) for name in dict.fromkeys(names))
    return tuple(_bounded(p, (bounds or {}).get(p.name)) for p in found)


def _parameter(config: JointConfig, name: str) -> Parameter:
    key, _, which = name.partition(".")
    if name.startswith("effect."):
        return _effect_parameter(config, name)
    if key in STAGE_KEYS:
        nominal = getattr(config.drive.stage[_stage_of(config, name, which)], key)
        if nominal is None:
            raise InputError(f"calibration: `{name}` is not stated in {config.name}; add it or leave it out")
        return _positive(name, float(nominal), config.tolerance.get(name, config.tolerance.get(key)))
    if name == "joint_torque_gain":
        return _positive(name, config.sensors.joint_torque_gain, config.tolerance.get(name))
    if name.partition("[")[0] in SENSOR_KEYS and name.partition("[")[0].endswith(("offset_rad", "offset_Nm")):
        nominal = float(getattr(config.sensors, name.partition("[")[0]))
        return _additive(name, nominal, config.tolerance.get(name), 1e-3)
    raise InputError(
        f"calibration: `{name}` is no parameter; accepted are keys of [[drive.stage]] "
        f"({', '.join(STAGE_KEYS)}), .N for one stage, sensor offsets, joint_torque_gain, "
        "effect.ID.PARAMETER"
    )


def _stage_of(config: JointConfig, name: str, which: str) -> int:
    count = len(config.drive.stage)
    if not which:
        return 0
    if not which.isdigit() or not 1 <= int(which) <= count:
        raise InputError(f"calibration: `{name}`: stage {which!r}; 1 to {count} are accepted")
    return int(which) - 1


def _effect_parameter(config: JointConfig, name: str) -> Parameter:
    identifier, key = effect_name(name)
    entry = next((e for e in config.effect if e.id == identifier), None)
    if entry is None or key not in entry.parameters:
        raise InputError(f"calibration: `{name}` is not in {config.name}; add the effect with that key first")
    nominal = float(entry.parameters[key])
    return _additive(name, nominal, config.tolerance.get(name), abs(nominal) if nominal else 1.0)


def _positive(name: str, nominal: float, tolerance: float | None) -> Parameter:
    if tolerance is None or tolerance == 0.0:
        return Parameter(name, nominal, 0.1, True, inf, -log(10.0) / 0.1, log(10.0) / 0.1)
    if tolerance >= 1.0:
        return Parameter(name, nominal, _ORDER_OF_MAGNITUDE, True, 1.0, -3.0, 3.0)
    return Parameter(name, nominal, tolerance, True, 1.0, -5.0, 5.0)


def _additive(name: str, nominal: float, tolerance: float | None, unit: float) -> Parameter:
    if tolerance:
        return Parameter(name, nominal, tolerance, False, 1.0, -5.0, 5.0)
    return Parameter(name, nominal, unit, False, inf, -1e4, 1e4)


def _bounded(p: Parameter, own: tuple[float, float] | None) -> Parameter:
    if own is None:
        return p
    if p.logarithmic:
        low, high = (log(v / p.nominal) / p.unit for v in own)
    else:
        low, high = ((v - p.nominal) / p.unit for v in own)
    return Parameter(p.name, p.nominal, p.unit, p.logarithmic, p.prior_sd, low, high)
