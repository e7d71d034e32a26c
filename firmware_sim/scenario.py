"""A scenario: motor, link, loads, effects and faults of a simulated joint, apart from its own configuration.

```toml
[motor]                       # any of MotorSpec's fields; what is left out suits the joint
torque_max_Nm = 2.0
[link]                        # any of LinkSpec's fields
gravity_Nm = 0.3
[[load]]                      # see firmware_sim/loads.py
shape = "sine"
amplitude = 0.4
period_s = 3.0
[[effect]]                    # physics beyond the plain drive, as in a joint's configuration
id = "viscous_slip"
coefficient_Ns_per_m_rad = 120.0
[[fault]]
spec = "drop:p=0.01,start=5"
```
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from firmware_sim.errors import SimError
from firmware_sim.loads import Load, load_from
from firmware_sim.plant import EffectSpec, LinkSpec, MotorSpec, Plant, PlantConfig, PlantReadings

TABLES = ("motor", "link", "load", "effect", "fault")
Spec = TypeVar("Spec", MotorSpec, LinkSpec)


@dataclass(frozen=True)
class Scenario:
    """What a scenario file says; empty = the joint alone."""

    where: str = "scenario"
    motor: Mapping[str, Any] = field(default_factory=dict)
    link: Mapping[str, Any] = field(default_factory=dict)
    loads: tuple[Load, ...] = ()
    effects: tuple[EffectSpec, ...] = ()
    faults: tuple[str, ...] = ()


def load_scenario(path: Path) -> Scenario:
    """Read a scenario; raises SimError that names file and key."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SimError(f"{path}: cannot be read ({error.strerror}); give the path of a scenario") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SimError(f"{path}: is not valid TOML: {error}") from None
    for key in data:
        if key not in TABLES:
            raise SimError(f"{path}: unknown table `{key}`; one of {', '.join(TABLES)} is accepted")
    try:
        return Scenario(
            str(path),
            data.get("motor", {}),
            data.get("link", {}),
            tuple(load_from(table, str(path)) for table in data.get("load", ())),
            tuple(
                EffectSpec(t["id"], {k: v for k, v in t.items() if k != "id"}) for t in data.get("effect", ())
            ),
            tuple(table["spec"] for table in data.get("fault", ())),
        )
    except (KeyError, TypeError, AttributeError):
        raise SimError(f"{path}: [[effect]] needs `id`, [[fault]] needs `spec`, [[load]] its keys") from None


def _changed(spec: Spec, changes: Mapping[str, Any], name: str, where: str) -> Spec:
    known = [f.name for f in fields(spec)]
    for key, value in changes.items():
        if key not in known:
            raise SimError(
                f"{where}: [{name}] has unknown key `{key}`; one of {', '.join(known)} is accepted"
            )
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise SimError(f"{where}: [{name}] key `{key}` is {value!r}; a number is accepted")
    return replace(spec, **changes)


class LoadedPlant:
    """A plant with its loads; steps as the firmware wants it."""

    def __init__(self, plant: Plant, loads: Sequence[Load] = ()) -> None:
        self.plant = plant
        self._torque = [load for load in loads if load.target == "torque_Nm"]
        self._temperature = [load for load in loads if load.target == "temperature_degC"]
        self._other = [load for load in loads if load.target == "other"]

    def step(self, dt_s: float, motor_torque_command_Nm: float, /) -> PlantReadings:
        """One step; loads are taken at its end, temperatures add to 20 degC."""
        end = self.plant.time_s + dt_s
        return self.plant.step(
            dt_s,
            motor_torque_command_Nm,
            sum(load.value(end) for load in self._torque),
            20.0 + sum(load.value(end) for load in self._temperature),
            sum(load.value(end) for load in self._other),
        )


def plant_maker(config: Path, scenario: Scenario, seed: int = 0) -> Callable[[int], LoadedPlant]:
    """Builds the plant of joint 1, 2…; each has noise of its own."""
    loaded = PlantConfig.from_toml(config)
    motor = _changed(MotorSpec.for_joint(loaded), scenario.motor, "motor", scenario.where)
    link = _changed(LinkSpec.for_joint(loaded), scenario.link, "link", scenario.where)

    def make(number: int) -> LoadedPlant:
        plant = Plant(loaded, motor=motor, link=link, effects=scenario.effects, seed=seed + number)
        return LoadedPlant(plant, scenario.loads)

    return make
