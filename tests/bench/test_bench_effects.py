"""How fast the kernel is with each effect, and how fast a model for new parameter values is built.

Run with: pytest tests/bench/test_bench_effects.py --benchmark-only
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cablecomp.config import JointConfig, load_joint
from cablecomp.effects import catalogue, extend, with_effects
from cablecomp.mechanics.assemble import assemble
from cablecomp.observer import Observer

CONFIG = Path(__file__).parents[2] / "configs" / "joints" / "snow-closed-rig.toml"
SAMPLES = 20_000


def richer(name: str) -> JointConfig:
    config = load_joint(CONFIG)
    if name == "plain":
        return config
    values: dict[str, Any] = dict.fromkeys(catalogue()[name].texts, "other_neighbour_Nm")
    for parameter in catalogue()[name].parameters:
        low, high = parameter.bounds(config)
        values[parameter.name] = np.sqrt(low * high) if parameter.log else 0.25 * low + 0.75 * high
        if parameter.name == "time_s":
            values[parameter.name] = 5.0
    return with_effects(config, [(name, values)])


@pytest.mark.benchmark(group="replay of 20 000 samples, both pulleys turning")
@pytest.mark.parametrize("name", ["plain", *sorted(catalogue())])
def test_replay(benchmark: Any, name: str) -> None:
    config = richer(name)
    time = 1e-3 * np.arange(SAMPLES)
    columns = {
        "time_s": time,
        "motor_position_rad": 0.6 * np.sin(0.9 * time),
        "joint_torque_Nm": 1.5 * np.sin(2.3 * time) * np.cos(0.31 * time),
        "temperature_degC": 20.0 + 5.0 * np.sin(0.1 * time),
        "other_neighbour_Nm": 0.3 * np.sin(1.1 * time),
    }
    Observer(config).run({key: value[:100] for key, value in columns.items()})
    benchmark.pedantic(
        lambda observer: observer.run(columns), setup=lambda: ((Observer(config),), {}), rounds=3
    )
    benchmark.extra_info["us_per_sample"] = 1e6 * benchmark.stats["median"] / SAMPLES


@pytest.mark.benchmark(group="a model for new parameter values")
@pytest.mark.parametrize("name", sorted(catalogue()))
def test_build(benchmark: Any, name: str) -> None:
    config = richer(name)
    assemble(config, extend(config))
    benchmark(lambda: assemble(config, extend(config)))
