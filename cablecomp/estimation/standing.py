"""How the drive stood in one recording: the common values, its session's own, and what its conditions add."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from cablecomp.config import JointConfig, claimed_by, in_session, session_of, with_laws_of, with_values
from cablecomp.effects import catalogue
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import Apart, Evidence
from cablecomp.estimation.parameter import parts_of
from cablecomp.signal.smoothing import FloatArray

PRETENSION = "pretension_N"
JOINT_ZERO, MOTOR_ZERO = "joint_position_offset_rad", "motor_torque_offset_Nm"
ONE_CLAIM = "let the `recordings` of one of them alone match it"
"""What is to be done about a recording that several sessions claim, where none can be chosen."""
ON_THE_CLOCK = ("instant", "begin", "cycle start")
"""Roles of effects' parameters that are read on the recordings' clock."""


def standing(config: JointConfig, values: Mapping[str, float], recording: Evidence) -> JointConfig:
    """The joint with these values as it stood in this recording."""
    return stood(with_common(config, values), values, recording)


def with_common(config: JointConfig, values: Mapping[str, float]) -> JointConfig:
    """The joint with those of these values that are no session's own and go with no condition."""
    common = {k: v for k, v in values.items() if "@" not in k and "~" not in k}
    return with_values(config, _checked(config, common))


def stood(common: JointConfig, values: Mapping[str, float], recording: Evidence) -> JointConfig:
    """The joint of common values as it stood in this recording, with what of these values is its session's own or goes
    with its conditions.

    The cable's law EA(T) and a coefficient mu(T) belong to the material: where a session's pretension is its own, their
    values at that pretension follow from those at the common one.
    """
    joint = in_its_place(common, recording)
    own: dict[str, float] = {}
    for name, value in values.items():
        base, session, _ = parts_of(name)
        if session and session == recording.session:
            own[base] = value
    if PRETENSION in own:
        joint = at_pretension(joint, own.pop(PRETENSION))
    if own:
        joint = with_values(joint, _checked(joint, own))
    gained: dict[str, float] = {}
    for name, value in values.items():
        base, _, condition = parts_of(name)
        if condition:
            gained[base] = gained.get(base, value_of(joint, base)) + value * recording.condition[condition]
    return with_values(joint, _checked(joint, gained)) if gained else joint


def in_its_place(joint: JointConfig, recording: Evidence) -> JointConfig:
    """A joint of common values as it stands in a recording by what its configuration states of that one."""
    for name, apart in recording.apart.items():
        joint = with_values(joint, {name: apart.factor * value_of(joint, name) + apart.addend})
    return with_laws_of(joint, recording.claimed)


def stated_of(config: JointConfig, recording: Path, columns: Mapping[str, FloatArray]) -> dict[str, float]:
    """The values that the configuration states of a recording alone: those of the session that claims it, else what
    its conditions make."""
    claimed = claimed_by(config, recording, ONE_CLAIM)
    return dict(claimed.values) if claimed else _gained(config, columns)[0]


def claimed_as(config: JointConfig, recording: Path) -> tuple[str, ...]:
    """The names of the configuration's session that claims a recording and of its mounting, if any, where laws hold in
    one session alone; else none."""
    by_session = any(law.session for law in config.empirical)
    claimed = claimed_by(config, recording, ONE_CLAIM) if by_session else None
    return () if claimed is None else tuple(name for name in (claimed.name, claimed.mounting) if name)


def apart_of(
    config: JointConfig, stated: Mapping[str, float], *, shift_s: float = 0.0, motor_is_load: bool = False
) -> dict[str, Apart]:
    """How far from the common values of the configuration the joint stands with these `stated` ones; instants on a
    clock that is `shift_s` before the recording's own. Zeros are found inside of the fit, but for that of a motor's
    torque which is the load."""
    found: dict[str, Apart] = {}
    joint = config
    for name, value in stated.items():
        if name == JOINT_ZERO or (name == MOTOR_ZERO and not motor_is_load):
            continue
        common = value_of(joint, name)
        scaled = common > 0.0 and not name.startswith("effect.") and "_offset_" not in name
        found[name] = Apart(value / common) if scaled else Apart(1.0, value - common)
        joint = with_values(joint, {name: value})
    if shift_s:
        for name in on_the_clock(config):
            found[name] = Apart(1.0, found.get(name, Apart()).addend + shift_s)
    return found


def on_the_clock(config: JointConfig) -> tuple[str, ...]:
    """Names of the effects' parameters that are instants on a recording's clock."""
    return tuple(
        f"effect.{entry.id}.{p.name}"
        for entry in config.effect
        for p in catalogue()[entry.id].parameters
        if p.role in ON_THE_CLOCK and p.name in entry.parameters
    )


def as_it_stood(
    config: JointConfig,
    recording: Path,
    head: Callable[[], Mapping[str, FloatArray]],
    session: str | None = None,
) -> tuple[JointConfig, str | None, tuple[str, ...]]:
    """The joint as it stood in a recording: by the session of that name, else by the one that claims the
    recording, else by its conditions, read off the recording's `head`. Also the session's name, and notes on
    what had to be assumed."""
    found = session_of(config, recording, session)
    if found is not None:
        return in_session(config, found), found.name, ()
    config = with_laws_of(config, ())
    if not config.depends:
        return config, None, ()
    gained, said = _gained(config, head())
    return with_values(config, gained), None, tuple(f"{recording.name}: {line}" for line in said)


def _gained(
    config: JointConfig, columns: Mapping[str, FloatArray]
) -> tuple[dict[str, float], tuple[str, ...]]:
    """What parameters come to in a recording that no session claims, by the `[[depends]]`; a note for each condition
    that lies beyond what they were told from."""
    gained: dict[str, float] = {}
    said = []
    for law in config.depends:
        channel = config.condition[law.on]
        if channel not in columns or not np.isfinite(columns[channel]).any():
            raise InputError(
                f"channel `{channel}` is missing, which [condition] `{law.on}` names "
                f"and `{law.parameter}` depends on; record it"
            )
        there = float(np.nanmedian(columns[channel]))
        inside = min(max(there, law.seen[0]), law.seen[1])
        if inside != there:
            said.append(
                f"{law.on} = {there:.4g} lies beyond {law.seen[0]:.4g} to {law.seen[1]:.4g}, "
                f"from which `{law.parameter}` was told:"
                f" taken at {inside:.4g}"
            )
        before = gained.get(law.parameter, value_of(config, law.parameter))
        gained[law.parameter] = before + law.per_unit * (inside - law.at)
    return _checked(config, gained), tuple(said)


def at_pretension(config: JointConfig, pretension_N: float) -> JointConfig:
    """The same joint tightened to another pretension (output stage), its cable and coats unchanged: laws that count
    from T0 are restated."""
    factor = pretension_N / config.drive.stage[-1].pretension_N
    changes = {PRETENSION: config.drive.stage[0].pretension_N * factor}
    for entry in config.effect:
        restate = catalogue()[entry.id].at_pretension
        if restate is None:
            continue
        law = restate({k: float(v) for k, v in entry.parameters.items()}, factor)
        changes |= {f"effect.{entry.id}.{k}": v for k, v in law.values.items()}
        for key, by in (("EA_N", law.EA), ("mu_output", law.mu), ("mu_input", law.mu)):
            changes[key] = changes.get(key, getattr(config.drive.stage[0], key)) * by
    return with_values(config, _checked(config, changes))


def value_of(config: JointConfig, name: str) -> float:
    """The value that the configuration holds under a parameter's name."""
    if name.startswith("effect."):
        _, identifier, key = name.split(".")
        entry = next((e for e in config.effect if e.id == identifier), None)
        if entry is None:
            raise InputError(f"{config.name}: effect `{identifier}` is not in the configuration; add it")
        value = entry.parameters.get(key)
        if value is None:  # left out: what that means
            laws = {p.name: p.omitted for p in catalogue()[identifier].parameters}
            value = laws.get(key)
        if not isinstance(value, int | float):
            takes = ", ".join(p.name for p in catalogue()[identifier].parameters)
            raise InputError(f"{config.name}: effect `{identifier}` has no number `{key}`; it takes {takes}")
        return float(value)
    key, _, which = name.partition(".")
    stage = config.drive.stage[int(which) - 1 if which else 0]
    return float(getattr(stage, key)) if hasattr(stage, key) else float(getattr(config.sensors, key))


def _checked(config: JointConfig, values: Mapping[str, float]) -> dict[str, float]:
    """Values inside what the laws can take."""
    found = {}
    for name, value in values.items():
        if name.startswith("effect."):
            _, identifier, key = name.split(".")
            p = catalogue()[identifier].parameter(key)
            value = min(max(value, p.minimum), p.maximum)
        found[name] = value
    return found
