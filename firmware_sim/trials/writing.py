"""What stands in a trial's folder: recordings and the nominal configuration; and the true model's."""

from __future__ import annotations

import gzip
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from firmware_sim.plant import EffectSpec, PlantConfig
from firmware_sim.plant.records import Floats
from firmware_sim.trials.joints import DrawnJoint

JOINT_FILE = "joint.toml"
_DIGITS = {"time_s": "%.6f", "temperature_degC": "%.4f"}


def folder_name(number: int) -> str:
    """Name of a trial's public folder."""
    return f"{number:05d}"


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
    tolerance: Mapping[str, float] | None = None,
    session_own: Sequence[str] = (),
    conditions: Mapping[str, str] | None = None,
) -> str:
    """A joint's configuration file: drive as given, the joint's sensors and limits, what may
    differ from session to session where that is known, and which channels tell how the drive stood."""
    sensors = dict(joint.sensors)
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
    return "\n".join(lines) + "\n"


def observer_parameters(effect: EffectSpec, other: str) -> dict[str, float | str]:
    """An effect's parameters as a joint configuration names them: a neighbour by its channel, `other`."""
    values: dict[str, float | str] = dict(effect.parameters)
    if effect.id == "crosstalk":
        values["channel"] = other
    return values


def _table(head: str, values: Mapping[str, Any]) -> list[str]:
    return ["", head, *(f"{key} = {_value(value)}" for key, value in values.items())]


def _value(value: Any) -> str:
    return json.dumps(value) if isinstance(value, (str, list)) else repr(float(value))
