"""How fast the kernel is with each effect, and how fast a model for new parameter values is built.

Run with: pytest tests/bench/test_bench_effects.py --benchmark-only
"""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import pytest

from cablecomp.config import JointConfig, load_joint
from cablecomp.effects import catalogue, extend, with_effects
from cablecomp.mechanics.assemble import assemble
from cablecomp.observer import Observer
from cablecomp.signals import Sample

CONFIG = Path(__file__).parents[2] / "configs" / "joints" / "snow-closed-rig.toml"
SAMPLES = 20_000


BESIDE_VISCOUS_SLIP = ("nonlinear_cable", "position_dependent_friction", "pressure_dependent_friction")


def richer(name: str) -> JointConfig:
    """The joint with an effect, or with several ("+" between)."""
    config = load_joint(CONFIG)
    names = [] if name == "plain" else name.split("+")
    return with_effects(config, [(n, sizeable(n, config)) for n in names])


def sizeable(name: str, config: JointConfig) -> dict[str, Any]:
    """An effect worth its run: what it has to be given, or its first amount with the shapes of that; other shapes left
    out."""
    effect = catalogue()[name]
    given = [p for p in effect.parameters if p.omitted is None]
    first = next(p for p in effect.parameters if not p.shape)
    values: dict[str, Any] = dict.fromkeys(effect.texts, "other_neighbour_Nm")
    for parameter in given or [first]:
        low, high = parameter.bounds(config)
        middle = 0.25 * low + 0.75 * high if low < 0.0 else 0.75 * low + 0.25 * high
        values[parameter.name] = np.sqrt(low * high) if parameter.log else middle
    if effect.of_role("instant"):
        values["time_s"] = 5.0
    return values


@pytest.mark.benchmark(group="replay of 20 000 samples, both pulleys turning")
@pytest.mark.parametrize(
    "name", ["plain", *sorted(catalogue()), *(f"viscous_slip+{n}" for n in BESIDE_VISCOUS_SLIP)]
)
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


def steps_us(config: JointConfig, bounds: bool) -> np.ndarray:
    """What each sample of a course costs [us]: the quickest of three repeats, so that other work does not count."""
    load = 0.5 * config.drive.stage[-1].pretension_N * config.drive.stage[-1].output_radius_m
    best = np.full(1500, np.inf)
    for _ in range(3):
        observer = Observer(config, bounds=bounds)
        for k in range(len(best)):
            t = 1e-3 * k
            sample = Sample(
                t, 0.3 * np.sin(1.8 * t), load * np.sin(4.6 * t) * np.cos(1.24 * t), 0.0, 0.0, 20.0
            )
            begin = perf_counter()
            observer.step(sample)
            best[k] = min(best[k], perf_counter() - begin)
    return 1e6 * best


@pytest.mark.benchmark(group="one step from Python, two stages in parallel")
@pytest.mark.parametrize("bounds", [False, True])
@pytest.mark.parametrize(
    "names",
    [(), ("pressure_dependent_friction",), ("pressure_dependent_friction", "nonlinear_cable")],
    ids=lambda names: "+".join(names) or "plain",
)
def test_steps_of_two_stages(benchmark: Any, names: tuple[str, ...], bounds: bool) -> None:
    """The dearest laws on the dearest joint that ships."""
    config = load_joint(CONFIG.with_name("two-stage-parallel.toml"))
    middle = [(name, sizeable(name, config)) for name in names]
    taken = benchmark.pedantic(lambda: steps_us(with_effects(config, middle), bounds), rounds=1)
    p50, p99 = np.percentile(taken, [50, 99])
    benchmark.extra_info.update(p50_us=p50, p99_us=p99)
    print(f"\n{'+'.join(names) or 'plain'}{', bounds' if bounds else ''}: p50 {p50:.1f} p99 {p99:.1f} us")


FINGER = CONFIG.with_name("tendon-finger.toml")


def course(step_s: float) -> dict[str, np.ndarray]:
    """20 s in which both pulleys of the finger turn, a row every `step_s`."""
    time = np.arange(0.0, 20.0, step_s)
    return {
        "time_s": time,
        "motor_position_rad": 0.6 * np.sin(0.9 * time),
        "joint_torque_Nm": 0.12 * np.sin(2.3 * time) * np.cos(0.31 * time),
    }


def seconds(config: JointConfig, columns: dict[str, np.ndarray]) -> float:
    """What a replay takes, the quickest of five."""
    best = np.inf
    for _ in range(5):
        observer = Observer(config)
        observer.compile()
        begin = perf_counter()
        observer.run(columns)
        best = min(best, perf_counter() - begin)
    return best


@pytest.mark.benchmark(group="replay, the output pulley off its centre")
@pytest.mark.parametrize("share", [0.01, 0.1, 0.25, 0.5])
def test_runout_over_plain(benchmark: Any, share: float) -> None:
    """How many plain rows a row costs whose cable lengths follow the angle; less than two, however far off."""
    config, columns = load_joint(FINGER), course(1e-3)
    stage = config.drive.stage[-1]
    effect = ("pulley_runout", {"eccentricity_m": share * stage.output_radius_m, "phase_rad": 0.5})
    plain = seconds(config, columns)
    off = benchmark.pedantic(lambda: seconds(with_effects(config, [effect]), columns), rounds=1)
    benchmark.extra_info["over_plain"] = off / plain
    print(f"\n{100.0 * share:.0f} % off its centre: {off / plain:.1f} plain rows")


@pytest.mark.benchmark(group="replay of rows 20 ms apart, a weight that nobody measures")
def test_weight_over_none(benchmark: Any) -> None:
    """Rows as a diagnosis thins them: friction on the path and a stiffening cable, with a weight and without."""
    config, columns = load_joint(FINGER), course(0.02)
    stage = config.drive.stage[-1]
    guided: list[tuple[str, dict[str, float]]] = [
        ("routing_friction", {"mu_angle": 0.4, "arc_length_m": 0.05 * stage.free_length_m, "skew": 0.0}),
        ("nonlinear_cable", {"stiffening": 0.7}),
    ]
    weight = ("gravity_load", {"moment_Nm": 0.3 * stage.pretension_moment_Nm, "phase_rad": 0.5})
    without = seconds(with_effects(config, guided), columns)
    weighed = benchmark.pedantic(lambda: seconds(with_effects(config, [*guided, weight]), columns), rounds=1)
    rows = len(columns["time_s"])
    benchmark.extra_info["over_none"] = weighed / without
    print(f"\n{1e6 * without / rows:.1f} us a row, with a weight {1e6 * weighed / rows:.1f}")
