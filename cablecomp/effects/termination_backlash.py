"""Termination backlash: clearance at a hub key or crimp, taken up to either side by the sign of the load, or bit by bit
where springs or several gaps share it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, at_most, pretension_moment, wrap_deflection
from cablecomp.effects.compiled_term import term
from cablecomp.effects.shared_shapes import varied, varying
from cablecomp.errors import InputError

# Moment, as a share of R T0, within which the clearance is crossed: a step that is smooth can be fitted.
TRANSITION = 0.0005


@term(parameters=("gap", "width", "middle", "preloaded", "swing", "order", "widest"))
def _cross(c: Any, p: Any, s: Any) -> None:
    """p: gap [rad], width of the transition [N m], moment amid what of it is preloaded [N m], share that is; how much
    wider than on average it is where it is widest, how often a turn, and there [rad, times the order]."""
    path = c.load - c.moment
    place = p.preloaded * math.tanh((path - p.middle) / p.width)
    if p.preloaded < 1.0:
        place += (1.0 - p.preloaded) * math.tanh(path / p.width)
    if p.swing != 0.0:
        place *= 1.0 + p.swing * math.cos(p.order * c.joint - p.widest)
    c.reading += 0.5 * p.gap * place


@term(parameters=("gap", "impulse", "drag", "wedges"), state=("place", "time", "path", "pulley"))
def _cross_slowly(c: Any, p: Any, s: Any) -> None:
    """p: gap [rad], impulse that crosses it [N m s], friction of the link, of a key in its taper [N m]; s: place in the
    gap, over half of it, and the time, moment and pulley's angle of the sample before. It begins on the flank that the
    moment presses, without any amid the gap, unless it wedges."""
    path = c.load - c.moment
    flank = 1.0 if path > 0.0 else -1.0
    place = flank if path != 0.0 or p.wedges > 0.0 else 0.0
    if not c.first:
        if abs(path) < p.wedges:
            place = s.place
        elif abs(path) < p.drag:
            place = s.place - 2.0 * (c.joint - s.pulley) / p.gap if p.gap > 0.0 else s.place
        elif p.impulse > 0.0:
            place = s.place + (path + s.path) * (c.time - s.time) / p.impulse
        place = min(max(place, -1.0), 1.0)
    c.reading += 0.5 * p.gap * place
    if c.commit:
        s.place, s.time, s.path, s.pulley = place, c.time, path, c.joint


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    gap, impulse, drag, wedges = (values[n] for n in ("gap_rad", "impulse_Nms", "drag_Nm", "wedges_Nm"))
    closes, preload, share, swing = (values[n] for n in ("closes_Nm", "preload_Nm", "preloaded", "swing"))
    if impulse > 0.0 or drag > 0.0 or wedges > 0.0:
        if closes or preload or share != 1.0 or swing:
            raise InputError(
                f"{config.name}: effect `termination_backlash` has `impulse_Nms`, `drag_Nm` or `wedges_Nm`, and "
                "`closes_Nm`, `preload_Nm`, `preloaded` or `swing`; one law is accepted: leave out either"
            )
        return Change(terms=_cross_slowly(gap=gap, impulse=impulse, drag=drag, wedges=wedges))
    width = closes or TRANSITION * pretension_moment(config)
    varies = {"swing": swing, "order": values["order"], "widest": values["widest_rad"]}
    return Change(terms=_cross(gap=gap, width=width, middle=preload, preloaded=share, **varies))


EFFECT = Effect(
    id="termination_backlash",
    statement="A hub key, pin or crimp has clearance: the joint falls from one flank to the other where the load "
    "changes sign; bit by bit where springs hold it amid the gap, or several gaps open one by one; of two in a row one "
    "may be preloaded; teeth and pins wear wider where they mostly stand.",
    equation="q_out = q_drive + (b/2) (1 + a cos(k q_drive - φ)) (s tanh((M - M_0)/M_c) + (1 - s) tanh(M/M_c)), M the "
    "moment in the load path, M_c = 0.0005 R T0 where it is not given: sgn M with a narrow transition; greased, the "
    "gap is crossed at the speed b M/J; a link that drags stands still in space while |M| is less than its friction "
    "M_f, and the pulley turns under it; a key that wedges leaves its flank only where M is M_w and more the other way",
    source="dead zone in the load path, seen from the load: M. Nordin and P.-O. Gutman, Controlling "
    "mechanical systems with backlash: a survey, Automatica 38 (2002)",
    parameters=(
        Parameter(
            "gap_rad",
            "rad",
            0.0,
            1e-4,
            3.0,
            "b, total clearance",
            log=True,
            scale=wrap_deflection,
            minimum=0.0,
            maximum=0.5,
        ),
        Parameter(
            "impulse_Nms",
            "N m s",
            0.0,
            1e-4,
            1.0,
            "J, the load's impulse that crosses the gap; 0: crossed at once",
            log=True,
            role="shape",
            scale=pretension_moment,
            omitted=0.0,
            minimum=0.0,
            tries=(0.003, 0.03),
        ),
        Parameter(
            "drag_Nm",
            "N m",
            0.0,
            1e-3,
            1.0,
            "M_f, friction of the link beyond the gap; 0: it falls freely",
            log=True,
            role="shape",
            scale=pretension_moment,
            omitted=0.0,
            minimum=0.0,
            tries=(0.03, 0.1),
        ),
        Parameter(
            "wedges_Nm",
            "N m",
            0.0,
            1e-3,
            1.0,
            "M_w, moment that draws a key out of its taper; 0: it lies loose",
            log=True,
            role="shape",
            scale=pretension_moment,
            omitted=0.0,
            minimum=0.0,
        ),
        Parameter(
            "closes_Nm",
            "N m",
            0.0,
            0.01,
            0.15,
            "M_c, moment that closes three quarters of the gap to either side: of springs that hold a key, or of gaps "
            "that open one by one; 0: it closes at once",
            log=True,
            role="shape",
            scale=pretension_moment,
            omitted=0.0,
            minimum=0.0,
            reach=1.0,
            is_another=at_most,
        ),
        Parameter(
            "preload_Nm",
            "N m",
            0.0,
            -0.5,
            0.5,
            "M_0, moment amid the gap: of a spring washer",
            role="shape",
            scale=pretension_moment,
            omitted=0.0,
        ),
        Parameter(
            "preloaded",
            "-",
            1.0,
            0.0,
            1.0,
            "s, share of the clearance that the washer preloads; the rest opens where the load changes sign",
            role="shape",
            omitted=1.0,
            minimum=0.0,
            maximum=1.0,
            of_known_drive=True,
        ),
        # of a load that keeps its sign a clearance shows nothing but how it varies, as a pulley out of true does
        *varying("the clearance is widest", at="widest_rad", of_both_ways=True),
    ),
    acts_through=("load", "load_direction"),
    bounded=True,
    in_series=True,
    change=_change,
    tries=(
        # asked for from three times that moment, a narrow one seems worse than one that closes at once
        {"closes_Nm": 0.015, "preload_Nm": 0.0},
        *({"closes_Nm": c, "preload_Nm": m} for c in (0.05, 0.15) for m in (-0.15, 0.0, 0.15)),
        # where a gap opens at once, or a key lets go, is found by looking there
        *({"wedges_Nm": m} for m in (0.02, 0.04, 0.07, 0.11, 0.17, 0.25)),
        *({"preload_Nm": 0.05 * k, "preloaded": 0.5} for k in (*range(-9, 0), *range(1, 10))),
        *varied("widest_rad"),
    ),
    rank=5,
)
