"""Strand break: wires of one cable break, at once or one after another, and it is softer from then on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter
from cablecomp.effects.compiled_term import term
from cablecomp.effects.course import COURSE, CURVE, DURATION, LENGTHS, STEPS, course, gone


@term(parameters=("fraction", "instant", "duration", "curve", *LENGTHS))
def _break(c: Any, p: Any, s: Any) -> None:
    """p: share of EA lost (below 0: by cable l), instant [s], how long it takes [s], how curved,
    when further steps come [s], how large they are."""
    since = c.time - p.instant
    if since >= 0.0:
        done = gone(since, p.duration, p.curve, p.after, p.size)
        if p.fraction > 0.0:
            c.stiffness_h *= 1.0 - p.fraction * done
        else:
            c.stiffness_l *= 1.0 + p.fraction * done


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(terms=_break(fraction=values["fraction"], **course(values, config)))


EFFECT = Effect(
    id="strand_break",
    statement="Wires of one cable broke (of h where the share is positive, of "
    "l where it is negative), at once or one after another: from then "
    "on it is softer, and at the same stretch it pulls less.",
    equation=f"EA_h -> EA_h (1 - g f), f > 0; EA_l -> EA_l (1 - g |f|), f < 0; stretch unchanged; {COURSE}",
    source="EA is modulus times metallic area; a broken wire carries nothing (G. A. Costello, Theory of "
    "Wire Rope, 1990)",
    parameters=(
        Parameter(
            "fraction",
            "-",
            0.0,
            -0.9,
            0.9,
            "f, share of the cross-section lost: of cable h, below 0 of cable l",
            minimum=-0.95,
            maximum=0.95,
            of_cable_l="below zero",
        ),
        Parameter("time_s", "s", 0.0, 0.0, 3600.0, "t*, on the recording's clock", role="instant"),
        DURATION,
        CURVE,
        *STEPS,
    ),
    acts_through=("time", "load"),
    bounded=True,
    change=_change,
    flag="loses strands",
)
