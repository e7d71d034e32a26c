"""Pretension relaxation: cable and terminations creep, the pretension falls with the logarithm or a power of time, or
comes to rest, or goes on evenly; quicker where it is warm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from cablecomp.config import JointConfig
from cablecomp.effects.base import LEAST_PRETENSION, Change, Effect, Parameter, pretension_moment
from cablecomp.effects.compiled_term import term
from cablecomp.effects.shared_shapes import begun

ROOM_DEGC: Final = 20.0
"""Temperature at which the time constants hold."""
MOST_QUICKER: Final = 30.0
"""Most powers of e by which a temperature quickens it, or slows it down."""


@term(
    parameters=("fraction", "time_constant", "power", "steady", "quickening", "began", "hanging"),
    state=("start", "time", "rate", "aged"),
)
def _relax(c: Any, p: Any, s: Any) -> None:
    """p: fraction, time constant [s], power, even part, quickening [1/K], when it began [s] (none: with the first
    sample), hanging moment R T0 [N m] (closed: 0); s: when it began, time [s] and rate of the sample before, time that
    the material has gone through [s].

    Without a temperature it goes as at room temperature.
    """
    rate = 1.0
    if p.quickening != 0.0 and not math.isnan(c.temperature):
        quicker = p.quickening * (c.temperature - ROOM_DEGC)
        rate = math.exp(min(max(quicker, -MOST_QUICKER), MOST_QUICKER))
    start, aged = s.start, s.aged
    if c.first:
        start = c.time if math.isnan(p.began) else p.began
        aged = rate * max(c.time - start, 0.0)
    else:
        aged += 0.5 * (s.rate + rate) * max(c.time - max(s.time, start), 0.0)
    slower = 1.0 + max(-p.power, 0.0)
    passed = math.log1p(aged / (p.time_constant * slower))
    if p.power != 0.0:
        passed = slower * math.expm1(p.power * passed) / p.power
    passed += p.steady * aged / p.time_constant
    factor = max(1.0 - p.fraction * passed, LEAST_PRETENSION)
    if p.hanging > 0.0:
        c.moment += p.hanging * (1.0 - factor)
    else:
        c.pretension_h *= factor
        c.pretension_l *= factor
    if c.commit:
        s.start, s.time, s.rate, s.aged = start, c.time, rate, aged


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    closed = config.drive.circuit == "closed"
    hanging = 0.0 if closed else pretension_moment(config)
    terms = _relax(
        fraction=values["fraction"],
        time_constant=values["time_constant_s"],
        power=values["power"],
        steady=values["steady"],
        quickening=values["quickening_per_K"],
        began=values["began_s"],
        hanging=hanging,
    )
    return Change(terms=terms, moves_pretension=closed)


EFFECT = Effect(
    id="pretension_relaxation",
    statement="The cable or its terminations creep, so that the pretension falls, fast at first and ever "
    "more slowly, or until it comes to rest or goes on evenly; quicker where it is warm.",
    equation="T0(t) = T0 (1 - a (k (u^m - 1)/m + w s/t_c)), m = 0: T0 (1 - a (ln u + w s/t_c)), u = 1 + s/(k t_c), "
    "k = 1, of m < 0 k = 1 - m: then its first stage comes to rest, at T0 (1 - a (1 + 1/|m|)), for m far below 0 by "
    "T0 (1 - a (1 - e^(-s/t_c))); s the time that the material goes through since t0, ds/dt = e^(q (ϑ - 20 degC)); t0 "
    "the recording's first sample unless it is given (creep that goes on from recording to recording); in an open "
    "circuit T = T0(t) + M/R",
    source="stress relaxation of steel wire and polymers at constant length, by the logarithm or a power of time: "
    "W. N. Findley, J. S. Lai and K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976; "
    "of an order n > 1, m = -1/(n - 1), and of the first, m far below 0, and beside an even second stage: F. Garofalo, "
    "Fundamentals of Creep and Creep-Rupture in Metals, 1965; a material's own time by temperature: F. Schwarzl and A. "
    "J. Staverman, J. Appl. Phys. 23 (1952)",
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
        Parameter(
            "steady",
            "-",
            0.0,
            0.0,
            1.0,
            "w, rate of its even second stage over that of the first at its begin",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=10.0,
            tries=(0.05, 0.3),
            of_known_drive=True,
        ),
        Parameter(
            "quickening_per_K",
            "1/K",
            0.0,
            -0.3,
            0.3,
            "q, logarithm by which a kelvin quickens it (0.07: doubled by 10 K); 0: temperature changes nothing",
            role="shape",
            omitted=0.0,
            minimum=-2.0,
            maximum=2.0,
            tries=(0.07, 0.2),
            of_known_drive=True,
            needs="temperature_degC",
        ),
        begun("began_s", tries=(0.0,)),
    ),
    acts_through=("time",),
    bounded=True,
    change=_change,
    tries=tuple(
        {"began_s": 0.0, "power": m, "time_constant_s": t}
        for m, t in ((-2.0, 5.0), (-2.0, 30.0), (-2.0, 200.0), (0.5, 3.0), (0.5, 100.0))
    )
    + tuple({"began_s": 0.0, "power": -10.0, "time_constant_s": t, "steady": 0.2} for t in (3.0, 15.0)),
    flag="drifts",
    rank=15,
)
