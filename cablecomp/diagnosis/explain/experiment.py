"""The next experiment: the excitation, within the joint's limits, that sets two fitted models apart best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.control.protocol import (
    AngleSweep,
    Hold,
    NestedReversals,
    Protocol,
    Ramp,
    RatePair,
    Unload,
    Wait,
)
from cablecomp.diagnosis.locate.covariates import Covariates
from cablecomp.errors import InputError
from cablecomp.estimation.parallel import in_processes
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray

STEPS = 2500
"""Instants at which a proposed motion is simulated."""

APART = 0.5
"""Noise floors (RMS) that a protocol has to set two models apart by; less is not worth anybody's time at the bench."""


@dataclass(frozen=True)
class Experiment:
    """A protocol, why it is proposed, and by how much it sets the models apart (RMS in noise floors)."""

    protocol: Protocol
    why: str
    separation: float


class Reach(NamedTuple):
    """What a protocol may use: largest load [N m; 0: none is known], joint angles [rad], top speed of the joint
    [rad/s]."""

    load: float
    low: float
    high: float
    speed: float

    @property
    def travel(self) -> float:
        """How far the joint may go, rad."""
        return max(self.high - self.low, 0.02)

    @property
    def middle(self) -> float:
        """Joint angle in the middle of that, rad."""
        return 0.5 * (self.low + self.high)

    @property
    def rate(self) -> float:
        """Rate of the load at which nothing is quick, N m/s."""
        return self.load / 4.0

    @property
    def quick(self) -> float:
        """Least time of a motion over most of the travel, s: motion of least jerk peaks at 15/8 of its mean speed."""
        return max(15.0 / 8.0 * 0.8 * self.travel / self.speed, 0.4)


def _reach(config: JointConfig, seen: Covariates) -> Reach:
    """The configuration's limits; where it states none, those of the recordings."""
    load = float(np.max(np.abs(seen.values["load"])))
    if config.limits.joint_torque_max_Nm is not None:
        load = config.limits.joint_torque_max_Nm
    angle = seen.values.get("joint_angle", seen.values["motor_angle"])
    low, high = float(np.min(angle)), float(np.max(angle))
    if config.limits.joint_position_min_rad is not None:
        low = config.limits.joint_position_min_rad
    if config.limits.joint_position_max_rad is not None:
        high = config.limits.joint_position_max_rad
    return Reach(load, low, high, _top_speed(config, seen))


def candidates(config: JointConfig, seen: Covariates) -> list[Protocol]:
    """Protocols inside the configuration's limits; where it states none, inside those of the recordings.

    A joint whose load is neither recorded nor limited is only moved.
    """
    reach = _reach(config, seen)
    moved = _moved(reach)
    return [*_loaded(reach), *moved] if reach.load > 0.0 else moved


def _moved(reach: Reach) -> list[Protocol]:
    """What a motor does by itself, whatever load is there."""
    travel, middle = reach.travel, reach.middle
    start = {"start_position_rad": middle}
    swings = (0.4, -0.4, 0.28, -0.2, 0.16, -0.08, 0.4, 0.0, 0.4, 0.2, 0.4)  # one way again and again, too
    return [
        Protocol(name="nested reversals of the joint", segment=(
            NestedReversals(
                channel="position", peaks=tuple(middle + share * travel for share in swings * 2),
                rate=min(travel / 3.0, 0.5 * reach.speed),
            ),
        ), **start),
        Protocol(name="quick and slow motion, load at rest", segment=tuple(
            Ramp(duration_s=share * reach.quick, position_rad=middle + side * 0.4 * travel)
            for share in (4.0, 1.0, 2.0, 1.4) * 4 for side in (1.0, -1.0)
        ), **start),
    ]  # fmt: skip


def _loaded(reach: Reach) -> list[Protocol]:
    """What needs a known load at the joint."""
    load, low, high, _ = reach
    travel, rate = reach.travel, reach.rate
    start = {"start_position_rad": reach.middle}
    # every swing comes several times: what is judged on held-out blocks must stand in many of them
    swings = (load, -load, 0.7 * load, -0.5 * load, 0.4 * load, -0.2 * load)
    nested = NestedReversals(peaks=(*swings * 3, load), rate=rate)
    step = (
        Ramp(duration_s=0.5, load_Nm=load),
        Hold(duration_s=12.0),
        Ramp(duration_s=0.5, load_Nm=0.0),
        Hold(duration_s=12.0),
        Ramp(duration_s=8.0, load_Nm=-load),
        Hold(duration_s=8.0),
    )
    sweeps = _sweeps(reach)
    return [
        Protocol(name="ramp and hold", segment=(*step, *step, Unload(rate_Nm_s=rate)), **start),
        Protocol(name="rate pair", segment=(
            *(RatePair(amplitude=load, rates=(load / 8.0, load * 2.0), dwell_s=2.0) for _ in range(2)),
        ), **start),
        Protocol(name="nested reversals", segment=(nested,), **start),
        Protocol(name="nested reversals at two places", segment=(
            nested, Ramp(duration_s=4.0, position_rad=low + 0.1 * travel),
            nested, Ramp(duration_s=4.0, position_rad=high - 0.1 * travel), nested,
        ), **start),
        Protocol(name="angle sweeps under three loads", segment=(*sweeps, *sweeps), **start),
        Protocol(name="small and large swings through zero", segment=(
            NestedReversals(
                peaks=(0.05 * load, -0.05 * load, 0.1 * load, -0.1 * load, load, -load) * 3,
                rate=rate, dwell_s=1.0,
            ),
        ), **start),
        Protocol(name="wait for the temperature", segment=(
            Ramp(duration_s=4.0, load_Nm=0.8 * load), Wait(duration_s=30.0, why="let the temperature change"),
            NestedReversals(peaks=(load, -load) * 3, rate=rate),
        ), **start),
    ]  # fmt: skip


def _sweeps(reach: Reach) -> tuple[AngleSweep, ...]:
    """Motions to and fro over most of the travel, under no load and most of either sign."""
    return tuple(
        AngleSweep(
            from_rad=reach.low + 0.05 * reach.travel,
            to_rad=reach.high - 0.05 * reach.travel,
            speed_rad_s=reach.travel / 3.0,
            load_Nm=share * reach.load,
            load_rate_Nm_s=reach.rate,
            cycles=2,
        )
        for share in (0.0, 0.8, -0.8)
    )


def _top_speed(config: JointConfig, seen: Covariates) -> float:
    """Joint speed, rad/s, that a protocol may reach: most of the motor's limit, or what was seen."""
    limit = config.limits.motor_velocity_max_rad_s
    if limit is None:
        return max(float(np.max(np.abs(seen.values["velocity"]))), 1e-3)
    return 0.8 * limit * config.drive.ratio


def best_experiment(
    models: Sequence[JointConfig], seen: Covariates, floor_rad: float, temperature_degC: float
) -> Experiment | None:
    """Simulate all fitted models over the candidates; what sets the closest two farthest apart wins.

    What a constant, a drift in load and in position could explain of a difference is not counted. None if no
    protocol can be followed.
    """
    found: list[Experiment] = []
    protocols = candidates(models[0], seen)
    made = in_processes(lambda p: _readings(models, p, temperature_degC), protocols)
    for protocol, readings in zip(protocols, made, strict=True):
        if readings is None:
            continue
        worst = (
            min(_apart(readings[i], readings[j], readings[-1]) for i in range(len(models)) for j in range(i))
            / floor_rad
        )
        why = (
            f"`{protocol.name}` sets the candidate models apart by {worst:.1f} noise floors (RMS), "
            "more than any other tried"
        )
        found.append(Experiment(protocol, why, worst))
    return max(found, key=lambda e: e.separation, default=None)


def _readings(
    models: Sequence[JointConfig], protocol: Protocol, temperature: float
) -> list[FloatArray] | None:
    time = np.linspace(0.0, protocol.duration_s, STEPS)
    references = [protocol.reference(float(t)) for t in time]
    ratio = models[0].drive.ratio
    columns = {
        "time_s": time,
        "motor_position_rad": np.array([r.joint_position_rad for r in references]) / ratio,
        "joint_torque_Nm": np.array([r.joint_torque_Nm for r in references]),
        "temperature_degC": temperature + 3.0 * time / max(float(time[-1]), 1.0),
    }
    columns["motor_torque_Nm"] = -ratio * columns["joint_torque_Nm"]
    found = []
    for model in models:
        own = columns | {name: np.zeros(STEPS) for name in Observer(model).channels}
        try:
            found.append(Observer(model).run(own)["joint_position_rad"])
        except InputError:
            return None
    return [*found, columns["joint_torque_Nm"]]


def _apart(a: FloatArray, b: FloatArray, load: FloatArray) -> float:
    basis = np.column_stack((np.ones_like(load), load))
    difference = a - b
    coefficients, *_ = np.linalg.lstsq(basis, difference, rcond=None)
    return float(np.sqrt(np.mean((difference - basis @ coefficients) ** 2)))
