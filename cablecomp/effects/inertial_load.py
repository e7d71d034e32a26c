"""Inertial load: the link's inertia, which the torque channel does not contain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, pretension_moment
from cablecomp.effects.compiled_term import term

GAP = 5.0
"""Steps of the last one's length beyond which the motion in between is not known."""
WHOLE: Final = 0.9
"""Share that swings after the joint beyond which hardly any of it is on the joint itself."""
SLOW_RAD_S: Final = 2.0
"""What follows more slowly follows no joint that is moved once in three seconds (trials seeds 685 to 801, 17 names of
which nine tenths swung: the six faster ones, from 3.1 rad/s on, were right, of the eleven slower ones, up to 1.5 rad/s,
eight were wrong)."""


@term(
    parameters=("inertia", "cosine", "sine", "swings", "pulsation", "damping"),
    state=("seen", "angle", "angle_old", "speed", "speed_old", "step", "pull", "apart", "parts", "hurries"),
)
def _accelerate(c: Any, p: Any, s: Any) -> None:
    """p: inertia [kg m2], shares of it that go with cosine and sine of the angle, share that swings after the joint,
    how fast by itself [rad/s], with what share of critical damping; s: samples seen (up to 2), angles, speeds, last
    step [s], last moment over the inertia, how far what swings is from the joint [rad], its first two derivatives.

    Acceleration by the two-step backward difference formula for uneven steps, implicit in the angle: the
    inertia swings on the drive's own stiffness, and noise of the inputs moves the load no more than a real
    one would. Over a gap the mean speed is not that of its end: there by even acceleration from the last speed. What
    swings, r = x - q, r'' + 2 z w r' + w^2 r = -q'', goes by the trapezoidal rule.
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
            s.apart = s.parts = s.hurries = 0.0
        return
    if h <= GAP * s.step:
        w = h / s.step
        b0, b1, b2 = (1.0 + 2.0 * w) / (1.0 + w), -(1.0 + w), w * w / (1.0 + w)
        speed_by_angle = b0 / h
        rate_by_angle = speed_by_angle**2
        speed = (b0 * x + b1 * s.angle + b2 * s.angle_old) / h
        rate = (b0 * speed + b1 * s.speed + b2 * s.speed_old) / h
    else:
        speed_by_angle, rate_by_angle = 2.0 / h, 2.0 / h**2
        rate = rate_by_angle * (x - s.angle - s.speed * h)
        speed = s.speed + rate * h
    share, by_angle, curve = 1.0, 0.0, 0.0
    if p.cosine != 0.0 or p.sine != 0.0:
        cosine, sine = math.cos(x), math.sin(x)
        curve = -p.cosine * cosine - p.sine * sine
        share, by_angle = 1.0 - curve, p.sine * cosine - p.cosine * sine
    pull = share * rate + 0.5 * by_angle * speed**2
    slope = share * rate_by_angle + by_angle * (rate + speed * speed_by_angle) + 0.5 * curve * speed**2
    apart, parts, hurries = 0.0, 0.0, 0.0
    if p.swings != 0.0:
        stiff, drag = p.pulsation**2, 2.0 * p.damping * p.pulsation
        parts = s.parts + 0.5 * h * s.hurries
        apart = s.apart + h * s.parts + 0.25 * h**2 * s.hurries
        yields = 1.0 + 0.5 * h * drag + 0.25 * h**2 * stiff
        hurries = -(rate + drag * parts + stiff * apart) / yields
        parts += 0.5 * h * hurries
        apart += 0.25 * h**2 * hurries
        pull += p.swings * (rate + hurries - pull)
        slope += p.swings * (rate_by_angle * (1.0 - 1.0 / yields) - slope)
    c.moment += p.inertia * pull
    c.moment_slope += p.inertia * slope
    if c.commit:
        s.apart, s.parts, s.hurries = apart, parts, hurries
        s.angle_old, s.angle = s.angle, x
        s.speed_old, s.speed = s.speed, speed
        s.step, s.pull = h, pull


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    folds = {"cosine": values["by_cosine"], "sine": values["by_sine"]}
    swings = {
        "swings": values["swings"],
        "pulsation": values["swings_rad_s"],
        "damping": values["damping_ratio"],
    }
    return Change(terms=_accelerate(inertia=values["inertia_kgm2"], **folds, **swings))


def _swings_away(values: Mapping[str, float], _on_high: bool) -> bool:
    """What swings as a whole, and after nothing that a joint does in less than seconds, leaves the joint its drag and
    its spring: no inertia."""
    follows = values["swings_rad_s"] * max(1.0, 2.0 * values["damping_ratio"])
    return values["swings"] > WHOLE and follows < SLOW_RAD_S


def _folds(name: str, text: str) -> Parameter:
    return Parameter(
        name,
        "-",
        0.0,
        -0.7,
        0.7,
        text,
        role="shape",
        omitted=0.0,
        minimum=-0.7,
        maximum=0.7,
        of_known_drive=True,
    )


_SWINGS = (
    {"swings": 1.0, "swings_rad_s": 38.0, "damping_ratio": 0.35},
    {"swings": 1.0, "swings_rad_s": 20.0, "damping_ratio": 0.3},
    {"swings": 0.4, "swings_rad_s": 8.0, "damping_ratio": 0.3},
    {"swings": 0.4, "swings_rad_s": 4.0, "damping_ratio": 0.3},
    {"swings": 0.4, "swings_rad_s": 2.0, "damping_ratio": 0.3},
)
_WAYS = ((0.4, 0.0), (0.3, 0.3), (0.0, 0.4), (-0.3, 0.3), (-0.4, 0.0), (-0.3, -0.3), (0.0, -0.4), (0.3, -0.3))

EFFECT = Effect(
    id="inertial_load",
    statement="The link's inertia pulls at the cables whenever the joint speeds up or slows down; the "
    "torque channel does not show it. Of an arm that folds as the joint turns it changes with the angle; of a flexible "
    "link, a hanging tool or a liquid some of it swings after the joint.",
    equation="M_cable = M - (1 - n) (J(q) d²q/dt² + J'(q) (dq/dt)²/2) - n J d²x/dt², q = q_out, "
    "J(q) = J (1 + c cos q + s sin q), d²x/dt² = w² (q - x) + 2 z w (dq/dt - dx/dt)",
    source="Newton; one mode of what is flexible, as of a link with its tip's mass, or of a liquid (H. N. Abramson, "
    "The Dynamic Behavior of Liquids in Moving Containers, NASA SP-106, 1966); two-step backward differences: E. "
    "Hairer and G. Wanner, Solving Ordinary Differential Equations II, 1996",
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
        _folds("by_cosine", "c, of an arm that is stretched out at q = 0"),
        _folds("by_sine", "s, of one that is stretched out a quarter turn on"),
        Parameter(
            "swings",
            "-",
            0.0,
            0.0,
            1.0,
            "n, share of it that swings after the joint: 1 at the end of a flexible link",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=1.0,
            is_another=_swings_away,
            another_is_unlisted=True,
            of_known_drive=True,
        ),
        Parameter(
            "swings_rad_s",
            "rad/s",
            10.0,
            0.5,
            80.0,
            "w, how fast that swings by itself, held at the joint",
            log=True,
            role="shape",
            omitted=10.0,
            minimum=1e-3,
            reach=3.0,
            of_known_drive=True,
        ),
        Parameter(
            "damping_ratio",
            "-",
            0.3,
            0.02,
            2.0,
            "z, its damping over the critical one",
            log=True,
            role="shape",
            omitted=0.3,
            minimum=0.0,
            reach=3.0,
            of_known_drive=True,
        ),
    ),
    acts_through=("acceleration",),
    rates=True,
    felt_by_motor=True,
    bounded=False,
    change=_change,
    tries=(*({"by_cosine": c, "by_sine": s} for c, s in _WAYS), *_SWINGS),
)
