"""Measured: what `--live` costs the loop a cycle, the worker running beside it."""

from __future__ import annotations

import itertools
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from cablecomp.config import load_joint
from cablecomp.signals import Estimate, Sample
from cablecomp.watch.live import LiveOptions, LiveWatch

JOINT = Path(__file__).parents[2] / "configs/joints/wrist-capstan.toml"


@pytest.mark.benchmark(group="live")
def test_one_cycle(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    """Twenty thousand cycles as quick as they go: worse than a loop, where the worker has time between them."""
    noise = 2e-5 * np.random.default_rng(0).standard_normal(20_000)
    watch = LiveWatch(load_joint(JOINT), 1e-3, tmp_path, LiveOptions(learning_s=4.0))
    ticks = itertools.count()
    took: list[float] = []

    def cycle() -> None:
        k = next(ticks)
        sample = Sample(1e-3 * k, 0.0, 0.0, float(noise[k % len(noise)]), temperature_degC=20.0)
        estimate = Estimate(1e-3 * k, 0.0, 0.0, 0.0, 0.0, 0.0, 60.0, 60.0)
        begin = perf_counter()
        watch.take(sample, estimate, True)
        took.append(perf_counter() - begin)

    benchmark.pedantic(cycle, rounds=20_000)
    watch.finish()
    spread = np.quantile(1e6 * np.array(took), [0.5, 0.99, 0.999])
    benchmark.extra_info.update(zip(("p50_us", "p99_us", "p99.9_us"), spread.tolist(), strict=True))
    print(f"\ntake: p50 {spread[0]:.2f} p99 {spread[1]:.1f} p99.9 {spread[2]:.1f} us")
