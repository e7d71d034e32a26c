"""An effect as weighed, and what may not be named beside another: a second of what gives way in series."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt

from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.explain.scores import ScoreDifference
from cablecomp.diagnosis.thresholds import LIMITS


@dataclass(frozen=True)
class Weighed:
    """One effect of the final model: its evidence, confidence, rivals that stand in for it with the standard errors by
    which data left out put it ahead of each, its score against the nearest of all that were tried.

    `removes`: share of the calibrated drive's mean square on data left out that it takes off, alone or as the
    last to come, whichever is more: effects that trade places take off little as the last, what others hide
    takes off little alone; no more than the whole model does. `better`: the model with the rival in its place that
    predicts data left out better, by more than a tie; None where there is none.
    """

    term: Hypothesis
    depends: Dependence | None
    evidence: Mapping[str, float]
    confidence: float
    rivals: Mapping[str, float]
    difference: ScoreDifference
    why_not: str
    removes: float
    better: Model | None = None


def in_order(named: Iterable[Weighed]) -> list[Weighed]:
    """The same, first what moves the joint's angle most for how sure it is: RMS of what it adds (any amount where the
    drive cannot follow without it) times the root of the odds that the name is right, so that a doubtful name does not
    stand before a sure one of much the same size; of what shows in the motor's torque alone, what is missed most there.
    """

    def place(w: Weighed) -> tuple[float, float]:
        odds = w.confidence / max(1.0 - w.confidence, LIMITS.least_doubt)
        return w.evidence.get("moves_rad", inf) * sqrt(odds), w.evidence["gain"]

    return sorted(named, key=place, reverse=True)


def one_in_series(weighed: Sequence[Weighed]) -> list[Weighed]:
    """The same, where of those named that give way in series with the joint the one that takes off most keeps its name:
    what one law's form lacks there the other has, and data show the one curve that they make together."""
    among = [w for w in weighed if w.term.effect.in_series and w.confidence >= LIMITS.name]
    if not among:
        return list(weighed)
    most = max(among, key=lambda w: w.removes).term.effect.id
    why_not = f"what gives way in series is one curve of the load, and `{most}` takes off more of it"
    return [
        replace(w, confidence=LIMITS.little_told, why_not=why_not)
        if any(w is other for other in among) and w.term.effect.id != most
        else w
        for w in weighed
    ]
