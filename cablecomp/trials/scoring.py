"""One blind trial scored: what the verdict said against what was true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, nan, pi
from typing import Any

from cablecomp.config import EffectEntry
from cablecomp.effects import catalogue
from cablecomp.effects.catalogue import acts_through
from cablecomp.trials.reference import Yardstick
from cablecomp.trials.sealed import TrueEffect, Truth

EVENT_SLACK_S = 1.0  # how far beside an interval an event may lie and still count as inside
VISIBLE = 1.5  # mean square over the noise floor from which unknown physics can be seen at all


@dataclass(frozen=True)
class Named:
    """A name given, with its confidence, and whether it is true."""

    effect: str
    confidence: float
    right: bool


@dataclass(frozen=True)
class Estimate:
    """A stated value against the truth; `z` in stated standard deviations."""

    what: str
    true: float
    value: float
    sd: float

    @property
    def z(self) -> float:
        """Deviation in stated standard deviations; NaN where none is stated."""
        return (self.value - self.true) / self.sd if self.sd > 0.0 else nan


@dataclass(frozen=True)
class Bound:
    """How large an effect that was concealed and not named could be, as stated (None: any size), against what is true."""

    what: str
    true: float
    below: float | None

    @property
    def held(self) -> bool:
        """Whether the truth lies below."""
        return self.below is None or abs(self.true) <= self.below


@dataclass(frozen=True)
class Row:
    """The score of one trial.

    `decidable`: the true model itself beats the recalibrated drive beyond its margin; `located`: the first covariate of
    the calibrated drive's residual, before any name, or an interval, is what the concealed effect acts through (None if
    nothing is concealed); `bounds`: of what was concealed and not named; `final_rad`: RMSE after modelling on data kept for
    the end;
    `said_tied`, `proposed`, `settled`: of confounded trials (None otherwise); `heldout_rad`, `baseline_rad`,
    `true_rad`, `floor_rad`: RMSE after modelling, of the recalibrated drive, of the true model with true
    parameters, of noise alone as the recording's own (averaged) rows have it; `failed`: why there is no
    verdict.
    """

    number: int
    kind: str
    case: str
    label: str
    excitation: str
    size: float
    truth: tuple[str, ...]
    verdict: str
    named: tuple[Named, ...]
    tied: tuple[tuple[str, ...], ...]
    decidable: bool
    located: bool | None
    covariate: str
    said_tied: bool | None
    proposed: bool | None
    settled: bool | None
    estimates: tuple[Estimate, ...]
    bounds: tuple[Bound, ...]
    heldout_rad: float
    final_rad: float
    baseline_rad: float
    true_rad: float
    floor_rad: float
    seconds: float
    failed: str = ""

    @property
    def first(self) -> str:
        """The first name; empty if none was given."""
        return self.named[0].effect if self.named else ""

    @property
    def first_right(self) -> bool:
        """Whether the first name is true."""
        return bool(self.named) and self.named[0].right

    @property
    def wrong(self) -> bool:
        """Whether any name given (confidence 0.5 and more) is not true."""
        return any(not n.right for n in self.named)

    @property
    def all_right(self) -> bool:
        """Whether all that is concealed is named, and nothing else."""
        return sorted(n.effect for n in self.named) == sorted(self.truth)

    @property
    def visible(self) -> bool:
        """Whether the recalibrated drive leaves clearly more than noise."""
        return self.baseline_rad**2 > VISIBLE * self.floor_rad**2

    @property
    def outcome(self) -> str:
        """What stands in the confusion matrix: the first name, or the verdict where none was given."""
        if self.failed:
            return "failed"
        return self.first or (f"tied ({self.verdict})" if self.tied else self.verdict)


def score_trial(
    truth: Truth,
    yardstick: Yardstick,
    verdict: Mapping[str, Any],
    second: Mapping[str, Any] | None = None,
    seconds: float = nan,
) -> Row:
    """Score the contents of a `diagnosis.json` (and of the one after the proposed experiment) against the
    truth."""
    named = _named(verdict, truth)
    confounded = truth.kind == "confounded"
    mismatch = verdict["mismatch"]
    return Row(
        truth.number,
        truth.kind,
        truth.case,
        truth.label,
        truth.excitation,
        truth.size,
        truth.names,
        verdict["verdict"],
        named,
        tuple(tuple(g["effects"]) for g in verdict["not_excluded"]),
        yardstick.decidable,
        _located(truth, mismatch) if truth.effects else None,
        mismatch[0]["covariate"] if mismatch else "",
        _said_tied(truth, verdict) if confounded else None,
        verdict["next_experiment"] is not None if confounded else None,
        _settled(truth, second) if confounded else None,
        tuple(_estimates(truth, verdict)),
        tuple(_bounds(truth, verdict)),
        _number(verdict["augmented"]["heldout_rmse_rad"]),
        _number(verdict["augmented"]["final_rmse_rad"]),
        yardstick.baseline_rmse_rad,
        yardstick.true_rmse_rad,
        _number(verdict["noise_floor_rad"]),
        seconds,
    )


def failed_trial(truth: Truth, yardstick: Yardstick, why: str, seconds: float = nan) -> Row:
    """The row of a trial whose diagnosis came to no verdict."""
    confounded = False if truth.kind == "confounded" else None
    return Row(
        truth.number,
        truth.kind,
        truth.case,
        truth.label,
        truth.excitation,
        truth.size,
        truth.names,
        "failed",
        (),
        (),
        yardstick.decidable,
        False if truth.effects else None,
        "",
        confounded,
        confounded,
        confounded,
        (),
        (),
        nan,
        nan,
        yardstick.baseline_rmse_rad,
        yardstick.true_rmse_rad,
        truth.floor_rad,
        seconds,
        why,
    )


def _named(verdict: Mapping[str, Any], truth: Truth) -> tuple[Named, ...]:
    return tuple(
        Named(m["effect"], _number(m["confidence"]), m["effect"] in truth.names)
        for m in verdict["missing_physics"]
    )


def _covariates(effect: TrueEffect) -> tuple[str, ...]:
    """What the effect acts through: the first two of the catalogue; a stranger's as its truth says."""
    if not effect.known:
        return effect.covariates
    entry = EffectEntry(id=effect.id, **dict(effect.parameters))
    return acts_through(entry)[:2]


def _located(truth: Truth, mismatch: list[Mapping[str, Any]]) -> bool:
    """Whether the first covariate is one of theirs, or time with an interval that holds the event."""
    if not mismatch:
        return False
    first = mismatch[0]
    for effect in truth.effects:
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
    wanted = {*truth.names, *([truth.partner] if truth.partner in catalogue() else [])}
    return any(wanted <= set(group["effects"]) for group in verdict["not_excluded"])


def _settled(truth: Truth, second: Mapping[str, Any] | None) -> bool:
    """Whether after the proposed experiment the truth alone is named."""
    if second is None:
        return False
    return tuple(m["effect"] for m in second["missing_physics"]) == truth.names and not any(
        set(truth.names) & set(g["effects"]) for g in second["not_excluded"]
    )


def _estimates(truth: Truth, verdict: Mapping[str, Any]) -> list[Estimate]:
    """Stated values of what was named rightly, and of the calibration, where the verdict rests on them."""
    found: list[Estimate] = []
    right = {m["effect"]: m for m in verdict["missing_physics"] if m["effect"] in truth.names}
    if (
        len(right) != len(truth.effects)
        or len(verdict["missing_physics"]) != len(right)
        or verdict["empirical"]
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
    """What was said of the size of known effects that are there and were not named."""
    said = {u["effect"]: u for u in verdict["could_be_unseen"]}
    found = []
    for effect in truth.effects:
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
    if effect.id == "thermal_pretension":
        entry = stated.get("reference_degC")
        reference = entry["value"] if isinstance(entry, Mapping) else entry
        if isinstance(reference, float | int):
            factor = 1.0 + true["coefficient_per_K"] * (float(reference) - true["reference_degC"])
            calibration["pretension_N"] *= factor
            true = {"coefficient_per_K": true["coefficient_per_K"] / factor}
        else:
            calibration.pop("pretension_N", None)
            true = {}
    return true


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else nan
