"""Tables of the diagnosis page and how its numbers are written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cablecomp.diagnosis.body import short
from cablecomp.diagnosis.result import Tested, Traces
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.report import page
from cablecomp.report.diagnosis_figures import not_fitted, residual
from cablecomp.report.diagnosis_words import plain
from cablecomp.report.measured import with_sd
from cablecomp.report.replay_figures import Scale
from cablecomp.units import suffix_of


def angle(value_rad: float | None, unit: Scale) -> str:
    """Return an angle in the page's unit; None and NaN are a dash."""
    if value_rad is None or value_rad != value_rad:
        return "–"
    return page.number(value_rad * unit.factor, unit.unit)


def unit_for(result: Mapping[str, Any]) -> Scale:
    """The unit of all angles of a page: that in which the calibrated drive's error reads well."""
    size = known(result["baseline"]["heldout_rmse_rad"])
    return next(
        (s for s in (Scale(1.0, "rad"), Scale(1e3, "mrad")) if size * s.factor >= 0.3), Scale(1e6, "µrad")
    )


def known(value: float | None) -> float:
    """Return a number of diagnosis.json, NaN where it holds none."""
    return float("nan") if value is None else float(value)


def shown_with_sd(value: float, sd: float) -> str:
    """`value ± sd` as a page prints it."""
    return page.typeset(with_sd(value, sd))


def interval(value: float, sd: float, least: float = -np.inf, most: float = np.inf) -> str:
    """The 95 % interval of a value inside what it can be, a dash if its uncertainty is not known."""
    if not np.isfinite(sd):
        return "–"
    return between(max(value - 1.96 * sd, least), min(value + 1.96 * sd, most))


def between(low: float, high: float) -> str:
    """An interval in words."""
    return f"{page.number(low, digits=4)} … {page.number(high, digits=4)}"


def errors(result: Mapping[str, Any], unit: Scale) -> str:
    """RMS errors of the joint angle before and after, and of the other channels."""
    by = result["heldout"]["by"]
    rows = [
        (
            words,
            angle(result["baseline"][key], unit),
            angle(result["augmented"][key], unit),
            _ratio(result, key),
        )
        for words, key in (
            (f"{by}s left out in turn", "heldout_rmse_rad"),
            ("kept for the end, never used", "final_rmse_rad"),
            ("fitted", "rmse_rad"),
        )
    ]
    for name, entry in result["channels"].items():
        before, after = known(entry["baseline_rmse"]), known(entry["augmented_rmse"])
        ratio = f"{before / after:.2f}" if after > 0.0 else "–"
        stated = (suffix_of(name) or "").replace("Nm", "N·m")
        rows.append((f"{name}, fitted", page.number(before, stated), page.number(after, stated), ratio))
    return page.table(("joint angle, RMS on data", "before", "after", "before / after"), rows)


def by_recording(traces: Sequence[Traces], unit: Scale) -> str:
    """RMS error of each recording: on what counted in the fit, and on the rest."""
    rows = []
    for trace in traces:
        for name, mask in (("fitted", np.asarray(trace.counted)), ("not fitted", not_fitted(trace))):
            if np.count_nonzero(mask) < 3:
                continue
            before, after = (
                float(np.sqrt(np.mean(residual(trace, key)[mask] ** 2)))
                for key in ("before_rad", "after_rad")
            )
            rows.append((short(trace.name), trace.session, name, angle(before, unit), angle(after, unit)))
    return page.table(("recording", "session", "rows", "RMS before", "RMS after"), rows)


def _ratio(result: Mapping[str, Any], key: str) -> str:
    after = known(result["augmented"][key])
    return f"{known(result['baseline'][key]) / after:.2f}" if after > 0.0 else "–"


def calibration(entries: Mapping[str, Mapping[str, Any]]) -> str:
    """Return nominal and calibrated values side by side, those of all sessions."""
    rows = []
    for name, entry in entries.items():
        if entry["session"] is not None:
            continue
        nominal, value, sd = (known(entry[key]) for key in ("nominal", "value", "sd"))
        share = np.isfinite(nominal) and nominal and "_offset_" not in name  # a zero has no share
        change = f"{100.0 * (value / nominal - 1.0):+.1f} %" if share else "–"
        rows.append(
            (name, page.number(nominal, digits=5), shown_with_sd(value, sd), change.replace("-", "−"))
        )
    return page.table(("parameter", "configured", "calibrated", "change"), rows) if rows else ""


def by_session(entries: Mapping[str, Mapping[str, Any]]) -> str:
    """Return each session's own values, one row per session; empty where there are none."""
    own = {name: entry for name, entry in entries.items() if entry["session"] is not None}
    names = list(dict.fromkeys(name.partition("@")[0] for name in own))
    sessions = list(dict.fromkeys(entry["session"] for entry in own.values()))
    rows = [
        (
            s,
            *(
                shown_with_sd(known(e["value"]), known(e["sd"])) if (e := own.get(f"{n}@{s}")) else "–"
                for n in names
            ),
        )
        for s in sessions
    ]
    return page.table(("session", *names), rows) if rows else ""


def rejected(tested: Sequence[Tested], rounds: Mapping[str, int]) -> str:
    """Every hypothesis that was fitted and why it is not named."""
    rows = []
    for t in sorted(tested, key=lambda t: (rounds[t.beside], -t.heldout_gain)):
        rows.append((rounds[t.beside], plain(t.name), f"{100 * t.heldout_gain:.1f} %", f"{t.z:.1f}",
                     f"{100 * t.selected_in:.0f} %", t.outcome, _why(t, tested)))  # fmt: skip
    heads = ("step", "hypothesis", "takes off", "z", "best in resamples", "outcome", "why")
    return page.table(heads, rows)


def _why(t: Tested, tested: Sequence[Tested]) -> str:
    if t.outcome != "not needed":
        return ""
    if t.heldout_gain < LIMITS.gain:
        return f"takes off less than {100 * LIMITS.gain:g} % of what is left"
    if t.z < LIMITS.z:
        return f"z = {t.z:.1f}: chance does as much; {LIMITS.z:g} is asked for"
    best = max((o for o in tested if o.beside == t.beside), key=lambda o: o.heldout_gain)
    return f"{plain(best.name)} takes off more" if best is not t else "with the others known it is not missed"
