"""The diagnosis page: the answer, what was missing, what remains, where, before and after, what was rejected
and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any, Final

from cablecomp.counting import counted
from cablecomp.diagnosis.body import short
from cablecomp.diagnosis.result import Diagnosis, Traces, report_json
from cablecomp.effects import Effect, catalogue
from cablecomp.estimation.parameter import parts_of
from cablecomp.report import diagnosis_figures as figures
from cablecomp.report import page
from cablecomp.report.concealed_page import concealed_section
from cablecomp.report.diagnosis_answer import answer, shown_first
from cablecomp.report.diagnosis_tables import (
    angle,
    between,
    by_recording,
    by_session,
    calibration,
    errors,
    interval,
    known,
    rejected,
    shown_with_sd,
    unit_for,
)
from cablecomp.report.diagnosis_words import (
    base_value,
    covariate,
    dependences,
    depends,
    percent,
    plain,
    sentence,
)
from cablecomp.report.page import Section
from cablecomp.report.replay_figures import Scale

_DRAWN: Final = 6
"""Recordings whose curves are drawn."""
_BY_CHANCE: Final = 0.05
"""p-value from which on a mismatch is said to sit nowhere."""


def diagnosis_page(d: Diagnosis, augmented_toml: str = "", concealed: Mapping[str, Any] | None = None) -> str:
    """Return the page of one diagnosis as HTML that opens offline; `augmented_toml` is shown folded,
    `concealed` is what `cablecomp prove --in` found of physics concealed in the same recordings."""
    many = len(d.sessions) > 1
    count = counted(len(d.recordings), "recording")
    lead = f"{count}{f' in {len(d.sessions)} sessions' if many else ''}; diagnosed in {d.runtime_s:.0f} s."
    return page.page(f"Diagnosis: {d.config.name}", lead, _sections(d, augmented_toml, concealed))


def _sections(d: Diagnosis, augmented_toml: str, concealed: Mapping[str, Any] | None) -> Iterator[Section]:
    result = report_json(d)
    unit = unit_for(result)
    yield answer(d, result, unit)
    if result["missing_physics"]:
        yield Section("What was missing", "".join(_missing(result)))
    laws = dependences(result)
    if laws or len(d.sessions) > 1:
        yield _sessions(d, result, laws)
    if d.remainder["structured"] or d.empirical:
        yield _remains(d, result, unit)
    if result["mismatch"]:
        yield _where(d, result["mismatch"], unit)
    if d.traces:
        yield _overlays(d, unit)
    yield Section(
        "Numbers",
        errors(result, unit) + (page.fold("by recording", by_recording(d.traces, unit)) if d.traces else ""),
        "Data left out in turn may have helped to choose; data kept for the end were used for nothing.",
    )
    if d.tested or d.candidates:
        yield _rejected(d)
    if d.calibration:
        yield Section(
            "Calibration",
            calibration(result["calibration"]),
            "Nominal values of the drive, fitted together with the physics above.",
        )
    yield from _open_questions(d)
    if d.could_be_unseen:
        yield _unseen(d)
    if concealed is not None:
        yield concealed_section(concealed)
    yield from _files(d, augmented_toml)


def _missing(result: Mapping[str, Any]) -> Iterator[str]:
    for m in result["missing_physics"]:
        effect = catalogue()[m["effect"]]
        yield f"<h3>{escape(sentence(plain(m['effect'])))} <code>{escape(m['effect'])}</code></h3>"
        yield page.paragraph(m["statement"])
        yield f'<div class="equation">{escape(m["equation"])}</div>'
        rows = [_parameter(effect, name, value) for name, value in m["parameters"].items()]
        yield page.table(("parameter", "value", "unit", "95 % interval"), rows)
        if m["depends_on"]:
            yield page.paragraph(f"{depends(m['depends_on'])}.")
        most = " in the channel in which it shows most" if result["channels"] else ""
        yield page.paragraph(
            f"Takes {percent(known(m['heldout_gain']))} off the calibrated "
            f"drive's held-out mean square{most}; probability "
            f"that the name is right: {100 * known(m['confidence']):.0f} %. Source: {effect.source}."
        )
        yield page.fold("the evidence", page.table(("evidence", "value"), list(m["evidence"].items())))


def _parameter(effect: Effect, name: str, entry: Any) -> tuple[str, str, str, str]:
    """A row of the table of fitted values; a text (such as a channel's name) stands as it is."""
    if not isinstance(entry, Mapping):
        return name, str(entry), "", ""
    value, sd = known(entry["value"]), known(entry["sd"])
    ends = entry.get("interval_95")
    base, _, condition = parts_of(name)
    known_as = next((p for p in effect.parameters if p.name == base and not condition), None)
    if known_as is not None and known_as.held:
        return name, shown_with_sd(value, sd), known_as.unit, "chosen, not fitted"
    if known_as is None:
        return name, shown_with_sd(value, sd), "", between(*ends) if ends else interval(value, sd)
    least = 0.0 if known_as.low >= 0.0 else known_as.minimum
    words = between(*ends) if ends else interval(value, sd, least, known_as.maximum)
    return name, shown_with_sd(value, sd), known_as.unit, words


def _sessions(d: Diagnosis, result: Mapping[str, Any], laws: Sequence[Mapping[str, Any]]) -> Section:
    drawn = []
    for law in laws:
        points = _points(d, result, law)
        words = f"{depends(law)}."
        line = "" if "values" in law else f" The line is that law, as far as {law['on']} was recorded."
        drawn.append(
            page.figure(figures.dependence(points, law["parameter"], law["on"]), words + line)
            if len(points) > 1
            else page.paragraph(words)
        )
    lead = (
        "What is not the same everywhere, and the law that ties it together."
        if laws
        else "Only the zeros are each session's own: one set of constants holds for all of them."
    )
    return Section("Sessions and conditions", page.columns(*drawn) + by_session(result["calibration"]), lead)


def _points(d: Diagnosis, result: Mapping[str, Any], law: Mapping[str, Any]) -> dict[str, float]:
    """Values of a parameter by session, or by the condition's value."""
    if "values" in law:
        return dict(law["values"])
    base = base_value(result, law["parameter"])
    if base is None:
        return {}
    where = sorted({e.condition[law["on"]] for e in d.evidence if law["on"] in e.condition})
    return {f"{c:.6g}": base + law["per_unit"] * c for c in where}


def _remains(d: Diagnosis, result: Mapping[str, Any], unit: Scale) -> Section:
    law = d.remainder.get("equation")
    said = str(d.remainder["description"])
    body = page.paragraph(f"{sentence(said.removesuffix(str(law)).removesuffix(': ') if law else said)}.")
    if law:
        body += f'<div class="equation">{escape(str(law))}</div>'
        body += page.paragraph("A fit that holds on data left out; not the name of a mechanism.")
    after = [m.entry() for m in d.remainder_location.mismatch]
    if d.named and after:
        body += page.figure(figures.shares(after), "What is left after the names above: what it follows.")
    rows = [
        (law.law, covariate(law.of), f"{100 * law.heldout_gain:.1f} %", f"{law.z:.1f}") for law in d.empirical
    ]
    if rows:
        body += page.paragraph(
            "Laws without a physical name that hold on data left out; they run in the augmented joint:"
        )
        body += page.table(("law", "of", "takes off what is left", "z"), rows)
    lead = f"{angle(result['remainder']['rmse_rad'], unit)} RMS that no named effect accounts for."
    return Section("What remains", body, lead)


def _where(d: Diagnosis, mismatch: Sequence[Mapping[str, Any]], unit: Scale) -> Section:
    first = next((m for m in mismatch if m["p_value"] < _BY_CHANCE), mismatch[0])
    floor = max(d.noise_floor_rad, 1e-12)
    name = first["covariate"]
    if first["p_value"] < _BY_CHANCE:
        low, high = (page.number(v, figures.unit_of(name)) for v in first["range"])
        lead = (
            f"Before any name: {covariate(name)} accounts for {100 * first['share']:.0f} % of the calibrated drive's "
            f"mismatch, four fifths of that between {low} and {high}. The residual: {first['how']}."
        )
    else:
        lead = "Before any name: nothing that was asked stands out of what noise does by chance."
    body = page.figure(
        figures.shares(mismatch),
        "Energy beyond noise that a dependence on each quantity predicts in blocks that its fit did not see. "
        "Shares overlap where quantities move together; pale bars are not beyond chance "
        "(p corrected for all of them).",
    )
    usable = [m["covariate"] for m in mismatch if all(m["covariate"] in t.covariates for t in d.traces)]
    if d.traces and usable:
        body += page.columns(
            page.figure(
                figures.along(d.traces, usable[0], floor, unit),
                "Mean error of what was fitted; the grey band is the sensors' noise.",
            ),
            page.figure(
                figures.energy_map(d.traces, _grid_axis(usable), floor),
                "RMS error in noise floors, of what was not fitted too.",
            ),
        )
    return Section("Where the mismatch is", body, lead)


def _grid_axis(usable: Sequence[str]) -> str:
    """Covariate for the map: a direction has two values and makes no map."""
    return next((name for name in usable if name not in ("load_direction", "time")), "load")


def _overlays(d: Diagnosis, unit: Scale) -> Section:
    first = shown_first(d)
    assert first is not None
    most = d.location.mismatch[0] if d.location.mismatch else None
    sure = most is not None and most.p_value < _BY_CHANCE
    intervals = [i for i in most.intervals_s if _inside(i, first)] if most is not None and sure else []
    said = f"{short(first.name)}. Shaded above: not fitted (unknown history, or kept for the end)."
    middle = " Shaded in the middle: where the mismatch sits." if intervals else ""
    body = page.figure(figures.overlay(first, intervals, unit), said + middle)
    body += page.figure(
        figures.loops(first, unit), "The loop measured (broad), before (left) and after (right)."
    )
    others = [t for t in d.traces if t is not first]
    for t in others[: _DRAWN - 1]:
        body += page.fold(
            short(t.name), page.figure(figures.overlay(t, (), unit)) + page.figure(figures.loops(t, unit))
        )
    left = f" Not drawn: {counted(len(others) - _DRAWN + 1, 'recording')}." if len(others) >= _DRAWN else ""
    return Section(
        "Before and after",
        body,
        f"Measured deflection, and the prediction without and with what was found.{left}",
    )


def _inside(interval: Sequence[float], trace: Traces) -> bool:
    time = trace.covariates["time"]
    return bool(interval[1] >= time[0] and interval[0] <= time[-1])


def _rejected(d: Diagnosis) -> Section:
    rounds = {name: k + 1 for k, name in enumerate(dict.fromkeys(t.beside for t in d.tested))}
    body = ""
    if d.candidates:
        rows = [(plain(c.effect), f"{100 * c.confidence:.0f} %", c.why_not_named) for c in d.candidates]
        body += page.table(("candidate", "confidence", "why it is not named"), rows)
    if d.tested:
        steps = "; ".join(f"step {k}: beside {name}" for name, k in rounds.items())
        body += page.figure(figures.tried(d.tested, rounds), f"By step. {steps}.")
        body += page.fold(f"all {len(d.tested)} that were fitted", rejected(d.tested, rounds))
    lead = (
        f"{len({t.name for t in d.tested})} hypotheses were fitted together "
        f"with the calibration and judged on data that "
        "their fit had not seen; the others promised less when they were asked."
    )
    return Section("What was rejected, and why", body, lead)


def _open_questions(d: Diagnosis) -> Iterator[Section]:
    body = ""
    if d.not_excluded:
        lines = [f"{' / '.join(plain(name) for name in names)}: {why}" for names, why in d.not_excluded]
        body += "<h3>These data cannot tell apart</h3>" + page.bullets(lines)
    if d.next_experiment is not None:
        why, protocol = d.next_experiment
        body += "<h3>The experiment that would</h3>" + page.paragraph(f"{why}.")
        body += page.code(protocol) + page.paragraph("`cablecomp run` executes this protocol as it stands.")
    if body:
        yield Section("What is open, and the next experiment", body)


def _unseen(d: Diagnosis) -> Section:
    rows = []
    for u in sorted(d.could_be_unseen, key=lambda u: u["below"] is None):
        below = (
            "could be any size"
            if u["below"] is None
            else f"{page.number(u['below'], u['unit'].removeprefix('-'))}"
        )
        rows.append((plain(u["effect"]), u["parameter"], below))
    table = page.table(("effect", "parameter", "would have been seen above"), rows)
    lead = "How large each effect that is not named could be without showing in these data, in its least visible shape."
    return Section("What these data could have shown", table, lead)


def _files(d: Diagnosis, augmented_toml: str) -> Iterator[Section]:
    body = page.bullets(d.notes)
    sessions = [(name, len(members), ", ".join(map(short, members))) for name, members in d.sessions.items()]
    body += page.fold("recordings", page.table(("session", "recordings", ""), sessions))
    if d.final:
        body += page.fold("kept for the end", page.bullets(map(short, d.final)))
    if augmented_toml:
        body += page.fold("joint.augmented.toml", page.code(augmented_toml))
    lead = "Replay and the live controller load joint.augmented.toml as it is." if augmented_toml else ""
    yield Section("Data and the augmented joint", body, lead)
