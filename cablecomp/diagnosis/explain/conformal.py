"""Explanations that cannot be excluded, with a level that trials have set: split conformal prediction.

V. Vovk, A. Gammerman and G. Shafer, Algorithmic Learning in a Random World, 2005; J. Lei et al.,
Distribution-free predictive inference for regression, JASA 113, 2018. What it promises holds for trials to come
that are like those that set the level.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, inf


def deficits(z: Mapping[str, float]) -> dict[str, float]:
    """By how many standard errors each explanation falls short of the best: max z - z, by name; `z` of each
    over the same model without any of them."""
    best = max(z.values(), default=0.0)
    return {name: best - value for name, value in z.items()}


def conformal_level(scores: Sequence[float], miss: float = 0.1) -> float:
    """The ceil((n+1)(1-miss))-th smallest of n scores: one more is at most that with probability 1 - miss or more.

    `scores`: the truth's own deficit on trials that nothing was learnt on. Infinite where n is too small to say.
    """
    rank = ceil((len(scores) + 1) * (1.0 - miss))
    return inf if rank > len(scores) else sorted(scores)[rank - 1]


def conformal_set(short: Mapping[str, float], level: float) -> tuple[str, ...]:
    """Explanations whose deficit is at most the level, best first: those that are not excluded."""
    return tuple(name for name, d in sorted(short.items(), key=lambda item: item[1]) if d <= level)
