"""Speed of the simulated plant: one recording of 60 s at 250 Hz, and one live step of 1 ms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from firmware_sim.plant import Plant, PlantConfig, StageConfig, simulate

JOINT = PlantConfig(
    "bench", "closed", (StageConfig(0.04, 0.015, 0.08, 25000.0, 60.0, 0.12, 0.18, 10.0, 12.0),)
)


@pytest.mark.benchmark(group="plant")
def test_bench_plant_recording(benchmark: Any) -> None:
    t = np.arange(0, 60, 0.004)
    motor, load = 1.5 * np.sin(1.3 * t), 2.0 * np.sin(1.9 * t + 0.3) * np.cos(0.2 * t)
    simulate(JOINT, t[:10], motor[:10], load[:10])
    run = benchmark.pedantic(simulate, args=(JOINT, t, motor, load), rounds=3)
    assert run.failures == 0
    assert benchmark.stats.stats.min < 5.0


@pytest.mark.benchmark(group="plant")
def test_bench_plant_live_step(benchmark: Any) -> None:
    plant = Plant(JOINT)
    angle, speed = 0.0, 0.0

    def one() -> None:
        nonlocal angle, speed
        wanted = math.sin(3.0 * plant.time_s)
        readings = plant.step(1e-3, 10.0 * (wanted - angle) - 0.2 * speed)
        angle, speed = readings.motor_position_rad, readings.motor_velocity_rad_s

    benchmark.pedantic(one, rounds=3000, warmup_rounds=100)
    assert benchmark.stats.stats.median < 300e-6
