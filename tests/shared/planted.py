"""Synthetic recordings and residuals with known causes, for the laws of the diagnosis's statistics."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from cablecomp.diagnosis.locate.covariates import Covariates, covariates
from cablecomp.signal.smoothing import FloatArray

SIGMA = 2e-5


def autoregressive(rng: np.random.Generator, n: int, memory: float, sd: float) -> FloatArray:
    """AR(1) noise of standard deviation `sd`, correlation exp(-1/memory) between neighbours."""
    a = np.exp(-1.0 / max(memory, 1e-9))
    white = rng.standard_normal(n + 2_000)
    return np.asarray(lfilter([np.sqrt(1.0 - a * a) * sd], [1.0, -a], white)[2_000:])


def columns(kind: str, n: int = 5_000, step_s: float = 8e-3, seed: int = 1) -> dict[str, FloatArray]:
    """Channels of a bench run: `sweep` (joint and load move) or `hold` (ramps and holds, motor at rest)."""
    rng = np.random.default_rng(seed)
    time = np.arange(n) * step_s
    if kind == "sweep":
        motor = 0.6 * np.sin(2.0 * np.pi * 0.21 * time) + 0.25 * np.sin(2.0 * np.pi * 0.09 * time + 1.0)
        load = 1.2 * np.sin(2.0 * np.pi * 0.13 * time + 0.3) + 0.8 * np.sin(2.0 * np.pi * 0.31 * time)
    else:
        motor = np.full(n, 0.1)
        knots, levels = [0.0], [0.0]
        for start in np.arange(0.0, time[-1] + 2.5, 2.5):
            knots += [start + 0.01, start + 1.3]
            levels += [levels[-1], rng.uniform(-2.0, 2.0)]
        load = np.interp(time, knots, levels)
    joint = motor + 0.003 * load + 5e-4 * np.sign(np.gradient(load))
    return {
        "time_s": time,
        "motor_position_rad": motor,
        "joint_torque_Nm": load + 0.002 * rng.standard_normal(n),
        "joint_position_rad": joint + SIGMA * rng.standard_normal(n),
        "temperature_degC": 22.0 + 3.0 * np.sin(2.0 * np.pi * time / 37.0) + 0.05 * rng.standard_normal(n),
        "other_elbow": np.sin(2.0 * np.pi * 0.17 * time),
    }


def causes(channels: dict[str, FloatArray], found: Covariates) -> dict[str, FloatArray]:
    """Shapes of mismatch, named by the covariate that they act through."""
    v, time = found.values, channels["time_s"]
    direction, load = v["load_direction"], channels["joint_torque_Nm"]
    held = v["dwell"]
    shapes = {
        "time": (time > 23.0) * 1.0,
        "time, drift": np.log1p(time / 5.0),
        "load": load**2,
        "load_direction": direction,
        "load_direction, growing": direction * np.abs(load),
        "load_rate": np.tanh(v["load_rate"]),
        "reversal": direction * np.exp(-v["reversal"] / 0.5),
        "motor_angle": np.sin(8.0 * channels["motor_position_rad"]),
        "velocity": v["velocity"],
        "acceleration": v["acceleration"],
        "temperature": channels["temperature_degC"],
        "temperature, loop": (channels["temperature_degC"] - 22.0) * direction * np.abs(load),
        "other:elbow": channels["other_elbow"],
        "dwell": np.where(held > 0.0, direction * (1.0 - np.exp(-held / 0.5)), 0.0),
    }
    return {name: shape - shape.mean() for name, shape in shapes.items() if np.std(shape) > 0.0}


def recording(kind: str) -> tuple[dict[str, FloatArray], Covariates]:
    """Channels and covariates of one bench run."""
    channels = columns(kind)
    return channels, covariates(channels)
