"""Which trial conceals what: kinds and effects in fixed shares, in an order drawn from the seed.

A trial's assignment depends on the seed and its number alone, not on how many trials are run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from firmware_sim.plant import PlantError
from firmware_sim.trials.confounded import CASES
from firmware_sim.trials.strangers import STRANGERS
from firmware_sim.trials.suspects import CATALOGUE, Suspect

KINDS = ("single", "pair", "nothing", "parameters", "unknown", "confounded")
SHARES = {"single": 30, "pair": 5, "nothing": 2, "parameters": 4, "unknown": 5, "confounded": 4}
"""Trials of each kind among 50."""

_BLOCK = sum(SHARES.values())


@dataclass(frozen=True)
class Assignment:
    """What one trial is to conceal: effect ids (in no order), or the name of a confounded case."""

    number: int
    kind: str
    effects: tuple[str, ...] = ()
    case: str = ""


def assignment(seed: int, number: int, kind: str = "mixed") -> Assignment:
    """The assignment of trial `number` (from 0) under a seed; `kind` "mixed" draws kinds in their shares."""
    if kind != "mixed" and kind not in KINDS:
        raise PlantError(f"kind is {kind!r}; mixed, {', '.join(KINDS)} are accepted")
    place = number
    if kind == "mixed":
        kind, place = _kind_and_place(seed, number)
    if kind in ("nothing", "parameters"):
        return Assignment(number, kind)
    if kind == "confounded":
        return Assignment(number, kind, case=_in_turn(seed, place, [c.name for c in CASES], 1))
    if kind == "pair":
        return Assignment(number, kind, effects=_pair(np.random.default_rng([seed, 2, place])))
    pool: tuple[Suspect, ...] = STRANGERS if kind == "unknown" else CATALOGUE
    which = _in_turn(seed, place, [s.id for s in pool], 3 if kind == "unknown" else 4)
    return Assignment(number, kind, effects=(which,))


def _kind_and_place(seed: int, number: int) -> tuple[str, int]:
    """Kind of a mixed trial, and how many of that kind came before."""
    block, within = divmod(number, _BLOCK)
    kinds = np.random.default_rng([seed, 0, block]).permutation(np.repeat(KINDS, [SHARES[k] for k in KINDS]))
    kind = str(kinds[within])
    return kind, block * SHARES[kind] + int(np.sum(kinds[:within] == kind))


def _in_turn(seed: int, place: int, names: Sequence[str], stream: int) -> str:
    """Every name once in each round, in a new order each round."""
    turn, within = divmod(place, len(names))
    return str(np.random.default_rng([seed, stream, turn]).permutation(np.asarray(names))[within])


def _pair(rng: np.random.Generator) -> tuple[str, str]:
    """Two different effects that one course can show."""
    while True:
        first, second = (CATALOGUE[int(k)] for k in rng.choice(len(CATALOGUE), 2, replace=False))
        if set(first.courses) & set(second.courses):
            return first.id, second.id
