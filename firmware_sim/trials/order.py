"""What each of a series of trials is to hold: kinds in turn, effects in turn, drawn from the seed."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_sim.plant import PlantError
from firmware_sim.trials.plan import Assignment, assignment

KINDS = ("single", "pair", "none", "stranger")
LAWS = ("catalogue",)
IMPERFECTIONS = ("none",)
_PLANNED = {"single": "single", "pair": "pair", "none": "parameters", "stranger": "unknown"}


@dataclass(frozen=True)
class Wanted:
    """What was asked for: a seed, kinds of trials, whose laws, how imperfect the world."""

    seed: int
    kinds: tuple[str, ...]
    laws: str
    imperfections: str

    def __post_init__(self) -> None:
        for kind in self.kinds:
            if kind not in KINDS:
                raise PlantError(f"kind is {kind!r}; {', '.join(KINDS)} are accepted")


def order(wanted: Wanted, number: int) -> Assignment:
    """What trial `number` is to hold: kinds in turn, each kind's effects in an order drawn from the seed."""
    turn, within = divmod(number, len(wanted.kinds))
    planned = assignment(wanted.seed, turn, _PLANNED[wanted.kinds[within]])
    return Assignment(number, planned.kind, planned.effects, planned.case)
