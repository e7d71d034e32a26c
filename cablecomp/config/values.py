"""Values of parameters by name, put into a configuration: calibrated ones, those of a session.

Names: a key of `[[drive.stage]]` moves that value of every stage by one common factor (`EA_N`), `EA_N.2` that
of stage 2 alone; a key of `[sensors]` (`joint_position_offset_rad`); `effect.ID.KEY` a parameter of the effect
ID.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from cablecomp.config.drive import Stage
from cablecomp.config.options import EffectEntry, Sensors
from cablecomp.config.schema import JointConfig
from cablecomp.config.sessions import Session
from cablecomp.errors import InputError

STAGE_KEYS: Final = tuple(Stage.model_fields)
SENSOR_KEYS: Final = tuple(Sensors.model_fields)


def with_values(config: JointConfig, values: Mapping[str, float]) -> JointConfig:
    """The configuration with these values in place of its own (`offset[k]` of single recordings is left out); raises
    InputError for one that no drive can have."""
    stages: list[dict[str, float]] = []
    sensors: dict[str, Any] = {}
    effects: dict[int, dict[str, Any]] = {}
    # a fit calls this for every value that it tries: what stays as it is is not made anew
    for name, value in values.items():
        key, _, which = name.partition(".")
        if name.startswith("effect."):
            identifier, parameter = effect_name(name)
            place = next(k for k, e in enumerate(config.effect) if e.id == identifier)
            effects.setdefault(place, {})[parameter] = value
        elif key in STAGE_KEYS:
            stages = stages or [{} for _ in config.drive.stage]
            places = range(len(stages)) if not which else (int(which) - 1,)
            before = [stages[k].get(key, getattr(config.drive.stage[k], key)) for k in places]
            for k, old in zip(places, before, strict=True):
                stages[k][key] = old * (value / before[0])
            stages[places[0]][key] = value
        elif name in SENSOR_KEYS:
            sensors[name] = value
    changed: dict[str, Any] = {}
    if stages:
        moved = zip(config.drive.stage, stages, strict=True)
        anew = tuple(_stage(config.name, stage, new) for stage, new in moved)
        changed["drive"] = config.drive.model_copy(update={"stage": anew})
    if sensors:
        changed["sensors"] = config.sensors.model_copy(update=sensors)
    if effects:
        changed["effect"] = tuple(
            e if k not in effects else with_parameters(e, effects[k]) for k, e in enumerate(config.effect)
        )
    return config.model_copy(update=changed) if changed else config


def with_parameters(entry: EffectEntry, values: Mapping[str, Any]) -> EffectEntry:
    """The entry with these parameters in place of its own; an effect's own checks come when it is used."""
    return EffectEntry.model_construct(None, id=entry.id, **{**entry.parameters, **values})


def _stage(name: str, stage: Stage, new: Mapping[str, float]) -> Stage:
    try:
        return Stage(**{**vars(stage), **new}) if new else stage
    except ValidationError as error:
        first = error.errors()[0]
        where, value = first["loc"][0], first["input"]
        raise InputError(f"{name}: `{where}` would come to {value:.4g}: {first['msg'].lower()}") from None


def effect_name(name: str) -> tuple[str, str]:
    """Id and key of `effect.ID.KEY`; raises InputError if it is not of that form."""
    parts = name.split(".")
    if len(parts) != 3:
        raise InputError(f"calibration: `{name}`; effect.ID.PARAMETER is accepted")
    return parts[1], parts[2]


def claiming(config: JointConfig, recording: Path | None) -> list[Session]:
    """The sessions that claim a recording: those that name most of its path, else all whose patterns match."""
    matching = [s for s in config.sessions if recording is not None and s.matches(recording)]
    named = [0 if recording is None else s.names(recording) for s in matching]
    return [s for s, parts in zip(matching, named, strict=True) if parts == max(named)]


def claimed_by(config: JointConfig, recording: Path, instead: str) -> Session | None:
    """The session that claims a recording; None if there is none. Of several that do, a part of a mounting goes before
    that mounting, and one that names the recording before those that name more. Raises InputError, which says what to
    do `instead`, if several are left."""
    matching = claiming(config, recording)
    if len(matching) > 1:
        matching = _closest(matching, recording)
    if len(matching) > 1:
        names = ", ".join(s.name for s in matching)
        raise InputError(f"{recording}: several sessions claim it ({names}); {instead}")
    return matching[0] if matching else None


def _closest(claims: list[Session], recording: Path) -> list[Session]:
    """Of sessions that claim a recording alike those that are about it the most."""
    mountings = {s.mounting for s in claims if s.mounting != s.name}
    parts = [s for s in claims if s.name not in mountings] or claims
    if not all(s.names(recording) for s in parts):
        return parts  # how many patterns there are says nothing of how much they match
    fewest = min(len(s.recordings) for s in parts)
    return [s for s in parts if len(s.recordings) == fewest]


def session_of(config: JointConfig, recording: Path | None, name: str | None) -> Session | None:
    """The session by its name, else the one whose patterns match the recording; None if there is none.

    Raises InputError for an unknown name, or if several sessions match.
    """
    known = ", ".join(s.name for s in config.sessions) or "none"
    if name is not None:
        found = [s for s in config.sessions if s.name == name]
        if not found:
            raise InputError(f"--session {name}: {config.name} has no session of that name; it has {known}")
        return found[0]
    return None if recording is None else claimed_by(config, recording, "choose one with --session")


def in_session(config: JointConfig, session: Session | None) -> JointConfig:
    """The configuration with the session's own values and laws in place; as it is without a session."""
    if session is None:
        return config
    return with_laws_of(with_values(config, session.values), (session.name, session.mounting))


def with_laws_of(config: JointConfig, sessions: Collection[str]) -> JointConfig:
    """The configuration with those laws without a name in force that hold in these sessions alone; those of other
    sessions are left out."""
    if not any(law.session for law in config.empirical):
        return config
    here = (law for law in config.empirical if not law.session or law.session in sessions)
    laws = tuple(law.model_copy(update={"session": ""}) for law in here)
    return config.model_copy(update={"empirical": laws})
