"""What the evidence amounts to: each effect of the final model with its evidence and confidence, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cablecomp.diagnosis.explain.confidence import features, learnt
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model, Selection, is_told, without
from cablecomp.diagnosis.explain.rivals import Rivals, rivals
from cablecomp.diagnosis.explain.scores import Groups, ScoreDifference, halves, scales, score_difference
from cablecomp.diagnosis.locate.location import Location
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Weighed:
    """One effect of the final model: its evidence, confidence, rivals that stand in for it, its score against
    the nearest one.

    `removes`: share of the calibrated drive's mean square on data left out that it takes off, alone or as the
    last to come, whichever is more: effects that trade places take off little as the last, what others hide
    takes off little alone.
    """

    term: Hypothesis
    depends: Dependence | None
    evidence: Mapping[str, float]
    confidence: float
    rivals: tuple[str, ...]
    difference: ScoreDifference
    why_not: str
    removes: float


def weigh(
    selection: Selection,
    pool: Sequence[Hypothesis],
    remainder: Location,
    share_left: float,
    rng: np.random.Generator,
) -> list[Weighed]:
    """Every effect of the final model, most certain first."""
    final, groups = selection.final, selection.groups
    bounds = final.fit.at_bound()
    # whoever took nothing off in any round stands in for nobody
    able = {t.term.name for r in selection.rounds for t in r.tried if t.difference.gain > 0.0}
    found = []
    for term in final.terms:
        if not isinstance(term, Hypothesis):
            continue
        bare = without(final, term, groups)
        own = (
            score_difference(final.left_out, bare.left_out, groups)
            if bare is not None
            else ScoreDifference(1.0, 99.0, 10.0, np.zeros(1))
        )
        instead = (
            Rivals()
            if bare is None
            else rivals(final, term, bare, [h for h in pool if h.name in able], groups, rng)
        )
        nearest = min(
            instead.differences.values(),
            key=lambda v: v.z,
            default=ScoreDifference(1.0, 10.0, 10.0, np.zeros(1)),
        )
        follows = _follows(term, remainder)
        evidence = features(
            gain=own.gain,
            z=own.z,
            z_blocks=own.z_blocks,
            selected_in=_selected(selection, term),
            lead_gain=nearest.gain,
            lead_z=nearest.z,
            share_left=share_left,
            share_total=_share_of_baseline(selection, bare, final),
            rivals=len(instead.effects),
            follows=follows,
            unsteady=_unsteady(final, term, groups),
            at_bound=any(b.startswith(f"effect.{term.effect.id}.") for b in bounds),
            tries=len(term.starts),
            terms=sum(isinstance(t, Hypothesis) for t in final.terms),
        )
        told = is_told(final.fit, term)
        confidence = learnt().probability(evidence) if told else 0.0
        depends = next((d for d in final.terms if isinstance(d, Dependence) and d.belongs_to(term)), None)
        found.append(
            Weighed(
                term, depends, {**evidence, "z": own.z, "gain": own.gain}, confidence, instead.effects, nearest,
                _against((*instead.effects, *instead.plain), follows, own, evidence)
                if told
                else "its amount is not told from none",
                max(evidence["share_total"], _alone(selection, term)),
            )
        )  # fmt: skip
    return sorted(found, key=lambda w: -w.confidence)


def _selected(selection: Selection, term: Hypothesis) -> float:
    """Share of resampled data in which the effect was best, in the round where it did best."""
    shares = [
        t.selected_in
        for r in selection.rounds
        for t in r.tried
        if t.term.name == term.name and t.difference.gain > 0.0
    ]
    return max(shares, default=0.0)


def _share_of_baseline(selection: Selection, bare: Model | None, final: Model) -> float:
    """Share of the calibrated drive's mean square on data left out that goes with the effect, in the channel in
    which it shows most; single rows far off the rest count as at most `LIMITS.tail` deviations."""
    if bare is None:
        return 1.0
    return _gone(selection, bare, final)


def _alone(selection: Selection, term: Hypothesis) -> float:
    """The same for the effect alone beside the calibrated drive; 0 where it was not fitted so."""
    first = selection.rounds[0].tried if selection.rounds else ()
    models = [t.model for t in first if t.term.name == term.name]
    return max((_gone(selection, selection.baseline, m) for m in models), default=0.0)


def _gone(selection: Selection, before: Model, after: Model) -> float:
    whole = _mean_squares(selection.baseline, selection.groups)
    gone = _mean_squares(before, selection.groups) - _mean_squares(after, selection.groups)
    return float(np.clip(np.max(gone / np.maximum(whole, 1e-300)), 0.0, 1.0))


def _mean_squares(model: Model, groups: Groups) -> FloatArray:
    """Mean square left out of each channel, in its own unit."""
    bound = LIMITS.tail * scales(model.left_out, groups)
    problem = model.fit.problem
    return np.array([
        float(np.mean(np.minimum(np.abs(model.left_out[span]), most) ** 2)) * problem.weighing.sigma[c] ** 2
        for (c, span), most in zip(problem.spans().items(), bound, strict=True)
    ])  # fmt: skip


def _unsteady(final: Model, term: Hypothesis, groups: Groups) -> float:
    """How far the effect's amount differs between halves of the data (early and late, much and little load,
    quick and slow, one channel and another), each fitted by a linear step of its own: a true constant is
    constant. In units of their mean; at most 1."""
    fit = final.fit
    name = term.key(term.amount.name)
    column = next((k for k, p in enumerate(fit.problem.parameters) if p.name == name), None)
    if column is None:
        return 1.0
    n = len(groups.block)
    r, J, priors = fit.residual[:n], fit.J[:n], fit.J[n:]
    p = fit.problem.parameters[column]
    value = abs(p.value(float(fit.x[column])))
    if value <= 0.0:
        return 1.0
    worst = 0.0
    for half in halves(fit.problem, groups):
        found = []
        for side in (half > 0, half < 0):
            H = J[side].T @ J[side] + priors.T @ priors
            scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
            H = H / np.outer(scale, scale) + 1e-6 * np.eye(len(H))
            step = np.linalg.solve(H, J[side].T @ r[side] / scale) / scale
            found.append(-float(step[column]) * p.slope(float(fit.x[column])))
        worst = max(worst, abs(found[0] - found[1]) / (2.0 * value))
    return min(worst, 1.0)


def _follows(term: Hypothesis, remainder: Location) -> float:
    """Share of the remainder that follows the first two covariates that the effect acts through."""
    wanted = term.acts_through[:2]
    shares = [m.share for m in remainder.mismatch if m.covariate in wanted and m.p_value < 0.05]
    return max(shares, default=0.0)


def _against(
    instead: Sequence[str], follows: float, own: ScoreDifference, evidence: Mapping[str, float]
) -> str:
    reasons = []
    if instead:
        reasons.append(f"{', '.join(instead)} in its place explains data left out as well")
    if follows > 0.3:
        reasons.append(f"{follows:.0%} of what is left still follows the covariate that it acts through")
    if own.z < LIMITS.z:
        reasons.append(f"z = {own.z:.1f}, {LIMITS.z:g} are asked for")
    if evidence["selected_in"] < 0.5:
        reasons.append(f"it is the best of its round in {evidence['selected_in']:.0%} of resampled data only")
    if evidence["share_left"] > 0.3:
        reasons.append(f"{evidence['share_left']:.0%} of the mismatch is left over")
    return "; ".join(reasons) or "its evidence is weak in every respect"
