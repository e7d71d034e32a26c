"""The plant's small joint, both pulleys turning under a load of two frequencies, and what is known of it beforehand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from joints import SMALL, SMALL_NOISE, closed

from cablecomp.config import JointConfig, parse_joint
from cablecomp.diagnosis.body import Body, gather_body
from cablecomp.diagnosis.calibration.drive import Calibrated, calibrate_drive
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

STEP_S = 0.04
TOLERANT = parse_joint(
    {**closed(SMALL, "small"), "tolerance": {"pretension_N": 0.06, "mu_output": 0.25}}, "small"
)


def course(
    seconds: float, loads: float = 1.0, step_s: float = STEP_S
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time [s], motor angle [rad] and load [N m], from rest."""
    time = np.arange(0.0, seconds, step_s)
    soft = 1.0 - np.exp(-time)
    motor = soft * (0.8 * np.sin(1.1 * time) + 0.5 * np.sin(2.1 * time))
    load = loads * soft * (0.9 * np.sin(1.7 * time) + 0.6 * np.sin(2.9 * time))
    return time, motor, load


def recorded(
    effects: Sequence[EffectSpec],
    seconds: float,
    loads: float = 1.0,
    *,
    locked: bool = False,
    stage: Mapping[str, float] = SMALL,
) -> dict[str, FloatArray]:
    """What the plant with these effects shows, with noise on every channel; `locked`: the motor does not move."""
    rng = np.random.default_rng(3)
    time, motor, load = course(seconds, loads)
    motor = 0.0 * motor if locked else motor
    found = simulate(
        PlantConfig.from_dict(closed(dict(stage))), time, motor, load, effects=effects
    ).channels()
    columns: dict[str, FloatArray] = {"time_s": time}
    for name, noise in SMALL_NOISE.items():
        turned = 0.0 if locked and name == "motor_position_rad" else noise
        columns[name] = found[name] + turned * rng.standard_normal(len(time))
    return columns


class Case(NamedTuple):
    """An effect's values in the plant, and what its recording needs beyond the common one; `form`: the law that the
    plant has it with, where that is not the usual one."""

    values: dict[str, float]
    channels: tuple[str, ...] = ()
    seconds: float = 20.0
    loads: float = 1.0
    form: str = ""
    plant: str = ""  # what the plant calls it, if not the effect's name and form
    step_s: float = STEP_S


def recording(effect: str, case: Case) -> dict[str, FloatArray]:
    """The plant with the effect: both pulleys turning, load of two frequencies, noise on all channels."""
    rng = np.random.default_rng(3)
    time, motor, load = course(case.seconds, case.loads, case.step_s)
    given: dict[str, Any] = {
        "temperature_degC": 20.0 + 4.0 * np.sin(0.9 * time),
        "other_1": np.sin(1.3 * time),
    }
    specs = [EffectSpec(case.plant or effect + case.form, case.values)]
    found = simulate(
        PlantConfig.from_dict(closed(SMALL)), time, motor, load, effects=specs, **given
    ).channels()
    noise = {**SMALL_NOISE, "motor_torque_Nm": 1e-3, "temperature_degC": 0.02, "other_1": 1e-3}
    columns = {"time_s": time}
    for name in (*SMALL_NOISE, *case.channels):
        columns[name] = found[name] + noise[name] * rng.standard_normal(len(time))
    return columns


def calibrated(columns: dict[str, FloatArray], stated: JointConfig = TOLERANT) -> tuple[Body, Calibrated]:
    """The recording gathered, and the drive calibrated on it."""
    body = gather_body(stated, {"small/1": columns}, None)
    return body, calibrate_drive(stated, body.used, np.random.default_rng(0))
