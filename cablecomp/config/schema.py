"""A joint configuration as frozen objects; an unknown key fails."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final, Literal, Self

from pydantic import BeforeValidator, Field, ValidationError, field_validator, model_validator

from cablecomp.config.base import Frozen, Listed, NonNegative, Text, listed
from cablecomp.config.drive import Drive, Stage
from cablecomp.config.options import EffectEntry, Limits, ObserverOptions, Remainder, Sensors
from cablecomp.config.sessions import ZEROS, Depends, Empirical, Session, as_tables, check_names

PARAMETERS: Final = (*Stage.model_fields, *Sensors.model_fields)
"""Keys that are parameters: what [tolerance], `own` and `values` may name (also KEY.STAGE and effect.ID.KEY)."""


class JointConfig(Frozen):
    """A cable-driven joint as its TOML file states it. SI units, each named in its key."""

    schema_: Literal[1] = Field(alias="schema", description="version of this format")
    name: Text = Field(description="name of the joint")
    drive: Drive
    tolerance: dict[str, NonNegative] = Field(
        default_factory=dict,
        description="by key of [[drive.stage]]: relative 1 sigma of what is only nominally known; absent = exact "
        "(to a diagnosis: a radius to 0.3 %, free lengths to 2 %); 1 and more = order of magnitude only. "
        "Offsets of [sensors]: 1 sigma in their own unit. effect.ID.KEY: of an effect that the joint is known to have, "
        "relative; in its own unit where it may have either sign",
    )
    sensors: Sensors = Sensors()
    effect: Annotated[tuple[EffectEntry, ...], listed(64)] = ()
    empirical: Annotated[tuple[Empirical, ...], listed(256)] = ()
    observer: ObserverOptions = ObserverOptions()
    limits: Limits = Limits()
    session: Annotated[tuple[Session, ...], Listed, BeforeValidator(as_tables)] = ()
    condition: dict[str, Text] = Field(
        default_factory=dict,
        description="name -> channel that tells how the drive stood (slow in a recording)",
    )
    depends: Annotated[tuple[Depends, ...], listed(16)] = ()
    remainder: Remainder = Remainder()

    @property
    def motor_zero_Nm(self) -> float:
        """What the motor's torque reads where no load acts: the sensor's offset less what holds the pretension. A
        reading tells the load -(reading - this)/ratio."""
        return self.sensors.motor_torque_offset_Nm - self.drive.preload_Nm

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

    @field_validator("tolerance")
    @classmethod
    def _tolerance_of_parameters(cls, value: dict[str, float]) -> dict[str, float]:
        check_names("tolerance", value, PARAMETERS, 16)
        return value

    @model_validator(mode="after")
    def _names(self) -> Self:
        names = [s.name for s in self.session]
        for name in dict.fromkeys(names):
            if names.count(name) > 1:
                raise ValueError(f"[[session]] `{name}` is given twice; give each a name of its own")
        stages = len(self.drive.stage)
        check_names("tolerance", self.tolerance, PARAMETERS, stages)
        check_names("session", self.session_own, PARAMETERS, stages)
        check_names("depends", (d.parameter for d in self.depends), PARAMETERS, stages)
        for d in self.depends:
            if d.on not in self.condition:
                known = ", ".join(self.condition) or "none"
                raise ValueError(
                    f"[[depends]]: on `{d.on}`, which [condition] does not name; it names {known}"
                )
        held = {f"effect.{e.id}": e.parameters for e in self.effect}
        for key in self.tolerance:
            if "." not in key or key.partition(".")[0] in PARAMETERS:
                continue
            effect, _, name = key.rpartition(".")
            if effect not in held:
                raise ValueError(f"[tolerance]: `{key}`: the configuration has no such effect; add it first")
            numbers = [k for k, v in held[effect].items() if isinstance(v, int | float)]
            if name not in numbers:
                raise ValueError(
                    f"[tolerance]: `{key}`: that effect has {', '.join(numbers) or 'no number'} here"
                )
        for session in self.session:
            self._values_of(session, held)
        mountings = {*names, *(s.mounting for s in self.session), ""}
        for law in self.empirical:
            if law.session not in mountings:
                known = ", ".join(s.name for s in self.sessions) or "none"
                raise ValueError(
                    f"[[empirical]] `{law.id}`: no [[session]] is called `{law.session}`; there are: {known}"
                )
        return self

    def _values_of(self, session: Session, held: Mapping[str, object]) -> None:
        """Raise ValueError for a session's value of an effect that the joint has not, or that no stage can have."""
        for key, value in session.values.items():
            head, _, which = key.partition(".")
            where = f"[[session]] `{session.name}`: `{key}` = {value:g}"
            if head in Stage.model_fields:
                stage = self.drive.stage[int(which) - 1 if which else 0]
                try:
                    Stage(**{**stage.model_dump(), head: value})
                except ValidationError as error:
                    raise ValueError(f"{where}: {error.errors()[0]['msg'].lower()}") from None
            elif head == "effect" and key.rpartition(".")[0] not in held:
                raise ValueError(f"{where}: the configuration has no such effect; add it first")
