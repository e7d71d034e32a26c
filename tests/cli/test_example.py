"""Examples that come with the project: each is found by name, loads, and is copied whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cablecomp import examples, load_joint
from cablecomp.cli import main
from cablecomp.control.options import load_control
from cablecomp.errors import InputError
from cablecomp.links import load_link
from firmware_sim.scenario import load_scenario

LOADERS: dict[str, Callable[[Any], Any]] = {"joints": load_joint, "links": load_link, "control": load_control}


@pytest.mark.parametrize(
    ("kind", "name"), [(kind, name) for kind in LOADERS for name in examples.names(kind)]
)
def test_a_copy_of_an_example_loads_as_the_example(kind: str, name: str, tmp_path: Path) -> None:
    assert main(["example", f"{kind}/{name}", "--out", str(tmp_path)]) == 0
    copied = LOADERS[kind](tmp_path / f"{name}.toml")
    original = LOADERS[kind](examples.example(kind, name))
    changes = {"folder": Path()} if kind == "links" else {}
    assert copied.model_copy(update=changes) == original.model_copy(update=changes)


@pytest.mark.parametrize("command", ["info", "design", "calibrate a.csv", "inspect a.csv"])
def test_a_name_that_is_no_example_is_told_which_are(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text("time_s,motor_position_rad\n0,0\n1,1\n")
    assert main([*command.split(), "--config", "capstan-am"]) == 2
    said = capsys.readouterr().err
    assert said.startswith(
        "cablecomp: capstan-am: no such file here, and no example of joints; those are capstan-arm, "
    )


def test_a_bare_name_stands_for_an_example_unless_such_a_file_is_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mit-udp").mkdir()  # a folder of that name hides nothing
    assert load_joint("capstan-arm") == load_joint(examples.example("joints", "capstan-arm"))
    assert load_link("mit-udp") == load_link(examples.example("links", "mit-udp"))
    Path("capstan-arm").write_text("schema = 2\n", encoding="utf-8")
    with pytest.raises(InputError, match="schema"):
        load_joint("capstan-arm")


def test_a_name_stands_for_an_example_as_the_list_of_examples_writes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert load_joint("joints/capstan-arm") == load_joint("capstan-arm")
    assert load_link("links/mit-udp") == load_link("mit-udp")
    assert load_control("control/wrist-capstan") == load_control("wrist-capstan")
    assert load_control("wrist-capstan") == load_control(examples.example("control", "wrist-capstan"))
    with pytest.raises(
        InputError, match=r"^links/mit-udp: no such file here, and no example of joints; those are "
    ):
        load_joint("links/mit-udp")
    Path("links").mkdir()
    Path("links/mit-udp").write_text("schema = 2\n", encoding="utf-8")
    with pytest.raises(InputError, match="schema"):
        load_link("links/mit-udp")


@pytest.mark.parametrize("load", LOADERS.values())
def test_what_is_no_path_is_said(load: Callable[[Any], object]) -> None:
    for given, shown in ((None, "a NoneType"), (3, "a int"), ([], "a list")):
        with pytest.raises(
            InputError, match=f"^{shown} is no path; give a file's path or an example's name$"
        ):
            load(given)


def test_a_name_of_two_kinds_is_asked_about(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["example", "wrist-capstan"]) == 2
    said = capsys.readouterr().err
    assert "joints/wrist-capstan" in said
    assert "control/wrist-capstan" in said


def test_a_file_that_differs_is_not_overwritten(tmp_path: Path) -> None:
    mine = tmp_path / "cablecomp_joint.dbc"
    mine.write_text("mine", encoding="utf-8")
    assert main(["example", "wrist-virtual", "--out", str(tmp_path)]) == 2
    assert mine.read_text(encoding="utf-8") == "mine"
    assert [p.name for p in tmp_path.iterdir()] == [mine.name]


def test_the_simulated_wrist_has_the_motor_and_the_link_that_its_control_file_states() -> None:
    stated = load_control(examples.example("control", "wrist-capstan")).motor
    simulated = load_scenario(examples.example("scenarios", "wrist"))
    told = load_link("mit-udp").joint[0].motor
    assert told is not None
    assert simulated.motor["rotor_inertia_kgm2"] == stated.inertia_kgm2
    assert simulated.motor["viscous_Nms_per_rad"] == stated.viscous_Nms_per_rad
    assert simulated.motor["coulomb_Nm"] == stated.coulomb_Nm
    assert simulated.motor["current_bandwidth_Hz"] == stated.torque_bandwidth_Hz
    assert simulated.link["inertia_kgm2"] == stated.output_inertia_kgm2
    assert simulated.link["viscous_Nms_per_rad"] == stated.output_viscous_Nms_per_rad
    assert told.stiffness_Nm_per_rad == stated.stiffness_Nm_per_rad
    assert told.damping_Nms_per_rad == stated.damping_Nms_per_rad


def test_every_example_is_listed_with_what_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["example"]) == 0
    said = capsys.readouterr().out
    for kind in examples.KINDS:
        for name in examples.names(kind):
            assert f"{kind}/{name} " in said


def test_the_list_and_what_was_written_are_had_as_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["example", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert set(listed) == {f"{kind}/{name}" for kind in examples.KINDS for name in examples.names(kind)}
    assert main(["example", "capstan-arm", "--out", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"written": [str(tmp_path / "capstan-arm.toml")]}
