"""Giving an effect the size asked for: its parameter is found by simulating with and without it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from firmware_sim.plant import COARSE, EffectSpec, PlantError, PlantRun, Resolution, simulate
from firmware_sim.plant.records import Floats
from firmware_sim.trials.measures import apparent_angle, contribution
from firmware_sim.trials.suspects import Scene, Shape

SMALLEST, LARGEST = 0.02, 0.60  # of the plain loop
_TRIES = 7
_CLOSE = 0.10


@dataclass(frozen=True)
class Sized:
    """An effect with its size: contribution to the joint angle (RMS) over the width of the plain loop."""

    spec: EffectSpec
    size: float


def run_course(scene: Scene, effects: Sequence[EffectSpec] = (), resolution: Resolution = COARSE) -> PlantRun:
    """The scene's course on its true joint."""
    c = scene.course
    return simulate(
        scene.joint.true,
        c.time_s,
        c.motor_rad,
        c.load_Nm,
        effects=effects,
        temperature_degC=c.temperature_degC,
        other_1=c.other,
        resolution=resolution,
        history=c.history,
    )


def give_size(
    scene: Scene,
    identifier: str,
    shape: Shape,
    wanted: float,
    plain: PlantRun,
    within: tuple[float, float] = (SMALLEST, LARGEST),
    motor_torque: bool = False,
) -> Sized | None:
    """Find the effect whose contribution is `wanted` of the loop, or as near as it gets within its limits.

    `plain` is the plain drive's run. False position in logarithms, at most a few simulations.
    None if nothing whose size lies `within` the smallest and the largest that count was found.
    """
    low: tuple[float, float] | None = None
    high: tuple[float, float] | None = None
    found: list[tuple[float, Sized]] = []
    without = (
        apparent_angle(plain, scene.plain.compliance, motor_torque)
        if shape.absent
        else _angle(scene, identifier, shape, 0.0, motor_torque)
    )
    if without is None:
        return None
    x, ceiling = min(shape.first * wanted, shape.largest), shape.largest
    for _ in range(_TRIES):
        angle = _angle(scene, identifier, shape, x, motor_torque)
        if angle is None:  # more than the joint can carry
            ceiling = x
            x = 0.5 * x if low is None else math.sqrt(low[0] * x)
            continue
        size = contribution(angle, without) / scene.plain.loop_rad
        off = abs(math.log(max(size, 1e-9) / wanted))
        found.append((off, Sized(EffectSpec(identifier, shape.parameters(x)), size)))
        if off < _CLOSE:
            break
        if size < wanted:
            low = (x, size)
        else:
            high = (x, size)
        if size < wanted and x >= 0.999 * ceiling:
            break
        x = min(_next(low, high, wanted), ceiling)
    nearest_first = [sized for _, sized in sorted(found, key=lambda pair: pair[0])]
    fit = [sized for sized in nearest_first if within[0] <= sized.size <= within[1]]
    return fit[0] if fit else None


def _angle(scene: Scene, identifier: str, shape: Shape, x: float, motor_torque: bool) -> Floats | None:
    try:
        run = run_course(scene, (EffectSpec(identifier, shape.parameters(x)),))
        return apparent_angle(run, scene.plain.compliance, motor_torque)
    except PlantError:
        return None


def _next(low: tuple[float, float] | None, high: tuple[float, float] | None, wanted: float) -> float:
    """Where to look next: along the secant between the brackets, or in proportion, by a factor of 20 at
    most."""
    if low is None or high is None:
        known = low or high
        assert known is not None
        x, size = known
        return x * min(max(wanted / max(size, 1e-12), 0.05), 20.0)
    (x0, s0), (x1, s1) = low, high
    if s0 <= 0.0 or s1 <= s0 or x1 <= x0:
        return math.sqrt(x0 * x1)
    share = math.log(wanted / s0) / math.log(s1 / s0)
    return x0 * math.exp(min(max(share, 0.05), 0.95) * math.log(x1 / x0))
