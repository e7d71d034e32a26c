"""From a finished diagnosis to its page."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cablecomp.diagnosis.covariates import Covariates
from cablecomp.diagnosis.diagnose import Diagnosis, report_json
from cablecomp.report.diagnosis_page import diagnosis_page
from cablecomp.report.diagnosis_view import (
    DiagnosisView,
    EffectNote,
    FloatArray,
    Hypothesis,
    Limit,
    RecordingView,
)


def diagnosis_report(diagnosis: Diagnosis, augmented_toml: str = "") -> str:
    """Return the report of a diagnosis as HTML that opens offline; `augmented_toml` is shown folded."""
    return diagnosis_page(diagnosis_view(diagnosis, augmented_toml))


def diagnosis_view(diagnosis: Diagnosis, augmented_toml: str = "") -> DiagnosisView:
    """Collect what the page shows: the result as written, the series behind it, and how each effect is
    explained.
    """
    result = report_json(diagnosis)
    limits = [
        Limit(entry["effect"], entry["parameter"], entry["below"], entry["unit"])
        for entry in result.get("could_be_unseen") or []
        if entry.get("below") is not None
    ]
    return DiagnosisView(
        diagnosis.setting.problem.config.name,
        result,
        list(_recordings(diagnosis)),
        _notes(diagnosis),
        list(_hypotheses(diagnosis)),
        limits,
        (result.get("remainder") or {}).get("equation") or "",
        result.get("warnings") or (),
        augmented_toml,
    )


def _recordings(diagnosis: Diagnosis) -> Iterator[RecordingView]:
    setting = diagnosis.setting
    found, measured = setting.covariates, setting.problem.measured
    ratio = setting.problem.config.drive.ratio
    rigid = ratio * found.values["motor_angle"]
    kept = setting.layout.heldout | setting.layout.training
    bounds = np.append(found.starts, found.samples)
    for number, name in enumerate(diagnosis.names):
        rows = slice(int(bounds[number]), int(bounds[number + 1]))
        # the encoder's zero is no deflection
        zero = float(np.median((measured - rigid)[rows]))
        yield RecordingView(
            name,
            _cut(found, rows),
            measured[rows],
            (measured - diagnosis.mismatch_rad)[rows],
            (measured - diagnosis.after_rad)[rows],
            (rigid + zero)[rows],
            kept[rows],
        )


def _cut(found: Covariates, rows: slice) -> dict[str, FloatArray]:
    return {name: values[rows] for name, values in found.values.items()}


def _notes(diagnosis: Diagnosis) -> dict[str, EffectNote]:
    """Every effect that was asked about, explained as its own file explains it."""
    forms = [group[0].form for group in diagnosis.selection.probes if group]
    forms += [form for form, _, _ in diagnosis.final.effects]
    notes = {}
    for form in forms:
        effect = form.effect
        units = {parameter.name: parameter.unit for parameter in effect.parameters}
        title = effect.id.replace("_", " ").capitalize()
        notes[effect.id] = EffectNote(title, effect.statement, effect.equation, effect.source, units)
    return notes


def _hypotheses(diagnosis: Diagnosis) -> Iterator[Hypothesis]:
    """Fitted hypotheses of all rounds with their scores, then those that the linear look ruled out."""
    named = {diagnosis.final.effects[k][0].name for k, _ in diagnosis.findings.named}
    ruled_out: list[Hypothesis] = []
    nan = float("nan")
    for number, round_ in enumerate(diagnosis.selection.rounds):
        best = round_.accepted
        beside = "the calibrated drive" if number == 0 else round_.base.replace("_", " ")
        for score in round_.verdict.scores:
            chosen = best is not None and best.name == score.name
            outcome = "not supported"
            if chosen:
                outcome = "named" if score.name in named else "fitted, not named"
            elif score.supported:
                outcome = "behind the best"
            why = f"z {score.z:.3g}, needed {score.margin:.3g}; beside {beside}"
            prefix = "" if number == 0 else "+ "
            yield Hypothesis(
                f"{prefix}{score.name}",
                score.heldout_gain,
                score.gain_sd,
                score.log_ratio,
                score.p_value,
                outcome,
                why,
                beside,
            )
        fitted = {score.name for score in round_.verdict.scores}
        for name, drop in sorted(round_.asked.items(), key=lambda item: -item[1]):
            if number == 0 and name not in fitted:
                why = f"accounts for {100.0 * max(drop, 0.0):.2g} % of the mismatch in a linear look"
                ruled_out.append(Hypothesis(name, nan, nan, nan, nan, "ruled out early", why, beside))
    yield from ruled_out
