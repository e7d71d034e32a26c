"""The score of one blind trial: what was named, located, promised and bounded, against what is true."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, isfinite, nan, pi
from typing import Any

from cablecomp.config import EffectEntry
from cablecomp.diagnosis.explain.conformal import deficits
from cablecomp.effects.catalogue import acts_through, catalogue
from cablecomp.estimation.parameter import parts_of
from cablecomp.trials.reference import Yardstick
from cablecomp.trials.row import Bound, Estimate, Named, Row
from cablecomp.trials.sealed import TrueEffect, Truth

EVENT_SLACK_S = 1.0  # how far beside an interval an event may lie and still count as inside


def score_trial(
    truth: Truth,
    yardstick: Yardstick,
    verdict: Mapping[str, Any],
    second: Mapping[str, Any] | None = None,
    seconds: float = nan,
) -> Row:
    """Score the contents of a `diagnosis.json` (and of the one after the proposed experiment) against the
    truth."""
    confounded = truth.kind == "confounded"
    mismatch = verdict["mismatch"]
    stated = _dependences(verdict) - _neither(truth)
    return Row(
        **_known(truth, yardstick),
        verdict=verdict["verdict"],
        named=tuple(_weighed(m, truth) for m in verdict["missing_physics"]),
        weighed=tuple(
            _weighed(m, truth)
            for m in (*verdict["missing_physics"], *verdict["candidates"])
            if "selected_in" in m["evidence"]
        ),
        tied=tuple(tuple(g["effects"]) for g in verdict["not_excluded"]),
        located=_located(truth, mismatch) if truth.in_joint else None,
        covariate=mismatch[0]["covariate"] if mismatch else "",
        said_tied=_said_tied(truth, verdict) if confounded else None,
        proposed=verdict["next_experiment"] is not None if confounded else None,
        settled=_settled(truth, second) if confounded else None,
        depends=(len(stated & set(truth.depends_on)), len(truth.depends_on)) if truth.depends_on else None,
        depends_wrongly=len(stated - set(truth.depends_on)),
        short_by=_short_by(truth, verdict) if truth.kind in ("single", "motor") else None,
        estimates=tuple(_estimates(truth, verdict)),
        bounds=tuple(_bounds(truth, verdict)),
        empirical=tuple(law["law"] for law in verdict["empirical"]),
        heldout_rad=_number(verdict["augmented"]["heldout_rmse_rad"]),
        final_rad=_number(verdict["augmented"]["final_rmse_rad"]),
        floor_rad=_number(verdict["noise_floor_rad"]),
        seconds=seconds,
    )


def failed_trial(truth: Truth, yardstick: Yardstick, why: str, seconds: float = nan) -> Row:
    """The row of a trial whose diagnosis came to no verdict."""
    confounded = False if truth.kind == "confounded" else None
    return Row(
        **_known(truth, yardstick),
        located=False if truth.in_joint else None,
        said_tied=confounded,
        proposed=confounded,
        settled=confounded,
        depends=(0, len(truth.depends_on)) if truth.depends_on else None,
        floor_rad=truth.floor_rad,
        seconds=seconds,
        failed=why,
    )


def _known(truth: Truth, yardstick: Yardstick) -> dict[str, Any]:
    """What a row holds whatever was said."""
    return {
        "number": truth.number,
        "kind": truth.kind,
        "case": truth.case,
        "label": truth.label,
        "excitation": truth.excitation,
        "size": truth.size,
        "truth": truth.names,
        "laws": truth.laws,
        "forms": tuple(f"{e.id}:{e.form}" for e in truth.main),
        "imperfections": tuple(truth.imperfections),
        "decidable": yardstick.decidable,
        "baseline_rad": yardstick.baseline_rmse_rad,
        "true_rad": yardstick.true_rmse_rad,
    }


def _weighed(entry: Mapping[str, Any], truth: Truth) -> Named:
    name = entry["effect"].partition(":")[0]
    evidence = {k: _number(v) for k, v in entry["evidence"].items()}
    return Named(name, _number(entry["confidence"]), name in truth.right, evidence)


def _covariates(effect: TrueEffect) -> tuple[str, ...]:
    """What the effect acts through: the first two of the catalogue for its laws; otherwise as its truth says."""
    if not effect.listed:
        return effect.covariates
    entry = EffectEntry(id=effect.id, **dict(effect.parameters))
    return acts_through(entry)[:2]


def _located(truth: Truth, mismatch: list[Mapping[str, Any]]) -> bool:
    """Whether the first covariate is one of theirs, or time with an interval that holds the event."""
    if not mismatch:
        return False
    first = mismatch[0]
    for effect in truth.main:
        instant = effect.parameters.get("time_s")
        if isinstance(instant, float):
            intervals = first["intervals_s"] if first["covariate"] == "time" else []
            if any(a - EVENT_SLACK_S <= instant <= b + EVENT_SLACK_S for a, b in intervals):
                return True
        if first["covariate"] in _covariates(effect):
            return True
    return False


def _said_tied(truth: Truth, verdict: Mapping[str, Any]) -> bool:
    """Whether the truth stands in a group of what cannot be told apart, with its partner if an effect."""
    groups = [{n.partition(":")[0] for n in group["effects"]} for group in verdict["not_excluded"]]
    wanted = {*truth.names, *([truth.partner] if not truth.partner.endswith("_N") else [])}
    return any(wanted <= group for group in groups)


def _settled(truth: Truth, second: Mapping[str, Any] | None) -> bool:
    """Whether after the proposed experiment the truth alone is named."""
    if second is None:
        return False
    return tuple(m["effect"] for m in second["missing_physics"]) == truth.names and not any(
        set(truth.names) & set(g["effects"]) for g in second["not_excluded"]
    )


def _dependences(verdict: Mapping[str, Any]) -> set[tuple[str, str]]:
    """(parameter, on) of all dependences that were stated, effects' and drive's; zeros are each session's own
    anyway."""
    found = {
        (d["parameter"].removeprefix("effect."), d["on"])
        for m in verdict["missing_physics"]
        if (d := m.get("depends_on")) is not None
    }
    for name in verdict["calibration"]:
        base, session, condition = parts_of(name)
        if condition:
            found.add((base.removeprefix("effect."), condition))
        if session and not base.endswith(("_offset_rad", "_offset_Nm")):
            found.add((base, "session"))
    return found


def _short_by(truth: Truth, verdict: Mapping[str, Any]) -> float:
    tried = verdict["hypotheses"]
    first = [t for t in tried if t["beside"] == tried[0]["beside"]]
    short = deficits({t["name"]: _number(t["z"]) for t in first})
    return min((d for name, d in short.items() if name.partition(":")[0] in truth.names), default=inf)


def _neither(truth: Truth) -> set[tuple[str, str]]:
    """Dependences that are there in small, or were declared: stating them is neither right nor wrong."""
    return (
        {("pretension_N", "session")} - set(truth.depends_on) if "sessions" in truth.imperfections else set()
    )


def _estimates(truth: Truth, verdict: Mapping[str, Any]) -> list[Estimate]:
    """Stated values of what was named rightly, and of the calibration, where the verdict rests on the true laws."""
    found: list[Estimate] = []
    right = {m["effect"]: m for m in verdict["missing_physics"] if m["effect"] in truth.names}
    if (
        len(right) != len(truth.effects)
        or len(verdict["missing_physics"]) != len(right)
        or verdict["empirical"]
        or truth.depends_on
        or not all(e.listed for e in truth.effects)
        or {"configuration", "gain"} & set(truth.imperfections)  # other values than the true ones fit better
    ):
        return found  # the values of a model that is not the true one say nothing about their uncertainty
    calibration = dict(truth.true)
    for effect in truth.effects:
        stated = right[effect.id]["parameters"]
        true = _in_terms_of(effect, stated, calibration)
        for name, value in true.items():
            entry = stated.get(name)
            if isinstance(entry, Mapping) and entry["sd"]:
                off = float(entry["value"]) - value
                if name.endswith("phase_rad"):
                    off = (off + pi) % (2.0 * pi) - pi
                found.append(Estimate(f"{effect.id}.{name}", value, value + off, float(entry["sd"])))
    for name, entry in verdict["calibration"].items():
        if name in calibration and entry["sd"]:
            found.append(Estimate(name, calibration[name], float(entry["value"]), float(entry["sd"])))
    return [e for e in found if isfinite(e.z)]


def _bounds(truth: Truth, verdict: Mapping[str, Any]) -> list[Bound]:
    """What was said of the size of the catalogue's effects that are there and were not named."""
    said = {u["effect"]: u for u in verdict["could_be_unseen"]}
    found = []
    for effect in truth.effects:
        if not effect.listed:
            continue
        channel = effect.parameters.get("channel")
        entry = said.get(f"{effect.id}:{channel}" if channel else effect.id)
        true = effect.parameters.get(entry["parameter"]) if entry else None
        if entry and isinstance(true, float | int):
            found.append(Bound(f"{effect.id}.{entry['parameter']}", float(true), entry["below"]))
    return found


def _in_terms_of(
    effect: TrueEffect, stated: Mapping[str, Any], calibration: dict[str, float]
) -> dict[str, float]:
    """True parameters as the verdict counts them: a pretension at another reference temperature is another
    pretension and another coefficient."""
    true = {k: float(v) for k, v in effect.parameters.items() if not isinstance(v, str)}
    known = catalogue().get(effect.id)
    reference = known.of_role("reference") if known else None
    if known is None or known.at_reference is None or reference is None:
        return true
    entry = stated.get(reference.name)
    value = entry["value"] if isinstance(entry, Mapping) else entry
    if not isinstance(value, float | int):
        calibration.pop("pretension_N", None)
        return {}
    law = known.at_reference(true, float(value))
    calibration["pretension_N"] *= law.pretension
    return dict(law.values)


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else nan
