"""The diagnosis page: where the mismatch is, what was missing, what it changes, what was tried, what to
do next.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any, Final

import numpy as np

from cablecomp.report import diagnosis_figures as figures
from cablecomp.report import page, style
from cablecomp.report.diagnosis_tables import angle, calibration, interval, known, numbers, title, with_sd
from cablecomp.report.diagnosis_view import DiagnosisView, EffectNote, RecordingView
from cablecomp.report.page import Fact, Section, Tone

_VERDICTS: Final[Mapping[str, tuple[str, Tone, str]]] = {
    "consistent": (
        "Consistent",
        "good",
        "The drive's own physics account for these data; nothing is left beyond noise.",
    ),
    "recalibrate": ("Recalibrate", "warn", "Nominal values were off; no physics is missing."),
    "explained": (
        "Explained",
        "good",
        "Physics that the model lacked was found, and held-out data support it.",
    ),
    "unexplained": (
        "Unexplained",
        "bad",
        "There is structure that no known effect accounts for; it is not given a name.",
    ),
}


def diagnosis_page(view: DiagnosisView) -> str:
    """Return the page of one diagnosis as HTML that opens offline."""
    count = len(view.recordings)
    samples = sum(len(recording.measured_rad) for recording in view.recordings)
    names = ", ".join(recording.name for recording in view.recordings[:4])
    more = ", …" if count > 4 else ""
    lead = f"{count} recording{'s' if count != 1 else ''} ({names}{more}), {samples} samples."
    return page.page(f"Diagnosis: {view.joint}", lead, _sections(view))


def _sections(view: DiagnosisView) -> Iterator[Section]:
    result = view.result
    yield Section(
        "Verdict", _STYLE + page.facts(_facts(view)) + page.bullets(view.warnings), _verdict_line(view)
    )
    if result.get("missing_physics"):
        yield Section("What was missing", "".join(_missing(view)))
    remainder = result.get("remainder") or {}
    if result["verdict"] == "unexplained" or remainder.get("structured") or view.law:
        yield _unexplained(view, remainder)
    if result.get("mismatch"):
        yield _where(view)
    if view.recordings:
        yield _overlays(view)
        yield _residuals(view)
        yield Section(
            "Held-out numbers",
            numbers(view),
            "Held-out samples are predicted by a fit that has not seen them; the state runs through.",
        )
    if result.get("calibration"):
        yield Section(
            "Calibration",
            calibration(result["calibration"]),
            "Nominal values of the drive, fitted together with the physics above.",
        )
    if view.hypotheses:
        yield _tried(view)
    yield from _open_questions(view)
    if view.limits:
        yield _limits(view)
    if view.augmented_toml:
        body = page.fold("joint.augmented.toml", page.code(view.augmented_toml))
        yield Section("The augmented joint", body, "Replay and the live controller load this file as it is.")


def _facts(view: DiagnosisView) -> Iterator[Fact]:
    result = view.result
    verdict, tone, _ = _VERDICTS[result["verdict"]]
    missing = result.get("missing_physics") or []
    remark = " + ".join(title(view, entry["effect"]) for entry in missing)
    yield Fact("Verdict", verdict, remark, tone)
    if missing:
        sure = min(known(entry["confidence"]) for entry in missing)
        yield Fact("Confidence in the name", f"{100.0 * sure:.0f} %", "calibrated on blind trials")
    before, after = result["baseline"], result["augmented"]
    yield Fact("Held-out RMSE before", angle(before["heldout_rmse_rad"]), "calibrated drive")
    yield Fact("Held-out RMSE after", angle(after["heldout_rmse_rad"]), "augmented drive", _after_tone(view))
    yield Fact("Noise floor", angle(result["noise_floor_rad"]), "of measured minus predicted")
    if before["heldout_rmse_rad"] > 0.0:
        gain = 1.0 - (after["heldout_rmse_rad"] / before["heldout_rmse_rad"]) ** 2
        yield Fact("Mean square removed", f"{100.0 * gain:.1f} %", "on held-out data")


def _after_tone(view: DiagnosisView) -> Tone:
    floor, after = view.result["noise_floor_rad"], view.result["augmented"]["heldout_rmse_rad"]
    return "good" if floor > 0.0 and after < 1.3 * floor else "plain"


def _verdict_line(view: DiagnosisView) -> str:
    return _VERDICTS[view.result["verdict"]][2]


def _missing(view: DiagnosisView) -> Iterator[str]:
    for entry in view.result["missing_physics"]:
        note = view.notes.get(
            entry["effect"], EffectNote(title(view, entry["effect"]), entry["statement"], "")
        )
        yield f"<h3>{escape(note.title)} <code>{escape(entry['effect'])}</code></h3>"
        yield page.paragraph(entry.get("statement") or note.statement)
        if note.equation:
            yield f'<div class="equation">{escape(note.equation)}</div>'
        rows = [_parameter(name, value, note) for name, value in entry["parameters"].items()]
        yield page.table(("parameter", "value", "unit", "95 % interval"), rows)
        gain, sure = 100.0 * known(entry["heldout_gain"]), 100.0 * known(entry["confidence"])
        source = f" Source: {note.source}." if note.source else ""
        yield page.paragraph(
            f"Removes {gain:.1f} % of the calibrated drive's held-out mean square; probability that the name "
            f"is right: {sure:.0f} %.{source}"
        )


def _parameter(name: str, entry: Any, note: EffectNote) -> tuple[str, str, str, str]:
    """A row of the table of fitted values; a text (such as a channel's name) stands as it is."""
    if not isinstance(entry, Mapping):
        return name, str(entry), "", ""
    value, sd = known(entry["value"]), known(entry.get("sd"))
    return name, with_sd(value, sd), note.units.get(name, ""), interval(value, sd)


def _unexplained(view: DiagnosisView, remainder: Mapping[str, Any]) -> Section:
    body = page.paragraph(_sentence(str(remainder.get("description", ""))))
    if view.law:
        body += f'<div class="equation">{escape(view.law)}</div>'
        body += page.paragraph("A fit to data, held up by held-out blocks; not the name of a mechanism.")
    rms = remainder.get("rmse_rad")
    lead = f"What no known effect accounts for: {angle(float(rms))} RMS." if rms is not None else ""
    return Section("What stays unexplained", body, lead)


def _where(view: DiagnosisView) -> Section:
    mismatch = view.result["mismatch"]
    first = mismatch[0]
    floor = max(float(view.result["noise_floor_rad"]), 1e-12)
    share = 100.0 * float(first["share"])
    unit = figures.unit_of(first["covariate"])
    how = f" The residual: {first['how']}." if first.get("how") else ""
    lead = (
        f"{_sentence(figures.words(first['covariate']))} accounts for {share:.0f} % of the drive's "
        f"mismatch, four fifths of that between {page.number(first['range'][0], unit)} and "
        f"{page.number(first['range'][1], unit)}.{how}"
    )
    body = page.figure(
        figures.shares(mismatch),
        "Energy beyond noise that a dependence on each quantity predicts in blocks that its fit did not see. "
        "Shares overlap where quantities move together; pale bars are not beyond chance "
        "(p corrected for all of them).",
    )
    usable = [
        e["covariate"] for e in mismatch if all(e["covariate"] in r.covariates for r in view.recordings)
    ]
    if view.recordings and usable:
        lines = page.figure(
            figures.along(view.recordings, usable[0], floor),
            "Mean residual; the grey band is the noise floor.",
        )
        if usable[0] == "time":
            usable = [name for name in usable if name != "time"] or ["load"]
        grid = page.figure(
            figures.energy_map(view.recordings, _grid_axis(usable), floor), "RMS residual in noise floors."
        )
        body += page.columns(lines, grid)
    return Section("Where the mismatch is", body, lead)


def _grid_axis(usable: Sequence[str]) -> str:
    """Covariate for the map: a direction has two values and makes no map."""
    return next((name for name in usable if name not in ("load_direction", "time")), "load")


def _overlays(view: DiagnosisView) -> Section:
    mismatch = view.result.get("mismatch") or []
    intervals = mismatch[0]["intervals_s"] if mismatch and len(view.recordings) == 1 else []
    shown = sorted(view.recordings, key=_size, reverse=True)
    first = shown[0]
    body = page.figure(
        figures.overlay(first, intervals),
        f"{first.name}. Above, shaded violet: held-out stretches (if not all of it is). "
        "Middle, shaded orange: where the mismatch sits.",
    )
    body += page.figure(figures.loops(first), "The loop measured (broad), before (left) and after (right).")
    for recording in shown[1:6]:
        body += page.fold(
            recording.name,
            page.figure(figures.overlay(recording, ())) + page.figure(figures.loops(recording)),
        )
    left = f" The {len(shown) - 6} recordings with less mismatch are not drawn." if len(shown) > 6 else ""
    return Section(
        "Before and after",
        body,
        f"Measured deflection, and the prediction without and with what was missing.{left}",
    )


def _size(recording: RecordingView) -> float:
    return float(np.mean(recording.residual_before**2))


def _residuals(view: DiagnosisView) -> Section:
    floor = max(float(view.result["noise_floor_rad"]), 1e-12)
    axes = [name for name in ("load", "joint_angle") if all(name in r.covariates for r in view.recordings)]
    parts = [page.figure(figures.spectra(view.recordings, floor), "Spectrum of the residual.")]
    parts += [
        page.figure(figures.along(view.recordings, name, floor), f"Mean residual over {figures.words(name)}.")
        for name in axes
    ]
    return Section(
        "Residuals before and after",
        page.columns(*parts),
        "A model that lacks nothing leaves the flat noise floor.",
    )


def _tried(view: DiagnosisView) -> Section:
    fitted = [entry for entry in view.hypotheses if np.isfinite(entry.heldout_gain)]
    body = (
        page.figure(figures.hypotheses(fitted), "Bars: two standard deviations, dependence counted.")
        if fitted
        else ""
    )
    rows = [
        (
            entry.name.replace("_", " "),
            page.number(100.0 * entry.heldout_gain, "%"),
            page.number(entry.score, "nats"),
            page.number(entry.p_value, digits=2),
            entry.outcome,
            entry.why,
        )
        for entry in view.hypotheses
    ]
    headers = ("hypothesis", "held-out gain", "score", "p (corrected)", "outcome", "why")
    body += page.fold(f"all {len(rows)} hypotheses", page.table(headers, rows), opened=len(rows) <= 24)
    return Section(
        "What was tried",
        body,
        "Each effect was fitted together with the calibration, and judged on data that the fit had not seen.",
    )


def _open_questions(view: DiagnosisView) -> Iterator[Section]:
    excluded = view.result.get("not_excluded") or []
    experiment = view.result.get("next_experiment") or {}
    if not excluded and not experiment.get("protocol"):
        return
    body = ""
    if excluded:
        lines = [
            f"{' / '.join(title(view, name) for name in entry['effects'])}: {entry['why']}"
            for entry in excluded
        ]
        body += "<h3>These data cannot tell apart</h3>" + page.bullets(lines)
    if experiment.get("protocol"):
        body += "<h3>The experiment that would</h3>" + page.paragraph(str(experiment.get("why", "")))
        body += page.code(str(experiment["protocol"])) + page.paragraph(
            "`cablecomp run` executes this protocol as it stands."
        )
    yield Section("What is open, and the next experiment", body)


def _limits(view: DiagnosisView) -> Section:
    rows = [
        (title(view, entry.effect), entry.name, page.number(entry.value), entry.unit) for entry in view.limits
    ]
    table = page.table(("effect", "parameter", "would have been seen above", "unit"), rows)
    lead = "How large each effect could still be without showing in these data (95 %)."
    return Section("What these data could have shown", table, lead)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] if text else ""


_STYLE: Final = (
    "<style>h3{font-size:16px;margin:14px 0 4px}h3 code{font-size:13px;font-weight:400;color:#64748b}"
    f".equation{{font:17px/1.7 {style.MONO};background:#f8fafc;border-left:4px solid {style.PREDICTED};"
    "padding:8px 16px;margin:6px 0 12px;overflow-x:auto;border-radius:0 8px 8px 0}</style>"
)
