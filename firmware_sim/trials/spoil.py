"""What sensors and loggers make of a run: lag, noise of any colour, rounding, outliers, and rows that never arrive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from firmware_sim.plant import PlantRun
from firmware_sim.plant.late import read_late
from firmware_sim.plant.records import Floats
from firmware_sim.trials.imperfections import Imperfections
from firmware_sim.trials.sensors import NEIGHBOUR_NOISE, TEMPERATURE_NOISE_K

UNITS = {"joint_position": "rad", "motor_position": "rad", "joint_torque": "Nm"}


@dataclass(frozen=True)
class Recorded:
    """A recording's channels by canonical names, and which samples of the run its rows are."""

    channels: dict[str, Floats]
    rows: NDArray[np.int64]


def record(
    rng: np.random.Generator,
    run: PlantRun,
    sensors: Mapping[str, float],
    how: Imperfections,
    zeros: Mapping[str, float],
    other: str,
) -> Recorded:
    """The recording of a run; `zeros` are what the channels show too much.

    `sensors` as the configuration states them; `other` is the name of the further channel, empty where none is
    recorded.
    """
    clean = {
        "joint_position": run.joint_position_rad,
        "motor_position": run.motor_position_rad,
        "joint_torque": run.joint_torque_Nm,
    }
    if "gain" in how:
        clean["joint_torque"] = clean["joint_torque"] * how["gain"]["joint_torque_gain"]
    _delay(clean, run.time_s, how)
    channels = {"time_s": run.time_s.copy()}
    for name in ("motor_position", "joint_position", "joint_torque"):
        unit = UNITS[name]
        value = clean[name] + zeros.get(name, 0.0)
        sigma = sensors[f"{name}_noise_{unit}"] * _factor(how, name)
        value = value + sigma * _noise(rng, run.time_s, how)
        value = _rounded(value, sensors[f"{name}_resolution_{unit}"] * coarser(how, name))
        channels[f"{name}_{unit}"] = _with_outliers(rng, value, sigma, how, name)
    if "motor_torque" in how:
        torque = run.motor_torque_Nm
        sigma = how["motor_torque"]["noise_of_range"] * max(float(np.ptp(torque)), 1e-9)
        channels["motor_torque_Nm"] = torque + sigma * rng.standard_normal(len(torque))
    noise = TEMPERATURE_NOISE_K * rng.standard_normal(len(run.time_s))
    channels["temperature_degC"] = run.temperature_degC + noise
    if other:
        noise = NEIGHBOUR_NOISE * float(np.ptp(run.other_1)) * rng.standard_normal(len(run.time_s))
        channels[other] = run.other_1 + noise
    kept = _kept(rng, channels, how)
    return Recorded({name: values[kept] for name, values in channels.items()}, kept)


def coarser(how: Imperfections, name: str) -> float:
    """By what factor a channel is rounded more coarsely."""
    given = "quantisation" in how and name in how["quantisation"]["channels"]
    return float(how["quantisation"]["factor"]) if given else 1.0


def _factor(how: Imperfections, name: str) -> float:
    return float(how["noise_misstated"][name]) if "noise_misstated" in how else 1.0


def _delay(clean: dict[str, Floats], time_s: Floats, how: Imperfections) -> None:
    if "low_pass" in how:
        channel, step = how["low_pass"]["channel"], float(np.median(np.diff(time_s)))
        clean[channel] = _low_passed(clean[channel], step, how["low_pass"]["lag_s"])
    if "late" in how:
        channel = how["late"]["channel"]
        clean[channel] = read_late(time_s, clean[channel], float(how["late"]["lag_s"]))


def _low_passed(values: Floats, step_s: float, lag: float) -> Floats:
    keep = float(np.exp(-step_s / max(lag, 1e-9)))
    start = [keep * values[0]]
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values, zi=start)[0])


def _noise(rng: np.random.Generator, time: Floats, how: Imperfections) -> Floats:
    """Noise of unit variance: white, or in part a first-order autoregression."""
    white = rng.standard_normal(len(time))
    if "coloured_noise" not in how:
        return white
    share, correlation_s = how["coloured_noise"]["share"], how["coloured_noise"]["time_s"]
    keep = float(np.exp(-np.median(np.diff(time)) / correlation_s))
    drive = np.sqrt(1.0 - keep**2) * rng.standard_normal(len(time))
    red = lfilter([1.0], [1.0, -keep], drive, zi=[keep * rng.standard_normal()])[0]
    return np.asarray(np.sqrt(1.0 - share) * white + np.sqrt(share) * red)


def _rounded(values: Floats, resolution: float) -> Floats:
    return np.asarray(np.round(values / resolution) * resolution) if resolution > 0.0 else values


def _with_outliers(
    rng: np.random.Generator, values: Floats, sigma: float, how: Imperfections, name: str
) -> Floats:
    if "outliers" not in how or name not in how["outliers"]["channels"]:
        return values
    hit = rng.uniform(size=len(values)) < how["outliers"]["share"]
    size = how["outliers"]["sigmas"] * sigma * rng.uniform(0.3, 1.0, len(values))
    return np.asarray(values + np.where(hit, size * rng.choice((-1.0, 1.0), len(values)), 0.0))


def _kept(rng: np.random.Generator, channels: dict[str, Floats], how: Imperfections) -> NDArray[np.int64]:
    """The rows that arrive; single channels lose values besides, which are NaN then."""
    n = len(channels["time_s"])
    if "gaps" not in how:
        return np.arange(n)
    numbers = how["gaps"]
    column = channels[f"{numbers['nan_channel']}_{UNITS[numbers['nan_channel']]}"]
    for _ in range(numbers["nan_stretches"]):
        start = int(rng.integers(1, n - 1))
        column[start : start + int(rng.integers(3, 60))] = np.nan
    keep = rng.uniform(size=n) >= numbers["single_share"]
    for _ in range(numbers["bursts"]):
        start = int(rng.integers(1, n - 1))
        keep[start : start + int(rng.integers(5, numbers["longest"] + 6))] = False
    keep[[0, n - 1]] = True
    return np.flatnonzero(keep)
