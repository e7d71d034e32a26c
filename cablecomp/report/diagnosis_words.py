"""What a diagnosis says, in words that terminal and page share."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from cablecomp.estimation.parameter import parts_of
from cablecomp.report.measured import with_sd

ANSWERS: Final[Mapping[str, str]] = {
    "consistent": "The drive's known physics account for these data; nothing is left beyond noise.",
    "recalibrate": "Nominal values were off; no physics is missing.",
    "explained": "Physics was missing, data left out support it, and what is left is noise.",
    "partly explained": "Physics was missing and data left out support it. Structure remains beside it, which is "
    "located and sized below.",
    "unexplained": "There is structure, and no known effect that deserves its name.",
}
"""One sentence for each verdict."""
_AS_USUAL: Final = (
    "The drive's known physics account for these data; what is left beyond noise is no more than this joint is known "
    "to leave."
)
_COVARIATES: Final[Mapping[str, str]] = {
    "load_direction": "direction of the load",
    "load_rate": "rate of the load",
    "dwell": "time at constant load",
    "reversal": "load since the last reversal",
    "motor_angle": "motor angle",
    "joint_angle": "joint angle",
}


def plain(effect: str) -> str:
    """An effect's id in words; `id:channel` names the channel that it reads; `PARAMETER by SESSION` stays as it is."""
    if " by " in effect:
        return effect
    name, _, channel = effect.partition(":")
    return name.replace("_", " ") + (f" ({channel})" if channel else "")


def sentence(text: str) -> str:
    """The text with a capital at its head."""
    return text[:1].upper() + text[1:]


def covariate(name: str) -> str:
    """A covariate's name in plain words."""
    for prefix in ("other:", "condition:"):
        if name.startswith(prefix):
            return f"{prefix[:-1].replace('other', 'channel')} {name.removeprefix(prefix)}"
    return _COVARIATES.get(name, name)


def number(value: float | None, digits: int = 4) -> str:
    """A number with its significant digits; None is a dash."""
    return "–" if value is None else f"{value:.{digits}g}"


def percent(share: float) -> str:
    """A share in percent, with the digits that tell it from nothing and from all."""
    rest = 100.0 * min(abs(share), abs(1.0 - share))
    digits = math.ceil(-math.log10(rest)) if 1e-3 < rest < 1.0 else 0
    return f"{100.0 * share:.{digits}f} %"


def values_of(entry: Mapping[str, Any]) -> Iterator[str]:
    """`name = value ± sd` of each parameter of an entry of `missing_physics`; a channel's name as it is."""
    for name, v in entry["parameters"].items():
        if isinstance(v, Mapping):
            yield f"{name} = {with_sd(v['value'], v['sd'])}"
        else:
            yield f"{name} = {v}"


def depends(law: Mapping[str, Any]) -> str:
    """What ties a parameter's values together: a `depends_on` of `diagnosis.json` as a sentence."""
    parameter, on = str(law["parameter"]), str(law["on"])
    if "per_unit" in law:
        rate = float(law["per_unit"])
        return f"{parameter} {'grows' if rate >= 0.0 else 'falls'} by {number(abs(rate))} per unit of {on}"
    values = ", ".join(f"{name} {number(v)}" for name, v in law.get("values", {}).items())
    return f"{parameter} differs between {on}s" + (f": {values}" if values else "")


def dependences(result: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Every dependence found, effects' and drive's: `parameter`, `on`, and `values` by session or `per_unit` of
    a condition."""
    found = {
        (d["parameter"], d["on"]): dict(d)
        for m in result["missing_physics"]
        if (d := m["depends_on"]) is not None
    }
    for name, entry in result["calibration"].items():
        base, session, condition = parts_of(name)
        if condition:
            found[base, condition] = {"parameter": base, "on": condition, "per_unit": entry["value"]}
        if session and not base.endswith(("_offset_rad", "_offset_Nm")):
            law = found.setdefault((base, "session"), {"parameter": base, "on": "session", "values": {}})
            law["values"][session] = entry["value"]
    return list(found.values())


def in_a_sentence(result: Mapping[str, Any]) -> str:
    """The verdict in one sentence."""
    as_usual = result["verdict"] == "consistent" and result["usual_rad"] is not None
    return _AS_USUAL if as_usual else ANSWERS[result["verdict"]]


def repeats_limit(result: Mapping[str, Any]) -> bool:
    """Whether the scatter between repeats limits a model: one that leaves less has seen that they differ (in what
    went before them), and then their scatter says nothing of the machine. Nor does one below the sensors' noise, as of
    readings that stand on one step of an encoder."""
    scatter, left = result["repeatability_rad"], result["augmented"]["rmse_rad"]
    if scatter is None or scatter < result["noise_floor_rad"]:
        return False
    return left is None or scatter < 1.5 * left


def base_value(result: Mapping[str, Any], parameter: str) -> float | None:
    """The common value of a parameter that depends on a condition; None where there is none."""
    for m in result["missing_physics"]:
        for name, v in m["parameters"].items():
            if f"{m['effect']}.{name}" == parameter and isinstance(v, Mapping):
                return float(v["value"])
    entry = result["calibration"].get(parameter)
    return None if entry is None else float(entry["value"])
