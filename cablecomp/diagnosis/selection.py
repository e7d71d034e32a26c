"""Forward selection of effects, judged on blocks that were not fitted, in two folds that change roles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cablecomp.diagnosis.blocks import Layout
from cablecomp.diagnosis.fitting import Model, Problem, seen_by, solve
from cablecomp.diagnosis.forms import Form
from cablecomp.diagnosis.hidden import Hidden, hidden_effects
from cablecomp.diagnosis.hypotheses import (
    Fold,
    all_rows,
    amplitude,
    at_noise,
    fit_roughly,
    floor_of,
    fold_of,
    polish,
    start_of,
    worth_a_search,
)
from cablecomp.diagnosis.judge import Score, Verdict, compare, judge
from cablecomp.diagnosis.parallel import side_by_side
from cablecomp.diagnosis.rivals import Round, rivals_of, settle
from cablecomp.diagnosis.screening import Probe, Progress, probe_all

CAREFUL = 3  # hypotheses that are then fitted with their shapes free
CLOSE = 0.5  # of the best one's gain, below which a hypothesis is not fitted carefully
FAR = 10.0  # times what the best one leaves, beyond which a hypothesis is not either
LEVEL = 0.01  # of a false support, all hypotheses together
# of the floor's mean square that an effect must remove as well (instants are searched over all rows), and
# only from where there is more than the floor
LEAST = (0.08, 0.04)  # in the first round, and later
LEAST_GAIN = 0.02  # share of the held-out mean square that an effect must remove
EFFECTS = 3
SILENT = 1.05  # mean square over the floor at which no further effect is looked for
WEAK = 2.0  # sds below which a fitted amplitude is no finding
REST = 1 / 3  # of what is left beyond noise, that the last effect of several may leave over


@dataclass(frozen=True)
class Selection:
    """The outcome: folds of the calibrated drive and of the final model, the rounds, and the model
    fitted to all rows.
    """

    baseline: Fold
    final: Fold
    model: Model
    base_model: Model
    rounds: tuple[Round, ...]
    layout: Layout
    probes: list[list[Probe]] = field(default_factory=list)
    hidden: tuple[Hidden, ...] = ()
    """What the calibrated drive alone could conceal."""


def select(
    problem: Problem,
    base: Model,
    groups: Sequence[Sequence[Form]],
    layout: Layout,
    rng: np.random.Generator,
    progress: Progress,
) -> Selection:
    """Add effects one at a time while held-out data support it; try to do without the earlier ones
    after each step.
    """
    baseline = fold_of(problem, base, layout)
    current, current_fold = base, baseline
    rounds: list[Round] = []
    first_probes: list[list[Probe]] = []
    reached: list[tuple[Model, Fold, int]] = []
    for number in range(EFFECTS):
        left = [g for g in groups if g[0].name not in {f.name for f in current.forms}]
        start = start_of(problem, current, layout)
        start = seen_by(problem.rough(), start) or start
        probes = probe_all(problem.rough(), start, left, progress)
        first_probes = first_probes or probes
        thorough = worth_a_search(problem, current, layout, number)
        models, asked = fit_roughly(problem.rough(), start, probes, layout, thorough, progress)
        round_, best = _one_round(problem, (current, current_fold), models, asked, layout, rng, progress)
        rounds.append(round_)
        if best is None:
            break
        current, current_fold = best
        if number > 0:
            current, current_fold = _without(problem, current, current_fold, layout, rng)
        reached.append((current, current_fold, len(rounds)))
        if at_noise(problem, current, layout, SILENT):
            break
    if reached:
        current, current_fold, count = _worth_their_place(problem, reached, layout)
        kept = [r if k < count else replace(r, accepted=None, rivals=()) for k, r in enumerate(rounds)]
        current, current_fold, settled = settle(problem, current, current_fold, kept, layout, rng)
        rounds = list(settled)
    hidden = tuple(hidden_effects(problem, base, first_probes, layout))
    return Selection(baseline, current_fold, current, base, tuple(rounds), layout, first_probes, hidden)


def _one_round(
    problem: Problem,
    now: tuple[Model, Fold],
    rough: Mapping[str, Model],
    asked: Mapping[str, float],
    layout: Layout,
    rng: np.random.Generator,
    progress: Progress,
) -> tuple[Round, tuple[Model, Fold] | None]:
    """Judge roughly fitted hypotheses on held-out rows, the front runners again with their shapes free; the
    round, and the model with the one that is accepted.
    """
    both = all_rows(layout)
    seen = {name: model for name, m in rough.items() if (model := seen_by(problem, m)) is not None}
    halves = side_by_side(lambda model: fold_of(problem, model, layout), list(seen.values()))
    folds = dict(zip(seen, halves, strict=True))
    verdict = _judged(now[1], folds, both, rng)
    models: dict[str, Model] = {}
    front = _front_runners(verdict)
    polished = side_by_side(lambda fold: polish(problem, fold, layout), [folds[s.name] for s in front])
    for score in front:
        progress(f"fitting {score.name} with its shapes free", 0.9)
        whole, fold = next(polished)
        if amplitude(problem, whole, layout) > WEAK:
            models[score.name], folds[score.name] = whole, fold
        else:  # its shape alone explains, not the effect
            del folds[score.name]
    if models:
        verdict = _judged(now[1], folds, both, rng)
    present = _energy(now[1], problem, layout)
    able = [s for s in verdict.scores if s.supported and s.name in models]
    least = LEAST[min(len(now[0].forms), 1)]
    best = next((s for s in able if s.heldout_gain * present > least and present > 1.0), None)
    rivals = () if best is None else rivals_of(best, verdict, folds, models, problem, both, rng)
    round_ = Round(now[0].name, verdict, asked, folds, best, rivals)
    return round_, None if best is None else (models[best.name], folds[best.name])


def _judged(base: Fold, folds: Mapping[str, Fold], both: Layout, rng: np.random.Generator) -> Verdict:
    return judge(
        base.residual_rad,
        {k: f.residual_rad for k, f in folds.items()},
        both,
        rng,
        LEVEL,
        least_gain=LEAST_GAIN,
    )


def _front_runners(verdict: Verdict) -> list[Score]:
    """Hypotheses worth a careful fit: the best ones, as far as they may yet overtake each other."""
    top = max((s.heldout_gain for s in verdict.scores), default=0.0)
    least = max(LEAST_GAIN, CLOSE * top, 1.0 - FAR * (1.0 - top))
    return [s for s in verdict.scores if s.heldout_gain > least][:CAREFUL]


def _without(
    problem: Problem, model: Model, fold: Fold, layout: Layout, rng: np.random.Generator
) -> tuple[Model, Fold]:
    """Drop an earlier effect where held-out data do not miss it, or where the rest explains them down to
    noise.
    """
    both = all_rows(layout)
    for k in range(len(model.forms) - 1):
        forms = tuple(f for j, f in enumerate(model.forms) if j != k)
        n = len(problem.parameters)
        keep = np.ones(len(model.z), dtype=bool)
        first = n + sum(f.size for f in model.forms[:k])
        keep[first : first + model.forms[k].size] = False
        smaller = solve(
            problem, forms, model.z[keep], layout.heldout | layout.training, model.J[:, keep], None
        )
        if smaller is None:
            continue
        smaller_fold = fold_of(problem, smaller, layout)
        lead = compare(smaller_fold.residual_rad, fold.residual_rad, both, rng)
        if lead.z < 2.0 or at_noise(problem, smaller, layout):
            return smaller, smaller_fold
    return model, fold


def _worth_their_place(
    problem: Problem, reached: Sequence[tuple[Model, Fold, int]], layout: Layout
) -> tuple[Model, Fold, int]:
    """The model after the last round that left a third or less of what was left beyond noise; that round's
    number.

    What is left by a law that is nearly right is nobody's, but one of many effects always fits a part of it.
    """
    left = [max(_energy(fold, problem, layout) - floor_of(problem, m), 0.0) for m, fold, _ in reached]
    last = next((k for k in range(len(left) - 1, 0, -1) if left[k] <= REST * left[k - 1]), 0)
    return reached[last]


def _energy(fold: Fold, problem: Problem, layout: Layout) -> float:
    kept = layout.heldout | layout.training
    return float(np.mean((fold.residual_rad[kept] / problem.sigma[kept]) ** 2))
