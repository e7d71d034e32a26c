"""Joint configuration as frozen objects; an unknown key fails."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from cablecomp.config.base import Finite, Frozen, Listed, NonNegative, Positive, Text
from cablecomp.config.sessions import ZEROS, Empirical, Session, as_tables, check_names


class Stage(Frozen):
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


class Drive(Frozen):
    """The cable drive, input side first."""

    circuit: Literal["open", "closed"]
    arrangement: Literal["parallel", "series"] = "series"
    stage: Annotated[tuple[Stage, ...], Listed] = Field(min_length=1)


class Sensors(Frozen):
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
    motor_torque_offset_Nm: Finite = 0.0
    tension_noise_N: NonNegative | None = None
    tension_resolution_N: NonNegative | None = None


class EffectEntry(Frozen):
    """One `[[effect]]`: the id of an effect and its parameters (every further key)."""

    model_config = ConfigDict(extra="allow", frozen=True)

    id: str

    @property
    def parameters(self) -> dict[str, Any]:
        return dict(self.__pydantic_extra__ or {})


class ObserverOptions(Frozen):
    """How the observer runs: input filter (causal, 0 = off), memory, load source.

    For guaranteed bounds: the least and the greatest T/T0 that any cable has borne since it was pretensioned
    (None = unknown).
    """

    input_filter_Hz: NonNegative = 0.0
    max_pieces: Annotated[int, Field(ge=16, le=4096)] = 192
    merge_tolerance: Positive = 1e-6
    load: Literal["joint_torque", "motor_torque", "both_encoders", "none"] = "joint_torque"
    past_tension_min: Annotated[float, Field(gt=0, le=1)] | None = None
    past_tension_max: Annotated[float, Field(ge=1, allow_inf_nan=False)] | None = None


class Limits(Frozen):
    """What joint and motor may be asked for; used by the gate, by `plan_erase`, by proposed experiments."""

    joint_torque_max_Nm: Positive | None = None
    motor_torque_max_Nm: Positive | None = None
    joint_position_min_rad: Finite | None = None
    joint_position_max_rad: Finite | None = None
    motor_velocity_max_rad_s: Positive | None = None
    motor_position_min_rad: Finite | None = None
    motor_position_max_rad: Finite | None = None


class JointConfig(Frozen):
    """A cable-driven joint as its TOML file states it. SI units, each named in its key."""

    schema_: Literal[1] = Field(alias="schema")
    name: Text
    drive: Drive
    tolerance: dict[str, NonNegative] = Field(default_factory=dict)
    sensors: Sensors = Sensors()
    effect: Annotated[tuple[EffectEntry, ...], Listed] = ()
    empirical: Annotated[tuple[Empirical, ...], Listed] = ()
    observer: ObserverOptions = ObserverOptions()
    limits: Limits = Limits()
    session: Annotated[tuple[Session, ...], BeforeValidator(as_tables)] = ()
    condition: dict[str, Text] = Field(default_factory=dict)

    @property
    def sessions(self) -> tuple[Session, ...]:
        """The sessions that have a name."""
        return tuple(s for s in self.session if s.name)

    @property
    def session_own(self) -> tuple[str, ...]:
        """Names of the parameters that may differ from session to session; the zeros unless `own` says
        otherwise. Those that a session gives a value for are among them.
        """
        stated = [name for s in self.session for name in s.own or ()]
        given = [name for s in self.session for name in s.values]
        silent = all(s.own is None for s in self.session)
        return tuple(dict.fromkeys([*(ZEROS if silent else stated), *given]))

    @model_validator(mode="after")
    def _sessions_told_apart(self) -> Self:
        names = [s.name for s in self.session]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"[[session]] `{name}` is given twice; give each a name of its own")
        check_names(self.session_own, (*Stage.model_fields, *Sensors.model_fields))
        return self
