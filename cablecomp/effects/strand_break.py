"""Strand break: wires of one cable break, at once or one after another, and it is softer from then on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import DURATION, Change, Effect, Parameter, term


@term(parameters=("fraction", "instant", "duration"))
def _break(c: Any, p: Any, s: Any) -> None:
    """p: share of EA lost (below 0: by cable l), instant [s], how long it takes [s]."""
    since = c.time - p.instant
    if since >= 0.0:
        done = since / p.duration if since < p.duration else 1.0
        if p.fraction > 0.0:
            c.stiffness_h *= 1.0 - p.fraction * done
        else:
            c.stiffness_l *= 1.0 + p.fraction * done


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    broken = _break(fraction=values["fraction"], instant=values["time_s"], duration=values["duration_s"])
    return Change(terms=broken)


EFFECT = Effect(
    id="strand_break",
    statement="Wires of one cable broke (of h where the share is positive, of "
    "l where it is negative), at once or one after another: from then "
    "on it is softer, and at the same stretch it pulls less.",
    equation="EA_h -> EA_h (1 - g f), f > 0; EA_l -> EA_l (1 - g |f|), f < 0; g = (t - t*)/d within 0..1, d = 0: a "
    "step; stretch unchanged",
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
        ),
        Parameter("time_s", "s", 0.0, 0.0, 3600.0, "t*, on the recording's clock", role="instant"),
        DURATION,
    ),
    acts_through=("time", "load"),
    bounded=True,
    change=_change,
    flag="loses strands",
)
