"""The first screen of the diagnosis page: what is missing, how sure, how much better, what remains."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any, Final

import numpy as np

from cablecomp.diagnosis.body import short
from cablecomp.diagnosis.result import Diagnosis, Traces
from cablecomp.report import diagnosis_figures as figures
from cablecomp.report import page
from cablecomp.report.diagnosis_tables import angle, known
from cablecomp.report.diagnosis_words import (
    dependences,
    depends,
    in_a_sentence,
    percent,
    plain,
    repeats_limit,
    sentence,
    values_of,
)
from cablecomp.report.measured import rounded
from cablecomp.report.page import Fact, Section, Tone
from cablecomp.report.replay_figures import Scale

_TONES: Final[Mapping[str, Tone]] = {
    "consistent": "good", "recalibrate": "warn", "explained": "good", "partly explained": "good",
    "unexplained": "bad",
}  # fmt: skip
_MOST_OLD: Final = 8


def answer(d: Diagnosis, result: Mapping[str, Any], unit: Scale) -> Section:
    """The answer: names or new values on the left, measured, before and after on the right, numbers below."""
    words = f'<p class="verdict {_TONES[d.verdict]}">{escape(sentence(d.verdict))}</p>'
    if d.mend_first:
        first = page.paragraph("Mend this first: what follows is about readings as they are.")
        words += f'<div class="mend">{first}{page.bullets(d.mend_first)}</div>'
    words += page.paragraph(in_a_sentence(result))
    missing = result["missing_physics"]
    words += "".join(_missing(m, bool(result["channels"]), len(missing) > 1, unit) for m in missing)
    words += "".join(_law(law) for law in dependences(result) if not _of_a_name(law, result))
    if not missing:
        words += _without_a_name(result)
    words += page.paragraph(_left(result, unit))
    words += page.paragraph(_nameless(result)) if result["empirical"] else ""
    trace = shown_first(d)
    picture = ""
    if trace is not None:
        seen = _unseen(result) if figures.end_is_shaded(trace) else ""
        picture = page.figure(figures.at_a_glance(trace, unit), f"The end of {short(trace.name)}.{seen}")
    others = page.bullets(w for w in d.warnings if w not in d.mend_first)
    return Section("Answer", f'<div class="answer"><div>{words}</div><div>{picture}</div></div>'
                   + page.facts(_facts(result, unit)) + others)  # fmt: skip


def shown_first(d: Diagnosis) -> Traces | None:
    """The recording to look at: where calibration alone leaves most."""
    return max(d.traces, key=_left_before, default=None)


def _left_before(trace: Traces) -> float:
    left = figures.residual(trace, "before_rad")
    read = left[np.isfinite(left)]
    return float(np.mean(read**2)) if len(read) else 0.0


def _missing(m: Mapping[str, Any], several: bool, others: bool, unit: Scale) -> str:
    """One name: how sure, what it takes off, its values; of `several` channels, beside `others`."""
    sure = 100.0 * known(m["confidence"])
    lines = "; ".join(values_of(m))
    law = page.paragraph(f"{depends(m['depends_on'])}.") if m["depends_on"] else ""
    moves, gain = m["evidence"].get("moves_rad"), m["evidence"].get("gain")
    by = f", and moves the joint by {angle(moves, unit)} RMS" if moves else ""
    beside = ""
    if others and gain is not None:
        last = (
            f"{percent(gain)} of what the others leave"
            if gain > 0.0
            else "the others predict as well without it"
        )
        beside = f" ({last})"
    return (
        f'<div class="missing"><h3>{escape(sentence(plain(m["effect"])))}</h3>'
        f'<div class="sure"><i style="width:{sure:.0f}%"></i></div>'
        f"<p><b>{sure:.0f} %</b> sure of the name; takes <b>{percent(known(m['heldout_gain']))}</b> off the held-out "
        f"square{' of the channel in which it shows most' if several else ''}{beside}{by}.</p>"
        f'<p class="values">{escape(lines)}</p>{law}</div>'
    )


def _law(law: Mapping[str, Any]) -> str:
    head, _, values = depends(law).partition(": ")
    under = f'<p class="values">{escape(values)}</p>' if values else ""
    return f'<div class="missing"><h3>{escape(head)}</h3>{under}</div>'


def _of_a_name(law: Mapping[str, Any], result: Mapping[str, Any]) -> bool:
    """Whether the law is said with the effect that it belongs to."""
    return any(
        m["depends_on"] and m["depends_on"]["parameter"] == law["parameter"]
        for m in result["missing_physics"]
    )


def _without_a_name(result: Mapping[str, Any]) -> str:
    """Old and new values of a recalibration; what a consistent or unexplained verdict rests on else."""
    if result["verdict"] == "recalibrate":
        moved = [(n, e) for n, e in result["calibration"].items() if e["nominal"] is not None]
        moved.sort(key=lambda p: -abs(p[1]["value"] - p[1]["nominal"]) / max(known(p[1]["sd"]), 1e-300))
        rows = [
            (n, *map(page.typeset, (f"{e['nominal']:.5g}", value, sd or "–")))
            for n, e in moved
            for value, sd in [rounded(e["value"], e["sd"])]
        ]
        return page.table(("parameter", "configured", "now", "±"), rows[:_MOST_OLD])
    if result["candidates"]:
        c = result["candidates"][0]
        return page.paragraph(
            f"Nearest: {plain(c['effect'])} ({100 * c['confidence']:.0f} %). Against it: {c['why_not_named']}."
        )
    return ""


def _nameless(result: Mapping[str, Any]) -> str:
    """What laws without a physical name take off what remains, one after the other."""
    laws = (
        f"{law['law'].replace('_', ' ')} {100.0 * known(law['heldout_gain']):.0f} %"
        for law in result["empirical"]
    )
    return (
        f"Of that one's square, laws without a name take off {', then '.join(laws)}; they run in the augmented joint "
        "and in the errors after."
    )


def _left(result: Mapping[str, Any], unit: Scale) -> str:
    remainder = result["remainder"]
    size = angle(remainder["rmse_rad"], unit)
    if not remainder["structured"]:
        return f"What remains, {size} RMS, follows nothing that was asked."
    text = str(remainder["description"]).partition(";")[0]
    return f"What remains: {size} RMS, {percent(known(remainder['share']))} of the calibrated drive's square; {text}."


def _unseen(result: Mapping[str, Any]) -> str:
    return " Shaded: kept for the end, nothing was fitted there." if result["heldout"]["final"] else ""


def _facts(result: Mapping[str, Any], unit: Scale) -> Iterator[Fact]:
    by, before, after = result["heldout"]["by"], result["baseline"], result["augmented"]
    for words, key in (
        (f"{by}s left out in turn", "heldout_rmse_rad"),
        ("kept for the end", "final_rmse_rad"),
    ):
        if before[key] is None:
            continue
        remark = "RMS error of the joint angle, before → after"
        yield Fact(
            sentence(words),
            _arrow(before[key], known(after[key]), unit),
            remark,
            _tone(before[key], after[key]),
        )
    if before["heldout_rmse_rad"] and result["missing_physics"]:
        gain = 1.0 - (known(after["heldout_rmse_rad"]) / before["heldout_rmse_rad"]) ** 2
        yield Fact("Square removed", percent(gain), "on data left out in turn", "good")
    if repeats_limit(result):
        yield Fact("The machine repeats to", angle(result["repeatability_rad"], unit), "what the data allow")
    yield Fact("Sensors' noise", angle(result["noise_floor_rad"], unit), "as it shows in the joint angle")


def _arrow(before: float, after: float, unit: Scale) -> str:
    if before == after:
        return angle(before, unit)
    return f"{page.number(before * unit.factor)} → {angle(after, unit)}"


def _tone(before: float, after: float | None) -> Tone:
    return "good" if after is not None and after < 0.9 * before else "plain"
