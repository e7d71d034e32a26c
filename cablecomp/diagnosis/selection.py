"""Forward selection of effects, judged on blocks that were not fitted, in two folds that change roles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import erf, sqrt

import numpy as np

from cablecomp.diagnosis.blocks import Layout
from cablecomp.diagnosis.fitting import INFLATION, Mask, Model, Problem, refit, solve
from cablecomp.diagnosis.forms import Form, FreedForm, freed
from cablecomp.diagnosis.judge import Score, Verdict, compare, judge
from cablecomp.diagnosis.screening import Guess, Probe, Progress, best_guesses, fit_guess, probe_all, refine
from cablecomp.identification.smoothing import FloatArray

FITTED = 7  # hypotheses that are fitted in each round, of all that were asked
LEAST_SHARE = 0.1  # of the best linear drop that a hypothesis must promise to be fitted
CAREFUL = 3  # hypotheses that are then fitted with their shapes free
CLOSE = 0.5  # of the best one's gain, below which a hypothesis is not fitted carefully
LEVEL = 0.01  # of a false support, all hypotheses together
# of the floor's mean square that an effect must remove as well: instants are searched over all rows
LEAST = 0.08
LEAST_GAIN = 0.02  # share of the held-out mean square that an effect must remove
EFFECTS = 3
POLISHES = 4  # careful fits of one hypothesis in a row, while they gain
NOISE = 1.25  # mean square over the floor at which nothing is left to explain
SURE = 3.0  # standard errors of lead beyond which a rival is refuted


@dataclass(frozen=True)
class Fold:
    """A model fitted on each of the two halves: its residual (rad) on every row, from the half that did
    not see it.
    """

    models: tuple[Model, Model]
    residual_rad: FloatArray


@dataclass(frozen=True)
class Round:
    """One step of the selection: what was asked, what was fitted, the judgement against the model before."""

    base: str
    verdict: Verdict
    asked: Mapping[str, float]
    """Linear drop in cost of every hypothesis, as a share of the residual's energy."""
    folds: Mapping[str, Fold]
    accepted: Score | None = None
    rivals: tuple[tuple[str, float], ...] = ()
    """Hypotheses that the data do not set apart from the best: name and z of the best one's lead."""


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
    both = all_rows(layout)
    baseline = fold_of(problem, base, layout)
    current, current_fold = base, baseline
    rounds: list[Round] = []
    first_probes: list[list[Probe]] = []
    for number in range(EFFECTS):
        left = [g for g in groups if g[0].name not in {f.name for f in current.forms}]
        probes = probe_all(problem, current, left, progress)
        first_probes = first_probes or probes
        folds, asked = _fit_folds(problem, current, current_fold, probes, layout, progress)
        verdict = _judged(current_fold, folds, both, rng)
        models: dict[str, Model] = {}
        for score in _front_runners(verdict):
            progress(f"fitting {score.name} with its shapes free", 0.9)
            models[score.name], folds[score.name] = _polish(problem, folds[score.name], layout)
        if models:
            verdict = _judged(current_fold, folds, both, rng)
        present = _energy(current_fold, problem, layout)
        best = next(
            (
                s
                for s in verdict.scores
                if s.supported and s.name in models and s.heldout_gain * present > LEAST
            ),
            None,
        )
        rivals = () if best is None else _rivals(best, verdict, folds, models, problem, both, rng)
        rounds.append(Round(current.name, verdict, asked, folds, best, rivals))
        if best is None:
            break
        current, current_fold = models[best.name], folds[best.name]
        if number > 0:
            current, current_fold = _without(problem, current, current_fold, layout, rng)
        if _at_noise(current, layout):
            break
    return Selection(baseline, current_fold, current, base, tuple(rounds), layout, first_probes)


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
    near = [s for s in verdict.scores if s.heldout_gain > max(LEAST_GAIN, CLOSE * top)]
    return near[:CAREFUL]


def all_rows(layout: Layout) -> Layout:
    """Both halves as held-out rows: each row's residual comes from the fold that did not fit it."""
    kept = layout.heldout | layout.training
    numbers = np.concatenate([layout.training_blocks, layout.heldout_blocks])
    return Layout(layout.block, kept, kept, np.sort(numbers), np.sort(numbers))


def fold_of(problem: Problem, model: Model, layout: Layout) -> Fold:
    """Refit a model on either half."""
    a = refit(problem, model, layout.training)
    b = refit(problem, model, layout.heldout)
    return _fold(problem, a, b, layout)


def _fold(problem: Problem, a: Model, b: Model, layout: Layout) -> Fold:
    held = layout.block % 2 == 1
    return Fold((a, b), np.where(held, a.residual, b.residual) * problem.sigma * INFLATION)


def _fit_folds(
    problem: Problem,
    base: Model,
    base_fold: Fold,
    probes: Sequence[Sequence[Probe]],
    layout: Layout,
    progress: Progress,
) -> tuple[dict[str, Fold], dict[str, float]]:
    """Fit the most promising hypotheses on both halves."""
    masks = (layout.training, layout.heldout)
    ranked = [
        best_guesses(problem, _shifted(base, model), probes, mask)
        for model, mask in zip(base_fold.models, masks, strict=True)
    ]
    energy = float(base.residual @ base.residual)
    asked: dict[str, float] = {}
    for pairs in ranked:
        for found, _ in pairs:
            name = found.probe.form.name
            asked[name] = asked.get(name, 0.0) + found.drop / energy
    limit = LEAST_SHARE * max(asked.values(), default=0.0)
    chosen = [n for n, v in sorted(asked.items(), key=lambda i: -i[1])[:FITTED] if v > limit]
    folds: dict[str, Fold] = {}
    for k, name in enumerate(chosen):
        progress(f"fitting {name}", k / len(chosen))
        models: list[Model | None] = []
        for model, mask, pairs in zip(base_fold.models, masks, ranked, strict=True):
            found, group = next(p for p in pairs if p[0].probe.form.name == name)
            start = _shifted(base, model)
            best: Guess = refine(problem, start, found, mask, group)
            models.append(fit_guess(problem, start, best, mask))
        a, b = models
        if a is not None and b is not None:
            folds[name] = _fold(problem, a, b, layout)
    return folds, asked


def _shifted(base: Model, fitted: Model) -> Model:
    """The half's own model, with the sensitivities of the one fitted to all rows where it has none better."""
    return Model(fitted.forms, fitted.c, fitted.x, fitted.residual, base.J if fitted.J is None else fitted.J)


def _polish(problem: Problem, fold: Fold, layout: Layout) -> tuple[Model, Fold]:
    """Free the shapes of the effects: fit all rows, then either half.

    Instants of events are the exception: the halves take them from all rows, for an event inside a held-out
    block cannot be placed without it.
    """
    both = layout.heldout | layout.training
    start = min(fold.models, key=lambda m: float(m.residual[both] @ m.residual[both]))
    whole = _careful(problem, *free_shapes(start), both) or start
    halves = []
    for model, mask in zip(fold.models, (layout.training, layout.heldout), strict=True):
        forms, z = _placed(whole) if _has_instant(whole) else free_shapes(model)
        halves.append(_careful(problem, forms, z, mask) or model)
    return whole, _fold(problem, halves[0], halves[1], layout)


def _careful(problem: Problem, forms: Sequence[Form], z: FloatArray, mask: Mask) -> Model | None:
    """Fit with fresh sensitivities, again and again while it gains."""
    model: Model | None = None
    for _ in range(POLISHES):
        found = solve(problem, forms, z, mask, None, None, iterations=8, refresh=2)
        if found is None:
            break
        before = np.inf if model is None else float(model.residual[mask] @ model.residual[mask])
        model, z = found, found.z
        now = float(found.residual[mask] @ found.residual[mask])
        if now > 0.97 * before or now * INFLATION**2 < NOISE * int(mask.sum()):
            break
    return model


def _has_instant(model: Model) -> bool:
    return any(p.name == "time_s" for f in model.forms for p in f.shapes)


def _placed(model: Model) -> tuple[tuple[Form, ...], FloatArray]:
    """The model with the instants of its events taken as known."""
    forms: list[Form] = []
    xs: list[FloatArray] = []
    for form, x in zip(model.forms, model.x, strict=True):
        if isinstance(form, FreedForm) and [p.name for p in form.shapes] == ["time_s"]:
            x = x[: form.size - 1]
            form = form.fixed_shapes(model.x[len(forms)].tolist())
        forms.append(form)
        xs.append(x)
    return tuple(forms), np.concatenate([model.c, *xs])


def free_shapes(model: Model) -> tuple[tuple[Form, ...], FloatArray]:
    """The model's forms with their shapes free, and its coordinates in them."""
    forms = tuple(freed(f) for f in model.forms)
    xs = [np.concatenate([x, np.zeros(f.size - len(x))]) for f, x in zip(forms, model.x, strict=True)]
    return forms, np.concatenate([model.c, *xs])


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
        if lead.z < 2.0 or _at_noise(smaller, layout):
            return smaller, smaller_fold
    return model, fold


def _rivals(
    best: Score,
    verdict: Verdict,
    folds: Mapping[str, Fold],
    models: Mapping[str, Model],
    problem: Problem,
    both: Layout,
    rng: np.random.Generator,
) -> tuple[tuple[str, float], ...]:
    """Supported hypotheses over which the best one's lead is not beyond doubt.

    Neither on held-out rows nor with all rows fitted; the second comparison is for events: one that falls
    into a held-out block cannot be placed by the other half.
    """
    unit = problem.sigma * INFLATION
    found = []
    for score in verdict.scores:
        if score.name == best.name or not score.supported:
            continue
        z = float(compare(folds[score.name].residual_rad, folds[best.name].residual_rad, both, rng).z)
        if score.name in models:
            whole = compare(models[score.name].residual * unit, models[best.name].residual * unit, both, rng)
            z = max(z, float(whole.z))
        if z < SURE:
            found.append((score.name, z))
    return tuple(found)


def confidence(rivals: Sequence[tuple[str, float]]) -> float:
    """Probability that the best hypothesis predicts better than each rival, by the normal law of its lead."""
    doubt = sum(0.5 * (1.0 - erf(z / sqrt(2.0))) for _, z in rivals)
    return 1.0 / (1.0 + 2.0 * doubt) if rivals else 0.99


def _energy(fold: Fold, problem: Problem, layout: Layout) -> float:
    kept = layout.heldout | layout.training
    return float(np.mean((fold.residual_rad[kept] / problem.sigma[kept]) ** 2))


def _at_noise(model: Model, layout: Layout) -> bool:
    kept = layout.heldout | layout.training
    return float(np.mean((model.residual[kept] * INFLATION) ** 2)) < NOISE
