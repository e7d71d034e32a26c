"""`python -m cablecomp.trials.learn RUN…`: learn confidence from judged trials, and check it on laws that it
was not learnt on.

Each RUN is the folder of a `cablecomp prove` that has ended: its scoreboard holds the evidence of every effect
that was weighed, and whether it was right. The model is logistic regression with a ridge (weights of
standardised features; the bias is free), fitted by own code: scikit-learn would be asked for ten lines alone. What is
said of it comes from folds that leave out whole laws: `bearing_friction:dahl` is judged by what other laws taught.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cablecomp.diagnosis.explain import confidence
from cablecomp.diagnosis.explain.confidence import (
    FEATURES,
    OF_TRIED,
    Logistic,
    derived,
    features_of_tried,
)
from cablecomp.diagnosis.explain.conformal import conformal_level
from cablecomp.errors import InputError, printable
from cablecomp.trials.calibrated import brier, calibration_error, risk_area
from cablecomp.trials.shares import write_json

Floats = NDArray[np.float64]
SHIPPED = Path(confidence.__file__).with_name("confidence.json")
WEIGHED = frozenset((
    "log_gain", "selected_in", "form_z", "form_margin_z", "unfollowed", "tries", "z",
))  # fmt: skip
"""What the evidence of a weighed effect holds, from which all else that is learnt from follows."""
FOLDS, FEWEST, MISS = 5, 30, 0.1
RIDGES = (0.3, 1.0, 3.0, 10.0, 30.0)
"""Standard deviations of a weight's prior to the minus two, of which one is taken (`_best`)."""


@dataclass(frozen=True)
class Judged:
    """One weighed effect: its evidence, whether it was right, and the law of its trial."""

    evidence: Mapping[str, float]
    right: bool
    law: str

    @property
    def z(self) -> float:
        """Its z over the model without it, the plain rival of a learnt confidence."""
        return self.evidence["z"]


@dataclass(frozen=True)
class Checked:
    """How a way to learn does on laws left out: expected calibration error, Brier score, area under risk
    against coverage by confidence and by z alone; `probability` of each effect, from the fold that had not seen
    its law."""

    probability: tuple[float, ...]
    error: float
    brier: float
    area: float
    area_by_z: float


def fit_logistic(features: Floats, right: Floats, ridge: float, steps: int = 50) -> tuple[float, Floats]:
    """Bias and weights that minimise -log likelihood + ridge/2 |w|^2, by iteratively reweighted least squares.

    `features` (n, k), standardised; `right` (n,) of 0 and 1; with p = 1/(1+exp(-(b+Xw))), each step solves
    (X'WX + R) d = X'(y-p) - R w, W = diag p(1-p) (P. McCullagh and J. Nelder, Generalized Linear Models, 1989).
    """
    X = np.column_stack([np.ones(len(features)), features])
    R = np.diag([1e-6, *(ridge,) * features.shape[1]])
    w = np.zeros(X.shape[1])
    for _ in range(steps):
        p = 1.0 / (1.0 + np.exp(-np.clip(X @ w, -30.0, 30.0)))
        step = np.linalg.solve((X.T * (p * (1.0 - p))) @ X + R, X.T @ (right - p) - R @ w)
        length = float(np.linalg.norm(step))
        w = w + step * min(1.0, 5.0 / max(length, 1e-12))  # where classes are nearly apart, Newton overshoots
        if length < 1e-9:
            break
    return float(w[0]), np.asarray(w[1:])


def learn(judged: Sequence[Judged], ridge: float, names: Sequence[str] = FEATURES) -> Logistic:
    """The logistic model of these effects; raises InputError for too few, or all right, or none."""
    right = np.array([float(j.right) for j in judged])
    if len(judged) < FEWEST or right.min() == right.max():
        raise InputError(
            f"{len(judged)} weighed effects, {int(right.sum()) if len(right) else 0} "
            f"right: at least {FEWEST}, right and "
            "wrong ones, are needed; run more trials with `cablecomp prove`"
        )
    raw = np.array([[j.evidence[f] for f in names] for j in judged])
    centre, scale = raw.mean(axis=0), raw.std(axis=0)
    scale = np.where(scale > 1e-9, scale, 1.0)
    bias, weight = fit_logistic((raw - centre) / scale, right, ridge)
    return Logistic(float(f"{bias:.4g}"), *(_by_name(names, v) for v in (weight, centre, scale)))


def _by_name(names: Sequence[str], values: Floats) -> dict[str, float]:
    return {f: float(f"{v:.4g}") for f, v in zip(names, values, strict=True)}


def check(judged: Sequence[Judged], ridge: float, names: Sequence[str] = FEATURES, seed: int = 0) -> Checked:
    """Learn on some laws and judge the others, in turn."""
    laws = sorted({j.law for j in judged})
    if len(laws) < FOLDS:
        raise InputError(f"{len(laws)} laws in these trials; at least {FOLDS} are needed to leave some out")
    order = np.random.default_rng(seed).permutation(len(laws))
    fold = {laws[k]: place % FOLDS for place, k in enumerate(order)}
    p = np.empty(len(judged))
    for f in range(FOLDS):
        model = learn([j for j in judged if fold[j.law] != f], ridge, names)
        for k, j in enumerate(judged):
            if fold[j.law] == f:
                p[k] = model.probability(j.evidence)
    right = [j.right for j in judged]
    return Checked(
        tuple(p.tolist()),
        calibration_error(p.tolist(), right),
        brier(p.tolist(), right),
        risk_area(p.tolist(), right),
        risk_area([j.z for j in judged], right),
    )


def judged_in(board: Mapping[str, Any]) -> tuple[list[Judged], list[Judged]]:
    """All effects of a scoreboard's final models whose evidence is whole; those that were tried and left."""
    weighed, left = [], []
    for row in board["rows"]:
        law = "+".join(row["forms"]) or row["kind"]
        for name in row["weighed"]:
            evidence = {k: v for k, v in name["evidence"].items() if v is not None}
            if evidence.keys() >= WEIGHED:
                weighed.append(Judged({**evidence, **derived(evidence)}, bool(name["right"]), law))
            elif evidence.keys() == {"gain", "z", "selected_in"}:
                told = {**features_of_tried(**evidence), "z": evidence["z"]}
                left.append(Judged(told, bool(name["right"]), law))
    return weighed, left


def _best(judged: Sequence[Judged], names: Sequence[str]) -> tuple[float, Checked]:
    """The largest ridge whose Brier score on laws left out is no more than a standard error of the (paired) difference
    behind the best: machines lie further out than trials (one-standard-error rule, T. Hastie, R. Tibshirani and J.
    Friedman, The Elements of Statistical Learning, 2009, 7.10)."""
    tried = {ridge: check(judged, ridge, names) for ridge in RIDGES}
    right = np.array([float(j.right) for j in judged])
    lost = {r: (np.array(c.probability) - right) ** 2 for r, c in tried.items()}
    best = min(lost.values(), key=np.mean)
    behind = {r: v - best for r, v in lost.items()}
    ridge = max(r for r, d in behind.items() if np.mean(d) <= np.std(d) / np.sqrt(len(d)))
    return ridge, tried[ridge]


def _of_tried(left: Sequence[Judged]) -> dict[str, Any] | None:
    """The model for what was tried and left, and how it does on laws left out; None where that is too few."""
    try:
        ridge, best = _best(left, OF_TRIED)
    except InputError:
        return None
    model = learn(left, ridge, OF_TRIED)
    return {
        "effects": len(left),
        "right": sum(j.right for j in left),
        "calibration_error": best.error,
        "brier": best.brier,
        "ridge": ridge,
        **_as_read(model),
    }


def _as_read(model: Logistic) -> dict[str, Any]:
    return {
        "bias": model.bias,
        "weight": dict(model.weight),
        "centre": dict(model.centre),
        "scale": dict(model.scale),
    }


def learnt_from(boards: Sequence[Mapping[str, Any]], command: str) -> dict[str, Any]:
    """The contents of `confidence.json`: the model, what it was learnt on, how it does on laws left out, the
    conformal level."""
    found = [judged_in(b) for b in boards]
    judged, left = ([j for parts in found for j in parts[k]] for k in range(2))
    ridge, best = _best(judged, FEATURES)
    model = learn(judged, ridge)
    short = [
        inf if r["short_by"] is None else float(r["short_by"])
        for board in boards
        for r in board["rows"]
        if r["kind"] == "single" and r["decidable"] and not r["failed"]
    ]
    level = conformal_level(short, MISS)
    runs = [{k: b[k] for k in ("trials", "seed", "kinds", "laws", "imperfections", "sha256")} for b in boards]
    return {
        "learnt_on": {
            "command": command,
            "runs": runs,
            "effects": len(judged),
            "right": sum(j.right for j in judged),
            "laws": len({j.law for j in judged}),
        },
        "on_laws_left_out": {
            "folds": FOLDS,
            "calibration_error": best.error,
            "brier": best.brier,
            "risk_coverage_area": best.area,
            "risk_coverage_area_by_z": best.area_by_z,
        },
        "conformal": {"miss": MISS, "level": level if isfinite(level) else None, "trials": len(short)},
        "tried": _of_tried(left),
        "ridge": ridge,
        **_as_read(model),
    }


def _board(run: Path) -> dict[str, Any]:
    path = run / "scoreboard.json"
    try:
        board: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if board["schema"] == 2:
            return board
        why = f"schema {board['schema']}, 2 is accepted"
    except (OSError, ValueError, KeyError, TypeError) as error:
        why = str(error)
    raise InputError(
        f"{path}: is no scoreboard ({why}); give the folder of a `cablecomp prove` that has ended"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0, or 2 for bad input (one line on stderr)."""
    parser = argparse.ArgumentParser(prog="python -m cablecomp.trials.learn", description=__doc__)
    parser.add_argument(
        "runs", nargs="+", type=Path, metavar="RUN", help="folder of a finished `cablecomp prove`"
    )
    parser.add_argument("--out", type=Path, default=SHIPPED, help="where the model goes: the one that ships")
    a = parser.parse_args(arguments)
    try:
        found = learnt_from(
            [_board(run) for run in a.runs],
            f"python -m cablecomp.trials.learn {' '.join(r.name for r in a.runs)}",
        )
        write_json(a.out, found)
    except InputError as error:
        print(f"error: {printable(str(error))}", file=sys.stderr)
        return 2
    for key, value in {**found["learnt_on"], **found["on_laws_left_out"], **found["conformal"]}.items():
        if key != "runs":
            print(f"{key}: {value}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
