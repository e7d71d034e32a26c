"""Clamp slip: a termination or clamp of one cable gives way, or a drum slips on its shaft, at once or for a while."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, drum_radius, term, wrap_deflection
from cablecomp.effects.course import COURSE, DURATION, STEPS, course, gone


@term(parameters=("slip", "instant", "duration", "steps", "taken_up"))
def _slip(c: Any, p: Any, s: Any) -> None:
    """p: length let go [m] (below 0: by cable l), instant [s], how long it takes [s], in how many
    steps, share that the other takes up."""
    since = c.time - p.instant
    if since >= 0.0:
        done = gone(since, p.duration, p.steps)
        if p.slip > 0.0:
            c.length_h -= p.slip * done
            c.length_l += p.slip * done * p.taken_up
        else:
            c.length_l += p.slip * done
            c.length_h -= p.slip * done * p.taken_up


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    slip = _slip(slip=values["slip_m"], taken_up=values["taken_up"], **course(values))
    return Change(terms=slip)


def _loop_arc(config: JointConfig) -> float:
    """Arc on the output drum that its unit of deflection makes [m]."""
    return drum_radius(config) * wrap_deflection(config)


EFFECT = Effect(
    id="clamp_slip",
    statement="A clamp or termination slipped, at once, in steps or little by little (of cable h where the length is "
    "positive, of l where it is negative): the joint stands off from then on, and the pretension is lower; "
    "or it is kept, where a drum, the link or its encoder slipped on the shaft (taken_up near 1).",
    equation="length of cable h + g s, of cable l - g k s, s > 0; of cable l + g |s|, of cable h - g k |s|, s < 0; "
    f"{COURSE}; k = taken_up",
    source="kinematics; in a closed circuit the joint moves by about s (1 + k)/(2R), and both tensions fall as 1 - k",
    parameters=(
        Parameter(
            "slip_m",
            "m",
            0.0,
            -1.0,
            1.0,
            "s, length let go: by cable h, below 0 by cable l",
            scale=_loop_arc,
            minimum=-0.1,
            maximum=0.1,
        ),
        Parameter("time_s", "s", 0.0, 0.0, 3600.0, "t*, on the recording's clock", role="instant"),
        DURATION,
        STEPS,
        Parameter(
            "taken_up",
            "-",
            0.0,
            0.0,
            1.0,
            "k, share of it that the other cable is shorter by: 0 where one cable slips, 1 where a drum does",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=1.0,
            tries=(1.0,),
        ),
    ),
    acts_through=("time",),
    bounded=True,
    change=_change,
    steps=True,
    flag="slips",
)
