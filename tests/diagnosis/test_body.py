"""One body of evidence: who belongs to which session, one clock, what is kept for the end stays unseen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.config import parse_joint
from cablecomp.diagnosis.body import gather_body, read_by_all, read_by_some, session_names
from cablecomp.diagnosis.calibration.drive import first_weights
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.parameter import of_drive
from cablecomp.estimation.problem import Problem
from cablecomp.estimation.standing import standing, stated_of
from cablecomp.signal.smoothing import FloatArray

PLAIN = JOINT.model_dump(by_alias=True, exclude_none=True)
ANGLE = "joint_position_rad"


def test_recordings_of_a_folder_are_one_session() -> None:
    names = ["data/monday/1.csv", "data/monday/2.csv", "data/tuesday/1.csv", "loose.csv"]
    assert list(session_names(JOINT, names).values()) == ["monday", "monday", "tuesday", "all"]
    assert set(session_names(JOINT, names, "one").values()) == {"all"}


def test_a_session_of_the_configuration_claims_its_recordings_unless_told_otherwise() -> None:
    claimed = parse_joint({**PLAIN, "session": [{"name": "warm", "recordings": ["tuesday/*"]}]}, "x")
    names = ["data/monday/1.csv", "data/tuesday/1.csv"]
    assert list(session_names(claimed, names).values()) == ["monday", "warm"]
    assert list(session_names(claimed, names, "folder").values()) == ["monday", "tuesday"]


@pytest.mark.parametrize("mode", [None, "each"])
def test_a_recording_that_several_sessions_claim_is_refused(mode: Literal["each"] | None) -> None:
    """Its values are those of one of them, and which is not known."""
    sessions = [
        {"name": n, "recordings": ["s/rec.csv"], "values": {"mu_output": 0.1}} for n in ("mon", "tue")
    ]
    joint = parse_joint({**PLAIN, "session": sessions}, "x")
    with pytest.raises(InputError, match=r"mon/s/rec.csv: several sessions claim it \(mon, tue\); let"):
        gather_body(joint, {"mon/s/rec.csv": recorded()}, mode)


@pytest.mark.parametrize("load", ["joint_torque_Nm", "motor_torque_Nm"])
def test_recordings_with_and_without_a_load_are_refused_whichever_comes_first(load: str) -> None:
    whole = recorded()
    whole[load] = whole.pop("joint_torque_Nm")
    bare = {k: v for k, v in whole.items() if k != load}
    joint = parse_joint({**PLAIN, "observer": {"load": load.removesuffix("_Nm")}}, "x")
    for given in ({"a": whole, "b": bare}, {"b": bare, "a": whole}):
        with pytest.raises(InputError, match=f"b: channel `{load}` is missing, which a has for its load"):
            gather_body(joint, given)


def test_parts_of_a_mounting_are_one_session_with_what_else_is_in_its_folder() -> None:
    parts = [
        {"name": "before", "mounting": "monday", "recordings": ["monday/1.csv"]},
        {"name": "after", "mounting": "monday", "recordings": ["monday/2.csv"]},
    ]
    joint = parse_joint({**PLAIN, "session": parts}, "x")
    names = [f"data/monday/{k}.csv" for k in (1, 2, 3)]
    assert set(session_names(joint, names).values()) == {"monday"}


def test_a_part_of_a_mounting_goes_before_a_mounting_that_names_all_of_its_recordings() -> None:
    """A session not called after its folder, with an event in one of its recordings."""
    entries = [
        {"name": "mine", "recordings": ["s/a.csv", "s/b.csv"], "values": {"pretension_N": 30.0}},
        {"name": "mine s/b.csv", "mounting": "mine", "recordings": ["s/b.csv"]},
    ]
    entries[1]["values"] = {"pretension_N": 33.0}
    joint = parse_joint({**PLAIN, "session": entries}, "x")
    names = ["x/s/a.csv", "x/s/b.csv"]
    assert set(session_names(joint, names).values()) == {"mine"}
    stated = [stated_of(joint, Path(name), {})["pretension_N"] for name in names]
    assert stated == [30.0, 33.0]


def test_a_law_of_one_session_holds_in_its_recordings_when_it_is_diagnosed_again() -> None:
    motor = "motor_position_rad"
    law = {"id": "ripple", "law": "fourier", "of": motor, "coefficients_rad": [0.0, 1e-3], "session": "a"}
    entries = [{"name": n, "recordings": [f"{n}/*"]} for n in "ab"]
    joint = parse_joint({**PLAIN, "session": entries, "empirical": [law]}, "x")
    body = gather_body(joint, {"a/1": with_torque(1), "b/1": with_torque(2)})
    of_a, of_b = (standing(joint, {}, e) for e in body.used)
    assert [f.id for f in of_a.empirical] == ["ripple"]
    assert of_a.empirical[0].session == ""
    assert of_b.empirical == ()
    problem = Problem(joint, of_drive(joint), body.used, first_weights(joint, body.used))
    plain = replace(problem, config=parse_joint({**PLAIN, "session": entries}, "x"))
    with_law, without = (p.misfits(p.start)[ANGLE] for p in (problem, plain))
    added = 1e-3 * np.sin(np.pi * body.used[0].at_rows(motor))
    np.testing.assert_allclose(without[0] - with_law[0], added, atol=1e-12)
    np.testing.assert_array_equal(without[1], with_law[1])


@pytest.mark.parametrize("count", [0, 1, 8])
def test_a_channel_that_hardly_counts_is_left_out_as_one_that_is_not_there(count: int) -> None:
    """What little of it there is lies where the end is kept."""
    torque = "motor_torque_Nm"
    whole = gather_body(JOINT, {"a/1": with_torque(1), "a/2": with_torque(2)}).used
    assert torque in read_by_all(JOINT, whole)
    assert read_by_some(JOINT, whole) == {}
    counted = np.zeros_like(whole[1].counted[torque])
    counted[:count] = True
    hardly = replace(whole[1], counted={**whole[1].counted, torque: counted})
    assert (torque in read_by_all(JOINT, [whole[0], hardly])) is (count > 0)
    assert read_by_some(JOINT, [whole[0], hardly]) == ({} if count else {torque: ["a/1"]})
    assert torque not in read_by_all(JOINT, [hardly])
    assert read_by_some(JOINT, [hardly]) == {torque: ["a/2"]}
    assert ANGLE in read_by_all(JOINT, [hardly])


def with_torque(seed: int) -> dict[str, FloatArray]:
    columns = recorded(seed=seed)
    return {**columns, "motor_torque_Nm": -JOINT.drive.ratio * columns["joint_torque_Nm"]}


def test_a_recording_stands_apart_as_its_session_states() -> None:
    """Tighter by a factor, loaded from another zero; its encoder's zero is found inside of the fit."""
    values = {"pretension_N": 1.2 * JOINT.drive.stage[0].pretension_N, "joint_torque_offset_Nm": 0.25}
    tight = {"name": "tight", "recordings": ["b"], "values": {**values, "joint_position_offset_rad": 0.1}}
    joint = parse_joint({**PLAIN, "session": [tight]}, "x")
    for e in gather_body(joint, {"a/1": recorded(seed=1), "b/1": recorded(seed=2)}).used:
        stated = {"pretension_N": (pytest.approx(1.2), 0.0), "joint_torque_offset_Nm": (1.0, 0.25)}
        assert e.apart == (stated if e.session == "tight" else {})


def test_the_end_of_few_recordings_is_kept_and_never_used() -> None:
    body = gather_body(JOINT, {"a/1": recorded(seed=1), "a/2": recorded(seed=2)})
    assert body.final_by == "block"
    for used, final in zip(body.used, body.final, strict=True):
        assert not np.any(used.counted[ANGLE] & final.counted[ANGLE])
        assert np.mean(used.counted[ANGLE] | final.counted[ANGLE]) > 0.98  # but for readings set aside
        assert used.rows[used.counted[ANGLE]].max() < used.rows[final.counted[ANGLE]].min()
        assert 0.10 < final.counted[ANGLE].mean() < 0.20


def test_whole_recordings_of_many_are_kept_and_every_session_stays_represented() -> None:
    short = {f"{'abcd'[k % 4]}/{k}": recorded(seed=k, duration_s=6.0) for k in range(LIMITS.final_from + 4)}
    body = gather_body(JOINT, short)
    assert body.final_by == "recording"
    used, final = {e.name for e in body.used}, {e.name for e in body.final}
    assert final
    assert not used & final
    assert used | final == set(short)
    assert {e.session for e in body.final} <= {e.session for e in body.used}


def test_clocks_go_on_one_after_the_other() -> None:
    body = gather_body(JOINT, {"a/1": recorded(seed=1), "a/2": recorded(seed=2)})
    first, second = (e.columns["time_s"] for e in body.used)
    assert second[0] > first[-1]
    assert body.used[1].shift_s == pytest.approx(float(second[0]) - 0.0, abs=0.05)


def test_recordings_of_one_clock_are_taken_in_order_of_time_however_they_are_given() -> None:
    columns = recorded(seed=1)
    later = {f"a/{k}": {**columns, "time_s": columns["time_s"] + 100.0 * k} for k in (2, 0, 1)}
    body = gather_body(JOINT, later)
    assert body.names == tuple(e.name for e in body.used) == ("a/0", "a/1", "a/2")
    assert body.clock_s == {}
    assert [e.columns["time_s"][0] // 100.0 for e in body.used] == [0.0, 1.0, 2.0]
    twice = gather_body(JOINT, {**later, "b/0": later["a/1"]})
    assert twice.names == ("a/2", "a/0", "a/1", "b/0")  # more clocks than one: as they are given


def test_a_condition_is_the_channels_median_and_has_to_be_there() -> None:
    bent = parse_joint({**PLAIN, "condition": {"bend_rad": "other_bend"}}, "x")
    columns = recorded()
    with pytest.raises(InputError, match=r"other_bend.*take that line out of the joint"):
        gather_body(bent, {"a/1": columns})
    columns["other_bend"] = np.full(len(columns["time_s"]), 0.7)
    (only,) = gather_body(bent, {"a/1": columns}).used
    assert only.condition == {"bend_rad": pytest.approx(0.7)}


def test_no_recording_is_refused() -> None:
    with pytest.raises(InputError, match="one or more"):
        gather_body(JOINT, {})


def test_sessions_are_told_of_names_on_any_system() -> None:
    assert session_names(JOINT, [str(Path("a") / "b.csv")]) == {str(Path("a") / "b.csv"): "a"}


def test_folders_of_one_name_are_not_one_session() -> None:
    names = ["left/monday/1.csv", "right/monday/1.csv", "right/tuesday/2.csv"]
    assert len(set(session_names(JOINT, names).values())) == 3
    assert len(set(session_names(JOINT, names, "each").values())) == 3


def test_where_every_recording_is_a_session_of_its_own_the_end_of_each_is_kept() -> None:
    body = gather_body(JOINT, {f"{k}/1": recorded(seed=k, duration_s=6.0) for k in range(LIMITS.final_from)})
    assert body.final_by == "block"
    assert len(body.final) == LIMITS.final_from


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda c: {k: v for k, v in c.items() if k != "joint_torque_Nm"},
            "`joint_torque_Nm` is missing, which a/1",
        ),
        (lambda c: {}, "`time_s` is missing"),
    ],
)
def test_recordings_that_do_not_go_together_are_refused(
    change: Callable[[dict[str, FloatArray]], dict[str, FloatArray]], words: str
) -> None:
    with pytest.raises(InputError, match=f"a/2: channel {words}"):
        gather_body(JOINT, {"a/1": recorded(seed=1), "a/2": change(recorded(seed=2))})
