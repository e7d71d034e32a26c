"""Inertial load: the link's inertia, which the torque channel does not contain."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment, term
from cablecomp.mechanics.layout import X_COMMIT, X_DT, X_JOINT, X_MOMENT, X_MOMENT_SLOPE

SEEN, ANGLE, ANGLE_OLD, SPEED, SPEED_OLD, STEP, PULL, STATE = range(8)


@term(parameters=1, state=STATE)
def _accelerate(c: Any, p: Any, s: Any) -> None:
    """p: inertia [kg m2]; s: samples seen (up to 2), angles, speeds, last step [s], last acceleration.

    Acceleration by the two-step backward difference formula for uneven steps, implicit in the angle: the
    inertia swings on the drive's own stiffness, and noise of the inputs moves the load no more than a real
    one would.
    """
    x, h = c[X_JOINT], c[X_DT]
    if s[SEEN] == 0.0:  # nothing is known yet: at rest or in even motion
        if c[X_COMMIT] != 0.0:
            s[SEEN], s[ANGLE] = 1.0, x
        return
    if h <= 0.0:  # a second sample at the same instant: what pulled goes on pulling
        c[X_MOMENT] += p[0] * s[PULL]
        if c[X_COMMIT] != 0.0:
            s[ANGLE] = x
        return
    if s[SEEN] == 1.0:
        if c[X_COMMIT] != 0.0:
            speed = (x - s[ANGLE]) / h
            s[SEEN], s[ANGLE], s[ANGLE_OLD] = 2.0, x, s[ANGLE]
            s[SPEED], s[SPEED_OLD], s[STEP] = speed, speed, h
        return
    b0, b1, b2 = 1.0, -1.0, 0.0
    if h <= 5.0 * s[STEP]:  # after a longer gap, two-step differences would carry the old motion too far
        w = h / s[STEP]
        b0, b1, b2 = (1.0 + 2.0 * w) / (1.0 + w), -(1.0 + w), w * w / (1.0 + w)
    speed = (b0 * x + b1 * s[ANGLE] + b2 * s[ANGLE_OLD]) / h
    pull = (b0 * speed + b1 * s[SPEED] + b2 * s[SPEED_OLD]) / h
    c[X_MOMENT] += p[0] * pull
    c[X_MOMENT_SLOPE] += p[0] * (b0 / h) ** 2
    if c[X_COMMIT] != 0.0:
        s[ANGLE_OLD], s[ANGLE] = s[ANGLE], x
        s[SPEED_OLD], s[SPEED] = s[SPEED], speed
        s[STEP], s[PULL] = h, pull


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(terms=_accelerate(values["inertia_kgm2"]))


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
    bounded=False,
    change=_change,
)
