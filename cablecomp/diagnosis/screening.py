"""Ask every effect whether the residual points along it: one or two simulations each, before any
expensive fit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cablecomp.diagnosis.fitting import (
    INFLATION,
    Mask,
    Model,
    Problem,
    bounded_step,
    bounds_of,
    cost,
    evaluate,
    prior_of,
    solve,
)
from cablecomp.diagnosis.forms import Form
from cablecomp.signal.smoothing import FloatArray

Progress = Callable[[str, float], None]
CLEAR = 0.1  # share of the cost that an effect must remove at once
HOPELESS = 0.01  # share of the cost below which a linear promise is not followed
FORCED = (0.5, 0.15)  # sizes that it is else given to begin with, in residuals
HIDDEN = 0.1  # weight of what calibration can take up of an effect, where its size is chosen
UNSEEN = 1e-3  # of the noise: an effect whose largest contribution is smaller is not asked further


@dataclass(frozen=True)
class Probe:
    """One form with its weighted sensitivities D at x = 0 (per unit of x), beyond the base model."""

    form: Form
    D: FloatArray
    length: float
    """RMS of D over the noise, after what the base model's own coordinates can explain is taken out:
    the information.
    """


def probe(problem: Problem, base: Model, form: Form, project: FloatArray) -> Probe | None:
    """Sensitivity to one form by a finite step of physical size, its unit chosen so that x = 1 is about
    the size of the residual.
    """
    size = float(np.sqrt(np.mean(base.residual**2))) * INFLATION
    target = max(0.7 * size, 1.0)
    columns: list[FloatArray] = []
    for _ in range(4):
        columns = _columns(problem, base, form)
        if not columns:
            form = form.scaled([0.1] * len(form.amplitudes))
            continue
        # what calibration takes up counts a little: else a hidden effect would be asked in absurd sizes
        seen = [_length(c, project) + HIDDEN * _size(c) for c in columns]
        factor = target / max(max(seen), 1e-12)
        smaller = form.scaled([min(max(factor, 1e-4), 1e4)] * len(form.amplitudes))
        if 0.5 < factor < 2.0 or smaller.scales == form.scales:
            break
        form = smaller
    if not columns or max(_size(c) for c in columns) < UNSEEN:
        return None
    D = np.stack(columns, axis=1)
    return Probe(form, D, max(_length(c, project) for c in columns))


def _columns(problem: Problem, base: Model, form: Form) -> list[FloatArray]:
    columns = []
    for k in range(form.size):
        x = np.zeros(form.size)
        x[k] = 1.0
        found = evaluate(problem, (*base.forms, form), np.concatenate([base.z, x]))
        if found is None:
            return []
        columns.append(base.residual - found)
    return columns


def _length(column: FloatArray, project: FloatArray) -> float:
    """RMS over the noise of a column, less its part along the calibration."""
    rest = column - project @ (project.T @ column)
    return float(np.sqrt(np.mean(rest**2))) * INFLATION


def _size(column: FloatArray) -> float:
    """RMS over the noise of a column."""
    return float(np.sqrt(np.mean(column**2))) * INFLATION


def projector(problem: Problem, base: Model) -> FloatArray:
    """Orthonormal columns that span the base model's own sensitivities (as far as the data outweigh the
    priors).
    """
    J = base.J
    scale = np.sqrt(np.maximum(np.sum(J**2, axis=0), 1e-300))
    u, s, _ = np.linalg.svd(J / scale, full_matrices=False)
    return u[:, s > 1e-6]


def probe_all(
    problem: Problem, base: Model, groups: Sequence[Sequence[Form]], progress: Progress
) -> list[list[Probe]]:
    """Probe every form of every group."""
    project = projector(problem, base)
    found: list[list[Probe]] = []
    for k, group in enumerate(groups):
        progress(f"asking {group[0].name}", k / len(groups))
        seen = [probe(problem, base, form, project) for form in group]
        probes = [p for p in seen if p is not None]
        if probes:
            found.append(probes)
    return found


@dataclass(frozen=True)
class Guess:
    """A form with its linear estimate on some rows: coordinates z, and the drop in cost that the linear
    model expects.
    """

    probe: Probe
    z: FloatArray
    drop: float


def guess(problem: Problem, base: Model, probe_: Probe, mask: Mask) -> Guess:
    """Linear, bounded estimate of one form together with the base model's coordinates."""
    forms = (*base.forms, probe_.form)
    prior, (low, high) = prior_of(problem, forms), bounds_of(problem, forms)
    J = np.hstack([base.J, probe_.D])
    z = np.concatenate([base.z, np.zeros(probe_.form.size)])
    step = bounded_step(J[mask], base.residual[mask], z, prior, low, high)
    left = base.residual - J @ step
    before = cost(base.residual, z, prior, mask)
    return Guess(probe_, z + step, before - cost(left, z + step, prior, mask))


def refine(problem: Problem, base: Model, best: Guess, mask: Mask, group: Sequence[Probe]) -> Guess:
    """Look between the grid points beside the best one, for forms with one shape."""
    form = best.probe.form
    if len(form.shapes) != 1 or best.drop <= 0.0:
        return best
    points = sorted({p.form.point[0] for p in group})
    if len(points) < 2:
        return best
    place = points.index(form.point[0])
    log = form.shapes[0].log
    low, high = form.limits[form.shapes[0].name]
    left = points[place - 1] if place > 0 else low
    right = points[place + 1] if place + 1 < len(points) else high
    project = projector(problem, base)
    for _ in range(3):
        here = best.probe.form.point[0]
        tries = [_middle(left, here, log), _middle(here, right, log)]
        for value in tries:
            found = probe(problem, base, best.probe.form.at((value,)), project)
            if found is None:
                continue
            guessed = guess(problem, base, found, mask)
            if guessed.drop > best.drop:
                best = guessed
        now = best.probe.form.point[0]
        left, right = (left, here) if now < here else ((here, right) if now > here else (tries[0], tries[1]))
    return best


def _middle(a: float, b: float, log: bool) -> float:
    return float(np.sqrt(a * b)) if log and a > 0.0 else 0.5 * (a + b)


def attempt(
    problem: Problem, base: Model, group: Sequence[Probe], mask: Mask, thorough: bool
) -> tuple[Model | None, float]:
    """Fit the effect of a group from its most promising grid point; also the share of the cost that the
    linear answer promised. None if nothing is won.

    Where the linear answer promises little, and `thorough`, the effect is given a size and the calibration
    time to make room for it: a calibration that has paid for a missing effect hides the slope towards it.
    """
    best = max((guess(problem, base, p, mask) for p in group), key=lambda g: g.drop)
    best = refine(problem, base, best, mask, group)
    prior = prior_of(problem, base.forms)
    before = cost(base.residual, base.z, prior, mask)
    promise = best.drop / before
    model = fit_guess(problem, base, best, mask) if promise > HOPELESS or thorough else None
    if not thorough or (model is not None and _cost(problem, model, mask) < (1.0 - CLEAR) * before):
        return model, promise
    tried = [model] if model is not None else []
    tried += [
        m for p in group for x in _sizes(p.form) if (m := _forced(problem, base, p, x, mask)) is not None
    ]
    tried = [m for m in tried if _cost(problem, m, mask) < before]
    return min(tried, key=lambda m: _cost(problem, m, mask), default=None), promise


def _sizes(form: Form) -> tuple[float, ...]:
    """Sizes to begin with, of either sign where the effect has one: friction answers the signs differently."""
    both = not form.phase and form.bounds()[0][0] < 0.0
    return (FORCED[0], -FORCED[0]) if both else FORCED


def _cost(problem: Problem, model: Model, mask: Mask) -> float:
    return cost(model.residual, model.z, prior_of(problem, model.forms), mask)


def _forced(problem: Problem, base: Model, probe_: Probe, size: float, mask: Mask) -> Model | None:
    """Fit from an effect of `size` (in residuals), the calibration moved to make room as far as it is
    linear."""
    forms = (*base.forms, probe_.form)
    prior, (low, high) = prior_of(problem, base.forms), bounds_of(problem, base.forms)
    x = np.zeros(probe_.form.size)
    x[0] = size
    left = base.residual - probe_.D @ x
    step = bounded_step(base.J[mask], left[mask], base.z, prior, low, high)
    return solve(problem, forms, np.concatenate([base.z + step, x]), mask, iterations=6)


def fit_guess(problem: Problem, base: Model, found: Guess, mask: Mask) -> Model | None:
    """Joint fit from a guess, started wherever between it and the base model the misfit is least; None
    if nothing is won.
    """
    forms = (*base.forms, found.probe.form)
    prior = prior_of(problem, forms)
    start = np.concatenate([base.z, np.zeros(found.probe.form.size)])
    before = cost(base.residual, start, prior, mask)
    J = np.hstack([base.J, found.probe.D])
    best: tuple[float, FloatArray, FloatArray] | None = None
    for share in (1.0, 0.5, 0.2, 0.05):
        z = start + share * (found.z - start)
        r = evaluate(problem, forms, z)
        if r is None:
            continue
        reached = cost(r, z, prior, mask)
        if best is not None and reached > best[0]:
            break
        best = (reached, z, r)
    if best is None:
        return None
    model = solve(problem, forms, best[1], mask, J, best[2])
    if model is None or cost(model.residual, model.z, prior, mask) > before:
        return None
    return model
