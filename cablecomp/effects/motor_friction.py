"""Motor friction: what turns before the cable takes torque that the cable never sees."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, input_moment
from cablecomp.effects.compiled_term import term
from cablecomp.effects.shared_shapes import dragging


@term(parameters=("torque", "presliding", "viscous", "at_joint"), state=("z",))
def _take(c: Any, p: Any, s: Any) -> None:
    """p: torque [N m], presliding [rad], growth with speed [s/rad], by how much more the joint would hold back where
    the load is read at the motor, else 0; s: z, the elasto-plastic direction of the motor's motion.

    The speed is what is known beside the samples, else that since the last one."""
    z = 0.0 if c.first else s.z
    z = min(max(z + (c.motor - c.motor_old) / p.presliding, -1.0), 1.0)
    drag = z
    if p.viscous > 0.0:
        speed = c.motor_rate
        if math.isnan(speed):
            speed = (c.motor - c.motor_old) / c.dt if c.dt > 0.0 and not c.first else 0.0
        drag += p.viscous * speed
    c.motor_moment += p.torque * drag
    c.moment -= p.at_joint * p.torque * drag
    if c.commit:
        s.z = z


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    read_there = config.observer.load == "motor_torque"
    terms = _take(
        torque=values["torque_Nm"],
        presliding=values["presliding_rad"],
        viscous=values["viscous_s_per_rad"],
        at_joint=1.0 / config.drive.ratio if read_there else 0.0,
    )
    return Change(terms=terms)


EFFECT = Effect(
    id="motor_friction",
    statement="Between the motor's torque sensor and the cable, friction holds back with a nearly constant torque, "
    "or, in grease, the more the quicker it turns; the motor feels it, the joint does not; a load that is read at the "
    "motor is off by it.",
    equation="τ_motor = -r (T_h - T_l) + τ_m (z + ν dq_in/dt), dz = dq_in/δ within -1 <= z <= 1; load read at the "
    "motor: M = (τ_m (z + ν dq_in/dt) - τ_motor) R/r",
    source="one elasto-plastic (Jenkins) element, the static limit of P. Dahl, A Solid Friction Model, 1968; a part "
    "in proportion to speed as makers of gears and bearings state it",
    parameters=(
        Parameter(
            "torque_Nm",
            "N m",
            0.0,
            1e-4,
            1.0,
            "τ_m, friction torque",
            log=True,
            scale=input_moment,
            minimum=0.0,
        ),
        Parameter(
            "presliding_rad",
            "rad",
            0.0,
            1e-4,
            0.05,
            "δ, turn in which the friction builds up",
            log=True,
            role="presliding",
            minimum=1e-9,
        ),
        replace(
            dragging("motor's", "τ_m", 5.0, (0.05, 0.5)),
            of_known_drive=True,
            of_motor_load=True,  # in a torque beside the load, what drags anywhere would be the motor's
        ),
    ),
    acts_through=("velocity", "reversal"),
    needs=("motor_torque_Nm",),
    bounded=True,
    unbounded_with=(
        "motor_torque",
    ),  # the load then goes by which way the motor slid before the first sample
    change=_change,
)
