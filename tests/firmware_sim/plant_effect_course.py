"""The moving run in which effects of the plant are tried."""

from __future__ import annotations

import numpy as np
from plant_joints import joint

from firmware_sim.plant import EffectSpec, PlantRun, simulate

T = np.arange(0.0, 4.0, 0.01)
MOTOR = 1.2 * np.sin(1.9 * T)
LOAD = 1.6 * np.sin(2.7 * T + 0.4)
WARM = 20.0 + 4.0 * np.sin(0.8 * T)
OTHER = np.cos(3.1 * T)


def play(name: str | None, **parameters: float) -> PlantRun:
    """The moving test run with one effect."""
    effects = () if name is None else (EffectSpec(name, parameters),)
    return simulate(joint(), T, MOTOR, LOAD, effects=effects, temperature_degC=WARM, other_1=OTHER)


def carried(run: PlantRun) -> np.ndarray:
    """What the cables carry, N·m."""
    return np.asarray(joint().stages[0].output_radius_m * (run.tension_h_N - run.tension_l_N))
