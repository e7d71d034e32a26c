"""Which effects stand in for a named one as well: each tried in its place, the set that data left out cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model, without
from cablecomp.diagnosis.explain.scores import (
    Groups,
    Lead,
    block_losses,
    confidence_set,
    lead,
    left_out,
    scales,
)
from cablecomp.diagnosis.explain.screening import anchor, ask_all, rough
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.parallel import side_by_side


def rivals(
    model: Model, term: Hypothesis, pool: Sequence[Hypothesis], groups: Groups, rng: np.random.Generator
) -> tuple[tuple[str, ...], dict[str, Lead]]:
    """Effects that stand in for a term as well (its model confidence set, itself left out), and the term's lead over each
    that was tried in its place."""
    base = without(model, term, groups)
    if base is None:
        return (), {}
    here = anchor(base.fit)
    names = {t.name for t in model.terms}
    before = 0.5 * float(base.fit.residual @ base.fit.residual)
    asked = side_by_side(lambda h: ask_all([here], h), [h for h in pool if h.name not in names])
    answers = [a for a in asked if a and a[0].cost < LIMITS.promise * before]
    answers = sorted(answers, key=lambda a: a[0].cost)[: LIMITS.promising - 2]
    fitted = [next(iter(f), None) for f in side_by_side(lambda a: rough(a, LIMITS.rough), answers)]
    roughs = sorted(
        ((f, a[0]) for f, a in zip(fitted, answers, strict=True) if f is not None), key=lambda p: p[0].cost
    )
    size = scales(model.left_out, groups)
    losses = {term.name: block_losses(model.left_out, size, groups)}
    leads: dict[str, Lead] = {}
    chosen = roughs[: LIMITS.promising // 2]
    fits = side_by_side(lambda p: _tried(p[0]), chosen)
    for fit, (_, a) in zip(fits, chosen, strict=True):
        if fit is None:
            continue
        other = Model((*base.terms, a.hypothesis), fit, left_out(fit, groups))
        leads[a.hypothesis.name] = lead(model.left_out, other.left_out, groups)
        losses[a.hypothesis.name] = block_losses(other.left_out, size, groups)
    kept = confidence_set(losses, rng)
    return tuple(n for n in kept if n != term.name), leads


def _tried(fit: Fit) -> Fit | None:
    try:
        return solve(fit.problem, fit.x, 10, LIMITS.tolerance, fit.J)
    except InputError:
        return None
