"""Confidence learnt from judged trials: the fit is the optimum, what is said of it holds on laws that it had
not seen."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from cablecomp.diagnosis.explain.confidence import derived, features_of_tried, logistic
from cablecomp.diagnosis.explain.conformal import conformal_level, conformal_set, deficits
from cablecomp.errors import InputError
from cablecomp.trials.calibrated import calibration_error, perfect_error, risk_area, risk_coverage
from cablecomp.trials.learn import fit_logistic, judged_in, learnt_from, main

LAWS = [f"effect_{k}:law" for k in range(20)]


def test_the_fit_is_the_optimum_of_the_penalised_likelihood() -> None:
    rng = np.random.default_rng(0)
    X = rng.standard_normal((200, 3))
    y = (rng.uniform(size=200) < 1.0 / (1.0 + np.exp(-(0.5 + X @ [1.0, -2.0, 0.0])))).astype(float)

    def cost(w: np.ndarray) -> float:
        u = w[0] + X @ w[1:]
        return float(np.sum(np.logaddexp(0.0, u) - y * u) + 0.5 * 2.0 * w[1:] @ w[1:] + 0.5e-6 * w[0] ** 2)

    bias, weight = fit_logistic(X, y, 2.0)
    best = minimize(cost, np.zeros(4), method="BFGS", options={"gtol": 1e-7}).x
    np.testing.assert_allclose([bias, *weight], best, atol=1e-4)


def test_classes_that_lie_apart_are_fitted_all_the_same() -> None:
    x = np.linspace(-1.0, 1.0, 40)[:, None]
    bias, weight = fit_logistic(x, (x[:, 0] > 0.0).astype(float), 0.3)
    assert np.isfinite(bias)
    assert 0.0 < weight[0] < 100.0


def board(effects: int = 1500, seed: int = 1) -> dict[str, Any]:
    """A scoreboard whose names are right with a probability that two of their features set."""
    rng = np.random.default_rng(seed)
    rows = []
    for k in range(effects):
        form_z, margin, selected = rng.standard_normal(3)
        evidence = {
            "log_gain": float(rng.uniform(-2.0, 0.0)),
            "selected_in": float(selected),
            "form_z": float(form_z),
            "form_margin_z": float(margin),
            "unfollowed": float(rng.uniform()),
            "tries": float(rng.uniform(0.0, 2.0)),
        }
        p = 1.0 / (1.0 + np.exp(-(0.3 + 1.5 * min(form_z, margin) - 1.0 * selected)))
        name = {
            "evidence": {**evidence, "z": float(rng.uniform(2, 9))},
            "right": bool(rng.uniform() < p),
        }
        seen = float(rng.uniform(2, 9))
        left = {
            "evidence": {"gain": 0.2, "z": seen, "selected_in": 0.1},
            "right": bool(rng.uniform() < 0.05 * seen),
        }
        rows.append(
            {"forms": [LAWS[k % len(LAWS)]], "kind": "single", "weighed": [name, left], "decidable": True,
             "short_by": abs(float(rng.normal())), "failed": ""}
        )  # fmt: skip
    wish = {"trials": effects, "seed": seed, "kinds": "single", "laws": "mixed", "imperfections": "some"}
    return {"schema": 2, "sha256": "ab", **wish, "rows": rows}


def test_what_is_learnt_from_follows_from_the_evidence_of_a_scoreboard() -> None:
    """Of an effect that was weighed; what was tried and left has its own."""
    whole = {
        "log_gain": -1.0,
        "selected_in": 1.0,
        "form_z": 3.0,
        "form_margin_z": 2.0,
        "unfollowed": 0.5,
        "tries": 1.0,
    }
    names = [
        {"evidence": {**whole, "z": 3.0}, "right": True},
        {"evidence": {"gain": 0.9, "z": 9.0, "selected_in": 1.0}, "right": False},
    ]
    (weighed,), (left,) = judged_in({"rows": [{"forms": ["a"], "kind": "single", "weighed": names}]})
    found = [weighed.evidence[name] for name in ("lead", "tries_rest", "unfollowed_rest")]
    np.testing.assert_allclose(found, [2.0, 0.9, 0.45])
    assert weighed.right
    assert not left.right


def test_what_is_learnt_holds_on_laws_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "scoreboard.json").write_text(json.dumps(board()))
    assert main([str(tmp_path / "run"), "--out", str(tmp_path / "confidence.json")]) == 0
    found = json.loads((tmp_path / "confidence.json").read_text())
    left_out = found["on_laws_left_out"]
    assert left_out["calibration_error"] < 0.06
    assert left_out["risk_coverage_area"] < 0.7 * left_out["risk_coverage_area_by_z"]
    assert found["learnt_on"]["laws"] == len(LAWS)
    assert found["learnt_on"]["runs"][0]["seed"] == 1
    fresh = board(2000, 2)["rows"]
    named = [({**(e := r["weighed"][0]["evidence"]), **derived(e)}, r["weighed"][0]["right"]) for r in fresh]
    left = [(features_of_tried(**r["weighed"][1]["evidence"]), r["weighed"][1]["right"]) for r in fresh]
    for model, told in ((logistic(found), named), (logistic(found["tried"]), left)):
        assert calibration_error([model.probability(e) for e, _ in told], [r for _, r in told]) < 0.05
    assert "calibration_error" in capsys.readouterr().out


@pytest.mark.parametrize(("change", "words"), [({"rows": []}, "laws"), ({"schema": 1}, "schema 1")])
def test_what_nothing_can_be_learnt_from_is_one_line(
    change: dict[str, Any], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scoreboard.json").write_text(json.dumps(board(50) | change))
    assert main([str(tmp_path), "--out", str(tmp_path / "confidence.json")]) == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1
    assert not (tmp_path / "confidence.json").exists()


def test_too_few_effects_are_refused() -> None:
    with pytest.raises(InputError, match="weighed effects"):
        learnt_from([board(10)], "")


def test_calibration_error_and_risk_by_hand() -> None:
    assert calibration_error([0.9] * 10, [True] * 9 + [False], bins=1) == pytest.approx(0.0)
    assert calibration_error([0.2, 0.2, 0.8, 0.8], [True, False, True, True], bins=2) == pytest.approx(0.25)
    coverage, risk = risk_coverage([0.1, 0.9, 0.5], [False, True, True])
    np.testing.assert_allclose(coverage, [1 / 3, 2 / 3, 1.0])
    np.testing.assert_allclose(risk, [0.0, 0.0, 1 / 3])
    assert risk_area([0.1, 0.9], [False, True]) < risk_area([0.9, 0.1], [False, True])


def test_what_a_perfect_confidence_shows_by_chance_is_told() -> None:
    """In one bin of n effects of probability p the error is the mean of |share - p|, sqrt(2 p (1 - p)/(pi n)) for many;
    sure ones have none."""
    mean, low, high = perfect_error([0.5] * 100, bins=1)
    assert mean == pytest.approx(np.sqrt(2.0 * 0.25 / (np.pi * 100)), rel=0.1)
    assert low == pytest.approx(0.0, abs=0.011)
    assert high == pytest.approx(1.96 * 0.05, rel=0.15)
    assert perfect_error([1.0] * 20) == (0.0, 0.0, 0.0)
    assert all(np.isnan(v) for v in perfect_error([]))


def test_names_of_the_same_confidence_count_alike_in_whatever_order_they_come() -> None:
    confidence = [0.45] * 8 + [0.9] * 4
    right = [True] * 4 + [False] * 4 + [True] * 4
    turned = confidence[::-1], right[::-1]
    assert risk_area(confidence, right) == pytest.approx(risk_area(*turned))
    assert calibration_error(confidence, right, 3) == pytest.approx(calibration_error(*turned, 3))
    np.testing.assert_allclose(risk_coverage(confidence, right)[1][3:6], [0.0, 0.1, 1.0 / 6.0])


def test_conformal_sets_hold_what_is_new_as_often_as_promised() -> None:
    rng = np.random.default_rng(3)
    held = []
    for _ in range(1500):
        scores = rng.exponential(size=40)
        level = conformal_level(scores[:39].tolist(), 0.1)
        held.append(scores[39] <= level)
    assert np.mean(held) == pytest.approx(36 / 40, abs=0.025)  # exactly rank/(n+1)
    assert conformal_level([1.0] * 5, 0.1) == np.inf  # five trials say nothing about one in ten
    short = deficits({"a": 5.0, "b": 4.5, "c": 1.0})
    assert conformal_set(short, 1.0) == ("a", "b")
    assert conformal_set(short, np.inf) == ("a", "b", "c")
