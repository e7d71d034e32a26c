"""Bearing friction: the output bearing holds the joint back, the more the harder it is loaded."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, drum_radius, pretension_moment, term
from cablecomp.mechanics.layout import (
    X_COMMIT,
    X_FIRST,
    X_JOINT,
    X_JOINT_OLD,
    X_MOMENT,
    X_MOMENT_SLOPE,
    X_TENSION_H,
    X_TENSION_L,
)


@term(parameters=5, state=1)
def _hold_back(c: Any, p: Any, s: Any) -> None:
    """p: torque [N m], load coefficient, presliding [rad], R [m], R (T_h + T_l) at rest [N m]; s: z.

    The first sample counts from the angle at uniform pretension, as the profiles do: z = 0 there.
    """
    radial = p[4]
    if not math.isnan(c[X_TENSION_H]):
        radial = p[3] * c[X_TENSION_H]
        if not math.isnan(c[X_TENSION_L]):
            radial += p[3] * c[X_TENSION_L]
    limit = p[0] + p[1] * radial
    before = 0.0 if c[X_FIRST] != 0.0 else s[0]
    z = before + (c[X_JOINT] - c[X_JOINT_OLD]) / p[2]
    if z > 1.0:
        z = 1.0
    elif z < -1.0:
        z = -1.0
    else:
        c[X_MOMENT_SLOPE] += limit / p[2]
    c[X_MOMENT] += limit * z
    if c[X_COMMIT] != 0.0:
        s[0] = z


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    cables = 2.0 if config.drive.circuit == "closed" else 1.0
    terms = _hold_back(
        values["torque_Nm"],
        values["load_coefficient"],
        values["presliding_rad"],
        drum_radius(config),
        cables * pretension_moment(config),
    )
    return Change(terms=terms)


EFFECT = Effect(
    id="bearing_friction",
    statement="The output bearing holds the joint back with a nearly constant torque against its motion, "
    "more under radial load; at a reversal it gives way elastically first.",
    equation="M_cable = M - τ_b z, dz = dq_out/δ within -1 <= z <= 1, τ_b = τ_0 + κ R (T_h + T_l)",
    source="one elasto-plastic (Jenkins) element, the static limit of P. Dahl, A Solid Friction Model, "
    "1968; torque in proportion to the radial load: rolling bearing manufacturers' estimate M = mu "
    "F d/2",
    parameters=(
        Parameter(
            "torque_Nm",
            "N m",
            0.0,
            1e-4,
            0.5,
            "τ_0, friction torque without load",
            log=True,
            scale=pretension_moment,
            minimum=0.0,
        ),
        Parameter(
            "load_coefficient",
            "-",
            0.0,
            0.0,
            0.1,
            "κ, growth with the radial load times R",
            minimum=0.0,
            maximum=1.0,
        ),
        Parameter(
            "presliding_rad",
            "rad",
            0.0,
            1e-6,
            3e-3,
            "δ, turn in which the friction builds up",
            log=True,
            shape=True,
            minimum=1e-9,
        ),
    ),
    acts_through=("reversal", "velocity", "load_direction"),
    bounded=False,
    change=_change,
    rank=10,
)
