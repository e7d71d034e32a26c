"""Numbers of the diagnosis page: values with their uncertainty, RMSE before and after, calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cablecomp.report import page
from cablecomp.report.diagnosis_view import DiagnosisView
from cablecomp.report.replay_figures import scale


def title(view: DiagnosisView, effect: str) -> str:
    """Return an effect's title, or its id in words."""
    note = view.notes.get(effect)
    return note.title if note is not None else effect.replace("_", " ")


def angle(value_rad: float) -> str:
    """Return an angle in the unit in which it reads well; NaN is a dash."""
    if value_rad != value_rad:
        return "–"
    unit = scale(abs(value_rad))
    return page.number(value_rad * unit.factor, unit.unit)


def known(value: float | None) -> float:
    """Return a number of diagnosis.json, NaN where it holds none."""
    return float("nan") if value is None else float(value)


def with_sd(value: float, sd: float) -> str:
    """Value with as many decimals as its standard deviation has, and that one with two digits."""
    if not (np.isfinite(sd) and sd > 0.0):
        return page.number(value, digits=5)
    decimals = 1 - int(np.floor(np.log10(sd)))
    if -1 <= decimals <= 7:
        places = max(decimals, 0)
        return f"{value:.{places}f} ± {sd:.{places}f}".replace("-", "−")
    digits = int(np.clip(np.floor(np.log10(max(abs(value), sd) / sd)) + 2, 2, 8))
    return f"{page.number(value, digits=digits)} ± {page.number(sd, digits=2)}"


def interval(value: float, sd: float) -> str:
    """Return the 95 % interval of a value, a dash if its uncertainty is not known."""
    if not np.isfinite(sd):
        return "–"
    return f"{page.number(value - 1.96 * sd, digits=4)} … {page.number(value + 1.96 * sd, digits=4)}"


def numbers(view: DiagnosisView) -> str:
    """Return RMSE before and after, over all samples and held out, as a whole and by recording."""
    rows = []
    for recording in view.recordings:
        for name, mask in (("fitted", ~recording.heldout), ("held out", recording.heldout)):
            if not np.any(mask):
                continue
            before, after = (
                float(np.sqrt(np.mean(residual[mask] ** 2)))
                for residual in (recording.residual_before, recording.residual_after)
            )
            rows.append(
                (
                    recording.name,
                    name,
                    int(mask.sum()),
                    angle(before),
                    angle(after),
                    f"{before / max(after, 1e-300):.2f}",
                )
            )
    result = view.result
    whole = [
        (
            "all",
            name,
            "",
            angle(result["baseline"][key]),
            angle(result["augmented"][key]),
            _ratio(result, key),
        )
        for name, key in (("every sample", "rmse_rad"), ("held out", "heldout_rmse_rad"))
    ]
    headers = ("recording", "samples of", "count", "RMSE before", "RMSE after", "before / after")
    table = page.table(headers, whole)
    return table + (
        page.fold("by recording", page.table(headers, rows)) if len(rows) > 2 else page.table(headers, rows)
    )


def _ratio(result: Mapping[str, Any], key: str) -> str:
    after = float(result["augmented"][key])
    return f"{float(result['baseline'][key]) / after:.2f}" if after > 0.0 else "–"


def calibration(entries: Mapping[str, Mapping[str, float | None]]) -> str:
    """Return nominal and calibrated values side by side."""
    rows = []
    for name, entry in entries.items():
        nominal, value, sd = (known(entry.get(key)) for key in ("nominal", "value", "sd"))
        change = f"{100.0 * (value / nominal - 1.0):+.1f} %" if np.isfinite(nominal) and nominal else "–"
        rows.append((name, page.number(nominal, digits=5), with_sd(value, sd), change.replace("-", "−")))
    return page.table(("parameter", "nominal", "calibrated", "change"), rows)
