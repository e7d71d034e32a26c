"""Which other effects explain the data as well as the best one, also beside what is found later."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cablecomp.diagnosis.blocks import Layout
from cablecomp.diagnosis.fitting import INFLATION, Model, Problem, solve
from cablecomp.diagnosis.hypotheses import Fold, all_rows, floor_of, fold_of
from cablecomp.diagnosis.judge import Score, Verdict, compare
from cablecomp.diagnosis.starts import CAREFULLY
from cablecomp.signal.smoothing import FloatArray

SURE = 2.33  # standard errors of lead beyond which a rival is refuted: one in a hundred
APART = 0.03  # of the noise floor's mean square, by which a rival has to be worse for that


@dataclass(frozen=True)
class Rival:
    """A hypothesis that the data do not set apart from the best: its name, the best one's lead in standard
    errors, and its fit to all rows.
    """

    name: str
    z: float
    model: Model


@dataclass(frozen=True)
class Round:
    """One step of the selection: what was asked, what was fitted, the judgement against the model before."""

    base: str
    verdict: Verdict
    asked: Mapping[str, float]
    """Linear drop in cost of every hypothesis, as a share of the residual's energy."""
    folds: Mapping[str, Fold]
    accepted: Score | None = None
    rivals: tuple[Rival, ...] = ()
    """Hypotheses that the data do not set apart from the best."""


def rivals_of(
    best: Score,
    verdict: Verdict,
    folds: Mapping[str, Fold],
    models: Mapping[str, Model],
    problem: Problem,
    both: Layout,
    rng: np.random.Generator,
) -> tuple[Rival, ...]:
    """Supported hypotheses over which the best one's lead is not beyond doubt."""
    found = []
    own = candidate(problem, folds[best.name], models[best.name])
    for score in verdict.scores:
        if score.name == best.name or not score.supported:
            continue
        whole = models.get(score.name)
        z = lead(problem, own, candidate(problem, folds[score.name], whole), both, rng)
        if z < SURE:
            found.append(Rival(score.name, z, whole or folds[score.name].models[0]))
    return tuple(found)


@dataclass(frozen=True)
class Candidate:
    """Residuals (rad) of one model in units of its own noise: on held-out rows, and with all rows fitted (None
    if there is no such fit)."""

    heldout_rad: FloatArray
    fitted_rad: FloatArray | None = None


def candidate(problem: Problem, fold: Fold, whole: Model | None) -> Candidate:
    """A model as its rivals are compared with it: each in its own noise, for a model that differentiates noise is
    not refuted by it."""
    if whole is None:
        return Candidate(fold.residual_rad)
    own = np.sqrt(floor_of(problem, whole))
    return Candidate(fold.residual_rad / own, whole.residual * problem.sigma * INFLATION / own)


def lead(
    problem: Problem, best: Candidate, rival: Candidate, both: Layout, rng: np.random.Generator
) -> float:
    """Standard errors by which the best one explains all rows better, or where the rival was not fitted to all,
    predicts held-out ones better.

    A law that is a little worse when half the rows are to place its instant or its time constant is not refuted
    by that. However many the rows, a lead of less than `APART` is none: no law is exact to that.
    """
    if best.fitted_rad is None or rival.fitted_rad is None:
        first, second = rival.heldout_rad, best.heldout_rad
    else:
        first, second = rival.fitted_rad, best.fitted_rad
    kept = both.heldout
    gap = float(np.mean((first[kept] ** 2 - second[kept] ** 2) / problem.sigma[kept] ** 2))
    z = float(compare(first, second, both, rng).z)
    return min(z, SURE * gap / APART) if z > 0.0 else z


def settle(
    problem: Problem,
    model: Model,
    fold: Fold,
    rounds: Sequence[Round],
    layout: Layout,
    rng: np.random.Generator,
) -> tuple[Model, Fold, tuple[Round, ...]]:
    """Ask the rivals of every effect again, in its place beside the others that were found since.

    What ties while much is unexplained may be plain once the rest is known. A rival that predicts better
    there, beyond doubt, takes the place.
    """
    both = all_rows(layout)
    settled = []
    for round_ in rounds:
        best, names = round_.accepted, [f.name for f in model.forms]
        others = [r for r in round_.rivals if r.name not in names]
        if best is not None and best.name in names and len(names) > 1 and others:
            place = names.index(best.name)
            own = candidate(problem, fold, model)
            found: list[Rival] = []
            for rival in others:
                whole = _in_place(problem, model, place, rival.model, layout)
                if whole is None:
                    continue
                other = fold_of(problem, whole, layout)
                theirs = candidate(problem, other, whole)
                z = lead(problem, own, theirs, both, rng)
                if z < -SURE:
                    model, fold, best, found = whole, other, replace(best, name=rival.name), []
                    own = theirs
                elif z < SURE:
                    found.append(Rival(rival.name, z, whole))
            others = found
        settled.append(replace(round_, accepted=best, rivals=tuple(others)))
    return model, fold, tuple(settled)


def _in_place(problem: Problem, model: Model, place: int, rival: Model, layout: Layout) -> Model | None:
    """The model with another effect in one place, fitted to all rows."""
    forms = (*model.forms[:place], rival.forms[-1], *model.forms[place + 1 :])
    xs = (*model.x[:place], rival.x[-1], *model.x[place + 1 :])
    return solve(
        problem,
        forms,
        np.concatenate([model.c, *xs]),
        layout.heldout | layout.training,
        iterations=CAREFULLY,
        renew=True,
    )
