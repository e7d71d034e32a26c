"""Pretension relaxation: cable and terminations creep, the pretension falls with the logarithm or a power of time, or
comes to rest."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import LEAST_PRETENSION, Change, Effect, Parameter, begun, pretension_moment, term


@term(parameters=("fraction", "time_constant", "power", "began", "hanging"), state=("start",))
def _relax(c: Any, p: Any, s: Any) -> None:
    """p: fraction, time constant [s], power, when it began [s] (none: with the first sample), hanging moment
    R T0 [N m] (closed: 0); s: when it began."""
    start = s.start
    if c.first:
        start = c.time if math.isnan(p.began) else p.began
    slower = 1.0 + max(-p.power, 0.0)
    passed = math.log1p(max(c.time - start, 0.0) / (p.time_constant * slower))
    if p.power != 0.0:
        passed = slower * math.expm1(p.power * passed) / p.power
    factor = max(1.0 - p.fraction * passed, LEAST_PRETENSION)
    if p.hanging > 0.0:
        c.moment += p.hanging * (1.0 - factor)
    else:
        c.pretension_h *= factor
        c.pretension_l *= factor
    if c.commit:
        s.start = start


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    closed = config.drive.circuit == "closed"
    hanging = 0.0 if closed else pretension_moment(config)
    terms = _relax(
        fraction=values["fraction"],
        time_constant=values["time_constant_s"],
        power=values["power"],
        began=values["began_s"],
        hanging=hanging,
    )
    return Change(terms=terms, moves_pretension=closed)


EFFECT = Effect(
    id="pretension_relaxation",
    statement="The cable or its terminations creep, so that the pretension falls, fast at first and ever "
    "more slowly, or until it comes to rest.",
    equation="T0(t) = T0 (1 - a k (u^m - 1)/m), m = 0: T0 (1 - a ln u), u = 1 + (t - t0)/(k t_c), k = 1, of m < 0 "
    "k = 1 - m: then it comes to rest, at T0 (1 - a (1 + 1/|m|)), for m far below 0 by T0 (1 - a (1 - e^(-(t - "
    "t0)/t_c))); t0 the recording's first sample unless it is given (creep that goes on from recording to recording); "
    "in an open circuit T = T0(t) + M/R",
    source="stress relaxation of steel wire and polymers at constant length, by the logarithm or a power of time: "
    "W. N. Findley, J. S. Lai and K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976; "
    "of an order n > 1, m = -1/(n - 1), and of the first, m far below 0: F. Garofalo, Fundamentals of Creep and "
    "Creep-Rupture in Metals, 1965",
    parameters=(
        Parameter(
            "fraction",
            "-",
            0.0,
            1e-4,
            0.3,
            "a, loss per factor e of time; per t_c at first",
            log=True,
            minimum=-0.5,
            maximum=0.5,
        ),
        Parameter(
            "time_constant_s",
            "s",
            0.0,
            0.1,
            1000.0,
            "t_c, when the fall sets in",
            log=True,
            role="shape",
            minimum=1e-6,
        ),
        Parameter(
            "power",
            "-",
            0.0,
            -4.0,
            1.0,
            "m, power of time; 0: its logarithm; below 0 it comes to rest",
            role="shape",
            omitted=0.0,
            minimum=-20.0,
            maximum=1.0,
            tries=(-2.0, 0.5),
            of_known_drive=True,
        ),
        begun("began_s", tries=(0.0,)),
    ),
    acts_through=("time",),
    bounded=True,
    change=_change,
    tries=tuple(
        {"began_s": 0.0, "power": m, "time_constant_s": t}
        for m, t in ((-2.0, 5.0), (-2.0, 30.0), (-2.0, 200.0), (0.5, 3.0), (0.5, 100.0))
    ),
    flag="drifts",
    rank=15,
)
