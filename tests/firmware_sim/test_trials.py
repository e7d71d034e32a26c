"""Blind trials: what is hidden has the size it is said to have, stays hidden, and comes out the same again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from firmware_sim.plant import EFFECTS, LISTED, UNLISTED
from firmware_sim.trials import Wanted, digest, generate, open_truth
from firmware_sim.trials.__main__ import main
from firmware_sim.trials.confounded import CASES
from firmware_sim.trials.courses import KINDS as COURSES
from firmware_sim.trials.courses import Range, draw_course
from firmware_sim.trials.forms_motor import MOTOR
from firmware_sim.trials.joints import OFF_NOMINAL, draw_joint
from firmware_sim.trials.measures import loop_width
from firmware_sim.trials.order import order
from firmware_sim.trials.seal import truth_text, write_seal
from firmware_sim.trials.strangers import STRANGERS
from firmware_sim.trials.suspects import CATALOGUE


def test_suspects_are_the_plants_listed_effects_and_strangers_are_not() -> None:
    assert {s.id for s in (*CATALOGUE, *MOTOR)} == set(LISTED)
    assert {s.id for s in STRANGERS} <= set(UNLISTED)


def test_kinds_come_in_turn_and_every_one_its_effects_in_turn() -> None:
    kinds = ("single", "single", "pair", "confounded")
    wanted = Wanted(3, kinds, "catalogue", "none")
    drawn = [order(wanted, k) for k in range(4 * len(CATALOGUE))]
    assert [o.kind for o in drawn] == list(kinds) * len(CATALOGUE)
    singles = [o.suspects[0].id.partition(":")[0] for o in drawn if o.kind == "single"]
    assert {singles.count(s.id) for s in CATALOGUE} == {2}  # one given twice comes twice, with other effects
    ties = [o.tie.name for o in drawn if o.tie is not None]
    assert set(ties[: len(CASES)]) == {c.name for c in CASES}


def test_another_pair_is_drawn_where_no_joint_shows_one_and_the_first_stays_what_it_was() -> None:
    wanted = Wanted(670, ("single", "single", "single", "pair", "none"), "catalogue", "all")
    pairs = [tuple(s.id.partition(":")[0] for s in order(wanted, 18, again).suspects) for again in range(3)]
    assert pairs[0] == (
        "thermal_pretension",
        "pressure_dependent_friction",
    )  # of a quadratic law no joint showed it
    assert len(set(pairs)) == 3
    assert order(wanted, 0, 1) == order(wanted, 0)


@pytest.mark.parametrize("kind", COURSES)
def test_courses_stay_in_range_and_hold_reversals_rates_and_rests(kind: str) -> None:
    for seed in range(6):
        course = draw_course(np.random.default_rng(seed), kind, Range(2.0, 1.2, 2.0))
        assert np.max(np.abs(course.load_Nm)) <= 2.0 + 1e-9
        assert np.max(np.abs(course.motor_rad)) <= 2.4 + 1e-9
        assert 40.0 <= np.ptp(course.time_s) <= 60.1
        rate = np.diff(course.load_Nm)
        moving = rate[np.abs(rate) > 1e-9]
        assert np.sum(np.diff(np.sign(moving)) != 0) >= 8
        speeds = np.abs(moving)
        assert np.percentile(speeds, 98) > 2.0 * np.percentile(speeds, 10)
        assert np.any(course.motor_rad) == (kind != "bench")
        warm = draw_course(np.random.default_rng(seed), kind, Range(2.0, 1.2, 2.0), warm=True)
        assert np.ptp(warm.temperature_degC) > 3.0 > np.ptp(course.temperature_degC)


def test_loop_width_of_a_parallelogram_and_of_a_curve() -> None:
    up = np.linspace(-1.0, 1.0, 4000)
    load = np.concatenate([up, up[::-1]])
    side = np.concatenate([np.full(4000, 0.5), np.full(4000, -0.5)])
    assert loop_width(3.0 * load + 0.2 * side, load) == pytest.approx(0.2, rel=0.02)
    assert loop_width(np.tanh(load), load) < 2e-3


def test_joints_lie_in_the_stated_ranges_and_off_nominal_within_twice_their_tolerance() -> None:
    for seed in range(40):
        joint = draw_joint(np.random.default_rng(seed))
        s, n = joint.true.stages[0], joint.nominal.stages[0]
        assert 0.004999 <= min(n.input_radius_m, n.output_radius_m) <= 0.0601
        assert 4999.0 <= n.EA_N <= 50001.0
        assert 19.9 <= n.pretension_N <= 151.0
        for key in OFF_NOMINAL:
            off = np.log(getattr(s, key) / getattr(n, key))
            assert 0.0 < abs(off) <= 2.0 * joint.tolerance[key] + 1e-9
    stated = draw_joint(np.random.default_rng(1), as_stated=True)
    assert stated.true == stated.nominal


def test_a_run_is_the_same_whatever_was_there_and_hides_its_truth(tmp_path: Path) -> None:
    wanted = Wanted(9, ("single", "none"), "catalogue", "none")
    first = generate(wanted, 2, tmp_path / "a", workers=1)
    told: list[tuple[int, int]] = []
    generate(wanted, 1, tmp_path / "b", workers=1)  # stopped after the first
    kept = (tmp_path / "b" / "sealed" / "00000.zip").stat().st_mtime_ns
    second = generate(wanted, 2, tmp_path / "b", 1, lambda done, of: told.append((done, of)))
    assert told == [(2, 2)]
    assert (tmp_path / "b" / "sealed" / "00000.zip").stat().st_mtime_ns == kept
    assert first == second == digest(tmp_path / "a" / "sealed")
    for path in sorted((tmp_path / "a" / "trials").rglob("*.*")):
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes()
    folder = tmp_path / "a" / "trials" / "00000"
    names = {p.name for p in folder.rglob("*") if p.is_file()}
    assert names <= {"joint.toml", "recording-1.csv.gz", "recording-2.csv.gz", "recording-3.csv.gz"}
    assert not any(name in (folder / "joint.toml").read_text() for name in EFFECTS)
    truth = open_truth(tmp_path / "a" / "sealed" / "00000.zip")
    assert [e["id"] for e in truth["effects"]] == [order(wanted, 0).suspects[0].id]
    assert open_truth(tmp_path / "a" / "sealed" / "00001.zip")["effects"] == []


def test_a_changed_truth_changes_the_digest(tmp_path: Path) -> None:
    write_seal(tmp_path / "00000.zip", {"truth.json": truth_text({"trial": 0})})
    write_seal(tmp_path / "00001.zip", {"truth.json": truth_text({"trial": 1})})
    before = digest(tmp_path)
    write_seal(tmp_path / "00001.zip", {"truth.json": truth_text({"trial": 1})})
    assert digest(tmp_path) == before
    write_seal(tmp_path / "00001.zip", {"truth.json": truth_text({"trial": 2})})
    assert digest(tmp_path) != before
    (tmp_path / "00000.zip").unlink()
    assert digest(tmp_path) != before


def test_command_line_ends_in_one_line_for_bad_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--trials", "1", "--seed", "4", "--workers", "1", "--out", str(tmp_path / "run")]
    for more in (["--kinds", "several"], ["--laws", "mine"], ["--trials", "0"]):
        assert main([*arguments, *more]) == 2
        message = capsys.readouterr().err
        assert message.startswith("error: ")
        assert message.count("\n") == 1
