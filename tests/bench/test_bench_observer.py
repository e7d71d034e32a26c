"""Speed of the observer, compiled and warm, one core.

`pytest tests/bench/test_bench_observer.py --benchmark-only -o addopts="" -q -s`
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from joints import WIDE, closed

from cablecomp.config import parse_joint
from cablecomp.observer import Observer
from cablecomp.signals import Sample

CONFIG = parse_joint(closed(WIDE, "bench"), "bench")
SAMPLES = 200_000


def recording(moving: bool) -> dict[str, np.ndarray]:
    """1 kHz, a load of two frequencies, both pulleys turning if asked."""
    t = 0.001 * np.arange(SAMPLES)
    motor = 1.5 * np.sin(0.9 * t) + 0.5 * np.sin(2.1 * t) if moving else np.zeros(SAMPLES)
    return {
        "time_s": t,
        "motor_position_rad": motor,
        "joint_torque_Nm": 1.6 * np.sin(3.1 * t) * np.cos(0.4 * t),
    }


@pytest.mark.parametrize("moving", [False, True])
def test_replay_speed(benchmark: Any, moving: bool) -> None:
    """Samples per second: 1e6 or better locked, 5e5 or better with both pulleys turning."""
    columns = recording(moving)
    Observer(CONFIG).compile()
    benchmark.pedantic(lambda o: o.run(columns), setup=lambda: ((Observer(CONFIG),), {}), rounds=9)
    rate = SAMPLES / benchmark.stats["median"]
    print(f"\nreplay, {'both pulleys turning' if moving else 'locked'}: {rate:,.0f} samples/s (median)")


def test_one_step_from_python(benchmark: Any) -> None:
    """Median 5 us or better, 99.9th percentile 20 us or better."""
    observer = Observer(CONFIG)
    observer.compile()
    columns = recording(True)
    samples = [Sample(*row) for row in zip(*(columns[k].tolist() for k in columns), strict=True)]
    spent = np.empty(50_000)

    def run() -> None:
        clock = time.perf_counter_ns
        for k in range(len(spent)):
            begin = clock()
            observer.step(samples[k])
            spent[k] = clock() - begin

    benchmark.pedantic(run, rounds=1)
    p50, p99, p999 = np.percentile(spent, [50, 99, 99.9]) / 1e3
    print(f"\nstep from Python: median {p50:.2f} us, p99 {p99:.2f} us, p99.9 {p999:.2f} us")


def test_cost_does_not_grow_with_the_history(benchmark: Any) -> None:
    """Time of the first and of the last tenth of a long run with many reversals."""
    observer = Observer(CONFIG)
    observer.compile()
    columns = recording(True)
    parts = [
        {k: v[i : i + SAMPLES // 10] for k, v in columns.items()} for i in range(0, SAMPLES, SAMPLES // 10)
    ]
    spent: list[float] = []

    def run() -> None:
        for part in parts:
            begin = time.perf_counter()
            observer.run(part)
            spent.append(time.perf_counter() - begin)

    benchmark.pedantic(run, rounds=1)
    print(f"\nlast tenth over first tenth of the run: {spent[-1] / spent[0]:.2f}")
