"""A diagnosis put together, out of the case, the search and what was made of it."""

from __future__ import annotations

import numpy as np

from cablecomp.config import JointConfig, Remainder
from cablecomp.diagnosis.answer.augmented import (
    augmented_joint,
    told_by,
    with_tolerances,
    with_tolerances_of,
)
from cablecomp.diagnosis.answer.entries import (
    candidates,
    channel_word,
    named_of,
    next_experiment,
    remainder,
    tested,
    tied_of,
    traces,
)
from cablecomp.diagnosis.answer.notes import by_the_clock, carried_on, notes
from cablecomp.diagnosis.answer.values import as_trials_say, drive_values
from cablecomp.diagnosis.answer.verdict import not_alike, not_carried, warnings_of
from cablecomp.diagnosis.calibration.drive import own_in_vain
from cablecomp.diagnosis.explain.search import Search
from cablecomp.diagnosis.explain.unseen import could_be_unseen
from cablecomp.diagnosis.locate.location import Location
from cablecomp.diagnosis.outcome import Case, Outcome
from cablecomp.diagnosis.result import Diagnosis, Law
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.least_squares import Fit, rms_left

OUT_OF_TIME = "the {:g} s were over before all hypotheses were tried: what is named is the best so far"


def diagnosis_of(
    case: Case, location: Location, found: Search, outcome: Outcome, rng: np.random.Generator, budget_s: float
) -> Diagnosis:
    """Everything found; `location`: where the calibrated drive's misfit lies."""
    drive, kept = case.drive, outcome.kept
    unseen, hidden = could_be_unseen(kept.fit, found.pool, outcome.names)
    proposed, alike = next_experiment(case, found.selection, outcome, hidden)
    return Diagnosis(
        config=case.config,
        recordings=case.body.names,
        sessions=case.body.sessions,
        clock_s=case.body.clock_s,
        verdict=outcome.verdict,
        noise_floor_rad=drive.floor_rad,
        repeatability_rad=outcome.repeated_rad,
        nominal_rmse_rad=rms_left(drive.nominal),
        baseline=outcome.baseline,
        augmented=outcome.augmented,
        heldout_by=found.groups.by,
        folds=found.groups.folds,
        final=tuple(e.name for e in case.body.final),
        channels=_channels(drive.fit, kept.fit),
        calibration=as_trials_say(drive_values(kept.fit, case.config)),
        location=location,
        named=tuple(named_of(w, found.final) for w in outcome.named),
        candidates=candidates(outcome.weighed, found.selection, found.final),
        not_excluded=(*tied_of(outcome.weighed, found.selection), *(((h.effect,), h.why) for h in hidden)),
        empirical=_laws(outcome),
        next_experiment=proposed,
        could_be_unseen=tuple(unseen),
        remainder=remainder(case, outcome, rng),
        remainder_location=outcome.remainder.location,
        tested=tested(found.selection, outcome.told),
        notes=(*notes(case), *by_the_clock(kept), *carried_on(kept), *alike),
        augmented_joint=_augmented(case, outcome),
        evidence=drive.fit.problem.evidence,
        traces=tuple(traces(drive.fit, kept.fit, case.covariates, outcome.empirical)),
        warnings=(
            *((OUT_OF_TIME.format(budget_s),) if found.cut_short else ()),
            *own_in_vain(case.config, drive.fit),
            *warnings_of(kept, found.cut_short),
            *not_alike(kept, found.groups.by),
            *not_carried(outcome.augmented, drive.floor_rad),
        ),
    )


def _augmented(case: Case, outcome: Outcome) -> JointConfig:
    """The joint with what was found, and how well that is known."""
    model = outcome.kept
    joint = augmented_joint(case.config, model, outcome.empirical, case.body.whole_for_the_end)
    joint = with_tolerances(joint, model.fit, told_by(model.fit, case.config.tolerance))
    joint = with_tolerances_of(joint, model)
    if outcome.verdict != "partly explained":
        return joint
    return joint.model_copy(update={"remainder": _remainder(outcome)})


def _remainder(outcome: Outcome) -> Remainder:
    """What the joint leaves of each channel, for later diagnoses: of the joint's angle on data left out, and what that
    goes by; of the others where it was fitted; zeros of the recordings apart."""
    fit = outcome.kept.fit
    left = {c: rms_left(fit, c) for c in fit.problem.channels}
    left[JOINT] = outcome.augmented.heldout_own_zero_rmse_rad
    follows = outcome.remainder.location.significant(LIMITS.p_structured)
    most = max((m.share for m in follows), default=0.0)
    goes_by = tuple(m.covariate for m in follows if m.share >= LIMITS.goes_by * most)
    return Remainder(**{c: float(f"{v:.3g}") for c, v in left.items()}, follows=goes_by)


def _channels(before: Fit, after: Fit) -> dict[str, tuple[float, float]]:
    """What is left of each further channel, before and after (RMS)."""
    others = [c for c in before.problem.channels if c != JOINT]
    return {c: (rms_left(before, c), rms_left(after, c)) for c in others}


def _laws(outcome: Outcome) -> tuple[Law, ...]:
    """The laws without a name, in the covariates' words."""
    return tuple(
        Law(f.law.id, channel_word(f.law.of), f.difference.gain, f.difference.z) for f in outcome.laws
    )
