"""What the evidence amounts to: each effect of the final model with its evidence and confidence, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cablecomp.diagnosis.explain.confidence import features, learnt
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.scores import Lead, lead
from cablecomp.diagnosis.explain.selection import Model, Selection, rivals, without
from cablecomp.diagnosis.locate import Location
from cablecomp.diagnosis.thresholds import LIMITS


@dataclass(frozen=True)
class Weighed:
    """One effect of the final model: its evidence, confidence, rivals that stand in for it, the nearest one's lead."""

    term: Hypothesis
    depends: Dependence | None
    evidence: Mapping[str, float]
    confidence: float
    rivals: tuple[str, ...]
    lead: Lead
    why_not: str


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
    able = {t.term.name for r in selection.rounds for t in r.tried if t.lead.gain > 0.0}
    found = []
    for term in final.terms:
        if not isinstance(term, Hypothesis):
            continue
        bare = without(final, term, groups)
        own = (
            lead(final.left_out, bare.left_out, groups)
            if bare is not None
            else Lead(1.0, 99.0, 10.0, np.zeros(1))
        )
        kept, leads = rivals(final, term, [h for h in pool if h.name in able], groups, rng)
        nearest = min(leads.values(), key=lambda v: v.z, default=Lead(1.0, 10.0, 10.0, np.zeros(1)))
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
            rivals=len(kept),
            follows=follows,
            at_bound=any(b.startswith(f"effect.{term.effect.id}.") for b in bounds),
        )
        confidence = learnt().probability(evidence)
        depends = next((d for d in final.terms if isinstance(d, Dependence) and d.belongs_to(term)), None)
        found.append(
            Weighed(
                term, depends, {**evidence, "z": own.z, "gain": own.gain}, confidence, kept, nearest,
                _against(kept, follows, own, evidence),
            )
        )  # fmt: skip
    return sorted(found, key=lambda w: -w.confidence)


def _selected(selection: Selection, term: Hypothesis) -> float:
    """Share of resampled data in which the effect was best, in the round where it did best."""
    shares = [
        t.selected_in
        for r in selection.rounds
        for t in r.tried
        if t.term.name == term.name and t.lead.gain > 0.0
    ]
    return max(shares, default=0.0)


def _share_of_baseline(selection: Selection, bare: Model | None, final: Model) -> float:
    """Share of the calibrated drive's square on data left out that goes with the effect."""
    if bare is None:
        return 1.0
    here = selection.groups.block >= 0
    # weights differ between baseline and final model: back to the channels' own units
    scale = _scales(selection.baseline, here)
    before = float(np.mean((selection.baseline.left_out[here] * scale) ** 2))
    own = _scales(final, here)
    gone = float(np.mean((bare.left_out[here] * own) ** 2) - np.mean((final.left_out[here] * own) ** 2))
    return gone / max(before, 1e-300)


def _scales(
    model: Model, here: np.ndarray[tuple[int], np.dtype[np.bool_]]
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """What a unit of each data row is, relative to the first channel's usual size, so that channels count alike."""
    problem = model.fit.problem
    rows = np.ones(len(here))
    for c, span in problem.spans().items():
        size = (
            float(np.std(np.concatenate([e.at_rows(c) for e in problem.evidence if c in e.columns]))) or 1.0
        )
        rows[span] = problem.weighing.sigma[c] / size
    return np.asarray(rows[here], dtype=np.float64)


def _follows(term: Hypothesis, remainder: Location) -> float:
    """Share of the remainder that follows the first two covariates that the effect acts through."""
    wanted = term.effect.acts_through[:2]
    shares = [m.share for m in remainder.mismatch if m.covariate in wanted and m.p_value < 0.05]
    return max(shares, default=0.0)


def _against(kept: Sequence[str], follows: float, own: Lead, evidence: Mapping[str, float]) -> str:
    reasons = []
    if kept:
        reasons.append(f"{', '.join(kept)} in its place explains data left out as well")
    if follows > 0.3:
        reasons.append(f"{follows:.0%} of what is left still follows the covariate that it acts through")
    if own.z < LIMITS.z:
        reasons.append(f"z = {own.z:.1f}, {LIMITS.z:g} are asked for")
    if evidence["selected_in"] < 0.5:
        reasons.append(f"it is the best of its round in {evidence['selected_in']:.0%} of resampled data only")
    if evidence["share_left"] > 0.3:
        reasons.append(f"{evidence['share_left']:.0%} of the mismatch is left over")
    return "; ".join(reasons) or "its evidence is weak in every respect"
