"""The diagnosis from top to bottom: gather, calibrate, locate, select, weigh, describe, say, propose."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.augmented import augmented_joint
from cablecomp.diagnosis.body import Body, Columns, Sessions, gather_body, spread
from cablecomp.diagnosis.calibration import Calibrated, calibrate_drive
from cablecomp.diagnosis.covariates import Covariates, covariates, join
from cablecomp.diagnosis.describe_law import Found, empirical_laws
from cablecomp.diagnosis.errors_left import errors_of
from cablecomp.diagnosis.experiment import best_experiment
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.scores import Groups, left_out, make_groups
from cablecomp.diagnosis.explain.selection import Model, Progress, Selection, select
from cablecomp.diagnosis.explain.verdict import Weighed, weigh
from cablecomp.diagnosis.locate import Location, locate
from cablecomp.diagnosis.repeatability import repeatability
from cablecomp.diagnosis.result import Diagnosis, Errors, Law, Named, Tested, Traces, Value
from cablecomp.diagnosis.series import Series, make_series
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.diagnosis.unknown import describe
from cablecomp.diagnosis.unseen import Hidden, could_be_unseen
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence, load_channel
from cablecomp.estimation.least_squares import Fit, covariance, refit, rms_left, solve, weighed
from cablecomp.estimation.simulate import load_of
from cablecomp.estimation.standing import value_of
from cablecomp.signal.smoothing import FloatArray


def diagnose(
    config: JointConfig,
    recordings: Mapping[str, Columns],
    progress: Progress = lambda what, share: None,
    seed: int = 0,
    sessions: Sessions | None = None,
) -> Diagnosis:
    """Find out what physics the configuration lacks to explain the recordings (name or path -> canonical channels).

    `sessions`: how recordings belong together ("folder", "each", "one"; None = as `[[session]]` says, else by folder).
    `progress` is told what is being done and the share done. Raises InputError for recordings that lack a channel or that the
    nominal joint cannot follow.
    """
    begin = time.monotonic()
    rng = np.random.default_rng(seed)
    progress("reading", 0.0)
    body = gather_body(config, recordings, sessions)
    progress("calibrating the drive", 0.02)
    drive = calibrate_drive(config, body.used, rng)
    body = replace(body, final=_from_where(body, drive.fit.problem.evidence))
    seen = [_covariates(config, e) for e in drive.fit.problem.evidence]
    before = _series(drive.fit, seen, drive.floor_rad)
    location = locate(before, rng, _sensitivities(drive.fit))
    pool = hypotheses(config, body.used)
    searched = spread(drive.fit.problem.evidence, LIMITS.searched)
    whole = len(searched) == len(drive.fit.problem.evidence)
    begin_fit = drive.fit if whole else solve(drive.fit.problem.with_evidence(searched), drive.fit.x, 6)
    nominal = drive.nominal if whole else _at_start(begin_fit)
    groups = make_groups(begin_fit)
    selection = select(begin_fit, nominal, pool, groups, rng, progress)
    progress("last fit", 0.9)
    selection = replace(selection, final=_settled(selection.final, drive, groups))
    final = selection.final
    if not whole and final.terms:
        everything = final.fit.problem.with_evidence(drive.fit.problem.evidence)
        groups = make_groups(drive.fit)
        fit = solve(everything, final.fit.x, 12)
        final = _settled(Model(final.terms, fit, left_out(fit, groups)), drive, groups)
    after = _series(final.fit, seen, drive.floor_rad)
    rest = locate(after, rng, _sensitivities(final.fit))
    share_left = _share_left(drive, final)
    progress("holding each name against its rivals", 0.92)
    weighed_terms = weigh(selection, pool, rest, share_left, rng)
    named = [w for w in weighed_terms if w.confidence >= LIMITS.name]
    if len(named) < len(weighed_terms) and not named:
        kept = Model((), drive.fit, left_out(drive.fit, groups))
    else:
        kept = final
    laws = empirical_laws(final, groups) if named else []
    repeated = repeatability(drive.fit.problem.evidence, seen)
    structured = _structured(rest if named else location, after if named else before, repeated, bool(named))
    verdict = _verdict(named, structured, drive)
    progress("counting errors on data left out", 0.95)
    by = groups.by
    baseline = errors_of(drive.fit, body.final, by)
    augmented = errors_of(kept.fit, body.final, by) if kept is final and final.terms else baseline
    if laws:
        augmented = _with_laws(augmented, laws)
    joint = augmented_joint(config, kept, [f.law for f in laws], body.names)
    unseen, hidden = could_be_unseen(kept.fit, pool, [w.term.name for w in named])
    tied = (*_tied(weighed_terms), *(((h.effect,), h.why) for h in hidden))
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
        calibration=_values(kept.fit, config, effects=False),
        location=location,
        named=tuple(_named(w, final) for w in named),
        candidates=_candidates(weighed_terms, selection, final),
        not_excluded=tied,
        empirical=tuple(Law(f.law.id, _of(f.law.of), f.lead.gain, f.lead.z) for f in laws),
        next_experiment=_experiment(selection, weighed_terms, kept, hidden, drive, seen),
        could_be_unseen=tuple(unseen),
        remainder=_remainder(
            kept, rest if named else location, after if named else before, structured, drive, rng
        ),
        remainder_location=rest if named else location,
        tested=_tested(selection, [w.term.name for w in named]),
        notes=_notes(config, body, drive),
        augmented_joint=joint,
        evidence=drive.fit.problem.evidence,
        traces=tuple(_traces(drive.fit, kept.fit, seen)),
        runtime_s=time.monotonic() - begin,
        warnings=tuple(f"{name} ended on its bound" for name in kept.fit.at_bound()),
    )


# --- steps ------------------------------------------------------------------------------------------------------------


def _from_where(body: Body, cut: Sequence[Evidence]) -> tuple[Evidence, ...]:
    """The recordings kept for the end, counted from where the ones used are: a full swing in."""
    if body.final_by == "block":
        return body.final
    first = int(np.median([int(np.argmax(e.counted[JOINT])) for e in cut]))
    return tuple(e.counting_from(min(first, len(e.rows) // 2)) for e in body.final)


def _at_start(fit: Fit) -> Fit:
    """The nominal drive about the same recordings, evaluated."""
    problem = fit.problem
    x = problem.start
    return Fit(problem, x, problem.residual(x), problem.jacobian(x))


def _settled(model: Model, drive: Calibrated, groups: Groups) -> Model:
    """The model fitted with weights that its own remainder asks for, so that its uncertainties mean something."""
    fit = model.fit
    for _ in range(2):
        fit = refit(fit, weighed(fit, drive.floor), 10)
    return replace(model, fit=fit, left_out=left_out(fit, groups))


def _covariates(config: JointConfig, e: Evidence) -> Covariates:
    """Covariates on the judged rows, out of the fine ones."""
    columns = {k: v for k, v in e.columns.items() if k != "motor_torque_Nm"}
    columns["joint_torque_Nm"] = np.broadcast_to(
        np.asarray(load_of(config, e.columns), dtype=np.float64), columns["time_s"].shape
    ).copy()
    whole = covariates(columns)
    return Covariates(
        {k: v[e.rows] for k, v in whole.values.items()},
        whole.motion_direction[e.rows],
        whole.motion_reversal[e.rows],
        whole.starts,
        whole.resting_share,
    )


def _series(fit: Fit, seen: Sequence[Covariates], floor_rad: float) -> Series:
    """What the fit leaves of the joint angle on counted rows, beside its covariates."""
    problem = fit.problem
    parts, kept = [], []
    for e, left, c in zip(problem.evidence, problem.left(fit.x), seen, strict=True):
        here = e.counted[JOINT]
        parts.append(left[here])
        kept.append(
            Covariates(
                {k: v[here] for k, v in c.values.items()},
                c.motion_direction[here],
                c.motion_reversal[here],
                c.starts,
                c.resting_share,
            )
        )
    return make_series(np.concatenate(parts), floor_rad, join(kept))


def _sensitivities(fit: Fit) -> FloatArray:
    """Derivative of the joint rows [rad] by the fit's parameters: what calibration can explain is not counted."""
    problem = fit.problem
    count = len(problem.owners(JOINT))
    weight = np.concatenate([e.weight[e.counted[JOINT]] for e in problem.evidence])
    rows = fit.J[:count] * (problem.weighing.sigma[JOINT] / weight)[:, None]
    own = np.stack([problem.owners(JOINT) == k for k in range(len(problem.evidence))], axis=1).astype(
        np.float64
    )
    return np.column_stack((rows, own)) if rows.shape[1] else own


def _share_left(drive: Calibrated, final: Model) -> float:
    """Mean square beyond noise left by the final model over that of the calibrated drive."""
    noise = drive.floor_rad**2
    before, after = rms_left(drive.fit) ** 2 - noise, rms_left(final.fit) ** 2 - noise
    return float(np.clip(after / max(before, 1e-3 * noise), 0.0, 1.0))


def _structured(found: Location, series: Series, repeated: float | None, named: bool) -> bool:
    """Whether what is left is more than noise and follows something; beside a name, far more than noise is enough."""
    yardstick = (
        float(np.mean(series.sigma)) if repeated is None else max(repeated, float(np.mean(series.sigma)))
    )
    ratio = float(np.mean(series.residual**2)) / yardstick**2
    follows = bool(found.significant(0.01))
    return ratio > (LIMITS.structured if follows else LIMITS.beyond_noise if named else np.inf)


def _verdict(named: Sequence[Weighed], structured: bool, drive: Calibrated) -> str:
    if named:
        return "partly explained" if structured else "explained"
    if structured:
        return "unexplained"
    before, after = rms_left(drive.nominal), rms_left(drive.fit)
    return "recalibrate" if after < LIMITS.recalibrate * before else "consistent"


def _with_laws(errors: Errors, laws: Sequence[Found]) -> Errors:
    factor = float(np.sqrt(np.prod([1.0 - f.lead.gain for f in laws])))
    return Errors(errors.rmse_rad * factor, errors.heldout_rmse_rad * factor, errors.final_rmse_rad)


# --- what is said -----------------------------------------------------------------------------------------------------


def _values(fit: Fit, config: JointConfig, effects: bool) -> tuple[Value, ...]:
    sd = np.sqrt(np.maximum(np.diag(covariance(fit)), 0.0))
    found = []
    for p, x, s in zip(fit.problem.parameters, fit.x, sd, strict=True):
        if p.name.startswith("effect.") != effects:
            continue
        nominal = None if effects or p.condition else value_of(config, p.base)
        found.append(Value(p.name, p.value(float(x)), float(s * abs(p.slope(float(x)))), nominal, p.session))
    zeros = fit.problem.zeros(fit.x)
    if not effects:
        for session in fit.problem.sessions:
            many = len(fit.problem.sessions) > 1
            name = "joint_position_offset_rad" + (f"@{session}" if many else "")
            count = sum(int(e.counted[JOINT].sum()) for e in fit.problem.evidence if e.session == session)
            sd_zero = fit.problem.weighing.sigma[JOINT] / max(count, 1) ** 0.5
            nominal = config.sensors.joint_position_offset_rad
            found.append(
                Value(name, float(zeros[JOINT][session][0]), sd_zero, nominal, session if many else None)
            )
    return tuple(found)


def _named(w: Weighed, final: Model) -> Named:
    effect = w.term.effect
    mine = f"effect.{effect.id}."
    parameters: dict[str, Value | str] = {
        v.name.removeprefix(mine): v
        for v in _values(final.fit, final.fit.problem.config, effects=True)
        if v.name.startswith(mine)
    }
    channel = w.term.name.partition(":")[2]
    if channel:
        parameters[effect.texts[0]] = channel
    return Named(
        effect.id,
        effect.statement,
        effect.equation,
        parameters,
        _depends(w.depends, final),
        float(w.evidence["share_total"]),
        w.confidence,
        dict(w.evidence),
        effect.acts_through,
        "" if w.confidence >= LIMITS.name else w.why_not,
    )


def _depends(d: Dependence | None, final: Model) -> dict[str, object] | None:
    if d is None:
        return None
    found: dict[str, object] = {"parameter": d.parameter.removeprefix("effect."), "on": d.on}
    values = final.fit.values
    if d.on == "session":
        found["values"] = {
            k.partition("@")[2]: v for k, v in values.items() if k.startswith(d.parameter + "@")
        }
    else:
        found["per_unit"] = values[f"{d.parameter}~{d.on}"]
    return found


def _candidates(found: Sequence[Weighed], selection: Selection, final: Model) -> tuple[Named, ...]:
    """Effects of the final model that are not sure enough, then what else stood out in a round."""
    rows = [_named(w, final) for w in found if w.confidence < LIMITS.name]
    known = {w.term.name for w in found}
    for r in selection.rounds:
        for t in r.tried:
            if (
                t.term.name in known
                or t.lead.gain < LIMITS.gain
                or t.lead.z < 2.0
                or isinstance(t.term, Dependence)
            ):
                continue
            known.add(t.term.name)
            effect = t.term.effect
            why = f"beside {r.base.name}, {r.tried[0].term.name} takes off more; with it known, this one is not missed"
            evidence = {"z": t.lead.z, "selected_in": t.selected_in, "gain": t.lead.gain}
            rows.append(
                Named(
                    effect.id,
                    effect.statement,
                    effect.equation,
                    {},
                    None,
                    t.lead.gain,
                    0.0,
                    evidence,
                    (),
                    why,
                )
            )
    return tuple(rows)


def _tied(found: Sequence[Weighed]) -> tuple[tuple[tuple[str, ...], str], ...]:
    rows = []
    for w in found:
        if w.rivals:
            why = f"they predict data left out alike: the lead over the nearest is {w.lead.z:.1f} standard errors"
            rows.append(((w.term.name, *w.rivals), why))
    return tuple(rows)


def _tested(selection: Selection, named: Sequence[str]) -> tuple[Tested, ...]:
    rows = []
    taken = {t.name for t in selection.final.terms}
    for r in selection.rounds:
        for t in r.tried:
            accepted = r.accepted is not None and r.accepted.term.name == t.term.name and t.term.name in taken
            outcome = (
                "named" if t.term.name in named and accepted else "candidate" if accepted else "not needed"
            )
            rows.append(Tested(t.term.name, r.base.name, t.lead.gain, t.lead.z, t.selected_in, outcome))
    return tuple(rows)


def _experiment(
    selection: Selection,
    found: Sequence[Weighed],
    kept: Model,
    hidden: Sequence[Hidden],
    drive: Calibrated,
    seen: Sequence[Covariates],
) -> tuple[str, str] | None:
    """Where effects are tied, or one hides behind the calibration, what would set the predictions apart."""
    first = drive.fit.problem.evidence[0]
    names = {n for w in found for n in w.rivals}
    models = [selection.final.fit.problem.joint(selection.final.fit.x, first)]
    for r in selection.rounds:
        for t in r.tried:
            if t.term.name in names:
                names.discard(t.term.name)
                models.append(t.model.fit.problem.joint(t.model.fit.x, first))
    if len(models) < 2:
        models = [kept.fit.problem.joint(kept.fit.x, first), *(h.joint for h in hidden[:1])]
    if len(models) < 2:
        return None
    temperature = float(np.mean(first.columns.get("temperature_degC", np.array([20.0]))))
    try:
        best = best_experiment(models, join(list(seen)), drive.floor_rad, temperature)
    except InputError:
        return None
    return None if best is None else (best.why, best.protocol.to_toml())


def _remainder(
    kept: Model,
    found: Location,
    series: Series,
    structured: bool,
    drive: Calibrated,
    rng: np.random.Generator,
) -> dict[str, object]:
    left = rms_left(kept.fit)
    text, equation = "noise", None
    if structured:
        stages = kept.fit.problem.config.drive.stage
        ratio = float(np.prod([s.output_radius_m / s.input_radius_m for s in stages]))
        description = describe(series, rng, _sensitivities(kept.fit), ratio)
        first = found.significant(0.01)
        text = (
            f"follows {first[0].covariate}: {first[0].how}; {description.text}" if first else description.text
        )
        equation = description.law.equation if description.law else None
    return {
        "rmse_rad": left,
        "share": float(left**2 / max(rms_left(drive.fit) ** 2, 1e-300)),
        "structured": structured,
        "description": text,
        "equation": equation,
    }


def _notes(config: JointConfig, body: Body, drive: Calibrated) -> tuple[str, ...]:
    load = load_channel(config, body.used[0].columns)
    found = [f"load from {load}" if load else "no load channel: the joint is taken as free"]
    if drive.lost_rows:
        total = sum(len(e.rows) for e in body.used)
        found.append(f"{drive.lost_rows} of {total} rows given up to the history before the first sample")
    outliers = sum(e.outliers for e in body.used)
    if outliers:
        found.append(f"{outliers} single readings set aside as outliers")
    return tuple(found)


def _of(channel: str) -> str:
    return {"motor_position_rad": "motor_angle", "joint_torque_Nm": "load"}.get(channel, channel)


def _traces(before: Fit, after: Fit, seen: Sequence[Covariates]) -> list[Traces]:
    stages = before.problem.config.drive.stage
    ratio = float(np.prod([s.input_radius_m / s.output_radius_m for s in stages]))
    rows = []
    lefts = (before.problem.left(before.x, own_zero=False), after.problem.left(after.x, own_zero=False))
    for k, (e, c) in enumerate(zip(before.problem.evidence, seen, strict=True)):
        measured = e.at_rows(JOINT)
        rigid = ratio * e.at_rows("motor_position_rad")
        zero = float(np.median(measured - rigid))
        rows.append(
            Traces(
                e.name, e.session, c.values, measured, measured - lefts[0][k], measured - lefts[1][k], rigid + zero,
                e.counted[JOINT],
            )
        )  # fmt: skip
    return rows
