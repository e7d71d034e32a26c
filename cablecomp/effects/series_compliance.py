"""Series compliance: torque sensor, coupling and mount give way with the load, more one way, less or more as they are
loaded more, or in their own time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, per_moment, pretension_moment, wrap_compliance
from cablecomp.effects.compiled_term import term
from cablecomp.effects.lag import lagged
from cablecomp.effects.shared_shapes import varied, varying

HERTZ = 2.0 / 3.0
"""Power of the load by which a contact yields."""
CONTACT = 1.0 / 6.0
"""Half of what that is less than 1."""
AT_ONCE = 0.1
"""Power of the load below which a coupling yields at once and then hardly any more (couplings of trials seeds 738 to
744 ended at 0.39 and more where the name was right, at 2e-10 and 1e-4 where it was not)."""
LATE_READING_S = 0.1
"""Lag below which a late reading is the better word for a coupling (trials seed 671: lags of 0.04 and 0.08 s where
channels were filtered and late by some milliseconds)."""


@term(
    parameters=(
        "compliance",
        "skew",
        "bends",
        "exponent",
        "swing",
        "order",
        "softest",
        "stage",
        "beyond",
    )
)
def _give_way(c: Any, p: Any, s: Any) -> None:
    """p: compliance [rad/(N m)], skew, one over the moment from which it bends [1/(N m)], exponent (1 - power)/2, how
    much softer it is than on average where it is softest, how often a turn, and there [rad, times the order]; moment
    at which its first stage ends [N m], how many times as much it yields beyond."""
    path = c.load - c.moment
    gives = path + p.skew * abs(path)
    if p.beyond != 1.0:
        gives += (p.beyond - 1.0) * (path - min(max(path, -p.stage), p.stage))
    gives *= p.compliance
    if p.swing != 0.0:
        gives *= 1.0 + p.swing * math.cos(p.order * c.joint - p.softest)
    c.reading += gives / (1.0 + (p.bends * path) ** 2) ** p.exponent


@term(parameters=("compliance", "lag", "decades"), state=(("late", 3), "path", "time"))
def _give_way_late(c: Any, p: Any, s: Any) -> None:
    """p: compliance [rad/(N m)], lag [s], decades from the shortest to the longest; s: what has given way so far of
    each third, as the moment that it would bear at rest, and the moment and time of the sample before. The moment goes
    straight from sample to sample."""
    path = c.load - c.moment
    passed = 0.0 if c.first else c.time - s.time
    parts = 3 if p.decades > 0.0 else 1
    for k in range(parts):
        lag = p.lag * 10.0 ** (0.5 * p.decades * (k - 1))
        late = path if c.first else s.late[k]
        if passed > 0.0:
            late = lagged(late, s.path, path, passed, lag)
        c.reading += p.compliance * late / parts
        if c.commit:
            s.late[k] = late
    if c.commit:
        s.path, s.time = path, c.time


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    elastic = _give_way(
        compliance=values["compliance_rad_per_Nm"],
        skew=values["skew"],
        bends=values["stiffening_per_Nm"],
        exponent=CONTACT - 0.5 * (values["power"] - HERTZ),
        swing=values["swing"],
        order=values["order"],
        softest=values["softest_rad"],
        stage=values["stage_Nm"],
        beyond=values["beyond"],
    )
    if values["late_rad_per_Nm"] == 0.0:
        return Change(terms=elastic)
    late = _give_way_late(
        compliance=values["late_rad_per_Nm"], lag=values["lag_s"], decades=values["decades"]
    )
    return Change(terms=(*elastic, *late) if values["compliance_rad_per_Nm"] else late)


def _stiffens(values: Mapping[str, float], on_high: bool) -> bool:
    """Ever more at once by a contact's power it is play, whose own is near none (`_at_once`); what yields by another
    power over all of its load is a coupling: it softens, or is bent at first and then stretched, as a diaphragm."""
    return on_high and values.get("power", HERTZ) == HERTZ


def _at_once(values: Mapping[str, float], _on_high: bool) -> bool:
    """What yields at once and then hardly any more is a clearance on springs."""
    return values.get("stiffening_per_Nm", 0.0) > 0.0 and values.get("power", HERTZ) < AT_ONCE


def _reads_late(values: Mapping[str, float], _on_high: bool) -> bool:
    """What follows the load at once but for a tenth of a second, and yields no other way, is a channel that reads late
    or through a filter: the two differ by the square of the lag over the time in which the load changes."""
    alone = values["compliance_rad_per_Nm"] <= 0.01 * values["late_rad_per_Nm"]
    return alone and values["lag_s"] < LATE_READING_S and values["decades"] == 0.0


EFFECT = Effect(
    id="series_compliance",
    statement="Something in series with the joint (torque sensor, coupling, mount) yields with the load; it may "
    "stiffen or soften as it is loaded, in two stages, or as the joint turns its load across it, or, where it is of "
    "rubber or plastic, yield in its own time.",
    equation="q_out = q_drive + c_s (1 + a cos(k q_drive - φ)) (M + s |M| + (b - 1) max(|M| - M_1, 0) sgn M) "
    "(1 + (g M)^2)^((p - 1)/2) + c_l y, "
    "t_l dy/dt = M - y, M the moment in the load path, -1 <= s <= 1; over d decades y is the mean of three, of "
    "t_l 10^(-d/2), t_l, t_l 10^(d/2)",
    source="Snow 1993, App. A.3; a mount that rests on a stop yields one way alone (s = 1 or -1); contacts "
    "yield by the 2/3 power of their load (H. Hertz, 1882), strain wave gears by makers' K1 < K2 < K3; bolted "
    "and clamped seats soften as they open (VDI 2230); delayed elasticity: C. Zener, Elasticity and "
    "Anelasticity of Metals, 1948",
    parameters=(
        Parameter(
            "compliance_rad_per_Nm",
            "rad/(N m)",
            0.0,
            1e-4,
            3.0,
            "c_s, added compliance",
            log=True,
            scale=wrap_compliance,
            minimum=0.0,
            omitted=0.0,
        ),
        Parameter(
            "skew",
            "-",
            0.0,
            -1.0,
            1.0,
            "s, how much softer it is to loads above zero than below: 1 rests on a stop for loads below zero",
            role="shape",
            omitted=0.0,
            minimum=-1.0,
            maximum=1.0,
            tries=(-0.7, 0.7),
            of="compliance_rad_per_Nm",
        ),
        Parameter(
            "stiffening_per_Nm",
            "1/(N m)",
            0.0,
            0.3,
            20.0,
            "g, one over the moment from which it yields by a power of the load; 0: it yields in proportion",
            log=True,
            role="shape",
            scale=per_moment,
            omitted=0.0,
            minimum=0.0,
            tries=(2.0, 7.0),
            reach=1.0,
            is_another=_stiffens,
            of="compliance_rad_per_Nm",
        ),
        Parameter(
            "power",
            "-",
            HERTZ,
            0.0,
            2.0,
            "p, of the load by which it yields from there on: below 1 it stiffens (2/3: a contact), above 1 it softens",
            role="shape",
            omitted=HERTZ,
            minimum=0.0,
            maximum=3.0,
            is_another=_at_once,
            of="compliance_rad_per_Nm",
            of_known_drive=True,
        ),
        *varying("it is softest", of="compliance_rad_per_Nm", at="softest_rad"),
        Parameter(
            "stage_Nm",
            "N m",
            0.0,
            0.05,
            0.6,
            "M_1, moment at which its first stage ends",
            log=True,
            role="shape",
            scale=pretension_moment,
            omitted=0.0,
            minimum=0.0,
            of="compliance_rad_per_Nm",
            of_known_drive=True,
        ),
        Parameter(
            "beyond",
            "-",
            1.0,
            0.1,
            10.0,
            "b, how many times as much it yields beyond: below 1 lobes that close, above 1 a seat that gapes",
            log=True,
            role="shape",
            omitted=1.0,
            minimum=0.0,
            reach=3.0,
            least_is_another=True,  # what hardly yields beyond is a clearance on springs
            of="compliance_rad_per_Nm",
            of_known_drive=True,
        ),
        Parameter(
            "late_rad_per_Nm",
            "rad/(N m)",
            0.0,
            1e-4,
            3.0,
            "c_l, compliance that yields late",
            log=True,
            scale=wrap_compliance,
            minimum=0.0,
            omitted=0.0,
            of_known_drive=True,
        ),
        Parameter(
            "lag_s",
            "s",
            0.0,
            0.02,
            5.0,
            "t_l, how late: to 63 % of it after a step of the load (the middle one of three)",
            log=True,
            role="shape",
            omitted=0.3,
            minimum=1e-6,
            is_another=_reads_late,
            of="late_rad_per_Nm",
        ),
        Parameter(
            "decades",
            "-",
            0.0,
            0.0,
            4.0,
            "d, decades of time over which it goes on yielding, as plastics do; 0: all with the one lag",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=6.0,
            tries=(2.0,),
            of="late_rad_per_Nm",
        ),
    ),
    acts_through=("load", "load_rate"),
    bounded=True,
    pliant=True,
    in_series=True,
    change=_change,
    tries=(
        *({"stiffening_per_Nm": g, "power": p} for g, p in ((7.0, 0.3), (1.0, 2.0), (4.0, 2.0))),
        *varied("softest_rad"),
        *({"stage_Nm": m, "beyond": b} for b in (0.25, 4.0) for m in (0.1, 0.2, 0.35)),
    ),
    rank=5,
)
