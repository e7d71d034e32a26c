"""A calibration in words: old -> new for the terminal and for `joint.calibrated.toml`, and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cablecomp.config_text import joint_text
from cablecomp.diagnosis.calibrate import Calibration, Kept
from cablecomp.diagnosis.result import Value
from cablecomp.report.measured import rounded, with_sd


def calibration_summary(found: Calibration) -> RenderableType:
    """Old -> new, what stays nominal and why, what is left of the recordings."""
    table = Table(box=None, pad_edge=False)
    for k, head in enumerate(("calibration", "was", "is", "± (1 sigma)", "change")):
        table.add_column(head, justify="right" if k else "left", overflow="fold")
    for v in found.values:
        table.add_row(v.name, *cells(v))
    for kept in found.kept:
        table.add_row(kept.name, f"{kept.nominal:.5g}", "not told", "", "")
    head = (
        f"The joint's angle is left with {1e3 * found.rmse_rad:.4g} mrad RMS "
        f"({1e3 * found.nominal_rmse_rad:.4g} with the "
        f"nominal values; the encoder's own noise is {1e3 * found.noise_rad:.4g})."
    )
    return Group(Text(head), "", table, *(Text(line, overflow="fold") for line in calibration_notes(found)))


def cells(v: Value) -> tuple[str, str, str, str]:
    """Nominal value, value, sd, change in per cent (in sd where the nominal one is 0)."""
    nominal = "–" if v.nominal is None else f"{v.nominal:.5g}"
    change = "" if not v.nominal else f"{float(f'{100 * (v.value / v.nominal - 1):.2g}'):+g} %"
    value, sd = rounded(v.value, v.sd)
    return nominal, value, sd or "–", change


def calibration_notes(found: Calibration) -> Iterator[str]:
    """What could not be told, what is known only together, warnings: one line each."""
    yield from map(_kept, found.kept)
    for a, b, correlation in found.tied:
        yield (
            f"{a} and {b} are known together better than each alone (correlation {correlation:+.2f}): "
            "their intervals are wide for that"
        )
    yield from (f"warning: {w}" for w in found.warnings)


def calibration_json(found: Calibration) -> dict[str, Any]:
    """The same as data."""
    return {
        "schema": 1,
        "rmse_rad": found.rmse_rad,
        "nominal_rmse_rad": found.nominal_rmse_rad,
        "noise_rad": found.noise_rad,
        "values": {v.name: {"value": v.value, "sd": v.sd, "nominal": v.nominal} for v in found.values},
        "not_told": {
            k.name: {
                "nominal": k.nominal,
                "tolerance": k.tolerance,
                "why": k.why,
                "would_tell": None if k.advice is None else {"motion": k.advice.motion, "sd": k.advice.sd},
            }
            for k in found.kept
        },
        "tied": [{"names": [a, b], "correlation": c} for a, b, c in found.tied],
        "warnings": list(found.warnings),
    }


def calibrated_text(found: Calibration) -> str:
    """`joint.calibrated.toml`: the joint with what is known now; its head says what was fitted and what was not."""
    lines = [
        "calibrated; tolerances of fitted values are what the fit leaves (1 sigma, relative, at least 0.3 %)"
    ]
    lines += [f"{v.name}: {with_sd(v.value, v.sd)}, was {cells(v)[0]}" for v in found.values]
    return joint_text(found.config, (*lines, *calibration_notes(found)))


def _kept(k: Kept) -> str:
    told = (
        "no motion within the joint's limits would tell it"
        if k.advice is None
        else f"{k.advice.motion} would tell it to ± {_wide(k.advice.sd, k.share)}"
    )
    return f"{k.name} stays nominal, {k.nominal:.5g} ± {_wide(k.tolerance, k.share)}: {k.why}; {told}"


def _wide(sd: float, share: bool) -> str:
    """A share in per cent; else the amount, in the unit that the value's name ends with."""
    return f"{float(f'{100 * min(sd, 9.99):.2g}'):g} %" if share else f"{sd:.2g}"
