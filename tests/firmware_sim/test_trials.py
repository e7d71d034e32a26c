"""Blind trials: what is hidden has the size it is said to have, stays hidden, and comes out the same again."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from firmware_sim.plant import COARSE, EFFECTS, LISTED, UNLISTED, PlantError
from firmware_sim.trials import assignment, digest, draw_trial, generate, open_truth
from firmware_sim.trials.__main__ import main
from firmware_sim.trials.courses import KINDS as COURSES
from firmware_sim.trials.courses import Range, draw_course
from firmware_sim.trials.joints import OFF_NOMINAL, draw_joint
from firmware_sim.trials.measures import loop_width
from firmware_sim.trials.plan import KINDS, SHARES, Assignment
from firmware_sim.trials.sizes import LARGEST, SMALLEST, run_course
from firmware_sim.trials.strangers import STRANGERS
from firmware_sim.trials.suspects import CATALOGUE, Scene


def test_suspects_are_the_plants_listed_effects_and_strangers_are_not() -> None:
    assert {s.id for s in CATALOGUE} == set(LISTED)
    assert {s.id for s in STRANGERS} <= set(UNLISTED)


def test_mixed_assignments_keep_their_shares_and_cover_the_catalogue() -> None:
    drawn = [assignment(3, k) for k in range(100)]
    assert {k: sum(a.kind == k for a in drawn) for k in KINDS} == {k: 2 * SHARES[k] for k in KINDS}
    singles = [a.effects[0] for a in drawn if a.kind == "single"]
    counts = [singles.count(s.id) for s in CATALOGUE]
    assert max(counts) - min(counts) <= 1
    assert [assignment(3, k) for k in range(100)] == drawn
    assert [assignment(4, k) for k in range(100)] != drawn
    with pytest.raises(PlantError, match="mixed, single"):
        assignment(3, 0, "several")


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


@pytest.mark.parametrize("effect", ["bearing_friction", "pulley_runout", "routing_friction"])
def test_an_effect_adds_to_the_joint_angle_what_its_size_says(effect: str) -> None:
    trial = draw_trial(2, Assignment(0, "single", (effect,)))
    sized = trial.effects[0]
    assert SMALLEST <= sized.size <= LARGEST
    scene = Scene(trial.joint, trial.courses[0], trial.plain)
    absent = replace(sized.spec, parameters={**sized.spec.parameters, "mu_angle": 0.0})
    without = run_course(scene, (absent,) if effect == "routing_friction" else (), COARSE)
    added = run_course(scene, (sized.spec,), COARSE).joint_position_rad - without.joint_position_rad
    assert np.std(added) / trial.plain.loop_rad == pytest.approx(sized.size, rel=1e-6)


def test_noise_floor_is_a_small_share_of_the_loop_and_is_what_the_sensors_make() -> None:
    trial = draw_trial(2, Assignment(0, "nothing"))
    assert 0.003 < trial.floor_rad / trial.plain.loop_rad < 0.025
    run = run_course(Scene(trial.joint, trial.courses[0], trial.plain), (), COARSE)
    read = trial.recordings[0]
    sensors = trial.joint.sensors
    noise = read["joint_position_rad"] - run.joint_position_rad - trial.joint.offset_rad
    expected = np.hypot(
        sensors["joint_position_noise_rad"], sensors["joint_position_resolution_rad"] / 12**0.5
    )
    assert np.std(noise) == pytest.approx(expected, rel=0.15)


def test_a_run_is_the_same_whatever_the_workers_and_hides_its_truth(tmp_path: Path) -> None:
    first = generate(2, 9, tmp_path / "a", "single", workers=1)
    second = generate(2, 9, tmp_path / "b", "single", workers=2)
    assert first == second == digest(tmp_path / "a" / "sealed.zip")
    for path in sorted((tmp_path / "a" / "trials").rglob("*.*")):
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes()
    public = sorted(p.name for p in (tmp_path / "a" / "trials" / "00000").iterdir())
    assert public == ["joint.toml", "recording-1.csv.gz", "recording-2.csv.gz"]
    truths = open_truth(tmp_path / "a" / "sealed.zip")
    text = (tmp_path / "a" / "trials" / "00000" / "joint.toml").read_text()
    assert not any(name in text for name in EFFECTS)
    assert [truths[k]["effects"][0]["id"] for k in range(2)] == [
        assignment(9, k, "single").effects[0] for k in range(2)
    ]
    with pytest.raises(PlantError, match="sealed run already"):
        generate(3, 9, tmp_path / "a", "single")


def test_a_changed_truth_changes_the_digest(tmp_path: Path) -> None:
    generate(1, 1, tmp_path, "nothing", workers=1)
    before = digest(tmp_path / "sealed.zip")
    with zipfile.ZipFile(tmp_path / "sealed.zip") as archive:
        truth = json.loads(archive.read("truth.json"))
    assert truth["trials"][0]["effects"] == []
    with zipfile.ZipFile(tmp_path / "sealed.zip", "a") as archive:
        archive.writestr("more.txt", "later")
    assert digest(tmp_path / "sealed.zip") != before


def test_command_line_prints_the_digest_and_one_line_for_bad_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--trials", "1", "--seed", "4", "--kind", "nothing", "--workers", "1", "--out"]
    assert main([*arguments, str(tmp_path / "run")]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed == ["written 1 of 1", f"sha256 {digest(tmp_path / 'run' / 'sealed.zip')}"]
    assert main([*arguments, str(tmp_path / "run")]) == 2
    assert capsys.readouterr().err.startswith("error: ")
