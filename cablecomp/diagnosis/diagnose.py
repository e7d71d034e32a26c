"""The diagnosis from top to bottom: gather, calibrate, locate, select, weigh, describe, say, propose."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.answer.augmented import augmented_joint
from cablecomp.diagnosis.answer.errors import errors_of
from cablecomp.diagnosis.answer.said import (
    candidates,
    channel_word,
    named_of,
    next_experiment,
    notes,
    remainder,
    tested,
    tied_of,
    traces,
)
from cablecomp.diagnosis.answer.values import drive_values
from cablecomp.diagnosis.body import Body, Columns, Sessions, gather_body, spread
from cablecomp.diagnosis.calibration.drive import Calibrated, calibrate_drive, without_history
from cablecomp.diagnosis.describe.empirical import empirical_laws
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, hypotheses
from cablecomp.diagnosis.explain.model import Model, Term, bears, placed, stripped
from cablecomp.diagnosis.explain.scores import Groups, left_out, make_groups
from cablecomp.diagnosis.explain.selection import select
from cablecomp.diagnosis.explain.unseen import could_be_unseen
from cablecomp.diagnosis.explain.verdict import Weighed, weigh
from cablecomp.diagnosis.locate.location import Location, locate
from cablecomp.diagnosis.locate.remainders import covariates_of, sensitivities, series_of
from cablecomp.diagnosis.locate.repeatability import repeatability
from cablecomp.diagnosis.locate.series import Series
from cablecomp.diagnosis.pace import Pace, Progress
from cablecomp.diagnosis.result import Diagnosis, Errors, Law
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.least_squares import Fit, derivative_of_part, refit, rms_left, solve, weighed

OUT_OF_TIME = "the {:g} s were over before all hypotheses were tried: what is named is the best so far"
NO_BETTER = "the joint's angle is predicted no better by it on data left out"


def diagnose(
    config: JointConfig,
    recordings: Mapping[str, Columns],
    progress: Progress = lambda what, share: None,
    seed: int = 0,
    sessions: Sessions | None = None,
    budget_s: float = inf,
) -> Diagnosis:
    """Find out what physics the configuration lacks to explain the recordings (name or path -> canonical channels).

    `sessions`: how recordings belong together ("folder", "each", "one"; None = as `[[session]]` says, else by folder).
    `progress` is told what is being done and the share done. After `budget_s` no further hypothesis is begun: what was
    found by then is weighed, and a warning says so. Raises InputError for recordings that lack a
    channel or that the nominal joint cannot follow.
    """
    begin = time.monotonic()
    rng = np.random.default_rng(seed)
    progress("reading", 0.0)
    body = gather_body(config, recordings, sessions)
    progress("calibrating the drive", 0.02)
    drive = calibrate_drive(config, body.used, rng)
    body = replace(body, final=_from_where(body, drive.fit))
    seen = [covariates_of(config, e) for e in drive.fit.problem.evidence]
    before = series_of(drive.fit, seen, drive.floor_rad)
    location = locate(before, rng, sensitivities(drive.fit))
    pool = hypotheses(config, body.used)
    searched = spread(drive.fit.problem.evidence, LIMITS.searched)
    whole = len(searched) == len(drive.fit.problem.evidence)
    begin_fit = drive.fit if whole else _about(drive.fit, searched)
    nominal = drive.nominal if whole else _at_start(begin_fit)
    groups = make_groups(begin_fit)
    pace = Pace(progress, begin + budget_s)
    selection = select(begin_fit, nominal, pool, groups, rng, pace)
    cut = (OUT_OF_TIME.format(budget_s),) if pace.over else ()
    progress("last fit", 0.9)
    final = _settled(selection.final.terms, selection.final.fit, drive, groups)
    selection = replace(selection, final=final)
    if not whole:
        groups = make_groups(drive.fit)
        final = _about_all(final, drive, groups)
    after = series_of(final.fit, seen, drive.floor_rad)
    rest = locate(after, rng, sensitivities(final.fit))
    share_left = _share_left(drive, final)
    progress("holding each name against its rivals", 0.92)
    weighed_terms = weigh(selection, pool, rest, share_left, rng)
    by = groups.by
    baseline = errors_of(drive.fit, body.final, by)
    augmented = errors_of(final.fit, body.final, by) if final.terms else baseline
    if weighed_terms and not _predicts(drive.fit, final.fit, baseline, augmented):
        weighed_terms = [replace(w, confidence=0.0, why_not=NO_BETTER) for w in weighed_terms]
    named = [w for w in weighed_terms if w.confidence >= LIMITS.name]
    named.sort(key=lambda w: -w.evidence["gain"])  # what is missed most stands first
    kept = final if named else _without_effects(final, drive, groups)
    if kept is not final:
        after = series_of(kept.fit, seen, drive.floor_rad) if kept.terms else before
        rest = locate(after, rng, sensitivities(kept.fit)) if kept.terms else location
    laws = empirical_laws(final, groups) if named else []
    repeated = repeatability(drive.fit.problem.evidence, seen)
    structured = _structured(rest, after, repeated, bool(named))
    verdict = _verdict(named, structured, drive, kept)
    progress("counting errors on data left out", 0.95)
    empirical = [f.law for f in laws]
    if kept is not final or empirical:
        augmented = errors_of(kept.fit, body.final, by, empirical) if kept.terms else baseline
    joint = augmented_joint(config, kept, empirical, body.names)
    unseen, hidden = could_be_unseen(kept.fit, pool, [w.term.name for w in named])
    tied = (*tied_of(weighed_terms, selection), *(((h.effect,), h.why) for h in hidden))
    return Diagnosis(
        config=config,
        recordings=body.names,
        sessions=body.sessions,
        verdict=verdict,
        noise_floor_rad=drive.floor_rad,
        repeatability_rad=repeated,
        nominal_rmse_rad=rms_left(drive.nominal),
        baseline=baseline,
        augmented=augmented,
        heldout_by=by,
        folds=groups.folds,
        final=tuple(e.name for e in body.final),
        channels={
            c: (rms_left(drive.fit, c), rms_left(kept.fit, c))
            for c in drive.fit.problem.channels
            if c != JOINT
        },
        calibration=drive_values(kept.fit, config),
        location=location,
        named=tuple(named_of(w, final) for w in named),
        candidates=candidates(weighed_terms, selection, final),
        not_excluded=tied,
        empirical=tuple(
            Law(f.law.id, channel_word(f.law.of), f.difference.gain, f.difference.z) for f in laws
        ),
        next_experiment=next_experiment(selection, weighed_terms, kept, hidden, drive, seen),
        could_be_unseen=tuple(unseen),
        remainder=remainder(kept, rest, after, structured, drive, rng),
        remainder_location=rest,
        tested=tested(selection, [w.term.name for w in named]),
        notes=notes(config, body, drive),
        augmented_joint=joint,
        evidence=drive.fit.problem.evidence,
        traces=tuple(traces(drive.fit, kept.fit, seen)),
        runtime_s=time.monotonic() - begin,
        warnings=(*cut, *_warnings(kept)),
    )


# --- steps ------------------------------------------------------------------------------------------------------------


def _from_where(body: Body, fit: Fit) -> tuple[Evidence, ...]:
    """The recordings kept for the end, counted from where their histories are forgotten, as the ones used are."""
    return body.final if body.final_by == "block" else tuple(without_history(fit, body.final)[0])


def _about(fit: Fit, some: Sequence[Evidence]) -> Fit:
    """The fit about some of its recordings."""
    return solve(fit.problem.with_evidence(some), fit.x, 6, J=derivative_of_part(fit, some))


def _about_all(model: Model, drive: Calibrated, groups: Groups) -> Model:
    """The model about all recordings again: the calibrated drive where nothing was found."""
    if not model.terms:
        return _without_effects(model, drive, groups)
    everything = model.fit.problem.with_evidence(drive.fit.problem.evidence)
    return _settled(model.terms, solve(everything, model.fit.x, 8), drive, groups)


def _at_start(fit: Fit) -> Fit:
    """The nominal drive about the same recordings, evaluated."""
    problem = fit.problem
    x = problem.start
    return Fit(problem, x, problem.residual(x), problem.jacobian(x))


def _settled(terms: tuple[Term, ...], fit: Fit, drive: Calibrated, groups: Groups) -> Model:
    """The fit with weights that its own remainder asks for, so that its uncertainties mean something."""
    for _ in range(2):
        fit = refit(fit, weighed(fit, drive.floor), 6)
    return Model(terms, fit, left_out(fit, groups))


def _without_effects(model: Model, drive: Calibrated, groups: Groups) -> Model:
    """The model with no effect in it: what differs between sessions or with a condition stays where it is the drive's
    own; the calibrated drive where nothing does."""
    own = tuple(t for t in model.terms if isinstance(t, Dependence) and t.of_drive)
    calibrated = Model((), drive.fit, left_out(drive.fit, groups))
    if not own:
        return calibrated
    if own == model.terms:
        return model
    problem = model.fit.problem
    for effect in (t for t in model.terms if isinstance(t, Hypothesis)):
        problem = stripped(problem, effect)
    try:
        fit = solve(problem, placed(model.fit, problem), LIMITS.settled, LIMITS.tolerance)
    except InputError:
        return calibrated
    return _settled(own, fit, drive, groups)


def _share_left(drive: Calibrated, final: Model) -> float:
    """Mean square beyond noise left by the final model over that of the calibrated drive."""
    noise = drive.floor_rad**2
    before, after = rms_left(drive.fit) ** 2 - noise, rms_left(final.fit) ** 2 - noise
    return float(np.clip(after / max(before, 1e-3 * noise), 0.0, 1.0))


def _predicts(before: Fit, after: Fit, baseline: Errors, augmented: Errors) -> bool:
    """Whether a fit done again without a part predicts that part better than the calibrated drive does; or whether
    another channel than the joint's angle is followed better."""
    others = [c for c in before.problem.channels if c != JOINT]
    return augmented.heldout_rmse_rad < baseline.heldout_rmse_rad or any(
        rms_left(after, c) < LIMITS.followed * rms_left(before, c) for c in others
    )


def _structured(found: Location, series: Series, repeated: float | None, named: bool) -> bool:
    """Whether what is left is more than noise and follows something; beside a name, far more than noise is enough."""
    yardstick = (
        float(np.mean(series.sigma)) if repeated is None else max(repeated, float(np.mean(series.sigma)))
    )
    ratio = float(np.mean(series.residual**2)) / yardstick**2
    follows = bool(found.significant(0.01))
    beyond = LIMITS.beyond_noise if named else LIMITS.far_beyond_noise
    return ratio > (LIMITS.structured if follows else beyond)


def _warnings(model: Model) -> tuple[str, ...]:
    lines = [f"{name} ended on its bound" for name in model.fit.at_bound()]
    if model.terms and not bears(model.fit):
        lines.append(
            "the joint as fitted has no solution at up to twice these loads; record greater ones as well"
        )
    return tuple(lines)


def _verdict(named: Sequence[Weighed], structured: bool, drive: Calibrated, kept: Model) -> str:
    if named:
        return "partly explained" if structured else "explained"
    if structured:
        return "unexplained"
    before, after = rms_left(drive.nominal), rms_left(kept.fit)
    return "recalibrate" if after < LIMITS.recalibrate * before else "consistent"
