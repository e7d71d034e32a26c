"""Inertial load: the link's inertia, which the torque channel does not contain."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment, term


@term(parameters=("inertia",), state=("seen", "angle", "angle_old", "speed", "speed_old", "step", "pull"))
def _accelerate(c: Any, p: Any, s: Any) -> None:
    """p: inertia [kg m2]; s: samples seen (up to 2), angles, speeds, last step [s], last acceleration.

    Acceleration by the two-step backward difference formula for uneven steps, implicit in the angle: the
    inertia swings on the drive's own stiffness, and noise of the inputs moves the load no more than a real
    one would.
    """
    x, h = c.joint, c.dt
    if s.seen == 0.0:  # nothing is known yet: at rest or in even motion
        if c.commit:
            s.seen, s.angle = 1.0, x
        return
    if h <= 0.0:  # a second sample at the same instant: what pulled goes on pulling
        c.moment += p.inertia * s.pull
        if c.commit:
            s.angle = x
        return
    if s.seen == 1.0:
        if c.commit:
            speed = (x - s.angle) / h
            s.seen, s.angle, s.angle_old = 2.0, x, s.angle
            s.speed, s.speed_old, s.step = speed, speed, h
        return
    b0, b1, b2 = 1.0, -1.0, 0.0
    if h <= 5.0 * s.step:  # after a longer gap, two-step differences would carry the old motion too far
        w = h / s.step
        b0, b1, b2 = (1.0 + 2.0 * w) / (1.0 + w), -(1.0 + w), w * w / (1.0 + w)
    speed = (b0 * x + b1 * s.angle + b2 * s.angle_old) / h
    pull = (b0 * speed + b1 * s.speed + b2 * s.speed_old) / h
    c.moment += p.inertia * pull
    c.moment_slope += p.inertia * (b0 / h) ** 2
    if c.commit:
        s.angle_old, s.angle = s.angle, x
        s.speed_old, s.speed = s.speed, speed
        s.step, s.pull = h, pull


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(terms=_accelerate(inertia=values["inertia_kgm2"]))


EFFECT = Effect(
    id="inertial_load",
    statement="The link's inertia pulls at the cables whenever the joint speeds up or slows down; the "
    "torque channel does not show it.",
    equation="M_cable = M - J d²q_out/dt²",
    source="Newton; two-step backward differences: E. Hairer and G. Wanner, Solving Ordinary Differential "
    "Equations II, 1996",
    parameters=(
        Parameter(
            "inertia_kgm2",
            "kg m2",
            0.0,
            1e-6,
            0.3,
            "J; the range is in units of R T0 per rad/s2",
            log=True,
            scale=pretension_moment,
            minimum=0.0,
        ),
    ),
    acts_through=("acceleration",),
    rates=True,
    felt_by_motor=True,
    bounded=False,
    change=_change,
)
