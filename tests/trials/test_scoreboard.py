"""The scoreboard counts what it says it counts."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from math import isnan
from typing import Any

import numpy as np
import pytest
from blind_joint import JOINT, recording, turning
from blind_verdict import verdict

from cablecomp.effects import with_effects
from cablecomp.report.scoreboard_page import scoreboard_page, scoreboard_table
from cablecomp.trials.reference import Yardstick, measure_truth
from cablecomp.trials.row import Row
from cablecomp.trials.scoreboard import as_json, scoreboard
from cablecomp.trials.scoring import failed_trial, score_trial
from cablecomp.trials.sealed import TrueEffect, Truth
from cablecomp.trials.shares import Rate

SURE = Yardstick(1e-5, 5e-5, True, 0.9, 20.0)
WISH = {"trials": 3, "seed": 7, "kinds": "single", "laws": "mixed", "imperfections": "some"}


def truth(
    kind: str = "single", *effects: TrueEffect, partner: str = "", number: int = 0, **imperfections: Any
) -> Truth:
    drive = {k: v for k, v in JOINT.drive.stage[0].model_dump().items() if v is not None}
    return Truth(number, kind, "", partner, "bench", effects, (), imperfections, 1e-3, 1e-5, drive)


def effect(name: str, size: float = 0.1, **parameters: float | str) -> TrueEffect:
    return TrueEffect(name, parameters, size, ("velocity",))


def row(t: Truth, said: dict[str, Any], **further: Any) -> Row:
    return score_trial(t, SURE, said, **further)


def target(rows: Sequence[Row], words: str) -> float:
    return next(t.reached for t in scoreboard(rows, "", WISH).targets if words in t.what)


def test_names_are_right_wrong_or_missing() -> None:
    one = truth("single", effect("bearing_friction"))
    right, wrong, none = (row(one, verdict(*n)) for n in (("bearing_friction",), ("gravity_load",), ()))
    assert (right.first_right, right.wrong, right.all_right) == (True, False, True)
    assert (wrong.first_right, wrong.wrong) == (False, True)
    assert (none.first_right, none.wrong, none.outcome) == (False, False, "consistent")
    assert target([right, wrong, none], "named first, catalogue") == pytest.approx(1 / 3)
    assert target([right, wrong, none], "a wrong name") == pytest.approx(1 / 3)
    unclear = replace(wrong, decidable=False)
    assert target([right, unclear], "named first, catalogue") == 1.0
    assert target([right, unclear], "a wrong name") == 0.5  # at any size, decidable or not


def test_laws_are_told_apart_and_companions_and_imperfections_are_no_wrong_names() -> None:
    greased = replace(effect("termination_backlash"), form="greased")
    other = truth("single", greased, replace(effect("clock_skew"), role="companion"))
    assert other.laws == "other"
    both = row(other, verdict("termination_backlash", "clock_skew"))
    assert (both.first_right, both.wrong, both.all_right) == (True, False, True)
    assert not row(other, verdict("clock_skew")).first_right
    behind = row(other, verdict("clock_skew", "termination_backlash"))
    assert target([behind, both], "named first, another law") == 0.5
    assert target(
        [behind, both, row(other, verdict("clock_skew"))], "whatever stands before it"
    ) == pytest.approx(2 / 3)
    assert target([both], "named first, another law") == 1.0
    assert isnan(target([both], "named first, catalogue"))
    late = truth("none", late={"channel": "joint_position", "acts_as": ["clock_skew"]})
    assert not row(late, verdict("clock_skew")).wrong
    assert row(late, verdict("crosstalk")).wrong
    board = scoreboard([both, row(late, verdict("crosstalk"))], "", WISH)
    assert [p.name for p in board.by_law] == ["clock_skew:catalogue", "termination_backlash:greased"][1:]
    assert {p.name: p.wrong.hits for p in board.by_imperfection} == {"none at all": 0, "late": 1}


def test_dependences_count_but_for_those_that_were_declared() -> None:
    tied = replace(truth("sessions"), depends_on=(("routing_friction.mu_angle", "sheath_bend_rad"),))
    on = {"parameter": "routing_friction.mu_angle", "on": "sheath_bend_rad"}
    said = verdict("routing_friction")
    said["missing_physics"][0]["depends_on"] = on
    said["calibration"] = {
        "pretension_N@run~1": {"value": 1.0, "sd": 0.1},
        "joint_position_offset_rad@run~1": {"value": 0.0, "sd": 0.1},
    }
    found = row(tied, said)
    assert (found.depends, found.depends_wrongly) == ((1, 1), 1)
    own = replace(tied, imperfections={"sessions": {"declared": True}})
    assert row(own, said).depends_wrongly == 0
    assert row(tied, verdict()).depends == (0, 1)


def test_the_truth_falls_short_of_the_best_by_what_the_first_step_says() -> None:
    one = truth("single", effect("crosstalk"))
    assert row(one, verdict("gravity_load", "clock_skew")).short_by == pytest.approx(2.0)
    assert row(one, verdict()).short_by == 0.0
    assert row(truth("single", effect("strand_break")), verdict()).short_by == np.inf


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
    assert row(truth("none"), verdict()).located is None
    beside = truth("motor", replace(effect("motor_friction"), channel="motor_torque_Nm"))
    assert row(beside, verdict()).located is None
    rows = [row(beside, verdict("motor_friction")), row(beside, verdict("crosstalk"))]
    assert target(rows, "friction of the motor, in its torque alone: named first") == 0.5
    assert target(rows, "friction of the motor: a wrong name") == 0.5
    assert isnan(target(rows, "single effect named first, catalogue"))
    cogging = replace(effect("motor_torque_cogging"), form="stranger", channel="motor_torque_Nm")
    unlike = [
        row(truth("stranger", cogging), verdict()),
        row(truth("stranger", replace(effect("tip_link"), form="stranger")), verdict()),
    ]
    assert scoreboard(unlike, "", WISH).by_law[0].located.of == 0
    assert target(unlike, "strangers: located") == 0.0


def test_a_stranger_may_be_called_what_it_is_nearest_to_and_nothing_else() -> None:
    unknown = truth("stranger", replace(effect("creeping_mount"), form="stranger", nearest=("viscous_slip",)))
    assert unknown.laws == "stranger"
    words = "strangers: no wrong name"
    assert target([row(unknown, verdict(verdict="unexplained"))], words) == 1.0
    assert target([row(unknown, verdict("viscous_slip"))], words) == 1.0
    assert target([row(unknown, verdict("gravity_load"))], words) == 0.0
    assert target([failed_trial(unknown, SURE, "no luck")], words) == 0.0


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
    rows = [row(truth("none"), verdict(augmented={"heldout_rmse_rad": 2.0, "final_rmse_rad": 3.0}))]
    assert target(rows, "kept for the end") == pytest.approx(1.5)


def test_a_trial_without_a_verdict_has_no_error_to_be_counted() -> None:
    one = truth("single", effect("bearing_friction"))
    rows = [row(one, verdict("bearing_friction")), failed_trial(one, SURE, "no luck")]
    over_noise = [t for t in scoreboard(rows, "", WISH).targets if "left out over noise" in t.what]
    assert [t.of for t in over_noise] == [1, 1]


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


def test_trust_compares_confidence_with_truth() -> None:
    one = truth("single", effect("clock_skew"))
    rows = [row(one, verdict("clock_skew")) for _ in range(3)] + [row(one, verdict("crosstalk"))]
    trust = scoreboard(rows, "", WISH).trust
    assert [mean for _, _, mean, _ in trust.bins] == pytest.approx([0.97] * 4)
    assert sum(share.hits for *_, share in trust.bins) == pytest.approx(3)
    assert sum(share.of for *_, share in trust.bins) == 4
    shown = sum(share.of * abs(share.value - mean) for _, _, mean, share in trust.bins) / trust.of
    assert trust.error == pytest.approx(shown) == pytest.approx(0.97 - 0.75)
    assert trust.brier == pytest.approx((3 * 0.03**2 + 0.97**2) / 4)
    assert trust.risk[-1] == 0.25


def test_page_and_table_hold_every_trial_and_json_no_nan() -> None:
    rows = [
        row(truth("single", effect("clock_skew"), number=3), verdict("clock_skew"), seconds=4.0),
        failed_trial(truth("pair", effect("gravity_load"), effect("crosstalk"), number=4), SURE, "no luck"),
        row(truth("none", number=5, gaps={}), verdict("crosstalk")),
    ]
    board = scoreboard(rows, "ab" * 32, WISH)
    text = scoreboard_page(board)
    assert "no luck" in text
    assert "abababababab" in text
    assert "--imperfections some" in text
    assert "(stated − true) / stated sd" not in text
    assert "No value was stated that has a true one" in text
    assert scoreboard_table(board).row_count == len(board.targets)
    assert json.loads(json.dumps(as_json(board), allow_nan=False))["confusion"]["a pair"] == {"failed": 1}
    assert target(rows, "nothing missing: a wrong name") == 1.0


def test_the_true_law_is_the_yardstick() -> None:
    """With its law's contribution known, the drive leaves noise, beats itself without and is decidable."""
    true = with_effects(JOINT, [("termination_backlash", {"gap_rad": 8e-5})])
    columns, plain = recording(true, 1), recording(JOINT, 1, noise=False)
    angles = {
        "time_s_1": columns["time_s"],
        "joint_rad_1": recording(true, 1, noise=False)["joint_position_rad"],
        "plain_rad_1": plain["joint_position_rad"],
    }
    found = measure_truth(JOINT, {"a": columns}, truth("single", effect("termination_backlash")), angles)
    assert found.decidable
    assert found.gain > 0.5
    assert found.true_rmse_rad < 0.8 * found.baseline_rmse_rad
    nothing = {**angles, "joint_rad_1": plain["joint_position_rad"]}
    assert not measure_truth(JOINT, {"a": columns}, truth("single", effect("clock_skew")), nothing).decidable
    none = measure_truth(JOINT, {"a": recording(JOINT, 1)}, truth("none"), nothing)
    assert not none.decidable
    assert none.baseline_rmse_rad == pytest.approx(none.true_rmse_rad, rel=0.15)


def test_what_the_motors_torque_alone_shows_is_measured_there() -> None:
    """The same joint angle, and a drag in the motor's torque: decidable by its true course, not by another one."""
    columns = turning(1)
    rng, motor = np.random.default_rng(2), columns["motor_position_rad"]
    drag = 0.004 * np.sign(np.gradient(motor))
    alone = columns["motor_torque_Nm"]
    columns["motor_torque_Nm"] = alone + drag + 1e-3 * rng.standard_normal(len(motor))
    angles = {
        "time_s_1": columns["time_s"],
        "joint_rad_1": columns["joint_position_rad"],
        "plain_rad_1": columns["joint_position_rad"],
        "joint_motor_Nm_1": alone + drag,
        "plain_motor_Nm_1": alone,
    }
    concealed = truth("motor", replace(effect("motor_friction"), channel="motor_torque_Nm"))
    found = measure_truth(JOINT, {"a": columns}, concealed, angles)
    assert found.decidable
    assert found.gain > 0.5
    off = {**angles, "joint_motor_Nm_1": alone + np.roll(drag, len(drag) // 3)}
    assert not measure_truth(JOINT, {"a": columns}, concealed, off).decidable
