"""Parameters that are not the same everywhere: each session's own, or growing with a condition.

Asked out of the derivative of a fit alone: a parameter's column cut by session, or weighted by the condition, is what a
value of each session's own, or a gain per unit, would do.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from cablecomp.diagnosis.explain.linear import anchor
from cablecomp.diagnosis.folds import kind_of_parts, shown_apart
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects import catalogue
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parameter import Parameter, by_condition
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import FloatArray

OWN_LEAVES: Final = 0.5
"""Share of the square of what is left, below which it is said what a value of each session's own would leave though
nothing judges it (a sheath at five bends that nothing recorded: 0.2)."""
POSTURES: Final = ("_rad", "_deg", "_m")
"""Ends of the names of conditions that say how the path lies."""


@dataclass(frozen=True)
class Dependence:
    """A parameter (`parameter`, as `with_values` takes it) that depends on `on`: "session", or a condition's name."""

    parameter: str
    on: str

    @property
    def name(self) -> str:
        """For lists and pages."""
        return f"{self.parameter} by {self.on}"

    @property
    def of_drive(self) -> bool:
        """Whether it is a parameter of the drive's own."""
        return not self.parameter.startswith("effect.")

    @property
    def mounted_anew(self) -> bool:
        """Whether it is how the drive stands in each session, and no effect."""
        return self.of_drive and self.on == "session"

    def belongs_to(self, term: Any) -> bool:
        """Whether it is a parameter of this effect."""
        return hasattr(term, "effect") and self.parameter.startswith(f"effect.{term.effect.id}.")

    def undone(self, problem: Problem) -> Problem:
        """The problem with one common value again."""
        if self.on != "session":
            kept = tuple(p for p in problem.parameters if p.name != f"{self.parameter}~{self.on}")
            return replace(problem, parameters=kept)
        own = [p for p in problem.parameters if p.base == self.parameter and p.session]
        common = replace(own[0], name=self.parameter)
        first = problem.parameters.index(own[0])
        others = [p for p in problem.parameters if p not in own]
        others.insert(first, common)
        return replace(problem, parameters=tuple(others))


def may_depend(parameter: str, condition: str) -> bool:
    """Whether a parameter may change with a condition: with a posture, the pretension and what acts along the
    path; with anything else (a temperature, an age), every amount."""
    if not condition.endswith(POSTURES):
        return not parameter.endswith(("_rad", "_m", "_s"))
    return _along_path(parameter)


def _along_path(parameter: str) -> bool:
    """Whether it is what another posture, or mounting the drive anew, may change: how tight the cables are, how
    their path lies."""
    if parameter.startswith("effect."):
        effect = catalogue()[parameter.split(".")[1]]
        return effect.posture and not effect.parameter(parameter.split(".")[2]).shape
    return parameter == "pretension_N"


def ask_dependences(fit: Fit, terms: Sequence[Any], by: str) -> list[tuple[Dependence, float, Problem]]:
    """The dependences that promise most: each with the cost after a linear step, and the problem that has it.

    `by`: what is left out in turn; a session of one recording shows a value of its own where blocks of it are.
    """
    problem = fit.problem
    here = anchor(fit)
    left = here.beyond(fit.residual)
    energy = float(left @ left)
    found: list[tuple[Dependence, float, Problem]] = []
    owners = _owners(problem, len(fit.residual))
    known = {t.name for t in terms if isinstance(t, Dependence)}
    for k, p in enumerate(problem.parameters):
        if p.session or p.condition:
            continue
        for dependence, columns, changed in _ways(problem, p, fit.J[:, k], owners, by):
            if dependence.name in known:
                continue
            own = np.column_stack([here.beyond(c) for c in columns])
            scale = np.linalg.norm(own, axis=0)
            if not np.all(scale > 1e-9):
                continue
            best = np.linalg.lstsq(own / scale, left, rcond=1e-6)[0]
            cost = 0.5 * float(np.sum((left - own / scale @ best) ** 2))
            found.append((dependence, cost, changed))
    found.sort(key=lambda f: f[1])
    return [f for f in found if 2.0 * f[1] < LIMITS.dependence * energy][: LIMITS.dependences]


def unjudged(fit: Fit, terms: Sequence[Any], by: str) -> Iterator[tuple[Dependence, float]]:
    """What leaves far less where each session has its own, with the share of the square left then, and what sessions of
    one recording each leave nothing to judge by."""
    asked = {d for d, _, _ in ask_dependences(fit, terms, by)}
    told = {t.parameter for t in terms if isinstance(t, Dependence)}
    left = anchor(fit).beyond(fit.residual)
    for d, cost, _ in ask_dependences(fit, terms, "block"):
        share = 2.0 * cost / float(left @ left)
        if d.on == "session" and d not in asked and d.parameter not in told and share < OWN_LEAVES:
            yield d, share


def gain_is_told(problem: Problem, condition: str) -> bool:
    """Whether a gain by a condition may be asked of these recordings."""
    blocks = len(problem.sessions) == 1 and kind_of_parts(problem) == "block"
    return tell_a_gain([e.condition[condition] for e in problem.evidence], blocks)


def tell_a_gain(values: Sequence[float], blocks: bool = False) -> bool:
    """Whether recordings with these values of a condition tell a gain by it while a part is left out: whole ones, or
    `blocks` of those of one session, where the rest of each still shows its own value."""
    counts = np.unique(values, return_counts=True)[1]
    each = 1 if blocks else LIMITS.of_each
    return len(counts) >= LIMITS.conditions or (len(counts) > 1 and int(min(counts)) >= each)


def _ways(
    problem: Problem, p: Parameter, column: FloatArray, owners: FloatArray, by: str
) -> list[tuple[Dependence, list[FloatArray], Problem]]:
    ways: list[tuple[Dependence, list[FloatArray], Problem]] = []
    sessions, shown = problem.sessions, shown_apart(problem, by)
    place = problem.parameters.index(p)
    # one recording alone shows how tight its cables are, but nothing is left of it that would judge a law of its own
    judged = len(shown) > 1 and not (p.of_effect and len(shown) < len(sessions))
    if judged and _along_path(p.base) and not problem.states(p.base):
        cut = []
        for s in sessions[1:]:
            mine = np.array([e.session == s for e in problem.evidence])
            inside = (owners >= 0) & mine[np.maximum(owners, 0).astype(np.int64)]
            cut.append(np.where(inside, column, 0.0))
        ways.append((Dependence(p.name, "session"), cut, problem.with_own(place)))
    for condition in problem.evidence[0].condition:
        if not gain_is_told(problem, condition) or not may_depend(p.base, condition):
            continue
        values = [e.condition[condition] for e in problem.evidence]
        centred = np.array(values) - np.mean(values)
        weight = np.where(owners >= 0, centred[np.maximum(owners, 0).astype(np.int64)], 0.0)
        gain = by_condition(p, condition, float(np.ptp(values)))
        free = (*problem.parameters, gain)
        ways.append((Dependence(p.name, condition), [column * weight], replace(problem, parameters=free)))
    return ways


def _owners(problem: Problem, length: int) -> FloatArray:
    """Recording of each row of the residual, -1 for penalties and priors."""
    found = np.full(length, -1.0)
    for c, span in problem.spans().items():
        found[span] = problem.owners(c)
    return found
