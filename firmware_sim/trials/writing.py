"""What stands in a trial's folder: recordings and the nominal configuration; and the true model's."""

from __future__ import annotations

import gzip
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from firmware_sim.plant import EFFECTS, EffectSpec, PlantConfig
from firmware_sim.plant.records import Floats
from firmware_sim.trials.joints import DrawnJoint
from firmware_sim.trials.sensors import NEIGHBOUR
from firmware_sim.trials.sizes import Sized
from firmware_sim.trials.trial import Trial

JOINT_FILE = "joint.toml"
_DIGITS = {"time_s": "%.6f", "temperature_degC": "%.4f"}


def folder_name(number: int) -> str:
    """Name of a trial's public folder."""
    return f"{number:05d}"


def recording_name(index: int) -> str:
    """Name of a trial's recording, counted from 0."""
    return f"recording-{index + 1}.csv.gz"


def write_recording(path: Path, channels: Mapping[str, Floats]) -> None:
    """Write a recording as gzipped CSV; the same channels give the same bytes."""
    names = ["time_s", *(n for n in channels if n != "time_s")]
    text = io.StringIO()
    np.savetxt(
        text,
        np.column_stack([channels[n] for n in names]),
        fmt=[_DIGITS.get(n, "%.9g") for n in names],
        delimiter=",",
        header=",".join(names),
        comments="",
    )
    with path.open("wb") as raw, gzip.GzipFile("", "wb", compresslevel=4, fileobj=raw, mtime=0) as packed:
        packed.write(text.getvalue().encode())


def joint_toml(
    joint: DrawnJoint,
    drive: PlantConfig,
    effects: Sequence[EffectSpec] = (),
    tolerance: Mapping[str, float] | None = None,
    offset_rad: float | None = None,
    session_own: Sequence[str] = (),
    conditions: Mapping[str, str] | None = None,
) -> str:
    """A joint's configuration file: drive as given, the joint's sensors and limits, effects if any, what may
    differ from session to session where that is known, and which channels tell how the drive stood."""
    sensors = dict(joint.sensors)
    if offset_rad is not None:
        sensors["joint_position_offset_rad"] = offset_rad
    motor = joint.travel_rad / joint.true.ratio
    limits = {
        "joint_torque_max_Nm": joint.load_Nm,
        "joint_position_min_rad": -joint.travel_rad,
        "joint_position_max_rad": joint.travel_rad,
        "motor_position_min_rad": -motor,
        "motor_position_max_rad": motor,
        "motor_velocity_max_rad_s": 4.0 * motor,
    }
    lines = ["schema = 1", f'name = "{drive.name}"', "", "[drive]", f'circuit = "{drive.circuit}"']
    for stage in drive.stages:
        lines += _table("[[drive.stage]]", stage.__dict__)
    if tolerance:
        lines += _table("[tolerance]", tolerance)
    lines += _table("[sensors]", sensors)
    lines += _table("[limits]", limits)
    if session_own:
        lines += _table("[session]", {"own": list(session_own)})
    if conditions:
        lines += _table("[condition]", conditions)
    for effect in effects:
        lines += _table("[[effect]]", {"id": effect.id, **observer_parameters(effect)})
    return "\n".join(lines) + "\n"


def observer_parameters(effect: EffectSpec) -> dict[str, float | str]:
    """An effect's parameters as a joint configuration names them: a neighbour by its channel."""
    values: dict[str, float | str] = dict(effect.parameters)
    if effect.id == "crosstalk":
        values["channel"] = NEIGHBOUR
    return values


def write_public(folder: Path, trial: Trial) -> None:
    """Write what the diagnosis may see: recordings and nominal configuration."""
    folder.mkdir(parents=True, exist_ok=True)
    for k, channels in enumerate(trial.recordings):
        write_recording(folder / recording_name(k), channels)
    text = joint_toml(trial.joint, trial.joint.nominal, tolerance=trial.joint.tolerance)
    (folder / JOINT_FILE).write_text(text, encoding="utf-8")


def truth_of(trial: Trial) -> dict[str, Any]:
    """Everything that is true of a trial, as plain data."""
    joint, catalogue = trial.joint, all(EFFECTS[e.spec.id].listed for e in trial.effects)
    return {
        "trial": trial.assignment.number,
        "kind": trial.assignment.kind,
        "case": trial.assignment.case,
        "partner": trial.partner,
        "circuit": joint.true.circuit,
        "excitation": trial.courses[0].kind,
        "listed": catalogue,
        "effects": [_effect_truth(e) for e in trial.effects],
        "loop_rad": trial.plain.loop_rad,
        "noise_floor_rad": trial.floor_rad,
        "true": dict(joint.stage.__dict__),
        "nominal": dict(joint.nominal.stages[0].__dict__),
        "tolerance": dict(joint.tolerance),
        "sensors": dict(joint.sensors),
        "offset_rad": joint.offset_rad,
        "load_Nm": joint.load_Nm,
        "travel_rad": joint.travel_rad,
        "neighbour": trial.neighbour,
        "plain": dict(trial.plain.__dict__),
        "duration_s": [float(c.time_s[-1]) for c in trial.courses],
    }


def _effect_truth(effect: Sized) -> dict[str, Any]:
    kind = EFFECTS[effect.spec.id]
    return {
        "id": effect.spec.id,
        "listed": kind.listed,
        "size": effect.size,
        "parameters": observer_parameters(effect.spec),
        "covariates": [c.replace("other:1", "other:neighbour") for c in kind.covariates],
    }


def true_model(trial: Trial) -> str:
    """Configuration of the true model with true parameters; an effect outside of the catalogue is left out,
    since no configuration can state it."""
    listed = [e.spec for e in trial.effects if EFFECTS[e.spec.id].listed]
    return joint_toml(trial.joint, trial.joint.true, listed, offset_rad=trial.joint.offset_rad)


def truth_text(truths: Sequence[Mapping[str, Any]], seed: int, kind: str) -> str:
    """The sealed truth of all trials, as JSON."""
    return json.dumps({"schema": 1, "seed": seed, "kind": kind, "trials": list(truths)}, indent=1) + "\n"


def _table(head: str, values: Mapping[str, Any]) -> list[str]:
    return ["", head, *(f"{key} = {_value(value)}" for key, value in values.items())]


def _value(value: Any) -> str:
    return json.dumps(value) if isinstance(value, (str, list)) else repr(float(value))
