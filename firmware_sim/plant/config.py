"""Joint configuration as the plant reads it: TOML to plain frozen dataclasses."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from firmware_sim.plant.errors import PlantError

_STAGE_KEYS = (
    "output_radius_m",
    "input_radius_m",
    "free_length_m",
    "EA_N",
    "pretension_N",
    "mu_output",
    "mu_input",
    "wrap_output_rad",
    "wrap_input_rad",
)


@dataclass(frozen=True)
class EffectSpec:
    """One effect switched on: its id and its parameters, each with the unit in its name."""

    id: str
    parameters: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class StageConfig:
    """One cable stage; effective radii, lengths and forces in SI, wraps at position zero."""

    output_radius_m: float
    input_radius_m: float
    free_length_m: float
    EA_N: float
    pretension_N: float
    mu_output: float
    mu_input: float
    wrap_output_rad: float
    wrap_input_rad: float

    def __post_init__(self) -> None:
        for key in _STAGE_KEYS:
            value = getattr(self, key)
            if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0):
                raise PlantError(f"drive.stage: `{key}` is {value!r}; a positive finite number is accepted")


@dataclass(frozen=True)
class PlantConfig:
    """The drive that the plant builds: stages input side first, sensors as stated, effects as stated."""

    name: str
    circuit: str
    stages: tuple[StageConfig, ...]
    arrangement: str = "series"
    sensors: Mapping[str, float] = field(default_factory=dict)
    effects: tuple[EffectSpec, ...] = ()

    def __post_init__(self) -> None:
        if self.circuit not in ("open", "closed"):
            raise PlantError(f'drive.circuit is {self.circuit!r}; "open" or "closed" is accepted')
        if self.arrangement not in ("parallel", "series"):
            raise PlantError(f'drive.arrangement is {self.arrangement!r}; "parallel" or "series" is accepted')
        if not self.stages:
            raise PlantError("drive.stage is empty; at least one stage is needed")

    @property
    def ratio(self) -> float:
        """Joint angle per motor angle of the rigid drive, product of r/R over the stages."""
        return math.prod(s.input_radius_m / s.output_radius_m for s in self.stages)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], where: str = "configuration") -> PlantConfig:
        """Build from a parsed TOML table; keys that concern only the observer are left aside.

        Raises PlantError with one line that names the key.
        """
        drive = _table(data, "drive", where)
        stages = drive.get("stage")
        if not isinstance(stages, (list, tuple)) or not stages:
            raise PlantError(f"{where}: missing [[drive.stage]]; give at least one stage")
        try:
            return cls(
                name=str(data.get("name", "joint")),
                circuit=drive.get("circuit", "closed"),
                stages=tuple(_stage(s) for s in stages),
                arrangement=drive.get("arrangement", "series"),
                sensors=dict(data.get("sensors", {})),
                effects=tuple(_effect(e) for e in data.get("effect", ())),
            )
        except PlantError as error:
            raise PlantError(f"{where}: {error}") from None

    @classmethod
    def from_toml(cls, path: str | Path) -> PlantConfig:
        """Read a joint configuration file; raises PlantError with one line that names file and key."""
        try:
            data = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        except OSError as error:
            raise PlantError(
                f"{path}: cannot be read ({error.strerror}); give the path of a TOML file"
            ) from None
        except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise PlantError(f"{path}: is not valid TOML: {error}") from None
        return cls.from_dict(data, str(path))


def _table(data: Mapping[str, Any], key: str, where: str) -> Mapping[str, Any]:
    value = data.get(key)
    if not isinstance(value, Mapping):
        raise PlantError(f"{where}: missing table [{key}]; add it")
    return value


def _stage(table: Any) -> StageConfig:
    if not isinstance(table, Mapping):
        raise PlantError("drive.stage: an array of tables is accepted")
    missing = [key for key in _STAGE_KEYS if key not in table]
    if missing:
        raise PlantError(f"drive.stage: missing key `{missing[0]}`; add it")
    return StageConfig(**{key: table[key] for key in _STAGE_KEYS})


def _effect(table: Any) -> EffectSpec:
    if not isinstance(table, Mapping) or "id" not in table:
        raise PlantError("effect: a table with a key `id` is accepted")
    # `channel` names a column of a recording; the plant has one further channel and needs no name for it
    parameters = {key: value for key, value in table.items() if key not in ("id", "channel")}
    return EffectSpec(str(table["id"]), parameters)
