"""The diagnosis from top to bottom: gather, calibrate, locate, search, weigh, judge, tell."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.answer.diagnosis import diagnosis_of
from cablecomp.diagnosis.answer.errors import errors_of
from cablecomp.diagnosis.answer.verdict import is_structured, not_carried, predicts, share_left, verdict_of
from cablecomp.diagnosis.body import Body, Columns, Sessions, gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive, without_history
from cablecomp.diagnosis.describe.empirical import empirical_laws
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.search import Search, done_without, exchanged, search, without_effects
from cablecomp.diagnosis.explain.usual import check_follows, usual_of
from cablecomp.diagnosis.explain.weighed import Weighed, in_order
from cablecomp.diagnosis.explain.weighing import weigh
from cablecomp.diagnosis.locate.remainders import covariates_of
from cablecomp.diagnosis.locate.repeatability import repeatability
from cablecomp.diagnosis.locate.responses import left_on_every_row
from cablecomp.diagnosis.outcome import Case, Outcome, Remainder
from cablecomp.diagnosis.pace import Pace, Progress
from cablecomp.diagnosis.result import Diagnosis
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parallel import algebra_in_one_thread
from cablecomp.estimation.steadying import with_steady_readings

NO_BETTER = "the joint's angle is predicted no better, or hardly, by it on data left out"


@algebra_in_one_thread
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
    begin_s = time.monotonic()
    pace = Pace(progress, begin_s + budget_s)
    rng = np.random.default_rng(seed)
    case = _calibrated(config, recordings, sessions, rng, pace)
    location = case.located(rng.spawn(1)[0])
    before = case.remainder_of(case.drive.fit, rng)
    found = search(case.drive, hypotheses(config, case.body.used), rng, pace)
    pace.tell("holding each name against its rivals", 0.92)
    found, after, weighed = _weighed(case, found, rng)
    outcome = _judged(case, before, found, after, weighed, rng, pace)
    answer = diagnosis_of(case, location, found, outcome, rng, budget_s)
    return replace(answer, runtime_s=time.monotonic() - begin_s)


# --- steps ------------------------------------------------------------------------------------------------------------


def _calibrated(
    config: JointConfig,
    recordings: Mapping[str, Columns],
    sessions: Sessions | None,
    rng: np.random.Generator,
    pace: Pace,
) -> Case:
    """The recordings gathered, the drive calibrated on those that are not kept for the end."""
    pace.tell("reading", 0.0)
    check_follows(config)
    body = gather_body(config, recordings, sessions)
    pace.tell("calibrating the drive", 0.02)
    drive = calibrate_drive(config, body.used, rng)
    body = replace(body, final=_counted(body, drive.fit))
    left = left_on_every_row(drive.fit)
    seen = (covariates_of(config, e, m) for e, m in zip(drive.fit.problem.evidence, left, strict=True))
    return Case(config, body, drive, tuple(seen))


def _counted(body: Body, fit: Fit) -> tuple[Evidence, ...]:
    """The recordings kept for the end, their readings averaged and counted from where their histories are forgotten, as
    those of the ones used are."""
    steady = with_steady_readings(fit.problem, fit.x, body.final)
    return tuple(steady if body.final_by == "block" else without_history(fit, steady)[0])


def _weighed(
    case: Case, found: Search, rng: np.random.Generator
) -> tuple[Search, Remainder, Sequence[Weighed]]:
    """The search's model, what it leaves, its effects weighed. Where none of them is sure, without those that are not
    missed beside the others, weakest first: of three that trade places none is missed while the others are there; what
    was put in another's place has to be missed as a further effect has. Where another effect in the place of one
    predicts better, with that."""
    exchanges = 0
    while True:
        after = case.remainder_of(found.final.fit, rng)
        weighed = weigh(found, after.location, case.locate, share_left(case.drive, found.final), rng)
        better = sorted((w.difference.z, k, w.better) for k, w in enumerate(weighed) if w.better is not None)
        more = better and exchanges < LIMITS.exchanges
        if more and (other := exchanged(found, better[0][2], case.drive)) is not None:
            exchanges += 1
            found = other
            continue
        needless = [
            w
            for w in weighed
            if w.evidence["z"] < (LIMITS.z if w.term.name in found.put_in else LIMITS.z_missed)
            and w.depends is None
        ]
        sure = any(w.confidence >= LIMITS.name for w in weighed)
        if sure or not needless or len(weighed) < 2:
            return found, after, weighed
        fewer = done_without(found, min(needless, key=lambda w: w.evidence["z"]).term, case.drive)
        if fewer is None:
            return found, after, weighed
        found = fewer


def _judged(
    case: Case,
    before: Remainder,
    found: Search,
    after: Remainder,
    weighed: Sequence[Weighed],
    rng: np.random.Generator,
    pace: Pace,
) -> Outcome:
    """Which effects are named, which model is kept, what it leaves, and the verdict."""
    drive, final, by = case.drive, found.final, found.groups.by
    baseline = errors_of(drive.fit, case.body.final, by)
    augmented = errors_of(final.fit, case.body.final, by) if final.terms else baseline
    if not predicts(drive.fit, final, baseline, augmented, drive.floor_rad):
        weighed = [replace(w, confidence=0.0, why_not=NO_BETTER) for w in weighed]
    named = in_order(w for w in weighed if w.confidence >= LIMITS.name)
    kept, remainder = final, after
    if not named:
        kept = without_effects(final, drive, found.groups)
    if kept is not final:
        remainder = case.remainder_of(kept.fit, rng) if kept.terms else before
    told = kept.fit.problem.left(kept.fit.x) if named else None
    repeated_rad = repeatability(drive.fit.problem.evidence, case.covariates, told)
    structured = is_structured(
        remainder.location, remainder.series, repeated_rad, usual_of(case.config, JOINT), bool(named)
    )
    pace.tell("counting errors on data left out", 0.95)
    laws = empirical_laws(kept, found.groups) if named or structured else []
    if kept is not final or laws:
        again = [law for f in laws for law in f.laws]
        augmented = errors_of(kept.fit, case.body.final, by, again) if kept.terms or laws else baseline
    structured = structured or any(not_carried(augmented, drive.floor_rad))
    verdict = verdict_of(bool(named), structured, drive, kept)
    return Outcome(
        tuple(weighed), tuple(named), kept, tuple(laws), baseline, augmented, remainder, repeated_rad, structured,
        verdict,
    )  # fmt: skip
