"""A diagnosis for the terminal: the answer first, then what it rests on, then what is left."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cablecomp.report.diagnosis_tables import unit_for
from cablecomp.report.diagnosis_words import (
    dependences,
    depends,
    in_a_sentence,
    percent,
    plain,
    repeats_limit,
    values_of,
)
from cablecomp.report.measured import rounded
from cablecomp.report.replay_figures import Scale

_COLOUR: Final[Mapping[str, str]] = {
    "consistent": "green", "recalibrate": "yellow", "explained": "green", "partly explained": "green",
    "unexplained": "red",
}  # fmt: skip
_MOST: Final = 6
"""Lines of a list before the page has to be looked at."""


def diagnosis_summary(result: Mapping[str, Any]) -> RenderableType:
    """The contents of `diagnosis.json` as text for a rich console."""
    verdict = result["verdict"]
    names = " and ".join(plain(m["effect"]) for m in result["missing_physics"])
    head = f"{verdict}: {names}" if names else verdict
    parts: list[RenderableType] = [
        Text(f"mend first: {line}", style="bold red", overflow="fold") for line in result["mend_first"]
    ]
    parts += [Text(head.upper()[:1] + head[1:], style=f"bold {_COLOUR[verdict]}")]
    parts += [Text(in_a_sentence(result)), ""]
    if result["missing_physics"]:
        parts += [_missing(result), ""]
    parts += [_errors(result), ""]
    if verdict == "recalibrate":
        parts += [_calibration(result), ""]
    parts += [Text(line, overflow="fold") for line in _rest(result)]
    return Group(*parts)


def _missing(result: Mapping[str, Any]) -> Table:
    table = _table("missing", "confidence", "held-out square removed", "values")
    for m in result["missing_physics"]:
        table.add_row(
            m["effect"],
            f"{100 * m['confidence']:.0f} %",
            percent(m["heldout_gain"]),
            ", ".join(values_of(m)),
        )
    return table


def _errors(result: Mapping[str, Any]) -> Table:
    """RMS of the joint angle, before and after."""
    unit = unit_for(result)
    table = _table(f"joint angle, RMS [{unit.unit}]", "before", "after")
    by = result["heldout"]["by"]
    for words, key in (
        (f"on {by}s left out in turn", "heldout_rmse_rad"),
        ("on data kept for the end", "final_rmse_rad"),
        ("on what was fitted", "rmse_rad"),
    ):
        table.add_row(words, _shown(result["baseline"][key], unit), _shown(result["augmented"][key], unit))
    if repeats_limit(result):
        table.add_row("the machine itself repeats to", "", _shown(result["repeatability_rad"], unit))
    table.add_row("sensors' noise", "", _shown(result["noise_floor_rad"], unit))
    return table


def _calibration(result: Mapping[str, Any]) -> Table:
    table = _table("calibration", "configured", "now", "±")
    for name, entry in result["calibration"].items():
        value, sd = rounded(entry["value"], entry["sd"])
        table.add_row(name, _number(entry["nominal"]), value, sd or "–")
    return table


def _rest(result: Mapping[str, Any]) -> Iterator[str]:
    """What remains, what stays open, what to do next, one line each."""
    remainder = result["remainder"]
    if remainder["structured"]:
        unit = unit_for(result)
        yield f"what remains: {_shown(remainder['rmse_rad'], unit)} {unit.unit} RMS; {remainder['description']}"
    yield from (f"not the same everywhere: {depends(law)}" for law in dependences(result))
    for law in result["empirical"]:
        gain = f"{100 * law['heldout_gain']:.0f} % of the square of what remains"
        yield f"law without a name: {law['law']} by {law['of']}, {gain}; the errors after are with it"
    for c in result["candidates"][:_MOST]:
        yield f"candidate: {c['effect']} ({100 * c['confidence']:.0f} %); {c['why_not_named']}"
    for tied in result["not_excluded"]:
        yield f"cannot be told apart: {', '.join(tied['effects'])}; {tied['why']}"
    first = result["mismatch"][0] if result["mismatch"] else None
    if first and first["p_value"] < 0.05:
        yield f"located in: {first['covariate']} (share {first['share']:.2f}, p = {first['p_value']:.2g})"
    unseen = [u["effect"] for u in result["could_be_unseen"] if u["below"] is None]
    if unseen:
        yield f"could be any size for all that these data say: {', '.join(unseen)}"
    yield from (f"note: {n}" for n in result["notes"])
    yield from (f"warning: {w}" for w in result["warnings"] if w not in result["mend_first"])
    if result["next_experiment"]:
        yield f"next experiment: {result['next_experiment']['why']}"


def _table(*heads: str) -> Table:
    table = Table(box=None, pad_edge=False)
    for k, head in enumerate(heads):
        table.add_column(head, justify="left" if k == 0 or head == "values" else "right", overflow="fold")
    return table


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.5g}"


def _shown(value_rad: float | None, unit: Scale) -> str:
    return "–" if value_rad is None else f"{value_rad * unit.factor:.4g}"
