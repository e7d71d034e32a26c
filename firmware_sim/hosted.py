"""Simulated joints for a host program in the same process, in step with its commands."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from firmware_sim.build import FD_PROTOCOLS, BenchConfig, make_bench
from firmware_sim.faults import Fault
from firmware_sim.joint import Asked
from firmware_sim.plant import NORMAL, LinkSpec, MotorSpec, Plant, PlantConfig, PlantReadings, Resolution
from firmware_sim.plantlike import Readings, readings_of
from firmware_sim.ports import open_port
from firmware_sim.wire.frame import Frame

OFF_NOMINAL = ("EA_N", "pretension_N", "mu_output", "mu_input")


class Truth(NamedTuple):
    """What no sensor sees: joint angle at the encoder's place (rad), external moment (Nm), free-span tensions
    (N)."""

    joint_position_rad: float
    joint_torque_Nm: float
    tension_h_N: float
    tension_l_N: float


@dataclass(frozen=True)
class HostedSpec:
    """What is simulated: `joint` is a joint configuration (parsed TOML), `bus` as for `python -m firmware_sim
    --bus`.

    `off_nominal_seed`: draw the true cable parameters within the configuration's [tolerance]; None = as
    configured. All joints are alike in parameters, each has noise of its own.
    """

    joint: Mapping[str, Any]
    bus: str
    bench: BenchConfig = field(default_factory=BenchConfig)
    motor: MotorSpec | None = None
    link: LinkSpec | None = None
    seed: int = 0
    off_nominal_seed: int | None = None
    resolution: Resolution = NORMAL
    travel_rad: float = 3.2
    faults: Sequence[Fault] = ()


class LoadedPlant:
    """A plant on whose link an external torque acts, set from outside."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.load_Nm = 0.0
        self.last: PlantReadings | None = None

    def step(self, dt_s: float, motor_torque_command_Nm: float, /) -> Readings:
        """One step under the present load."""
        self.last = self.plant.step(dt_s, motor_torque_command_Nm, self.load_Nm)
        return readings_of(self.last)


class HostedJoints:
    """Joints 1…n behind a port; call `advance` after each cycle's commands."""

    def __init__(self, spec: HostedSpec) -> None:
        config = PlantConfig.from_dict(spec.joint, str(spec.joint.get("name", "joint")))
        if spec.off_nominal_seed is not None:
            config = off_nominal(config, spec.joint.get("tolerance", {}), spec.off_nominal_seed)
        self.plants: dict[int, LoadedPlant] = {}

        def make(number: int) -> LoadedPlant:
            plant = Plant(
                config,
                spec.motor,
                spec.link,
                seed=1000 * spec.seed + number,
                resolution=spec.resolution,
                travel_rad=spec.travel_rad,
            )
            self.plants[number] = LoadedPlant(plant)
            return self.plants[number]

        port = open_port(spec.bus, fd=spec.bench.protocol in FD_PROTOCOLS)
        self.bench = make_bench(spec.bench, make, port, spec.faults)
        self._periods = 0

    @property
    def terminal(self) -> str | None:
        """The pseudo-terminal of a serial or slcan port; None on other buses."""
        path = self.bench.port.describe().get("terminal")
        return None if path is None else str(path)

    def set_load(self, number: int, torque_Nm: float) -> None:
        """External torque on the link of joint `number`, along +q_out, from now on."""
        self.plants[number].load_Nm = torque_Nm

    def set_wall(self, number: int, position_rad: float | None) -> None:
        """Put a wall at a joint angle, or take it away (None)."""
        self.plants[number].plant.set_wall(position_rad)

    def advance(self, periods: int = 1) -> None:
        """Stepped time: each joint steps one sample period for its command; one that heard none (lost
        on the way, or none was sent) goes on all the same. `periods` more than 1: the host left out
        ticks, time went on.
        """
        late: dict[int, list[Asked]] = {}
        self.bench.pump(late)
        self._periods += periods
        for joint in self.bench.joints:
            due = self._periods * joint.timing.sample_s
            frames: list[Frame] = []
            if joint.time_s < due - 0.5 * joint.timing.sample_s:
                frames = joint.advance_to(due)
            frames += joint.render(late.get(joint.number, ()))
            if frames:
                self.bench.port.send(frames, due)

    def truth(self, number: int) -> Truth:
        """What joint `number` really does, at the end of its last step."""
        last = self.plants[number].last
        if last is None:
            return Truth(math.nan, math.nan, math.nan, math.nan)
        t = last.truth
        return Truth(t.pulley_position_rad, t.joint_torque_Nm, t.tension_h_N, t.tension_l_N)

    def close(self) -> None:
        """Close the port."""
        self.bench.close()


def off_nominal(config: PlantConfig, tolerance: Mapping[str, float], seed: int) -> PlantConfig:
    """A joint whose cable parameters lie off their nominal values by log-normal draws of the stated
    tolerance."""
    rng = np.random.default_rng(seed)
    factors = {key: math.exp(float(tolerance.get(key, 0.0)) * rng.standard_normal()) for key in OFF_NOMINAL}
    stages = tuple(
        replace(s, **{key: getattr(s, key) * factors[key] for key in OFF_NOMINAL}) for s in config.stages
    )
    return replace(config, stages=stages)
