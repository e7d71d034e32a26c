"""Each effect of the final model weighed: its evidence on data left out, against its rivals, and its confidence."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from cablecomp.diagnosis.explain.confidence import features, learnt
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.discrepancy import left_out_with_discrepancy
from cablecomp.diagnosis.explain.events import untold
from cablecomp.diagnosis.explain.held_down import (
    another,
    greased,
    hardly_ahead,
    in_part_a_drag,
    seen_once,
    slight,
    stands_in,
    tightened,
    too_little,
)
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import (
    Model,
    Selection,
    moves_rad,
    no_answer,
    without,
)
from cablecomp.diagnosis.explain.rivals import ALONE, NO_RIVAL, Rivals, rivals
from cablecomp.diagnosis.explain.scores import ScoreDifference, halves, scales, score_difference
from cablecomp.diagnosis.explain.search import Search
from cablecomp.diagnosis.explain.ties import surest_alone
from cablecomp.diagnosis.explain.usual import lost_in_usual
from cablecomp.diagnosis.explain.weighed import Weighed, one_in_series
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.locate.location import Location
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects.catalogue import parameter_of
from cablecomp.estimation.evidence import JOINT, noise_rms
from cablecomp.estimation.least_squares import Fit, rms_left
from cablecomp.estimation.parallel import in_processes
from cablecomp.signal.smoothing import FloatArray

NO_SIZE: Final = ("length", "instant", "duration")
"""Roles of parameters whose bounds are no sign against an effect."""


Locate = Callable[[Fit], Location]
"""Says where what a fit leaves of the joint's angle lies."""


def weigh(
    found: Search, left: Location, locate: Locate, share_left: float, rng: np.random.Generator
) -> list[Weighed]:
    """Every effect of the search's model, most certain first; `left`: where lies what the final model leaves,
    `locate`: asked the same of models without an effect, `share_left`: how much of the mismatch is left."""
    selection, final = found.selection, found.selection.final
    # whoever took nothing off in any round stands in for nobody
    able = {t.term.name for r in selection.rounds for t in r.tried if t.difference.gain > 0.0}
    pool = [h for h in found.pool if h.name in able]
    terms = [t for t in final.terms if isinstance(t, Hypothesis)]
    drawn = zip(terms, rng.spawn(len(terms)), strict=True)
    weighed = in_processes(lambda t: _weighed(found, t[0], pool, left, locate, share_left, t[1]), [*drawn])
    return sorted(one_in_series(weighed), key=lambda w: -w.confidence)


def _weighed(
    found: Search,
    term: Hypothesis,
    pool: Sequence[Hypothesis],
    left: Location,
    locate: Locate,
    share_left: float,
    rng: np.random.Generator,
) -> Weighed:
    """One effect of the final model, `pool`: what may stand in for it."""
    selection = found.selection
    final, groups = selection.final, selection.groups
    bare = without(final, term, groups, selection.known)
    own, instead = ALONE, Rivals()
    if bare is not None:
        others = [t for t in bare.terms if isinstance(t, Hypothesis)]
        having, lacking = (
            left_out_with_discrepancy(m, others, groups, usual=term.has_instant) for m in (final, bare)
        )
        own = score_difference(having, lacking, groups)
        instead = rivals(final, term, bare, pool, groups, selection.seen.apart(), selection.known, rng)
    against = {name: d for name, d in instead.differences.items() if name not in instead.lesser}
    nearest = min(against.values(), key=lambda v: v.z, default=NO_RIVAL)
    # an event of any course predicts nothing of a part left out: it is weighed as it goes
    ahead, of_rival = (own, nearest) if term.has_instant else (instead.any_form, instead.any_form_ahead)
    # as the last to come, and alone: of which it takes off more
    ways = [_gone(selection, bare, final), *_alone(selection, term.name)]
    evidence = features(
        gain=own.gain,
        selected_in=instead.selected_in if term.name in found.put_in else _selected(selection, term),
        form_z=ahead.z,
        form_margin_z=of_rival.z,
        share_left=share_left,
        share_total=_share(selection, ways[0]),
        rivals=len(set(instead.effects) - set(instead.lesser)),
        unfollowed=0.0 if bare is None else _unfollowed(term, locate(bare.fit)),
        follows=_follows(term, left),
        unsteady=_unsteady(final, term, groups),
        at_bound=_at_bound(final, term),
        tries=len(term.starts),
        terms=sum(isinstance(t, Hypothesis) for t in final.terms),
    )
    depends = next((d for d in final.terms if isinstance(d, Dependence) and d.belongs_to(term)), None)
    confidence, why_not = 0.0, no_answer(final.fit, term)
    if not why_not:
        confidence = learnt().probability(evidence)
        why_not = _against((*instead.effects, *instead.plain), own, evidence)
    lead = min(ahead.z, of_rival.z)
    most = max(ways, key=lambda gone: _share(selection, gone))
    removes = _share(selection, most)
    if lacks := untold(final.fit, term, removes, lead):
        confidence, why_not = min(confidence, LIMITS.event_untold), lacks
    elif other := another(final, term, selection.rounds, lead, removes):
        confidence, why_not = min(confidence, LIMITS.beaten_told), other
    elif little := (
        too_little(removes, share_left * _beyond_noise(final.fit)) or _beside_usual(selection, term, most)
    ):
        confidence, why_not = min(confidence, LIMITS.little_told), little
    elif small := slight(final, term, selection.rounds, own, removes):
        confidence, why_not = min(confidence, LIMITS.little_told), small
    elif open_to := (
        stands_in(final, term, found.put_in, own)
        or tightened(term, instead.plain)
        or hardly_ahead(final, term, lead)
        or seen_once(final, term, lead)
        or greased(final, term)
        or in_part_a_drag(final, term, selection.rounds, lead)
    ):
        confidence, why_not = min(confidence, LIMITS.little_told), open_to
    better = None
    beaten_by = _beaten(selection, term, against)
    if beaten_by and of_rival.z < LIMITS.z_unbeaten:
        confidence = min(confidence, LIMITS.beaten_told)
        if depends is None:
            better = instead.models.get(beaten_by)
    said = {**evidence, "z": own.z, "gain": own.gain}
    if (moves := moves_rad(final, term)) is not None:
        said["moves_rad"] = moves
    ties = {name: instead.differences[name].z for name in instead.effects}
    said_to_go = _of_all(selection, most)
    return Weighed(term, depends, said, confidence, ties, nearest, why_not, said_to_go, better)


def _beyond_noise(fit: Fit) -> float:
    """Share of the mean square left of the joint's angle that is not the sensors' noise."""
    left, noise = rms_left(fit), noise_rms(fit.problem.evidence, JOINT)
    return max(1.0 - (noise / max(left, 1e-300)) ** 2, 0.0)


def _at_bound(model: Model, term: Hypothesis) -> bool:
    """Whether a parameter of the effect ended on a bound; that all of a cable lies on its guides is an answer, as that
    none does, that all of a slip is taken up, or that an event begins or ends with what was recorded."""
    names = (name.partition("@")[0].partition("~")[0] for name in model.fit.at_bound())
    found = (parameter_of(n) for n in names if n.startswith(f"effect.{term.effect.id}."))
    return any(p is not None and p.role not in NO_SIZE and not p.is_share for p in found)


def _selected(selection: Selection, term: Hypothesis) -> float:
    """Share of resampled data in which the effect was best, in the round where it did best."""
    shares = [
        t.selected_in
        for r in selection.rounds
        for t in r.tried
        if t.term.name == term.name and t.difference.gain > 0.0
    ]
    return max(shares, default=0.0)


def _beaten(selection: Selection, term: Hypothesis, differences: Mapping[str, ScoreDifference]) -> str:
    """What predicts data left out better in the effect's place, by more than a tie, by most standard errors, of what
    alone takes off a part of what the effect does; "" where nothing does: what explains by far the most alone stands,
    though what is left beside it goes to another."""

    def alone(name: str) -> float:
        return max((_share(selection, gone) for gone in _alone(selection, name)), default=0.0)

    least = LIMITS.rival_alone * alone(term.name)
    ahead = [name for name, d in differences.items() if d.gain < -LIMITS.tie and alone(name) >= least]
    if surest_alone(selection.rounds, term):
        ahead = [name for name in ahead if differences[name].z <= -LIMITS.z_dethrone]
    return min(ahead, key=lambda name: differences[name].z, default="")


def _alone(selection: Selection, name: str) -> Iterator[FloatArray]:
    """As `_gone`, of an effect alone beside the calibrated drive, where it was fitted so, even if alone it has to be
    larger than is plausible: beside others it is not."""
    if not selection.rounds:
        return
    first = selection.rounds[0]
    for model in (*(t.model for t in first.tried), *first.away):
        if model.terms[0].name == name:
            yield _gone(selection, selection.baseline, model)


def _gone(selection: Selection, before: Model | None, after: Model) -> FloatArray:
    """Mean square on data left out that goes from one model to another, of each channel; all there is where the drive
    cannot be followed before."""
    whole = _mean_squares(selection.baseline, selection.groups)
    if before is None:
        return whole
    return _mean_squares(before, selection.groups) - _mean_squares(after, selection.groups)


def _of_all(selection: Selection, gone: FloatArray) -> float:
    """The share of the channel in which the effect shows most, at most what the whole model takes off, single rows far
    off the rest counted in full: without the effect others may fare worse than the calibrated drive."""
    before, after = (
        _mean_squares(m, selection.groups, tail=np.inf) for m in (selection.baseline, selection.final)
    )
    taken = 1.0 - after / np.maximum(before, 1e-300)
    return float(np.clip(np.max(np.minimum(_shares(selection, gone), taken)), 0.0, 1.0))


def _shares(selection: Selection, gone: FloatArray) -> FloatArray:
    """The same as shares of what the calibrated drive leaves of each channel."""
    return gone / np.maximum(_mean_squares(selection.baseline, selection.groups), 1e-300)


def _share(selection: Selection, gone: FloatArray) -> float:
    """The share of the channel in which the effect shows most."""
    return float(np.clip(np.max(_shares(selection, gone)), 0.0, 1.0))


def _beside_usual(selection: Selection, term: Hypothesis, gone: FloatArray) -> str:
    """What is to be said of an effect that does not stand out of what the joint is known to leave of that channel."""
    problem = selection.baseline.fit.problem
    k = int(np.argmax(_shares(selection, gone)))
    return lost_in_usual(problem.config, list(problem.spans())[k], float(gone[k]), term.acts_through[0])


def _mean_squares(model: Model, groups: Groups, tail: float = LIMITS.tail) -> FloatArray:
    """Mean square left out of each channel, in its own unit squared; single rows far off the rest count as at most
    `tail` deviations."""
    bound = tail * scales(model.left_out, groups)
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


def _follows(term: Hypothesis, left: Location) -> float:
    """Share of the remainder that follows the first two covariates that the effect acts through."""
    wanted = term.acts_through[:2]
    shares = [m.share for m in left.mismatch if m.covariate in wanted and m.p_value < LIMITS.p_follows]
    return max(shares, default=0.0)


def _unfollowed(term: Hypothesis, before: Location) -> float:
    """p-value of what is left without the effect following one of the first two covariates that it acts through."""
    wanted = term.acts_through[:2]
    return min((m.p_value for m in before.mismatch if m.covariate in wanted), default=1.0)


def _against(instead: Sequence[str], own: ScoreDifference, evidence: Mapping[str, float]) -> str:
    """What speaks against a name, in words."""
    reasons, follows = [], evidence["follows"]
    if instead:
        reasons.append(f"{', '.join(instead)} in its place explains data left out as well")
    if follows > LIMITS.why_follows:
        reasons.append(f"{follows:.0%} of what is left still follows the covariate that it acts through")
    if evidence["unfollowed"] > LIMITS.unfollowed:
        reasons.append("what is left without it does not follow, beyond chance, what it acts through")
    if own.z < LIMITS.z:
        reasons.append(f"z = {own.z:.1f}, {LIMITS.z:g} are asked for")
    if evidence["selected_in"] < LIMITS.why_selected:
        reasons.append(f"it is the best of its round in {evidence['selected_in']:.0%} of resampled data only")
    if evidence["share_left"] > LIMITS.why_left:
        reasons.append(f"{evidence['share_left']:.0%} of the mismatch is left over")
    return "; ".join(reasons) or "its evidence is weak in every respect"
