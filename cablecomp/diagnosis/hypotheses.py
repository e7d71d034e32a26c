"""How hypotheses are fitted: roughly all of them, on either half those that promise, with free shapes the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cablecomp.diagnosis.blocks import Layout
from cablecomp.diagnosis.fitting import (
    INFLATION,
    Mask,
    Model,
    Problem,
    bounds_of,
    cost,
    evaluate,
    prior_of,
    refit,
    solve,
)
from cablecomp.diagnosis.forms import Form, FreedForm, freed, has_instant
from cablecomp.diagnosis.parallel import side_by_side
from cablecomp.diagnosis.screening import Probe, Progress, attempt
from cablecomp.diagnosis.starts import CAREFULLY, UNLIKELY, deepest, pulls
from cablecomp.signal.smoothing import FloatArray

FITTED = 7  # hypotheses that are fitted in each round, of all that were asked
LEAST_SHARE = 0.1  # of the best linear drop that a hypothesis must promise to be fitted
INSTANT_STEPS_S = (2.0, 0.5, 0.15, 0.04, 0.01)
REACH = 4  # such steps either way that an event is looked for
WORTH = (2.0, 4.0)  # mean square over the floor for that, in the first round and later
FLOORED = 6  # replicas by which the floor of a model is found
NOISE = 1.25  # mean square over the floor at which nothing is left to explain


@dataclass(frozen=True)
class Fold:
    """A model fitted on each of the two halves: its residual (rad) on every row, from the half that did
    not see it.
    """

    models: tuple[Model, Model]
    residual_rad: FloatArray


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


def start_of(problem: Problem, model: Model, layout: Layout) -> Model:
    """Where hypotheses are fitted from: the model, or where its calibration has gone too far to be likely,
    the model with priors as firm as a misfit of this size leaves them.

    A calibration that pays for a missing effect may end in a valley of its own.
    """
    mask = layout.heldout | layout.training
    excess = float(np.mean((model.residual[mask] * INFLATION) ** 2))
    if excess < 2.0 * NOISE or float(np.max(np.abs(pulls(problem, model)), initial=0.0)) < UNLIKELY:
        return model
    nominal = _nominal(problem, model)
    found = solve(problem, model.forms, nominal, mask, iterations=CAREFULLY, renew=True, firm=excess)
    return model if found is None else found


def worth_a_search(problem: Problem, model: Model, layout: Layout, number: int) -> bool:
    """Whether so much is left that effects are looked for which show no slope: from round to round more."""
    kept = layout.heldout | layout.training
    left = float(np.mean((model.residual[kept] * INFLATION) ** 2))
    return left > WORTH[min(number, 1)] * floor_of(problem, model)


def _nominal(problem: Problem, model: Model) -> FloatArray:
    """The model's coordinates, those with a prior put back to nominal."""
    z = model.z
    z[: len(model.c)] = [
        0.0 if np.isfinite(p.prior_sd) else v for p, v in zip(problem.parameters, model.c, strict=True)
    ]
    return z


def fit_roughly(
    problem: Problem,
    start: Model,
    probes: Sequence[Sequence[Probe]],
    layout: Layout,
    thorough: bool,
    progress: Progress,
) -> tuple[dict[str, Model], dict[str, float]]:
    """Fit every hypothesis to all rows; returns the most promising ones, and what was promised of each."""
    both = layout.heldout | layout.training
    before = _cost(problem, start, both)
    asked: dict[str, float] = {}
    models: dict[str, Model] = {}
    answers = side_by_side(lambda group: attempt(problem, start, group, both, thorough), probes)
    for k, group in enumerate(probes):
        name = group[0].form.name
        progress(f"fitting {name}", k / len(probes))
        model, asked[name] = next(answers)
        if model is not None:
            models[name] = model
    won = {name: 1.0 - _cost(problem, model, both) / before for name, model in models.items()}
    limit = LEAST_SHARE * max(won.values(), default=0.0)
    chosen = [n for n, v in sorted(won.items(), key=lambda i: -i[1])[:FITTED] if v > max(limit, 0.0)]
    return {name: models[name] for name in chosen}, asked


def _cost(problem: Problem, model: Model, mask: Mask) -> float:
    return cost(model.residual, model.z, prior_of(problem, model.forms), mask)


def polish(problem: Problem, fold: Fold, layout: Layout) -> tuple[Model, Fold]:
    """Free the shapes of the effects: fit all rows, then either half, with the sensitivities of the whole.

    Instants of events are the exception: the halves take them from all rows, for an event inside a held-out
    block cannot be placed without it.
    """
    both = layout.heldout | layout.training
    start = min(fold.models, key=lambda m: float(m.residual[both] @ m.residual[both]))
    forms, z = free_shapes(start)
    z = _instants_found(problem, forms, z, both)
    whole = solve(problem, forms, z, both, iterations=CAREFULLY, renew=True) or start
    whole = deepest(problem, whole, both)
    halves = []
    for mask in (layout.training, layout.heldout):
        forms, z, J = _placed(problem, whole)
        halves.append(solve(problem, forms, z, mask, J, whole.residual, CAREFULLY, renew=True) or whole)
    return whole, _fold(problem, halves[0], halves[1], layout)


def _instants_found(problem: Problem, forms: Sequence[Form], z: FloatArray, mask: Mask) -> FloatArray:
    """The coordinates with the instants of events moved to where the misfit is least, in ever finer steps.

    A misfit is no smooth function of an instant, so no slope leads there.
    """
    prior, (low, high) = prior_of(problem, forms), bounds_of(problem, forms)
    end = len(problem.parameters)

    def reached(trial: FloatArray) -> float:
        found = evaluate(problem, forms, trial)
        return np.inf if found is None else cost(found, trial, prior, mask)

    for form in forms:
        end += form.size
        if not has_instant(form):
            continue
        place, unit = end - 1, 20.0 / (form.limits["time_s"][1] - form.limits["time_s"][0])
        for step in INSTANT_STEPS_S:
            tries = [z.copy() for _ in range(2 * REACH + 1)]
            for k, trial in enumerate(tries):
                trial[place] = np.clip(z[place] + (k - REACH) * step * unit, low[place], high[place])
            z = min(tries, key=reached)
    return z


def amplitude(problem: Problem, model: Model, layout: Layout) -> float:
    """Amplitudes of the last effect together, in standard deviations of the fit."""
    mask = layout.heldout | layout.training
    form, x = model.forms[-1], model.x[-1]
    A = model.J[mask].T @ model.J[mask] + np.diag(prior_of(problem, model.forms))
    scale = np.sqrt(np.maximum(np.diag(A), 1e-300))
    covariance = np.linalg.pinv(A / np.outer(scale, scale), rcond=1e-11) / np.outer(scale, scale)
    first = len(model.z) - form.size
    size = form.size - (len(form.shapes) if isinstance(form, FreedForm) else 0)
    own = covariance[first : first + size, first : first + size]
    return float(np.sqrt(x[:size] @ np.linalg.pinv(own, rcond=1e-10) @ x[:size]))


def _placed(problem: Problem, model: Model) -> tuple[tuple[Form, ...], FloatArray, FloatArray]:
    """The model's forms, coordinates and sensitivities, with the instants of its events taken as known."""
    forms: list[Form] = []
    keep = np.ones(len(model.z), dtype=bool)
    end = len(problem.parameters)
    for form, x in zip(model.forms, model.x, strict=True):
        end += form.size
        if isinstance(form, FreedForm) and has_instant(form):
            keep[end - 1] = False
            form = form.fixed_shapes(x.tolist())
        forms.append(form)
    return tuple(forms), model.z[keep], model.J[:, keep]


def free_shapes(model: Model) -> tuple[tuple[Form, ...], FloatArray]:
    """The model's forms with their shapes free, and its coordinates in them."""
    forms = tuple(freed(f) for f in model.forms)
    xs = [np.concatenate([x, np.zeros(f.size - len(x))]) for f, x in zip(forms, model.x, strict=True)]
    return forms, np.concatenate([model.c, *xs])


def floor_of(problem: Problem, model: Model) -> float:
    """Mean square that noise alone leaves of this model, over the floor of the plain drive; 1 at least."""
    plain = float(np.mean(problem.sigma**2))
    return max(1.0, problem.noise_rad(problem.joint(model.c, model.entries()), FLOORED) ** 2 / plain)


def at_noise(problem: Problem, model: Model, layout: Layout, most: float = NOISE) -> bool:
    """Whether no more than `most` times the floor's mean square is left."""
    kept = layout.heldout | layout.training
    left = float(np.mean((model.residual[kept] * INFLATION) ** 2))
    return left < most or left < most * floor_of(problem, model)
