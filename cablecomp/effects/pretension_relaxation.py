"""Pretension relaxation: cable and terminations creep, the pretension falls with the logarithm of time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import LEAST_PRETENSION, Change, Effect, Parameter, pretension_moment, term


@term(parameters=("fraction", "time_constant", "began", "hanging"), state=("start",))
def _relax(c: Any, p: Any, s: Any) -> None:
    """p: fraction, time constant [s], when it began [s] (none: with the first sample), hanging moment R T0 [N m]
    (closed: 0); s: when it began."""
    start = s.start
    if c.first:
        start = c.time if math.isnan(p.began) else p.began
    factor = max(1.0 - p.fraction * math.log1p(max(c.time - start, 0.0) / p.time_constant), LEAST_PRETENSION)
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
        began=values["began_s"],
        hanging=hanging,
    )
    return Change(terms=terms, moves_pretension=closed)


EFFECT = Effect(
    id="pretension_relaxation",
    statement="The cable or its terminations creep, so that the pretension falls, fast at first and ever "
    "more slowly.",
    equation="T0(t) = T0 (1 - a ln(1 + (t - t0)/t_c)), t0 the recording's first sample unless it is given (creep that "
    "goes on from recording to recording); in an open circuit T = T0(t) + M/R",
    source="logarithmic stress relaxation of steel wire and polymers at constant length: W. N. Findley, J. "
    "S. Lai and K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976",
    parameters=(
        Parameter(
            "fraction",
            "-",
            0.0,
            1e-4,
            0.3,
            "a, loss per factor e of time",
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
            "began_s",
            "s",
            0.0,
            0.0,
            3600.0,
            "t0, on the recordings' common clock; left out: the recording's first sample",
            role="begin",
            held=True,
            omitted=math.nan,
            tries=(0.0,),
        ),
    ),
    acts_through=("time",),
    bounded=True,
    change=_change,
    flag="drifts",
    rank=15,
)
