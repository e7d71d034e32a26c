"""What a cycle costs: observer and compensator of one joint, and a whole cycle of eight joints on a
virtual bus.
"""

from __future__ import annotations

from math import nan, sin
from pathlib import Path
from typing import Any

import pytest
from joints import WRIST_GAINS

from cablecomp.config import load_joint
from cablecomp.control.command import Reference
from cablecomp.control.compensator import Compensator
from cablecomp.control.options import CompensatorOptions, load_control
from cablecomp.control.standard import reaching_protocol
from cablecomp.links.load import load_link
from cablecomp.observer import Observer
from cablecomp.runtime.priority import Policy
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import RunOptions, run_joints
from cablecomp.runtime.setup import Contestant, matched, same_joint
from cablecomp.signals import Sample
from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.hosted import Truth
from firmware_sim.plantlike import Readings
from firmware_sim.ports import open_port

CONFIGS = Path(__file__).parents[2] / "configs"
JOINT = CONFIGS / "joints/wrist-capstan.toml"


@pytest.mark.parametrize("mode", ["position", "force"])
def test_step_of_observer_and_compensator(benchmark: Any, mode: str) -> None:
    """Asked: 10 µs median a joint."""
    config = load_joint(JOINT)
    if mode == "force":
        config = config.model_copy(
            update={"observer": config.observer.model_copy(update={"load": "both_encoders"})}
        )
    observer = Observer(config)
    observer.compile()
    options = CompensatorOptions.model_validate({**WRIST_GAINS, "mode": mode})
    compensator = Compensator(config, options, 1e-3, observer)
    samples = []
    for k in range(200_000):
        t = k * 1e-3
        load = 1.2 * sin(2.1 * t)
        samples.append(Sample(t, 1.2 * sin(t), load, 0.4 * sin(t) + load / 200.0, -load / 3.0, 20.0))
    reference = Reference(0.1, 0.1, -0.5)
    coming = iter(samples)
    benchmark.pedantic(
        lambda sample: compensator.step(sample, reference),
        setup=lambda: ((next(coming),), {}),
        rounds=20_000,
        warmup_rounds=2_000,
    )
    print(f"\n{mode}: median {1e6 * benchmark.stats['median']:.2f} µs a step")
    assert benchmark.stats["median"] < 25e-6


class Springy:
    """A joint that costs next to nothing to simulate, so that the loop is measured and not the plant
    beside it: a rotor, and a spring under a slow load.
    """

    def __init__(self) -> None:
        self.time_s = self.angle = self.speed = 0.0

    def step(self, dt_s: float, motor_torque_command_Nm: float, /) -> Readings:
        """Semi-implicit Euler; the load swings at 0.3 Hz."""
        load = 1.2 * sin(1.9 * self.time_s)
        self.speed += dt_s * (motor_torque_command_Nm + load / 3.0 - 0.01 * self.speed) / 1e-4
        self.angle += dt_s * self.speed
        self.time_s += dt_s
        joint = self.angle / 3.0 + load / 200.0
        return Readings(
            self.time_s, self.angle, self.speed, joint, 0.0, load, motor_torque_command_Nm, 0.0, 20.0
        )


class SpringySimulation:
    """Eight of them behind the bus."""

    terminal = None

    def __init__(self, joints: int) -> None:
        self.bench = make_bench(
            BenchConfig(protocol="dbc", joints=joints), lambda number: Springy(), open_port("virtual:wrist")
        )
        self._periods = 0

    def set_load(self, number: int, torque_Nm: float) -> None:
        """The load is the plant's own."""

    def set_wall(self, number: int, position_rad: float | None) -> None:
        """There is none."""

    def advance(self, periods: int = 1) -> None:
        """One period for the commands sent, and for those who heard none."""
        self.bench.pump()
        self._periods += periods
        for joint in self.bench.joints:
            due = self._periods * joint.timing.sample_s
            if joint.time_s < due - 0.5 * joint.timing.sample_s:
                self.bench.port.send(joint.advance_to(due), due)

    def truth(self, number: int) -> Truth:
        """Not looked at."""
        return Truth(nan, nan, nan, nan)

    def close(self) -> None:
        """Close the bus."""
        self.bench.close()


def test_a_cycle_of_eight_joints(benchmark: Any) -> None:
    """Asked: decode, observe, compensate, encode of all eight in under 250 µs at the 99th percentile at
    1 kHz.
    """
    joint, control = load_joint(JOINT), load_control(CONFIGS / "control/wrist-capstan.toml")
    health = control.health.model_copy(update={"joint_residual_rad": None})
    options = control.compensator.model_copy(update=WRIST_GAINS)
    control = control.model_copy(update={"compensator": options, "health": health})
    link, control = matched(load_link(CONFIGS / "links/wrist-virtual.toml"), control, own_link=False)
    names = [f"joint-{k + 1}" for k in range(8)]
    link = same_joint(link, names)
    contestants = [Contestant(k, name, joint, control.compensator) for k, name in enumerate(names)]

    def run() -> RunReport:
        simulation = SpringySimulation(8)
        try:
            options = RunOptions(4.0, stepped=True, policy=Policy(50, False))
            return run_joints(contestants, link, control, reaching_protocol(joint, 1), options, simulation)
        finally:
            simulation.close()

    report = benchmark.pedantic(run, rounds=1)
    t = report.timing
    print()
    for name, spread in (("cycle", t.cycle), ("of it poll", t.poll), ("step of one joint", t.step)):
        words = (
            f"p50 {1e6 * spread.p50_s:.1f}, p99 {1e6 * spread.p99_s:.1f}, p99.9 {1e6 * spread.p999_s:.1f} µs"
        )
        print(f"eight joints, {name}: {words}")
    assert t.lost_frames == 0
    assert report.stop_reason == "time is over"
