"""What a round of the search begins from: the model, what was seen and fitted before, and the values from which its
fits set out beside where calibration stands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model, Term
from cablecomp.diagnosis.explain.seen import Seen
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.pace import Pace
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import MOTOR
from cablecomp.estimation.forked import helping
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parameter import vague_drive
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Beginning:
    """What a round begins from.

    `nominal`: a further point to ask from. `number`: 0 for the first round. `cold`: values to begin from where the
    drive is known by order of magnitude only; `known`: models of earlier rounds, to begin from as well; `seen`: what
    was asked beside these does. Once the time is up nothing further is begun but the most promising fit.
    """

    model: Model
    nominal: Fit | None
    pool: Sequence[Hypothesis]
    groups: Groups
    pace: Pace
    number: int
    cold: Mapping[str, float] | None
    known: Sequence[Model]
    seen: Seen

    @property
    def cost(self) -> float:
        """Cost of the model that hypotheses are put beside."""
        return self.model.fit.cost

    def tell(self, what: str) -> None:
        """Say what is being done, and how far the search is, where somebody listens."""
        if not helping():
            self.pace.tell(what, self.number / (LIMITS.rounds + LIMITS.later_rounds))

    def trades(self, h: Hypothesis) -> bool:
        """Whether a hypothesis is tried whatever it promises: beside another effect it may trade places."""
        return self.cold is not None and self.number > 0 and h.trades


@dataclass(frozen=True)
class Begun:
    """A fit that has been begun: its cost so far, what it adds, where it stands, and what is roughly known of
    its derivative."""

    cost: float
    terms: tuple[Term, ...]
    problem: Problem
    x: FloatArray
    J: FloatArray | None = None


def cold_starts(pool: Sequence[Hypothesis], baseline: Fit) -> dict[str, float] | None:
    """Where every effect would begin beside the nominal drive; None where the drive is known better than by
    order of magnitude (calibration then stays in its valley)."""
    if not vague_drive(baseline.problem.parameters):
        return None
    evidence = baseline.problem.evidence
    torque = [
        float(np.std(e.columns[c])) for e in evidence for c in (MOTOR, "joint_torque_Nm") if c in e.columns
    ]
    found: dict[str, float] = {}
    for h in pool:
        values = dict(h.starts[0].values if h.effect.posture else h.starts[len(h.starts) // 2].values)
        if (
            h.amount.unit == "N m" and torque
        ):  # a share of the torques that go round: moments are not known beforehand
            values[h.amount.name] = 0.25 * float(np.median(torque))
        found |= {h.key(k): v for k, v in values.items() if not isinstance(v, str)}
    return found


def further(h: Hypothesis, at: Beginning) -> list[Mapping[str, float]]:
    """Values to begin from beside where calibration stands: effects that trade places sit in a valley of their
    own, and an earlier model that has this one may have found it; what that model lacks begins at a part of its
    amount."""
    model, cold = at.model, at.cold
    having = [m for m in at.known if h.name in m.added and len(m.terms) <= len(model.terms)]
    if not having:
        return [cold, *_far(h, at)] if cold is not None and model.terms else []
    best = max(having, key=lambda m: len(model.added & m.added))
    values = dict(best.fit.values)
    amounts = {t.key(t.amount.name) for t in model.terms if isinstance(t, Hypothesis)}
    for name, value in model.fit.values.items():
        values.setdefault(name, LIMITS.part * value if name in amounts else value)
    return [values]


def _far(h: Hypothesis, at: Beginning) -> list[Mapping[str, float]]:
    """The drive as it stands with most of a share that has a bound: a little of it sits in another valley."""
    amount, values = h.amount, at.model.fit.values
    if amount.log or not 0.0 < amount.maximum <= 1.0:
        return []
    starts = {h.key(k): v for k, v in h.starts[0].values.items() if not isinstance(v, str)}
    far = LIMITS.far * amount.bounds(at.model.fit.problem.config)[1]
    return [{**starts, **values, h.key(amount.name): far}]
