"""What a diagnosis says, out of the fits and their evidence: values, names, candidates, ties, what remains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from cablecomp.config import Empirical
from cablecomp.diagnosis.answer.values import as_trials_say, effect_values
from cablecomp.diagnosis.describe.empirical import value_of
from cablecomp.diagnosis.describe.unknown import describe
from cablecomp.diagnosis.explain.confidence import features_of_tried, learnt_level, learnt_of_tried
from cablecomp.diagnosis.explain.conformal import conformal_set, deficits
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.events import course_of
from cablecomp.diagnosis.explain.experiment import APART, best_experiment
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model, Selection
from cablecomp.diagnosis.explain.unseen import Hidden
from cablecomp.diagnosis.explain.weighed import Weighed
from cablecomp.diagnosis.locate.covariates import Covariates, join
from cablecomp.diagnosis.locate.remainders import sensitivities
from cablecomp.diagnosis.outcome import Case, Outcome
from cablecomp.diagnosis.result import Named, Tested, Traces, Value
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.least_squares import Fit, rms_left
from cablecomp.estimation.parallel import in_processes
from cablecomp.estimation.profile import profile_interval
from cablecomp.observer import Observer

FURTHER = ("joint_torque_Nm", "motor_torque_Nm", "tension_h_N", "tension_l_N")
"""Channels that may tell apart what the joint's angle does not."""
TOO_ALIKE = (
    "no motion within the limits, or the reach of these recordings, sets the models that these data cannot tell apart "
    "by more than {:.1f} noise floors (RMS): {}a closer [tolerance] of what makes up for them, or wider [limits], may"
)


def named_of(w: Weighed, final: Model) -> Named:
    """One effect with its parameters, evidence and confidence; profile intervals where it is named."""
    effect = w.term.effect
    mine = f"effect.{effect.id}."
    values = list(as_trials_say([v for v in effect_values(final.fit) if v.name.startswith(mine)]))
    if w.confidence >= LIMITS.name:
        found = in_processes(lambda v: profile_interval(final.fit, v.name, LIMITS.wider), values)
        values = [replace(v, interval_95=i) for v, i in zip(values, found, strict=True)]
    values, recording = _in_its_recording(values, w.term, final.fit)
    parameters: dict[str, Value | str] = {v.name.removeprefix(mine): v for v in values}
    parameters |= _chosen(w.term, final.fit)
    if recording:
        parameters["recording"] = recording
    if w.term.channel:
        parameters[effect.texts[0]] = w.term.channel
    return Named(
        effect.id,
        effect.statement,
        effect.equation,
        parameters,
        _depends(w.depends, final),
        w.removes,
        w.confidence,
        dict(w.evidence),
        w.term.acts_through,
        "" if w.confidence >= LIMITS.name else w.why_not,
    )


def _chosen(h: Hypothesis, fit: Fit) -> dict[str, Value]:
    """When further steps of an event come, or how curved it goes, where it does: chosen, not fitted."""
    if not h.has_instant:
        return {}
    course = h.course(course_of(fit, h))
    return {k: Value(h.key(k), v, 0.0) for k, v in course.items() if h.effect.parameter(k).held}


def _in_its_recording(values: Sequence[Value], h: Hypothesis, fit: Fit) -> tuple[list[Value], str]:
    """The values with an event's instant on the clock of the recording in which it came, or after which; and that
    recording's name, "" where all share one clock."""
    evidence = fit.problem.evidence
    when = next((v.value for v in values if h.has_instant and v.name == h.key(h.instant)), None)
    if when is None or not any(e.shift_s for e in evidence):
        return list(values), ""
    begun = [e for e in evidence if float(e.columns["time_s"][0]) <= when] or [evidence[0]]
    e = max(begun, key=lambda e: float(e.columns["time_s"][0]))

    def moved(v: Value) -> Value:
        interval = v.interval_95 and (v.interval_95[0] - e.shift_s, v.interval_95[1] - e.shift_s)
        return replace(v, value=v.value - e.shift_s, interval_95=interval)

    return [moved(v) if v.name == h.key(h.instant) else v for v in values], e.name


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


def candidates(found: Sequence[Weighed], selection: Selection, final: Model) -> tuple[Named, ...]:
    """Effects of the final model that are not sure enough, then what else stood out in a round: no name, for the model
    does without it."""
    rows = [named_of(w, final) for w in found if w.confidence < LIMITS.name]
    known = {(w.term.effect.id, w.term.channel) for w in found}
    held = {w.term.effect.id for w in found if not w.term.channel}
    for r in selection.rounds:
        for t in r.tried:
            if (
                isinstance(t.term, Dependence)
                or (t.term.effect.id, t.term.channel) in known
                or t.difference.gain < LIMITS.gain
                or t.difference.z < LIMITS.z_candidate
                or t.term.effect.id in held
            ):
                continue
            known.add((t.term.effect.id, t.term.channel))
            effect = t.term.effect
            more = f"{r.tried[0].term.name} takes off more; with it known, this one is not missed"
            if t is r.tried[0]:
                more = "it takes off most, but another model without it predicts data left out better"
            why = f"beside {r.base.name}, {more}"
            evidence = {"z": t.difference.z, "selected_in": t.selected_in, "gain": t.difference.gain}
            rows.append(
                Named(
                    effect.id,
                    effect.statement,
                    effect.equation,
                    {},
                    None,
                    t.difference.gain,
                    _of_tried(evidence),
                    evidence,
                    (),
                    why,
                )
            )
    return tuple(rows)


def _of_tried(evidence: Mapping[str, float]) -> float:
    """How probable it is that what the final model does without is there all the same: less than a name asks for."""
    model = learnt_of_tried()
    return 0.0 if model is None else min(model.probability(features_of_tried(**evidence)), LIMITS.name - 0.01)


def tied_of(found: Sequence[Weighed], selection: Selection) -> tuple[tuple[tuple[str, ...], str], ...]:
    """Effects that data left out cannot tell apart; and where none has a name, the first explanations that trials say
    not to exclude."""
    rows = []
    for w in found:
        if w.rivals:
            nearest = min(w.rivals, key=w.rivals.__getitem__)
            z = w.rivals[nearest]
            why = f"data left out tell them apart by {z:.1f} standard errors alone"
            if z < 0.0:
                why = f"{nearest} predicts data left out better, by {-z:.1f} standard errors alone"
            rows.append(((w.term.name, *w.rivals), why))
    level, first = learnt_level(), (selection.rounds[0].tried if selection.rounds else ())
    if level is not None and found and all(w.confidence < LIMITS.name for w in found):
        names = conformal_set(deficits({t.term.name: t.difference.z for t in first}), level)
        if len(names) > 1 and all(set(names) != set(effects) for effects, _ in rows):
            why = (
                f"asked alone, each is within {level:.1f} standard errors of the "
                f"best: sets made so held the truth in nine of "
                "ten trials"
            )
            rows.append((names, why))
    return tuple(rows)


def tested(selection: Selection, named: Sequence[str]) -> tuple[Tested, ...]:
    """Every comparison of the search; what the final model has is no more "not needed" in the rounds that led to it,
    those beside a part of that model (in all, where it was put in afterwards)."""
    taken = {t.name for t in selection.final.terms}
    rows = [(r, t) for r in selection.rounds for t in r.tried]
    steps = {(r.base.name, t.term.name) for r, t in rows if {b.name for b in r.base.terms} <= taken}
    led = {name for _, name in steps}

    def outcome(base: str, name: str) -> str:
        if name not in taken or (name in led and (base, name) not in steps):
            return "not needed"
        return "named" if name in named else "candidate"

    return tuple(
        Tested(
            t.term.name,
            r.base.name,
            t.difference.gain,
            t.difference.z,
            t.selected_in,
            outcome(r.base.name, t.term.name),
        )
        for r, t in rows
    )


def next_experiment(
    case: Case, selection: Selection, outcome: Outcome, hidden: Sequence[Hidden]
) -> tuple[tuple[str, str] | None, tuple[str, ...]]:
    """Where effects are tied, or one hides behind the calibration, what would set the predictions apart: why, and the
    protocol; or a note that nothing within the limits does."""
    first = case.drive.fit.problem.evidence[0]
    names = {n for w in outcome.weighed for n in w.rivals}
    models = [selection.final.fit.problem.joint(selection.final.fit.x, first)]
    for r in selection.rounds:
        for t in r.tried:
            if t.term.name in names:
                names.discard(t.term.name)
                models.append(t.model.fit.problem.joint(t.model.fit.x, first))
    if len(models) < 2:
        fit = outcome.kept.fit
        models = [fit.problem.joint(fit.x, first), *(h.joint for h in hidden[:1])]
    # a neighbour is at rest meanwhile: what it does tells it from others, if from few
    alone = [m for m in models if not Observer(m).channels]
    models = alone if len(alone) > 1 else models
    if len(models) < 2:
        return None, ()
    temperature = float(np.mean(first.columns.get("temperature_degC", np.array([20.0]))))
    try:
        best = best_experiment(models, join(list(case.covariates)), case.drive.floor_rad, temperature)
    except InputError:
        best = None
    if best is None:
        return None, ()
    if best.separation < APART:
        further = [c for c in FURTHER if c not in first.columns]
        channel = f"a further channel ({', '.join(further)}), " if further else ""
        return None, (TOO_ALIKE.format(best.separation, channel),)
    return (best.why, best.protocol.to_toml()), ()


def remainder(case: Case, outcome: Outcome, rng: np.random.Generator) -> dict[str, object]:
    """What the model kept leaves, in words and, where a sparse law holds, as an equation."""
    fit = outcome.kept.fit
    left = rms_left(fit)
    text, equation = "noise", None
    if outcome.structured:
        turns = 1.0 / fit.problem.config.drive.ratio
        description = describe(outcome.remainder.series, rng, sensitivities(fit), turns)
        first = outcome.remainder.location.significant(LIMITS.p_structured)
        text = (
            f"follows {first[0].covariate}: {first[0].how}; {description.text}" if first else description.text
        )
        equation = description.law.equation if description.law else None
    return {
        "rmse_rad": left,
        "share": float(left**2 / max(rms_left(case.drive.fit) ** 2, 1e-300)),
        "structured": outcome.structured,
        "description": text,
        "equation": equation,
    }


def channel_word(channel: str) -> str:
    """A channel in the words of the covariates."""
    return {"motor_position_rad": "motor_angle", "joint_torque_Nm": "load"}.get(channel, channel)


def traces(before: Fit, after: Fit, seen: Sequence[Covariates], laws: Sequence[Empirical]) -> list[Traces]:
    """What was measured, and what the drive predicts before and, with its laws without a name, after, recording by
    recording."""
    ratio = before.problem.config.drive.ratio
    rows = []
    lefts = (before.problem.left(before.x, own_zero=False), after.problem.left(after.x, own_zero=False))
    for k, (e, c) in enumerate(zip(before.problem.evidence, seen, strict=True)):
        measured, read = e.at_rows(JOINT), e.read_at_rows(JOINT)
        rigid = ratio * e.at_rows("motor_position_rad")
        zero = float(np.median(measured - rigid))
        after_rad = measured - lefts[1][k] + sum(value_of(law, e) for law in laws)
        rows.append(
            Traces(
                e.name, e.session, c.values, read, measured - lefts[0][k], after_rad, rigid + zero,
                e.counted[JOINT],
            )
        )  # fmt: skip
    return rows
