"""Joint configuration: TOML to frozen objects; an unknown key fails."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from cablecomp.errors import InputError

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
M = TypeVar("M", bound=BaseModel)


class _Frozen(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Stage(_Frozen):
    """One cable stage; radii are effective (bare pulley radius + half the cable diameter)."""

    output_radius_m: Positive
    input_radius_m: Positive
    free_length_m: Positive
    EA_N: Positive
    pretension_N: Positive
    mu_output: Positive
    mu_input: Positive
    wrap_output_rad: Positive
    wrap_input_rad: Positive
    breaking_force_N: Positive | None = None


class Drive(_Frozen):
    """The cable drive, input side first."""

    circuit: Literal["open", "closed"]
    arrangement: Literal["parallel", "series"] = "series"
    stage: tuple[Stage, ...] = Field(min_length=1)


class Sensors(_Frozen):
    """1-sigma white noise and resolution of each channel; None = unknown, estimated from the recording."""

    joint_position_noise_rad: NonNegative | None = None
    joint_position_resolution_rad: NonNegative | None = None
    joint_position_offset_rad: Finite = 0.0
    motor_position_noise_rad: NonNegative | None = None
    motor_position_resolution_rad: NonNegative | None = None
    joint_torque_noise_Nm: NonNegative | None = None
    joint_torque_resolution_Nm: NonNegative | None = None
    joint_torque_gain: Positive = 1.0
    joint_torque_offset_Nm: Finite = 0.0
    motor_torque_noise_Nm: NonNegative | None = None
    motor_torque_resolution_Nm: NonNegative | None = None


class EffectEntry(_Frozen):
    """One `[[effect]]`: the id of an effect and its parameters (every further key)."""

    model_config = ConfigDict(extra="allow", frozen=True)

    id: str

    @property
    def parameters(self) -> dict[str, Any]:
        return dict(self.__pydantic_extra__ or {})


class ObserverOptions(_Frozen):
    """How the observer runs: input filter (causal, 0 = off), memory, load source.

    For guaranteed bounds: the least and the greatest T/T0 that any cable has borne since it was pretensioned
    (None = unknown).
    """

    input_filter_Hz: NonNegative = 0.0
    max_pieces: Annotated[int, Field(ge=16, le=4096)] = 192
    merge_tolerance: Positive = 1e-6
    load: Literal["joint_torque", "motor_torque", "both_encoders"] = "joint_torque"
    past_tension_min: Annotated[float, Field(gt=0, le=1)] | None = None
    past_tension_max: Annotated[float, Field(ge=1, allow_inf_nan=False)] | None = None


class Limits(_Frozen):
    """What joint and motor may be asked for; used by the gate, by `plan_erase`, by proposed experiments."""

    joint_torque_max_Nm: Positive | None = None
    motor_torque_max_Nm: Positive | None = None
    joint_position_min_rad: Finite | None = None
    joint_position_max_rad: Finite | None = None
    motor_velocity_max_rad_s: Positive | None = None
    motor_position_min_rad: Finite | None = None
    motor_position_max_rad: Finite | None = None


class JointConfig(_Frozen):
    """A cable-driven joint as its TOML file states it. SI units, each named in its key."""

    schema_: Literal[1] = Field(alias="schema")
    name: str = Field(min_length=1)
    drive: Drive
    tolerance: dict[str, NonNegative] = Field(default_factory=dict)
    sensors: Sensors = Sensors()
    effect: tuple[EffectEntry, ...] = ()
    observer: ObserverOptions = ObserverOptions()
    limits: Limits = Limits()

    @model_validator(mode="before")
    @classmethod
    def _lists_to_tuples(cls, data: Any) -> Any:
        # TOML arrays arrive as lists; the strict model wants tuples.
        if isinstance(data, dict):
            data = dict(data)
            if isinstance(data.get("effect"), list):
                data["effect"] = tuple(data["effect"])
            drive = data.get("drive")
            if isinstance(drive, dict) and isinstance(drive.get("stage"), list):
                data["drive"] = {**drive, "stage": tuple(drive["stage"])}
        return data


def load_joint(path: Path) -> JointConfig:
    """Read a joint configuration.

    Raises InputError with one line that names file, key, what was found, what is accepted.
    """
    return parse_joint(read_toml(path), str(path))


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file; raises InputError if it cannot be read or parsed."""
    try:
        text = path.read_bytes().decode("utf-8")
        return tomllib.loads(text)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give the path of a TOML file") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not text; a TOML file in UTF-8 is accepted") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {error}; mend it at that place") from None


def parse_joint(data: dict[str, Any], where: str) -> JointConfig:
    """Validate a configuration already read; `where` names it in errors."""
    return validated(JointConfig, data, where)


def validated(kind: type[M], data: Mapping[str, Any], where: str) -> M:
    """Data as a frozen model; raises InputError with one line that starts with `where`."""
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{where}: {explain(error)}") from None


def explain(error: ValidationError) -> str:
    """One line for the first thing wrong: key, what was found, what is accepted."""
    first = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in first["loc"]) or "(top level)"
    kind, found = first["type"], first["input"]
    if kind == "extra_forbidden":
        return f"unknown key `{key}`; remove it or check its spelling"
    if kind == "missing":
        return f"missing key `{key}`; add it"
    shown = repr(found) if len(repr(found)) < 60 else repr(found)[:57] + "..."
    return f"key `{key}` is {shown}; {first['msg'][0].lower() + first['msg'][1:]}"
