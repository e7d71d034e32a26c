"""Clamp slip: a termination or clamp of one cable gives way, or a drum slips on its shaft, at once or for a while."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, drum_radius, pretension, wrap_deflection
from cablecomp.effects.compiled_term import term
from cablecomp.effects.course import COURSE, CURVE, DURATION, LENGTHS, STEPS, course, gone
from cablecomp.errors import InputError
from cablecomp.mechanics.change import Term

LEAST_TURN = 0.01
"""Turn of the output drum by which a clamp or a drum plausibly slips, however slack its cables are [rad]: half a
degree, and nothing to do with how far friction on the wraps lets a cable stretch."""


@term(parameters=("slip", "instant", "duration", "curve", "taken_up", *LENGTHS))
def _slip(c: Any, p: Any, s: Any) -> None:
    """p: length let go [m] (below 0: by cable l), instant [s], how long it takes [s], how curved, share that the
    other takes up, when further steps come [s], how large they are."""
    since = c.time - p.instant
    if since >= 0.0:
        done = gone(since, p.duration, p.curve, p.after, p.size)
        if p.slip > 0.0:
            c.length_h -= p.slip * done
            c.length_l += p.slip * done * p.taken_up
        else:
            c.length_l += p.slip * done
            c.length_h -= p.slip * done * p.taken_up


@term(parameters=("rate", "holds", "of_l"), state=("crept", "over"))
def _creep(c: Any, p: Any, s: Any) -> None:
    """p: rate [m/(N s)], tension up to which the clamp holds [N], 1 where it is cable l's; s: length let go so far [m],
    tension beyond that at the sample before [N]. The tension goes straight from sample to sample."""
    tension = c.tension_l if p.of_l > 0.0 else c.tension_h
    over = 0.0 if math.isnan(tension) else max(tension - p.holds, 0.0)
    crept = s.crept
    if not c.first:
        crept += p.rate * 0.5 * (s.over + over) * c.dt
    if p.of_l > 0.0:
        c.length_l -= crept
    else:
        c.length_h -= crept
    if c.commit:
        s.crept, s.over = crept, over


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    terms: list[Term] = []
    if values["slip_m"] != 0.0:
        if math.isnan(values["time_s"]):
            raise _lacks("time_s", "when it slipped [s]", config)
        terms += _slip(slip=values["slip_m"], taken_up=values["taken_up"], **course(values, config))
    for of_l, cable in enumerate(("", "_l")):
        rate, holds = values[f"creep{cable}_m_per_Ns"], values[f"holds{cable}_N"]
        if rate != 0.0:
            if math.isnan(holds):
                raise _lacks(f"holds{cable}_N", "the tension that the clamp holds [N]", config)
            terms += _creep(rate=rate, holds=holds, of_l=float(of_l))
    return Change(terms=tuple(terms))


def _lacks(key: str, what: str, config: JointConfig) -> InputError:
    return InputError(f"{config.name}: effect `clamp_slip` lacks key `{key}`, {what}; add it")


def _arc_per_pull(config: JointConfig) -> float:
    """That arc in ten seconds of T0 beyond what holds [m/(N s)]."""
    return _loop_arc(config) / (10.0 * pretension(config))


def _loop_arc(config: JointConfig) -> float:
    """Arc on the output drum that its unit of deflection makes [m]."""
    return drum_radius(config) * wrap_deflection(config)


def _slipped_arc(config: JointConfig) -> float:
    """That arc, or that of the least turn by which a drum plausibly slips [m]."""
    return max(_loop_arc(config), LEAST_TURN * drum_radius(config))


def _creeping(key: str, cable: str) -> tuple[Parameter, Parameter]:
    """How fast the clamp of a cable creeps, and beyond which tension."""
    rate = f"creep{key}_m_per_Ns"
    return (
        Parameter(
            rate,
            "m/(N s)",
            0.0,
            1e-3,
            1.0,
            f"r, by which the clamp of cable {cable} lets go per tension beyond what it holds",
            log=True,
            scale=_arc_per_pull,
            minimum=0.0,
            maximum=0.1,
            omitted=0.0,
            of_cable_l="always" if cable == "l" else "never",
            of_known_drive=True,
        ),
        Parameter(
            f"holds{key}_N",
            "N",
            0.0,
            0.7,
            2.0,
            f"T_c, tension that the clamp of cable {cable} holds",
            log=True,
            role="shape",
            scale=pretension,
            minimum=0.0,
            omitted=math.nan,
            of=rate,
        ),
    )


EFFECT = Effect(
    id="clamp_slip",
    statement="A clamp or termination slipped, at once, in steps or little by little (of cable h where the length is "
    "positive, of l where it is negative): the joint stands off from then on, and the pretension is lower; "
    "or it is kept, where a drum, the link or its encoder slipped on the shaft (taken_up near 1). A clamp that holds "
    "so much and no more lets go a little at every peak of the tension.",
    equation="length of cable h + g s, of cable l - g k s, s > 0; of cable l + g |s|, of cable h - g k |s|, s < 0; "
    f"{COURSE}; k = taken_up; ds/dt = r max(T - T_c, 0) of a clamp that creeps beyond T_c",
    source="kinematics; in a closed circuit the joint moves by about s (1 + k)/(2R), and both tensions fall as 1 - k",
    parameters=(
        Parameter(
            "slip_m",
            "m",
            0.0,
            -1.0,
            1.0,
            "s, length let go: by cable h, below 0 by cable l",
            scale=_slipped_arc,
            minimum=-0.1,
            maximum=0.1,
            omitted=0.0,
            of_cable_l="below zero",
        ),
        Parameter(
            "time_s",
            "s",
            0.0,
            0.0,
            3600.0,
            "t*, on the recording's clock",
            role="instant",
            omitted=math.nan,
            of="slip_m",
        ),
        replace(DURATION, of="slip_m"),
        replace(CURVE, of="slip_m"),
        *(replace(p, of="slip_m") for p in STEPS),
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
            of="slip_m",
        ),
        *_creeping("", "h"),
        *_creeping("_l", "l"),
    ),
    acts_through=("time", "load"),
    bounded=True,
    pliant=True,
    unbounded_by=("creep_m_per_Ns", "creep_l_m_per_Ns"),  # they go by the tension that is solved for
    change=_change,
    steps=True,
    flag="slips",
)
