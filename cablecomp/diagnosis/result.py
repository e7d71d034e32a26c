"""What a diagnosis found: plain data, for `diagnosis.json`, the page and whoever calls the library."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.config_text import joint_text
from cablecomp.diagnosis.locate.location import Location
from cablecomp.estimation.evidence import Evidence
from cablecomp.signal.smoothing import FloatArray

PROTOCOL: Final = "next_experiment.toml"
"""The experiment that a diagnosis proposes; beside one that proposes none there is none."""


@dataclass(frozen=True)
class Value:
    """A parameter as fitted: value and 1-sigma in its own unit, what was nominal, the session whose own it is; of a
    named effect's, the 95 % interval by its profile likelihood."""

    name: str
    value: float
    sd: float
    nominal: float | None = None
    session: str | None = None
    interval_95: tuple[float, float] | None = None


@dataclass(frozen=True)
class Named:
    """An effect that the data demand, or a candidate (`why_not_named` says what speaks against it)."""

    effect: str
    statement: str
    equation: str
    parameters: Mapping[str, Value | str]
    depends_on: Mapping[str, Any] | None
    heldout_gain: float
    confidence: float
    evidence: Mapping[str, float]
    acts_through: tuple[str, ...] = ()
    why_not_named: str = ""


@dataclass(frozen=True)
class Tested:
    """A hypothesis as it fared: beside which model, share of what was left that it took off data left out, its z."""

    name: str
    beside: str
    heldout_gain: float
    z: float
    selected_in: float
    outcome: str


@dataclass(frozen=True)
class Law:
    """A law without a physical name that holds on data left out; it runs in the augmented joint."""

    law: str
    of: str
    heldout_gain: float
    z: float


@dataclass(frozen=True)
class Errors:
    """RMS errors of the joint angle [rad]: on what was fitted, on what was left out in turn, on what nobody had
    seen; on what was left out with a zero of each recording's own."""

    rmse_rad: float
    heldout_rmse_rad: float
    final_rmse_rad: float
    heldout_own_zero_rmse_rad: float


@dataclass(frozen=True)
class Traces:
    """One recording before and after: judged rows, predictions with the session's zeros in them; measured:
    NaN where nothing was read; `counted`: rows that count."""

    name: str
    session: str
    covariates: Mapping[str, FloatArray]
    measured_rad: FloatArray
    before_rad: FloatArray
    after_rad: FloatArray
    rigid_rad: FloatArray
    counted: Any


@dataclass(frozen=True)
class Diagnosis:
    """Everything found.

    `clock_s`: where recordings begin their own clocks on the one that they share here (times of `location`, `traces`).
    `mend_first`: the warnings about signs and units, which stand before any name.
    """

    config: JointConfig
    recordings: tuple[str, ...]
    sessions: Mapping[str, Sequence[str]]
    clock_s: Mapping[str, float]
    verdict: str
    noise_floor_rad: float
    repeatability_rad: float | None
    nominal_rmse_rad: float
    baseline: Errors
    augmented: Errors
    heldout_by: str
    folds: int
    final: tuple[str, ...]
    channels: Mapping[str, tuple[float, float]]
    calibration: tuple[Value, ...]
    location: Location
    named: tuple[Named, ...]
    candidates: tuple[Named, ...]
    not_excluded: tuple[tuple[tuple[str, ...], str], ...]
    empirical: tuple[Law, ...]
    next_experiment: tuple[str, str] | None
    could_be_unseen: tuple[Mapping[str, Any], ...]
    remainder: Mapping[str, Any]
    remainder_location: Location
    tested: tuple[Tested, ...]
    notes: tuple[str, ...]
    augmented_joint: JointConfig
    evidence: tuple[Evidence, ...] = ()
    traces: tuple[Traces, ...] = ()
    runtime_s: float = 0.0
    warnings: tuple[str, ...] = ()
    mend_first: tuple[str, ...] = ()

    @property
    def acting(self) -> tuple[str, ...]:
        """Covariates that the named effects act through, best first."""
        return tuple(dict.fromkeys(c for n in self.named for c in n.acts_through))

    @property
    def in_time(self) -> JointConfig:
        """The joint with what was found, its channels late by what was stated or is named alone: what else trails is
        not accounted for by a candidate that says the same."""
        known = {e.id for e in self.config.effect} | {n.effect for n in self.named}
        effects = tuple(e for e in self.augmented_joint.effect if e.id != "clock_skew" or e.id in known)
        return self.augmented_joint.model_copy(update={"effect": effects})


def report_json(d: Diagnosis) -> dict[str, Any]:
    """The contents of `diagnosis.json`, schema 2."""
    report: dict[str, Any] = {
        "schema": 2,
        "recordings": list(d.recordings),
        "sessions": {k: list(v) for k, v in d.sessions.items()},
        "clock_s": dict(d.clock_s),
        "verdict": d.verdict,
        "noise_floor_rad": d.noise_floor_rad,
        "repeatability_rad": d.repeatability_rad,
        "usual_rad": d.config.remainder.joint_position_rad,
        "nominal": {"rmse_rad": d.nominal_rmse_rad},
        "baseline": _errors(d.baseline),
        "augmented": _errors(d.augmented),
        "heldout": {"by": d.heldout_by, "folds": d.folds, "final": list(d.final)},
        "channels": {
            name: {"baseline_rmse": before, "augmented_rmse": after}
            for name, (before, after) in d.channels.items()
        },
        "calibration": {
            v.name: {"value": v.value, "sd": v.sd, "nominal": v.nominal, "session": v.session}
            for v in d.calibration
        },
        "mismatch": [m.entry() for m in d.location.mismatch],
        "acts_through": list(d.acting),
        "missing_physics": [_named(n) for n in d.named],
        "candidates": [
            {
                "effect": n.effect,
                "heldout_gain": n.heldout_gain,
                "confidence": n.confidence,
                "why_not_named": n.why_not_named,
                "evidence": dict(n.evidence),
            }
            for n in d.candidates
        ],
        "not_excluded": [{"effects": list(names), "why": why} for names, why in d.not_excluded],
        "empirical": [vars(law) for law in d.empirical],
        "next_experiment": None
        if d.next_experiment is None
        else {"why": d.next_experiment[0], "protocol": d.next_experiment[1]},
        "could_be_unseen": [dict(u) for u in d.could_be_unseen],
        "remainder": dict(d.remainder),
        "hypotheses": [vars(t) for t in d.tested],
        "notes": list(d.notes),
        "warnings": list(d.warnings),
        "mend_first": list(d.mend_first),
        "runtime_s": d.runtime_s,
    }
    finite: dict[str, Any] = _finite(report)
    return finite


def _errors(e: Errors) -> dict[str, float]:
    """The three that readers know: the fourth only decides whether a name may be given."""
    return {k: v for k, v in vars(e).items() if k != "heldout_own_zero_rmse_rad"}


def _named(n: Named) -> dict[str, Any]:
    return {
        "effect": n.effect,
        "statement": n.statement,
        "equation": n.equation,
        "parameters": {
            k: ({"value": v.value, "sd": v.sd, "interval_95": v.interval_95} if isinstance(v, Value) else v)
            for k, v in n.parameters.items()
        },
        "depends_on": None if n.depends_on is None else dict(n.depends_on),
        "heldout_gain": n.heldout_gain,
        "confidence": n.confidence,
        "evidence": dict(n.evidence),
    }


def write_diagnosis(d: Diagnosis, out: Path) -> None:
    """Write `diagnosis.json`, `joint.augmented.toml`, and `next_experiment.toml` where one is proposed."""
    (out / "diagnosis.json").write_text(json.dumps(report_json(d), indent=1) + "\n", encoding="utf-8")
    comment = ("calibrated values and effects found by the diagnosis",)
    (out / "joint.augmented.toml").write_text(joint_text(d.augmented_joint, comment), encoding="utf-8")
    if d.next_experiment is not None:
        (out / PROTOCOL).write_text(d.next_experiment[1], encoding="utf-8")


def _finite(value: Any) -> Any:
    """JSON knows no NaN: None instead."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, np.floating | np.integer | np.bool_):
        return _finite(value.item())
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    return value
