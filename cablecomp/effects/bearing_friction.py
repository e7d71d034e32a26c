"""Bearing friction: the output bearing holds the joint back, the more the harder it is loaded, by the cables or by the
joint's own load."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import (
    Change,
    Effect,
    Parameter,
    at_most,
    drum_radius,
    per_moment,
    pretension_moment,
)
from cablecomp.effects.compiled_term import term
from cablecomp.effects.shared_shapes import dragging


@term(
    parameters=("torque", "growth", "load_coefficient", "presliding", "viscous", "radius", "radial_at_rest"),
    state=("z",),
)
def _hold_back(c: Any, p: Any, s: Any) -> None:
    """p: torque [N m], growth [1/(N m)], load coefficient, presliding [rad], growth with speed [s/rad], R [m],
    R (T_h + T_l) at rest [N m].

    The first sample counts from the angle at uniform pretension, as the profiles do: z = 0 there. The joint's speed is
    the rigid drive's, where that is known beside the samples, and what the deflection adds since the last one.
    """
    radial = p.radial_at_rest
    if not math.isnan(c.tension_h):
        radial = p.radius * c.tension_h
        if not math.isnan(c.tension_l):
            radial += p.radius * c.tension_l
    limit = p.torque * (1.0 + p.growth * abs(c.load)) + p.load_coefficient * radial
    before = 0.0 if c.first else s.z
    z = before + (c.joint - c.joint_old) / p.presliding
    if z > 1.0:
        z = 1.0
    elif z < -1.0:
        z = -1.0
    else:
        c.moment_slope += limit / p.presliding
    c.moment += limit * z
    if p.viscous > 0.0 and c.dt > 0.0 and not c.first:
        speed = (c.joint - c.joint_old) / c.dt
        if not math.isnan(c.motor_rate):
            speed += c.rigid * (c.motor_rate - (c.motor - c.motor_old) / c.dt)
        c.moment += p.torque * p.viscous * speed
        c.moment_slope += p.torque * p.viscous / c.dt
    if c.commit:
        s.z = z


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    cables = 2.0 if config.drive.circuit == "closed" else 1.0
    terms = _hold_back(
        torque=values["torque_Nm"],
        growth=values["growth_per_Nm"],
        load_coefficient=values["load_coefficient"],
        presliding=values["presliding_rad"],
        viscous=values["viscous_s_per_rad"],
        radius=drum_radius(config),
        radial_at_rest=cables * pretension_moment(config),
    )
    return Change(terms=terms)


EFFECT = Effect(
    id="bearing_friction",
    statement="The output bearing holds the joint back with a nearly constant torque against its motion, "
    "more under radial load, where the joint's load tilts it, or, in grease, the quicker it turns; at a reversal it "
    "gives way elastically first.",
    equation="M_cable = M - τ_b z - τ_0 ν dq_out/dt, dz = dq_out/δ within -1 <= z <= 1, "
    "τ_b = τ_0 (1 + g |M|) + κ R (T_h + T_l)",
    source="one elasto-plastic (Jenkins) element, the static limit of P. Dahl, A Solid Friction Model, "
    "1968; torque in proportion to the radial load: rolling bearing manufacturers' estimate M = mu "
    "F d/2, of crossed rollers with the tilting moment in F; "
    "a part in proportion to speed as they state it of grease",
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
            "growth_per_Nm",
            "1/(N m)",
            0.0,
            0.3,
            40.0,
            "g, by which share of itself it grows per moment of the joint's load; 0: it does not",
            log=True,
            role="shape",
            scale=per_moment,
            omitted=0.0,
            minimum=0.0,
            of_load=True,
            of_known_drive=True,
            tries=(2.0, 20.0),
            reach=1.0,
            is_another=at_most,  # a bearing drags without load, too: what does not is another friction
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
            held=True,  # the load's own friction grows with it already
        ),
        Parameter(
            "presliding_rad",
            "rad",
            0.0,
            1e-6,
            3e-3,
            "δ, turn in which the friction builds up",
            log=True,
            role="presliding",
            minimum=1e-9,
        ),
        replace(
            dragging("joint's", "τ_0", 50.0, (0.1, 1.0, 10.0)),
            of_speed=True,
            needs="motor_torque_Nm",  # by the joint's angle alone it is a channel that comes late
        ),
    ),
    acts_through=("reversal", "velocity", "load_direction"),
    felt_by_motor=True,
    bounded=False,
    change=_change,
    rank=10,
)
