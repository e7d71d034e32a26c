"""Parameters that several laws have for the same: when a slow course began; an amount that varies as the joint turns,
by 1 + a cos(k q - φ), as a clearance that is widest where the joint mostly stands, a bracket softer across than along;
how often in a turn a drum's wave comes; how a friction grows with speed.
"""

from __future__ import annotations

import math
from dataclasses import replace

from cablecomp.effects.base import Parameter, at_most

SWING, ORDERS, PHASES = 0.6, (1.0, 2.0, 4.0), 4
"""Where a diagnosis asks: how much, how often a turn, at how many phases of each."""


def begun(name: str, *, of: str = "", tries: tuple[float, ...] = ()) -> Parameter:
    """When a slow course began [s]: with each recording's first sample, or at one instant of them all."""
    return Parameter(
        name,
        "s",
        0.0,
        0.0,
        3600.0,
        "t0, on the recordings' common clock; left out: the recording's first sample",
        role="begin",
        held=True,
        omitted=math.nan,
        of=of,
        tries=tries,
    )


def repeated(text: str, *, tries: tuple[float, ...], of: str = "") -> Parameter:
    """How often in a turn of a drum a wave of its own comes; ever more often it is teeth, poles or a graduation."""
    return Parameter(
        "order",
        "-",
        1.0,
        1.0,
        10.0,
        text,
        log=True,
        role="shape",
        omitted=1.0,
        minimum=0.2,
        maximum=50.0,
        of=of,
        tries=tries,
        reach=1.0,
        is_another=at_most,
        of_known_drive=True,
    )


def dragging(whose: str, of: str, high: float, tries: tuple[float, ...]) -> Parameter:
    """How a friction `of` that size grows with speed, in grease; `high`, `tries` [s/rad]: most, and where asked."""
    return Parameter(
        "viscous_s_per_rad",
        "s/rad",
        0.0,
        0.005,
        high,
        f"ν, growth with the {whose} speed, over {of}; 0: it does not",
        log=True,
        role="shape",
        omitted=0.0,
        minimum=0.0,
        tries=tries,
    )


def varying(what: str, *, at: str, of: str = "", of_both_ways: bool = False) -> tuple[Parameter, ...]:
    """The wave's amplitude, order and phase; `what`: the amount, and that it is most there, `at`: the phase's name."""
    wave = (
        Parameter(
            "swing",
            "-",
            0.0,
            0.0,
            1.0,
            "a, by which share of itself it varies with the joint's angle; 0: it does not",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=1.0,
            of=of,
            of_known_drive=True,
        ),
        Parameter(
            "order",
            "-",
            1.0,
            0.5,
            8.0,
            "k, how often in a turn of the joint",
            log=True,
            role="shape",
            omitted=1.0,
            minimum=0.1,
            maximum=30.0,
            of=of,
            of_known_drive=True,
        ),
        Parameter(
            at,
            "rad",
            0.0,
            -math.pi,
            math.pi,
            f"φ, k times the angle at which {what}",
            role="shape",
            omitted=0.0,
            of=of,
            of_known_drive=True,
        ),
    )
    return tuple(replace(p, of_both_ways=of_both_ways) for p in wave)


def varied(at: str) -> tuple[dict[str, float], ...]:
    """Waves to ask for."""
    phases = [2.0 * math.pi * k / PHASES - math.pi for k in range(PHASES)]
    return tuple({"swing": SWING, "order": k, at: p} for k in ORDERS for p in phases)
