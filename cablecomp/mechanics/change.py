"""What physics beyond the thesis's drive changes in it: compiled terms, factors of friction, the cable's path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NoReturn

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.mechanics.tables import (
    Floats,
    law_table,
    plain_law,
    stiffening_law,
)

Factor = Callable[[Floats], Floats]

KEPT = 32
"""Law tables that are at hand: of the laws that a fit goes to and fro between."""


@dataclass(frozen=True)
class Law:
    """A factor by its function of the argument and of numbers: the same as another with the same ones, so that a fit
    that changes neither has its tables made once."""

    function: Callable[..., Floats]
    numbers: tuple[float, ...]

    def __call__(self, x: Floats) -> Floats:
        return self.function(x, *self.numbers)


@dataclass(frozen=True)
class Product:
    """Factors that multiply."""

    factors: tuple[Factor, ...]

    def __call__(self, x: Floats) -> Floats:
        total = np.ones_like(x)
        for factor in self.factors:
            total = total * factor(x)
        return total


@dataclass(frozen=True)
class Term:
    """A compiled term: its address, its parameters, the size of its state, and of the rings at the state's end."""

    address: int
    parameters: tuple[float, ...]
    state_size: int
    ring_size: int = 0

    def __reduce__(self) -> NoReturn:
        raise TypeError("a term's machine code lies in its own process: send the joint, and extend it there")


@dataclass(frozen=True)
class Change:
    """What an effect, or several together, do to the drive; every default is neutral."""

    terms: tuple[Term, ...] = ()
    tension_factor: Factor | None = None
    """mu/mu0 as a function of tau = T/T0, vectorised; hashable, as its tables are kept (a `Law`, or any function)."""
    joint_angle_factor: Factor | None = None
    """mu/mu0 of the output drum's groove, by the joint angle [rad] at which the cable departs there."""
    motor_angle_factor: Factor | None = None
    """mu/mu0 of the input drum's groove, by the motor angle [rad] at which the cable departs there."""
    stiffening: float = 0.0
    steady: float = 0.0
    """Share of the cable's compliance at T0 that does not stiffen."""
    knee: float = 0.0
    """T/T0 around which it stiffens, at once; 0: with the tension."""
    again: float = 0.0
    """T/T0 around which it does once more, soft from the knee on to there; 0: nowhere."""
    guide_angle: float = 0.0
    guide_length_m: float = 0.0
    guide_skew: float = 0.0
    """The guide's angle counts (1 + skew) times in cable h, (1 - skew) times in l."""
    guide_place: float = 0.5
    """Share of the free cable between output drum and guide."""
    guide_spread: float = 0.0
    """Share of the stage's free length that lies between the guides of a row, and so within it."""
    extra_length_m: float = 0.0
    """Free cable beyond the stage's own free length."""
    play_share: float = 0.0
    play_yield_N: float = 0.0
    play_time_s: float = 0.0
    play_spread: float = 0.0
    play_grading: float = 1.0
    play_pressed: float = 0.0
    viscous_Ns_per_m_rad: float = 0.0
    viscous_skew: float = 0.0
    """It counts (1 + skew) times on output drums, (1 - skew) times on input drums."""
    moves_pretension: bool = False
    """Set where a term writes the pretension factors: what lies on the drums then has to follow."""


def together(changes: Sequence[Change]) -> Change:
    """All of these changes as one: terms run in this order, factors multiply, lengths, angles and shares add."""
    return Change(
        terms=tuple(t for c in changes for t in c.terms),
        tension_factor=_product([c.tension_factor for c in changes]),
        joint_angle_factor=_product([c.joint_angle_factor for c in changes]),
        motor_angle_factor=_product([c.motor_angle_factor for c in changes]),
        stiffening=sum(c.stiffening for c in changes),
        steady=max((c.steady for c in changes), default=0.0),
        knee=max((c.knee for c in changes), default=0.0),
        again=max((c.again for c in changes), default=0.0),
        guide_angle=sum(c.guide_angle for c in changes),
        guide_length_m=sum(c.guide_length_m for c in changes),
        guide_skew=sum(c.guide_skew for c in changes),
        guide_place=next((c.guide_place for c in changes if c.guide_angle > 0.0), 0.5),
        guide_spread=max((c.guide_spread for c in changes), default=0.0),
        extra_length_m=sum(c.extra_length_m for c in changes),
        play_share=sum(c.play_share for c in changes),
        play_yield_N=max((c.play_yield_N for c in changes), default=0.0),
        play_time_s=max((c.play_time_s for c in changes), default=0.0),
        play_spread=max((c.play_spread for c in changes), default=0.0),
        play_grading=max((c.play_grading for c in changes), default=1.0),
        play_pressed=max((c.play_pressed for c in changes), default=0.0),
        viscous_Ns_per_m_rad=sum(c.viscous_Ns_per_m_rad for c in changes),
        viscous_skew=sum(c.viscous_skew for c in changes),
        moves_pretension=any(c.moves_pretension for c in changes),
    )


def _product(factors: Sequence[Factor | None]) -> Factor | None:
    given = tuple(f for f in factors if f is not None)
    return Product(given) if given else None


def law_tables(change: Change, config: JointConfig) -> Floats | None:
    """Law tables (`tables.py`), as many as there are unlike ones: for all places, or for all but the joint's own drum
    in chain h and l, and the motor's. They may be kept for others, and are not to be written to.

    None where terms are all that is added: the kernel then runs the plain drive's own, quicker code.
    """
    by_tension, by_joint, by_motor = (
        change.tension_factor,
        change.joint_angle_factor,
        change.motor_angle_factor,
    )
    if by_tension is None and by_joint is None and by_motor is None:
        if change.stiffening != 0.0:
            return stiffening_law(change.stiffening, change.steady, change.knee, change.again)[None]
        inside = change.play_share or change.guide_angle or change.viscous_Ns_per_m_rad
        return plain_law()[None] if inside or change.moves_pretension else None
    out, wound = config.drive.stage[-1].wrap_output_rad, config.drive.stage[0].wrap_input_rad
    widest = 2.0 * max(s.wrap_output_rad + s.wrap_input_rad for s in config.drive.stage) + 20.0
    stiffness = change.stiffening, change.steady, change.knee, change.again
    return _law_tables(by_tension, by_joint, by_motor, out, wound, widest, stiffness)


@lru_cache(KEPT)
def _law_tables(
    by_tension: Factor | None,
    by_joint: Factor | None,
    by_motor: Factor | None,
    out: float,
    wound: float,
    widest: float,
    stiffness: tuple[float, float, float, float],
) -> Floats:
    """By `ELSEWHERE`, `ON_H`, `ON_L`, `IN_H`, `IN_L`; wraps on the joint's and the motor's drum, the widest of all."""
    grooves: list[Factor | None] = [None]
    if by_joint is not None:
        grooves += [lambda y: by_joint(y - out), lambda y: by_joint(out - y)]
    if by_motor is not None:  # the motor winds on what the joint winds off
        grooves += [None] * (3 - len(grooves)) + [
            lambda y: by_motor(wound - y),
            lambda y: by_motor(y - wound),
        ]
    return np.stack([law_table(by_tension or np.ones_like, groove, widest, *stiffness) for groove in grooves])
