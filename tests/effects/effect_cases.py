"""Joints, excitations and typical parameter values that the tests of the effects share."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cablecomp.config import JointConfig, load_joint, parse_joint
from cablecomp.effects import Change, Effect, Parameter, catalogue, register, with_effects
from cablecomp.effects.compiled_term import CompiledTerm
from cablecomp.effects.course import FURTHER
from cablecomp.observer import Observer

Floats = NDArray[np.float64]
Columns = dict[str, Floats]
CONFIGS = Path(__file__).parents[2] / "configs" / "joints"

IN_TWO_SECONDS = {"time_s": 0.7, "began_s": -1.0, "lag_s": 0.3} | {
    f"{step}_after_s": 0.2 * k for k, step in enumerate(FURTHER, start=1)
}
"""Times at which something happens while the excitation lasts."""
OTHER_LAW = {
    "closes_Nm": 0.0, "preload_Nm": 0.0, "preloaded": 1.0, "swing": 0.0, "duration_s": 0.0, "curve": 1.0,
    "play_units": 0.0,
}  # fmt: skip
"""Values of a law that an effect may have in the place of another of its own."""


def joint(name: str = "snow-closed-rig", **stage: float) -> JointConfig:
    """A shipped joint whose cables never break, with stage values changed."""
    data = load_joint(CONFIGS / f"{name}.toml").model_dump(by_alias=True)
    data["drive"]["stage"] = tuple(
        {**part, "breaking_force_N": None, **stage} for part in data["drive"]["stage"]
    )
    return parse_joint(data, "changed")


def typical(name: str, config: JointConfig) -> dict[str, Any]:
    """Parameter values amid the prior range, so that the effect clearly acts within a second or two."""
    values: dict[str, Any] = {}
    effect = catalogue()[name]
    for parameter in effect.parameters:
        if parameter.of_cable_l == "always" and config.drive.circuit == "open":
            continue
        low, high = parameter.bounds(config)
        values[parameter.name] = np.sqrt(low * high) if parameter.log else 0.25 * low + 0.75 * high
        values[parameter.name] = IN_TWO_SECONDS.get(parameter.name, values[parameter.name])
        if parameter.per_reading:
            values[parameter.name] *= 0.5 / neighbour_Nm(config)
        if effect.texts and parameter.role == "bend":
            values[parameter.name] = 0.5 / neighbour_Nm(config)
    other = {k: v for k, v in OTHER_LAW.items() if k in values}
    return values | other | dict.fromkeys(effect.texts, "other_neighbour_Nm")


def neutral(name: str) -> dict[str, Any]:
    """The values that switch the effect off."""
    effect = catalogue()[name]
    return {**effect.neutral(), **dict.fromkeys(effect.texts, "other_neighbour_Nm")}


def neighbour_Nm(config: JointConfig) -> float:
    """The largest load on the neighbouring joint: half of R T0."""
    stage = config.drive.stage[-1]
    return 0.5 * stage.output_radius_m * stage.pretension_N


def excitation(config: JointConfig, samples: int = 400, moving: bool = True) -> Columns:
    """Two seconds of changing load with a hold, the motor turning if `moving`; all channels in use."""
    time = np.linspace(0.0, 2.0, samples)
    ratio = np.prod([s.input_radius_m / s.output_radius_m for s in config.drive.stage])
    unit = neighbour_Nm(config)
    load = (
        unit * np.sin(7.0 * np.minimum(time, 1.2) + 4.0 * np.maximum(time - 1.4, 0.0)) * np.exp(-0.3 * time)
    )
    return {
        "time_s": time,
        "motor_position_rad": 0.4 / ratio * np.sin(2.6 * time) if moving else np.zeros(samples),
        "joint_torque_Nm": load,
        "temperature_degC": 20.0 + 4.0 * np.sin(2.0 * time),
        "other_neighbour_Nm": unit * np.cos(5.0 * time),
    }


def run(config: JointConfig, columns: Columns, *effects: tuple[str, Mapping[str, Any]]) -> Columns:
    """Estimates of an observer of the joint with these effects and no others."""
    return Observer(with_effects(config, effects)).run(columns)


def still(time: Floats, load: Floats, motor: Floats | float = 0.0, **more: Floats) -> Columns:
    """Channels of a recording with a given load."""
    return {
        "time_s": time,
        "motor_position_rad": np.zeros_like(time) + motor,
        "joint_torque_Nm": load,
        **more,
    }


def register_alone(
    monkeypatch: pytest.MonkeyPatch,
    identifier: str,
    parameter: str,
    change: Callable[[Mapping[str, Any]], CompiledTerm],
    *texts: str,
) -> None:
    """An effect of one amount, and of channels by name, known for this test alone; `change`: its term."""
    monkeypatch.setattr(importlib.import_module("cablecomp.effects.catalogue"), "_registered", {})
    register(
        Effect(
            id=identifier,
            statement="For a test.",
            equation="",
            source="",
            parameters=(Parameter(parameter, "", 0.0, 0.5, 2.0, ""),),
            acts_through=("other",),
            bounded=False,
            change=lambda values, config: Change(terms=change(values)),
            texts=texts,
        )
    )


def second_differences(time: Floats, q: Floats) -> Floats:
    """Acceleration by the two-step backward formula, twice, even steps; zero for the first two samples."""
    h = time[1] - time[0]
    v = np.zeros_like(q)
    v[0] = v[1] = (q[1] - q[0]) / h
    a = np.zeros_like(q)
    for n in range(2, len(q)):
        v[n] = (1.5 * q[n] - 2.0 * q[n - 1] + 0.5 * q[n - 2]) / h
        a[n] = (1.5 * v[n] - 2.0 * v[n - 1] + 0.5 * v[n - 2]) / h
    return a


def resting(time: Floats, **more: Floats) -> dict[str, Floats]:
    return still(time, np.zeros_like(time), **more)


def fed_with(config: JointConfig, columns: Columns, load: Floats) -> Floats:
    """Joint angle of the plain drive under another load."""
    return run(config, {**columns, "joint_torque_Nm": load})["joint_position_rad"]


def unit(config: JointConfig) -> float:
    """R T0 of the last stage [N m]."""
    return config.drive.stage[-1].output_radius_m * config.drive.stage[-1].pretension_N
