"""Trials with their truth beside them: the same whatever else is made, and true to what they say."""

from __future__ import annotations

import csv
import gzip
import json
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firmware_sim.plant import FORMS, PlantError
from firmware_sim.trials.forms_motor import MOTOR
from firmware_sim.trials.make import main, make
from firmware_sim.trials.order import (
    ALIKE,
    CATALOGUE_FORMS,
    KINDS,
    LATEST,
    LAWS,
    OTHER_FORMS,
    Wanted,
    concealable,
    order,
)
from firmware_sim.trials.suspects import CATALOGUE
from firmware_sim.trials.tabletop import CASES
from firmware_sim.trials.world import _turns, draw_world

PRIVATE = {"routing_friction:bending"}  # depends on a condition: for trials of several sessions


def _read(path: Path) -> dict[str, np.ndarray]:
    with gzip.open(path, "rt") as text:
        rows = list(csv.reader(text))
    return {name: np.array([float(r[k]) for r in rows[1:]]) for k, name in enumerate(rows[0])}


def _truth(folder: Path) -> tuple[dict[str, Any], Any]:
    return json.loads((folder / "truth.json").read_text()), np.load(folder / "truth.npz")


def test_everything_that_the_plant_can_do_otherwise_can_be_concealed() -> None:
    assert {s.id for s in OTHER_FORMS} == set(FORMS) - PRIVATE - ALIKE
    assert {s.id for s in CATALOGUE_FORMS} == {s.id for s in (*CATALOGUE, *MOTOR)} | ALIKE


def test_every_effect_has_two_laws_at_least_that_the_catalogue_has_not() -> None:
    count = Counter(s.id.partition(":")[0] for s in OTHER_FORMS)
    assert min(count[s.id] for s in (*CATALOGUE, *MOTOR)) >= 2


def test_effects_come_in_turn_and_forms_belong_to_them() -> None:
    for laws in ("catalogue", "other", "mixed"):
        wanted = Wanted(3, ("single",), laws, "none")
        drawn = [order(wanted, k).suspects[0].id for k in range(4 * len(CATALOGUE))]
        effects = Counter(name.partition(":")[0] for name in drawn)
        assert effects == {s.id: 4 for s in CATALOGUE}
        known = {s.id for s in CATALOGUE_FORMS}
        others = sum(name not in known for name in drawn)
        assert {"catalogue": others == 0, "other": others == len(drawn)}.get(laws, 20 < others < 52)
    every = Wanted(3, KINDS, "mixed", "none")
    assert [order(every, k).kind for k in range(len(KINDS))] == list(KINDS)
    first, second = order(Wanted(3, ("pair",), "mixed", "none"), 7).suspects
    assert first.id.partition(":")[0] != second.id.partition(":")[0]


def test_the_latest_forms_are_drawn_where_an_effect_has_one_and_its_other_ones_else() -> None:
    assert {s.id for s in LAWS["latest"]} == LATEST <= {s.id for s in OTHER_FORMS}
    fresh = {name.partition(":")[0] for name in LATEST}
    others = {s.id for s in OTHER_FORMS}
    wanted = Wanted(3, (*KINDS, "single", "single"), "latest", "none")
    for number in range(12 * len(CATALOGUE)):
        asked = order(wanted, number)
        for suspect in asked.suspects if asked.kind in ("single", "pair", "motor") else ():
            assert suspect.id in (LATEST if suspect.id.partition(":")[0] in fresh else others)
    assert {s.id.partition(":")[0] for s in concealable("latest")} == {s.id for s in (*CATALOGUE, *MOTOR)}
    for laws in ("catalogue", "other", "mixed"):
        assert concealable(laws) == LAWS[laws]


def test_a_trial_depends_on_its_number_and_not_on_how_many_are_made(tmp_path: Path) -> None:
    wanted = Wanted(5, ("single", "none"), "other", "some")
    make(wanted, 2, tmp_path / "both")
    make(wanted, 1, tmp_path / "second", first=1)
    files = sorted(p for p in (tmp_path / "second" / "00001").rglob("*") if p.is_file())
    assert len(files) >= 4
    for path in files:
        other = tmp_path / "both" / path.relative_to(tmp_path / "second")
        assert path.read_bytes() == other.read_bytes(), path.name


def test_the_truth_stands_beside_the_recordings_it_belongs_to(tmp_path: Path) -> None:
    make(Wanted(5, ("single", "pair"), "catalogue", "none"), 2, tmp_path)
    for folder in sorted(tmp_path.iterdir()):
        truth, angles = _truth(folder)
        for k, entry in enumerate(truth["recordings"], start=1):
            seen = _read(folder / entry["file"])
            assert len(seen["time_s"]) == entry["rows"] == len(angles[f"joint_rad_{k}"])
            np.testing.assert_allclose(seen["time_s"], angles[f"time_s_{k}"], atol=1e-6)
            noise = seen["joint_position_rad"] - entry["zeros"]["joint_position"] - angles[f"joint_rad_{k}"]
            assert np.std(noise) < 1.2 * truth["noise_floor_rad"]
        added = angles["joint_rad_1"] - angles["plain_rad_1"]
        assert 0.01 * truth["loop_rad"] < np.std(added) < 2.0 * truth["loop_rad"]
        assert all(e["effect"] not in (folder / "joint.toml").read_text() for e in truth["effects"])
        assert 9000 < sum(entry["rows"] for entry in truth["recordings"]) < 13000


def test_a_neighbour_that_turns_the_base_is_known_by_its_angle_and_one_that_loads_it_by_its_load(
    tmp_path: Path,
) -> None:
    rng = np.random.default_rng(5)
    forms = {s.id: s for s in (*CATALOGUE_FORMS, *OTHER_FORMS)}
    turns = [_turns(rng, (forms["gravity_load:tilting_base"],)) for _ in range(50)]
    assert min(turns) >= 0.4
    assert max(turns) <= 1.4
    assert {_turns(rng, (forms["crosstalk:dragged"],)) for _ in range(50)} == {0.0}
    any_of_them = [_turns(rng, (forms["bearing_friction:dahl"],)) for _ in range(200)]
    assert 60 < sum(t > 0.0 for t in any_of_them) < 140
    for form, unit, laws in (
        ("gravity_load:leaning_base", "rad", "catalogue"),
        ("crosstalk:stopped", "Nm", "other"),
    ):
        wanted = Wanted(7, ("single",), laws, "some")
        number = next(k for k in range(400) if order(wanted, k).suspects[0].id == form)
        assert draw_world(wanted, number).other == f"other_neighbour_{unit}"


def test_a_vague_drive_is_the_same_trial_stated_by_order_of_magnitude(tmp_path: Path) -> None:
    for amount in ("all", "vague"):
        make(Wanted(11, ("single", "none"), "other", amount), 2, tmp_path / amount)
    for number in ("00000", "00001"):
        known, vague = (tmp_path / amount / number for amount in ("all", "vague"))
        recordings = sorted(p.relative_to(known) for p in (known / "recordings").rglob("*.gz"))
        assert recordings
        assert all((known / p).read_bytes() == (vague / p).read_bytes() for p in recordings)
        (stated, stage), (guessed, guess) = (_stated(folder) for folder in (known, vague))
        assert max(stated.values()) <= 0.3
        assert guessed == {"input_radius_m": 0.02} | dict.fromkeys(stated, 1.0)
        off = {key: guess[key] / stage[key] for key in stage}
        assert all(off[key] == 1.0 for key in off.keys() - guessed.keys())
        assert all(0.39 < off[key] < 2.6 for key in stated)
        assert max(abs(np.log(off[key])) for key in stated) > 0.3
        truth = _truth(vague)[0]
        assert truth["effects"] == _truth(known)[0]["effects"]
        assert "vague" in truth["imperfections"]


def _stated(folder: Path) -> tuple[dict[str, float], dict[str, float]]:
    joint = tomllib.loads((folder / "joint.toml").read_text())
    return joint["tolerance"], joint["drive"]["stage"][0]


def test_a_companion_is_smaller_than_what_the_trial_is_about() -> None:
    """Where that is small itself: beside a large one every companion is."""
    for number in (3, 7):
        main, *companions = draw_world(Wanted(4, ("single",), "other", "all"), number).hidden
        assert main.role == "main"
        assert main.sized.size < 0.1
        assert len(companions) == 2
        assert all(c.role == "companion" and c.sized.size <= 0.5 * main.sized.size for c in companions)


@pytest.mark.parametrize("laws", ["catalogue", "other"])
def test_friction_of_the_motor_is_in_its_torque_alone(laws: str, tmp_path: Path) -> None:
    make(Wanted(5, ("motor",), laws, "none"), 3, tmp_path)
    forms = set()
    for folder in sorted(tmp_path.iterdir()):
        truth, true = _truth(folder)
        (hidden,) = truth["effects"]
        assert (truth["kind"], hidden["effect"], hidden["channel"]) == (
            "motor",
            "motor_friction",
            "motor_torque_Nm",
        )
        forms.add(hidden["form"])
        np.testing.assert_array_equal(true["joint_rad_1"], true["plain_rad_1"])
        added = true["joint_motor_Nm_1"] - true["plain_motor_Nm_1"]
        # as large as the truth says: in loops of the joint's angle, by the drive's ratio and its compliance
        ratio = truth["true"]["input_radius_m"] / truth["true"]["output_radius_m"]
        apparent = truth["plain"]["compliance"] / ratio * np.std(added) / truth["loop_rad"]
        assert apparent == pytest.approx(hidden["size"], rel=0.15)
        seen = _read(folder / truth["recordings"][0]["file"])["motor_torque_Nm"]
        noise = np.std(seen - true["joint_motor_Nm_1"]) / np.ptp(true["joint_motor_Nm_1"])
        assert 0.0018 < noise < 0.011
    assert (forms == {"catalogue"}) == (laws == "catalogue")


def test_imperfections_are_there_and_as_large_as_the_truth_says(tmp_path: Path) -> None:
    make(Wanted(8, ("none",), "catalogue", "all"), 1, tmp_path)
    folder = tmp_path / "00000"
    truth, angles = _truth(folder)
    how, sensors = truth["imperfections"], truth["sensors"]
    assert truth["effects"] == []
    assert len({entry["session"] for entry in truth["recordings"]}) == len(truth["recordings"]) >= 2
    for k, entry in enumerate(truth["recordings"], start=1):
        assert entry["history_s"] == pytest.approx(how["history"]["lasts_s"] + 1.1, abs=0.1)
        assert entry["file"].startswith(f"recordings/session-{k}/")
        seen = _read(folder / entry["file"])
        steps = np.diff(seen["time_s"])
        assert np.all(steps > 0)
        middle = np.median(steps)
        # uneven by as much as was drawn, but for rows that are missing
        assert np.percentile(np.abs(steps / middle - 1), 80) < 2 * how["uneven"]["jitter"] + 0.05
        assert np.percentile(np.abs(steps / middle - 1), 50) > 0.2 * how["uneven"]["jitter"]
        assert np.max(steps) > 4 * middle
        quiet = np.isfinite(seen["joint_position_rad"])
        noise = (seen["joint_position_rad"] - angles[f"joint_rad_{k}"])[quiet]
        noise -= np.median(noise)
        factor = how["noise_misstated"]["joint_position"]
        coarse = how["quantisation"]["factor"] if "joint_position" in how["quantisation"]["channels"] else 1.0
        expected = np.hypot(
            factor * sensors["joint_position_noise_rad"],
            coarse * sensors["joint_position_resolution_rad"] / 12**0.5,
        )
        spread = np.diff(np.percentile(noise, (15.865, 84.135)))[0] / 2
        assert spread == pytest.approx(np.hypot(expected, _lagged(how, truth)), rel=0.3)


def test_a_lag_is_no_larger_in_any_recording_than_the_truth_says(tmp_path: Path) -> None:
    """Joints that rest in one recording and move in another: what is late shows where they move."""
    make(Wanted(11, ("none",), "catalogue", "all"), 10, tmp_path)
    quickest = []
    for folder in sorted(tmp_path.iterdir()):
        truth, angles = _truth(folder)
        for late in (truth["imperfections"]["late"], truth["imperfections"]["low_pass"]):
            if late["channel"] == "joint_torque":
                continue
            moved = []
            for k, entry in enumerate(truth["recordings"], start=1):
                time = _read(folder / entry["file"])["time_s"]
                moved.append(float(np.std(np.gradient(angles[f"joint_rad_{k}"], time))) * late["lag_s"])
            quickest.append(max(moved) / (late["size_of_floor"] * truth["noise_floor_rad"]))
    assert len(quickest) >= 4
    assert max(quickest) < 1.5
    assert min(quickest) > 0.5


def _lagged(how: dict[str, Any], truth: dict[str, Any]) -> float:
    """What lag leaves between joint encoder and joint, RMS, about."""
    shares = [how[n]["size_of_floor"] for n in ("late", "low_pass") if how[n]["channel"] == "joint_position"]
    return float(np.sqrt(np.sum(np.square(shares)))) * truth["noise_floor_rad"] if shares else 0.0


def test_sessions_stand_apart_and_what_depends_on_what_is_in_the_truth(tmp_path: Path) -> None:
    make(Wanted(4, ("sessions",), "catalogue", "none"), len(CASES), tmp_path)
    seen = set()
    for folder in sorted(tmp_path.iterdir()):
        truth, angles = _truth(folder)
        case = next(c for c in CASES if c.name == truth["case"])
        seen.add(case.name)
        assert {(d["parameter"], d["on"]) for d in truth["depends_on"]} == set(case.depends)
        channel = f"other_{case.condition}"
        assert f'{case.condition} = "{channel}"' in (folder / "joint.toml").read_text()
        tight = {entry["session"]: entry["pretension_N"] for entry in truth["recordings"]}
        assert len(tight) == 2
        apart = abs(np.log(tight["1"] / tight["2"]))
        assert (apart > 0.14) == (("pretension_N", "session") in case.depends)
        stands = [np.mean(_read(folder / entry["file"])[channel]) for entry in truth["recordings"]]
        assert max(stands) - min(stands) > 0.3
        assert all(e["effect"] == "routing_friction" for e in truth["effects"])
        if any(on == case.condition for _, on in case.depends):
            # what depends on the stand adds more where it stands further
            loops = [
                np.ptp(angles[f"joint_rad_{k}"] - angles[f"plain_rad_{k}"]) for k in range(1, len(stands) + 1)
            ]
            assert loops[int(np.argmax(stands))] > loops[int(np.argmin(stands))]
    assert seen == {c.name for c in CASES}


def test_what_cannot_be_made_ends_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for more in (["--kinds", "several"], ["--count", "0"], ["--seed", "-1"]):
        assert main(["--seed", "1", "--count", "1", "--out", str(tmp_path), *more]) == 2
        message = capsys.readouterr().err
        assert message.startswith("error: ")
        assert message.count("\n") == 1
        assert "accepted" in message
    with pytest.raises(PlantError, match="catalogue, other, mixed"):
        Wanted(1, ("single",), "mine", "none")
