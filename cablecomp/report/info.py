"""Tables for the terminal: the design sheet of a joint, and the bench evaluation of a recording."""

from __future__ import annotations

import math
from typing import Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cablecomp.counting import counted
from cablecomp.report.measured import with_sd
from cablecomp.thesis.bench.types import BenchResult, Branch, Measured
from cablecomp.thesis.design_types import DesignSheet, StageSheet, WrapUse

_PREFIXES: Final = ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """Return a value with its unit and an SI prefix, `digits` significant digits; None and NaN are a dash."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "unlimited" if value > 0 else "−∞"
    factor, prefix = next(
        ((f, p) for f, p in _PREFIXES if abs(value) >= f * 0.99999), (_PREFIXES[-1] if value else (1.0, ""))
    )
    return f"{_digits(value / factor, digits)} {prefix}{unit}"


def design_table(sheet: DesignSheet) -> RenderableType:
    """Return the design sheet as tables with units, ready for a rich console; see `as_text` for
    plain text.
    """
    parts: list[RenderableType] = [_joint_table(sheet), "", _stage_table(sheet), "", _wrap_table(sheet), ""]
    parts += [Text(f"note: {note}", style="yellow") for note in sheet.notes]
    return Group(*parts)


def bench_table(result: BenchResult) -> RenderableType:
    """Return the bench evaluation as tables with uncertainties, ready for a rich console."""
    parts: list[RenderableType] = [_friction_table(result), "", _points_table(result), ""]
    lines = [
        f"mu_eff {_measured(result.mu_eff)} (nominal {result.mu_eff_nominal:.3g}), GF {result.GF:.3g}, peak "
        f"{quantity(result.peak_Nm, 'N·m')} (m = {result.m_peak:.3g})"
    ]
    for pulley in result.pulleys:
        lines.append(
            f"stage {pulley.stage}: mu_output {_measured(pulley.mu_output)}, mu_input "
            f"{_measured(pulley.mu_input)}; their ratio is the configuration's, the bench sees mu_eff alone"
        )
    lines.append(
        f"noise: load {quantity(result.load_noise_Nm, 'N·m', 2)}, deflection "
        f"{quantity(result.deflection_noise_rad, 'rad', 2)}"
    )
    parts += [Text(line) for line in lines]
    parts += [Text(f"note: {note}", style="yellow") for note in result.notes]
    return Group(*parts)


def _joint_table(sheet: DesignSheet) -> Table:
    circuit = sheet.circuit if sheet.arrangement == "single" else f"{sheet.circuit}, {sheet.arrangement}"
    table = _table(
        f"{sheet.name}: {circuit} circuit, {counted(len(sheet.stages), 'stage')}", "quantity", "value", ""
    )
    few = "of the output stage" if sheet.equivalent is None else ""
    ease = "of the load that eases the cable" if sheet.circuit == "open" else ""
    rows = [
        ("greatest load", quantity(sheet.load_max_Nm, "N·m"), "what the loaded values refer to"),
        ("reduction", f"{1.0 / sheet.ratio:.4g} : 1", "motor angle over joint angle"),
        ("effective friction mu_eff", f"{sheet.mu_eff:.4g}", few),
        ("geometry-friction number GF", f"{sheet.GF:.4g}", few or _reading(sheet.GF)),
        ("approximate model", *_model(sheet)),
        ("stiffness at zero load", quantity(sheet.zero_load_stiffness_Nm_per_rad, "N·m/rad"), "free spans"),
        ("stiffness at greatest load", quantity(sheet.loaded_stiffness_Nm_per_rad, "N·m/rad"), "tangent"),
        ("deflection at greatest load", quantity(sheet.deflection_rad, "rad"), ""),
        ("hysteresis left after it", quantity(sheet.hysteresis_rad, "rad"), "worst open-loop error"),
        ("tension after unloading", quantity(sheet.zero_load_tension_N, "N"), "output stage"),
        ("greatest cable tension", quantity(sheet.tension_greatest_N, "N"), ""),
        ("a wrap slips to its end from", quantity(sheet.slip_moment_Nm, "N·m"), ease or "finite wrap"),
        ("a cable goes slack from", quantity(sheet.slack_moment_Nm, "N·m"), ease),
        ("least pretension", quantity(sheet.pretension.minimum_N, "N"), _pretension(sheet)),
        ("efficiency limit", f"{100 * sheet.efficiency:.2f} %", "steady turning, bearings left out"),
    ]
    for row in rows:
        table.add_row(*row)
    return table


def _model(sheet: DesignSheet) -> tuple[str, str]:
    if sheet.circuit == "open":
        return "–", "the open circuit's formulas are exact"
    model = sheet.model
    return model.name, f"worst error while loading {100 * model.worst_error:.0f} %, m up to {model.m_limit:g}"


def _pretension(sheet: DesignSheet) -> str:
    rule = sheet.pretension
    if sheet.circuit == "open":
        return "if the greatest load may ease the cable as well"
    return (
        f"rule {rule.rule_narrow_N:.3g} to {rule.rule_wide_N:.3g} N, no slack {rule.no_slack_N:.3g} N, "
        f"no slip to the end {rule.no_slip_N:.3g} N"
    )


def _stage_table(sheet: DesignSheet) -> Table:
    columns = (
        "stage",
        "N_ik",
        "mu_eff",
        "GF",
        "pretension",
        "moment",
        "tension, most / least",
        "breaking margin",
    )
    table = _table("stages, motor side first", *columns)
    for stage in sheet.stages:
        table.add_row(
            str(stage.number), f"{stage.ratio:.4g}", f"{stage.mu_eff:.3g}", f"{stage.GF:.3g}",
            quantity(stage.pretension_N, "N"), quantity(stage.moment_Nm, "N·m"),
            f"{quantity(stage.tension_greatest_N, 'N')} / {quantity(stage.tension_least_N, 'N')}",
            "–" if stage.breaking_margin is None else f"{stage.breaking_margin:.2f}",
        )  # fmt: skip
    return table


def _wrap_table(sheet: DesignSheet) -> Table:
    table = _table("wrap that the greatest load affects, against what is there", "stage", "pulley",
                   "affected, tight / easy cable", "available", "least over the travel", "used")  # fmt: skip
    for stage in sheet.stages:
        for use in stage.wraps:
            table.add_row(*_wrap_row(stage, use))
    return table


def _wrap_row(stage: StageSheet, use: WrapUse) -> tuple[str, ...]:
    easy = "–" if math.isnan(use.affected_easy_rad) else f"{use.affected_easy_rad:.2f} rad"
    return (
        str(stage.number), use.pulley, f"{use.affected_tight_rad:.2f} rad / {easy}",
        f"{use.available_rad:.2f} rad", f"{use.available_least_rad:.2f} rad", f"{100 * use.used:.0f} %",
    )  # fmt: skip


def _friction_table(result: BenchResult) -> Table:
    table = _table(f"{result.name}: coefficient of friction mu_eff", "branch", "true (at rest)",
                   "acting (load moving)", "correlation", "samples")  # fmt: skip
    for branch in _branches(result):
        correlation = "–" if branch.correlation is None else f"{branch.correlation:.5f}"
        table.add_row(
            branch.name, _measured(branch.true), _measured(branch.acting), correlation, str(branch.samples)
        )
    return table


def _points_table(result: BenchResult) -> Table:
    table = _table("equilibrium points", "branch", "time", "load", "deflection", "drift", "mu_eff")
    for branch in _branches(result):
        for point in branch.points:
            drift = quantity(point.drift_rad, "rad", 2)
            table.add_row(
                branch.name, f"{point.time_s:.4g} s", quantity(point.load_Nm, "N·m"),
                quantity(point.deflection_rad, "rad"), drift if point.settled else f"{drift}, not settled",
                _measured(point.mu_eff),
            )  # fmt: skip
    return table


def _branches(result: BenchResult) -> list[Branch]:
    return [result.loading] + ([] if result.unloading is None else [result.unloading])


def _measured(value: Measured | None) -> str:
    return "–" if value is None else with_sd(value.value, value.sd)


def _reading(GF: float) -> str:
    if GF < 0.3:
        return "wrapped cable dominates: stiff, softening with load"
    return "free span dominates: compliant, nearly linear" if GF > 3.0 else "wrap and free span both count"


def _digits(value: float, digits: int) -> str:
    """Fixed-point with `digits` significant digits: 1000 stays 1000, 0.05 keeps its digits."""
    if value == 0.0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{places}f}"


def _table(title: str, *columns: str) -> Table:
    table = Table(
        title=title, title_justify="left", title_style="bold", header_style="bold", box=None, pad_edge=False
    )
    for column in columns:
        table.add_column(column)
    return table
