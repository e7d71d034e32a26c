"""The scoreboard counts what it says it counts, and the truth stays shut until all verdicts are written."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blind_joint import JOINT, recording

from cablecomp.config_text import joint_text
from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.recording.writer import write_canonical
from cablecomp.report.scoreboard_page import scoreboard_page, scoreboard_table
from cablecomp.trials.prove import SEALED, Blind, Wish, prove
from cablecomp.trials.reference import Yardstick, measure_truth
from cablecomp.trials.scoreboard import Rate, as_json, scoreboard
from cablecomp.trials.scoring import Row, failed_trial, score_trial
from cablecomp.trials.sealed import TrueEffect, Truth, digest, open_sealed

SURE = Yardstick(1e-5, 5e-5, True, 0.9, 20.0)


def truth(kind: str = "single", *effects: TrueEffect, partner: str = "", number: int = 0) -> Truth:
    drive = {k: v for k, v in JOINT.drive.stage[0].model_dump().items() if v is not None}
    return Truth(number, kind, "", partner, "bench", effects, 1e-3, 1e-5, drive, 0.0, JOINT)


def effect(name: str, size: float = 0.1, **parameters: float | str) -> TrueEffect:
    return TrueEffect(name, parameters, size, ("velocity",))


def verdict(*names: str, **changes: Any) -> dict[str, Any]:
    """What a diagnosis writes, with these names given."""
    said: dict[str, Any] = {
        "verdict": "explained" if names else "consistent",
        "noise_floor_rad": 1e-5,
        "augmented": {"heldout_rmse_rad": 1.05e-5, "final_rmse_rad": 1.1e-5},
        "calibration": {},
        "mismatch": [{"covariate": "load", "intervals_s": [[3.0, 5.0]]}],
        "missing_physics": [{"effect": n, "confidence": 0.97, "parameters": {}} for n in names],
        "not_excluded": [],
        "empirical": [],
        "could_be_unseen": [],
        "next_experiment": None,
    }
    return said | changes


def row(t: Truth, said: dict[str, Any], **further: Any) -> Row:
    return score_trial(t, SURE, said, **further)


def target(rows: Sequence[Row], words: str) -> float:
    return next(t.reached for t in scoreboard(rows, "", 0, "mixed").targets if words in t.what)


def test_names_are_right_wrong_or_missing() -> None:
    one = truth("single", effect("bearing_friction"))
    right, wrong, none = (row(one, verdict(*n)) for n in (("bearing_friction",), ("gravity_load",), ()))
    assert (right.first_right, right.wrong, right.all_right) == (True, False, True)
    assert (wrong.first_right, wrong.wrong) == (False, True)
    assert (none.first_right, none.wrong, none.outcome) == (False, False, "consistent")
    assert target([right, wrong, none], "named first") == pytest.approx(1 / 3)
    assert target([right, wrong, none], "wrong names") == pytest.approx(1 / 3)
    unclear = replace(wrong, decidable=False)
    assert target([right, unclear], "named first") == 1.0
    assert target([right, unclear], "wrong names") == 0.5  # at any size, decidable or not


def test_pairs_ask_for_both_and_nothing_else() -> None:
    pair = truth("pair", effect("gravity_load"), effect("clock_skew"))
    said = [("clock_skew", "gravity_load"), ("gravity_load",), ("clock_skew", "gravity_load", "crosstalk")]
    rows = [row(pair, verdict(*names)) for names in said]
    assert [r.all_right for r in rows] == [True, False, False]


def test_location_counts_by_the_effect_and_by_the_event() -> None:
    series = truth("single", effect("series_compliance"))
    assert row(series, verdict()).located
    assert not row(series, verdict(mismatch=[{"covariate": "time", "intervals_s": []}])).located
    assert not row(series, verdict(mismatch=[])).located
    for instant, expected in ((4.0, True), (5.5, True), (9.0, False)):
        slip = truth("single", replace(effect("termination_backlash"), parameters={"time_s": instant}))
        said = verdict(mismatch=[{"covariate": "time", "intervals_s": [[3.0, 5.0]]}])
        assert row(slip, said).located is expected
    channel = truth("single", effect("crosstalk", load_coefficient=0.1, channel="other_neighbour"))
    named = verdict(mismatch=[{"covariate": "other:neighbour", "intervals_s": []}])
    assert row(channel, named).located
    assert row(truth("nothing"), verdict()).located is None


def test_abstention_is_asked_for_where_there_is_something_to_see() -> None:
    unknown = truth("unknown", effect("creeping_mount"))
    assert target([row(unknown, verdict(verdict="unexplained"))], "unknown: unexplained") == 1.0
    assert target([row(unknown, verdict())], "unknown: unexplained") == 0.0
    unseen = score_trial(unknown, replace(SURE, baseline_rmse_rad=1.05e-5), verdict())
    assert target([unseen], "unknown: unexplained") == 1.0
    assert target([row(unknown, verdict("viscous_slip"))], "unknown: unexplained") == 0.0


def test_confounded_trials_are_to_be_said_proposed_and_settled() -> None:
    tie = truth("confounded", effect("gravity_load"), partner="inertial_load")
    said = verdict(
        not_excluded=[{"effects": ["inertial_load", "gravity_load"], "why": ""}],
        next_experiment={"why": "", "protocol": "schema = 1"},
    )
    good = row(tie, said, second=verdict("gravity_load"))
    assert (good.said_tied, good.proposed, good.settled) == (True, True, True)
    bad = row(tie, verdict("gravity_load"), second=verdict("inertial_load"))
    assert (bad.said_tied, bad.proposed, bad.settled) == (False, False, False)
    hidden = truth("confounded", effect("series_compliance"), partner="EA_N")
    alone = verdict(not_excluded=[{"effects": ["series_compliance", "EA_N"], "why": ""}])
    assert row(hidden, alone).said_tied


def test_coverage_counts_stated_intervals_and_turns_phases_round() -> None:
    one = truth("single", effect("pulley_runout", eccentricity_m=1e-4, phase_rad=3.1))
    said = verdict(
        "pulley_runout", calibration={"EA_N": {"value": JOINT.drive.stage[0].EA_N * 1.02, "sd": 200.0}}
    )
    said["missing_physics"][0]["parameters"] = {
        "eccentricity_m": {"value": 1.1e-4, "sd": 1e-5},
        "phase_rad": {"value": -3.1, "sd": 0.1},
    }
    found = {e.what: e.z for e in row(one, said).estimates}
    assert found["pulley_runout.eccentricity_m"] == pytest.approx(1.0)
    assert found["pulley_runout.phase_rad"] == pytest.approx((2 * np.pi - 6.2) / 0.1)
    assert found["EA_N"] == pytest.approx(0.02 * JOINT.drive.stage[0].EA_N / 200.0)
    assert not row(one, verdict("gravity_load")).estimates  # values of a wrong model prove nothing


def test_what_was_not_named_is_held_against_its_stated_bound() -> None:
    one = truth(
        "single",
        effect("bearing_friction", torque_Nm=0.02),
        effect("crosstalk", load_coefficient=0.1, channel="other_x"),
    )

    def said(friction: float | None, cross: float | None) -> dict[str, Any]:
        unseen = [
            {"effect": "bearing_friction", "parameter": "torque_Nm", "below": friction},
            {"effect": "crosstalk:other_x", "parameter": "load_coefficient", "below": cross},
            {"effect": "crosstalk:other_y", "parameter": "load_coefficient", "below": 0.001},
        ]
        return verdict(could_be_unseen=unseen)

    assert [b.held for b in row(one, said(0.03, 0.2)).bounds] == [True, True]
    assert [b.held for b in row(one, said(0.01, None)).bounds] == [False, True]
    assert target([row(one, said(0.01, None))], "below its stated bound") == 0.5


def test_what_was_kept_for_the_end_is_held_against_what_was_promised() -> None:
    rows = [row(truth("nothing"), verdict(augmented={"heldout_rmse_rad": 2.0, "final_rmse_rad": 3.0}))]
    assert target(rows, "kept for the end") == pytest.approx(1.5)


def test_a_pretension_at_another_reference_is_another_pretension() -> None:
    """T0 (1 + k (x - r)) is the same law for every r if T0 and k go with it."""
    k, r, other = 0.01, 20.0, 25.0
    warm = truth("single", effect("thermal_pretension", coefficient_per_K=k, reference_degC=r))
    moved = 1.0 + k * (other - r)
    T0 = JOINT.drive.stage[0].pretension_N
    said = verdict("thermal_pretension", calibration={"pretension_N": {"value": T0 * moved, "sd": 0.1}})
    said["missing_physics"][0]["parameters"] = {
        "coefficient_per_K": {"value": k / moved, "sd": 1e-3},
        "reference_degC": {"value": other, "sd": 0.0},
    }
    assert [e.z for e in row(warm, said).estimates] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_wilsons_interval() -> None:
    """Newcombe, Statistics in Medicine 17 (1998), table I: 81 of 263 gives 0.2553 to 0.3662."""
    assert Rate(81, 263).interval == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert Rate(0, 20).interval == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert isnan(Rate(0, 0).value)


def test_reliability_compares_confidence_with_truth() -> None:
    one = truth("single", effect("clock_skew"))
    rows = [row(one, verdict("clock_skew")) for _ in range(3)] + [row(one, verdict("crosstalk"))]
    ((_, _, mean, share),) = scoreboard(rows, "", 0, "single").reliability
    assert (mean, share.hits, share.of) == (pytest.approx(0.97), 3, 4)


def test_page_and_table_hold_every_trial_and_json_no_nan() -> None:
    rows = [
        row(truth("single", effect("clock_skew"), number=3), verdict("clock_skew"), seconds=4.0),
        failed_trial(truth("pair", effect("gravity_load"), effect("crosstalk"), number=4), SURE, "no luck"),
        row(truth("nothing", number=5), verdict("crosstalk")),
    ]
    board = scoreboard(rows, "ab" * 32, 7, "mixed")
    text = scoreboard_page(board, "cablecomp prove --seed 7")
    assert "no luck" in text
    assert "abababababab" in text
    assert scoreboard_table(board).row_count == len(board.targets)
    assert json.loads(json.dumps(as_json(board), allow_nan=False))["confusion"]["a pair"] == {"failed": 1}
    assert target(rows, "false names") == 1.0


def test_the_true_model_is_the_yardstick() -> None:
    """With the truth concealed the true model leaves noise, beats the calibrated drive and is decidable."""
    values = {"gap_rad": 8e-5}
    true = with_effects(JOINT, [("termination_backlash", values)])
    columns = recording(true, 1)
    t = replace(truth("single", effect("termination_backlash", **values)), model=true)
    found = measure_truth(JOINT, [columns], t)
    assert found.decidable
    assert found.gain > 0.5
    assert found.true_rmse_rad < 0.8 * found.baseline_rmse_rad
    nothing = measure_truth(JOINT, [recording(JOINT, 2)], truth("nothing"))
    assert not nothing.decidable
    assert nothing.baseline_rmse_rad == pytest.approx(nothing.true_rmse_rad, rel=0.15)


def _conceal(log: list[str]) -> Callable[..., str]:
    def work(out: Path, wish: Wish, told: Callable[[int, int], None]) -> str:
        trials = []
        with zipfile.ZipFile(out / SEALED, "w") as archive:
            for k in range(wish.trials):
                folder = out / "trials" / f"{k:05d}"
                folder.mkdir(parents=True)
                (folder / "joint.toml").write_text(joint_text(JOINT))
                write_canonical(folder / "recording-1.csv", recording(JOINT, k))
                archive.writestr(f"models/{k:05d}/true-model.toml", joint_text(JOINT))
                trials.append(_plain_truth(k))
                told(k + 1, wish.trials)
            archive.writestr("truth.json", json.dumps({"schema": 1, "trials": trials}))
        log.append("concealed")
        return digest(out / SEALED)

    return work


def _plain_truth(number: int) -> dict[str, Any]:
    drive = {k: v for k, v in JOINT.drive.stage[0].model_dump().items() if v is not None}
    return {
        "trial": number, "kind": "nothing", "case": "", "partner": "", "excitation": "bench", "effects": [],
        "loop_rad": 1e-3, "noise_floor_rad": 1e-5, "true": drive, "offset_rad": 0.0,
    }  # fmt: skip


def _fake_diagnosis(log: list[str]) -> Callable[[Path, Sequence[Path], Path], None]:
    def work(folder: Path, further: Sequence[Path], out: Path) -> None:
        assert sorted(p.name for p in folder.iterdir()) == ["joint.toml", "recording-1.csv"]
        log.append(f"diagnosed {folder.name} with {len(further)}")
        if folder.name == "00001":
            raise InputError("the joint cannot follow")
        said = verdict(next_experiment=None if further else {"why": "", "protocol": "x"})
        (out / "diagnosis.json").write_text(json.dumps(said))
        if not further:
            (out / "next_experiment.toml").write_text("x")

    return work


def _fake_experiment(log: list[str]) -> Callable[[Path, int, Path, Path], None]:
    def work(sealed: Path, trial: int, protocol: Path, out: Path) -> None:
        log.append(f"experiment {trial}")
        out.write_text("")

    return work


def test_the_whole_way_in_order_and_again_without_work(tmp_path: Path) -> None:
    log: list[str] = []
    blind = Blind(tmp_path, _conceal(log), _fake_experiment(log), _fake_diagnosis(log), workers=0)
    board = prove(blind, Wish(2, 5), lambda what, done, of: None, log.append)
    assert log[0] == "concealed"
    assert log[1] == digest(tmp_path / SEALED)
    assert log[2:] == [
        "diagnosed 00000 with 0",
        "diagnosed 00001 with 0",
        "experiment 0",
        "diagnosed 00000 with 1",
    ]
    assert [r.outcome for r in board.rows] == ["consistent", "failed"]
    assert json.loads((tmp_path / "scoreboard.json").read_text())["trials"] == 2
    before = len(log)
    prove(blind, Wish(2, 5), lambda what, done, of: None, log.append)
    assert log[before:] == [digest(tmp_path / SEALED)]
    with pytest.raises(InputError, match="holds another run"):
        prove(blind, Wish(3, 5), lambda what, done, of: None, log.append)


def test_a_broken_seal_is_not_opened(tmp_path: Path) -> None:
    log: list[str] = []
    _conceal(log)(tmp_path, Wish(1, 0), lambda done, of: None)
    sha256 = digest(tmp_path / SEALED)
    assert open_sealed(tmp_path / SEALED, sha256)[0].kind == "nothing"
    with zipfile.ZipFile(tmp_path / SEALED, "a") as archive:
        archive.writestr("more.txt", "later")
    with pytest.raises(InputError, match="the truth was changed"):
        open_sealed(tmp_path / SEALED, sha256)
    assert isnan(truth("nothing").size)
