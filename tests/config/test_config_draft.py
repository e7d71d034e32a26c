"""`cablecomp init`: what a person knows becomes a joint and a link that load, tolerances as wide as the knowledge."""

from __future__ import annotations

import io
import math
import tomllib
from pathlib import Path

import pytest

from cablecomp.cli import main
from cablecomp.config import load_joint
from cablecomp.config.cables import CABLES
from cablecomp.config.draft import PRETENSION
from cablecomp.links.load import load_link

KNOWN = {
    "output_radius_mm": 30.0,
    "input_radius_mm": 10.0,
    "cable": "steel-7x7",
    "cable_diameter_mm": 0.5,
    "free_length_mm": 100.0,
    "output_turns": 1.5,
    "input_turns": 2.0,
    "joint_torque_max_Nm": 2.0,
}


class Terminal(io.StringIO):
    """Somebody who answers."""

    def isatty(self) -> bool:
        return True


def init(out: Path, **more: object) -> int:
    told = [f"--set={k}={v}" for k, v in {**KNOWN, **more}.items()]
    return main(["init", "--out", str(out), *told])


def test_values_and_tolerances_follow_from_what_is_known(tmp_path: Path) -> None:
    assert init(tmp_path, pretension_N=40.0, pretension_set="weight", drive="moteus", name='my "wrist"') == 0
    joint = load_joint(tmp_path / "joint.toml")
    (stage,) = joint.drive.stage
    cable = CABLES["steel-7x7"]
    assert stage.output_radius_m == pytest.approx(0.03 + 0.00025)  # bare radius + half the cable
    assert pytest.approx(cable.modulus_Pa * math.pi * 0.25e-6 / 4, rel=1e-5) == stage.EA_N
    assert stage.wrap_output_rad == pytest.approx(3.0 * math.pi, rel=1e-5)
    assert joint.tolerance["EA_N"] == cable.EA_spread
    assert joint.tolerance["pretension_N"] == PRETENSION["weight"]
    assert [j.name for j in load_link(tmp_path / "link.toml").joint] == ['my "wrist"'] == [joint.name]


def test_a_joint_may_have_any_name(tmp_path: Path) -> None:
    assert init(tmp_path, drive="moteus", name="🦾\x7f") == 0
    assert load_joint(tmp_path / "joint.toml").name == "🦾\x7f"
    assert [j.name for j in load_link(tmp_path / "link.toml").joint] == ["🦾\x7f"]


@pytest.mark.parametrize("kind", CABLES)
def test_every_cable_makes_a_joint_and_an_unknown_pretension_is_an_order_of_magnitude(
    tmp_path: Path, kind: str
) -> None:
    assert init(tmp_path, cable=kind, radii="effective") == 0
    joint = load_joint(tmp_path / "joint.toml")
    assert joint.tolerance["pretension_N"] == 1.0
    assert joint.drive.stage[0].output_radius_m == pytest.approx(0.03)
    text = (tmp_path / "joint.toml").read_text()
    assert tomllib.loads(text)["drive"]["stage"][0]["EA_N"] == pytest.approx(
        CABLES[kind].EA_N(5e-4), rel=1e-5
    )


def test_everything_wrong_is_said_at_once_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", "--out", str(tmp_path), "--set", "name=a", "--set", "name=b"]) == 2
    assert capsys.readouterr().err == "cablecomp: --set: name is given twice; give it once\n"
    assert main(["init", "--out", str(tmp_path), "--set", "cable=stel", "--set", "output_radius=30"]) == 2
    said = capsys.readouterr().err
    assert "steel-7x7" in said
    assert "did you mean `output_radius_mm`" in said
    assert not list(tmp_path.iterdir())


def test_a_file_of_answers_is_read_as_any_configuration_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answers = tmp_path / "idea.toml"
    answers.write_text("")
    assert main(["init", "--from", str(answers), "--out", str(tmp_path)]) == 2
    assert "idea.toml: missing key `cable`" in capsys.readouterr().err
    answers.write_text("output_radius_m = 0.03\n")
    assert main(["init", "--from", str(answers), "--out", str(tmp_path)]) == 2
    assert "did you mean `output_radius_mm = 30`?" in capsys.readouterr().err


def test_a_number_is_a_name_as_the_error_says_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answers = tmp_path / "idea.toml"
    answers.write_text("".join(f"{k} = {v if isinstance(v, float) else repr(v)}\n" for k, v in KNOWN.items()))
    command = ["init", "--from", str(answers), "--out", str(tmp_path)]
    assert main([*command, "--set", "name=5"]) == 2
    assert "idea.toml with --set: key `name` is 5.0; text in quotes is accepted" in capsys.readouterr().err
    assert main([*command, "--set", 'name="5"']) == 0
    assert load_joint(tmp_path / "joint.toml").name == "5"


def test_a_file_that_differs_is_not_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert init(tmp_path) == 0
    before = (tmp_path / "joint.toml").read_text()
    assert init(tmp_path, cable_diameter_mm=0.6) == 2
    assert "differs" in capsys.readouterr().err
    assert (tmp_path / "joint.toml").read_text() == before


@pytest.mark.parametrize("there", [b"\xff\xfe\x00", None], ids=["no text", "folder"])
def test_whatever_stands_where_a_joint_is_to_be_written_stays(
    there: bytes | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "joint.toml"
    if there is None:
        place.mkdir()
    else:
        place.write_bytes(there)
    assert init(tmp_path) == 2
    assert f"{place}: is there already, and differs" in capsys.readouterr().err
    assert place.is_dir() if there is None else place.read_bytes() == there


def test_a_metre_for_a_millimetre_is_asked_about(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert init(tmp_path, output_radius_mm=30_000.0) == 0
    assert "output_radius_m" in capsys.readouterr().err


def asked(out: Path, answers: list[str], monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr("sys.stdin", Terminal("".join(f"{a}\n" for a in answers)))
    return main(["init", "--out", str(out)])


DIALOGUE = ["", "", "30", "10", "", "steel-7x7", "0.5", "", "100", "1.5", "2", "", "", "2", *[""] * 8]


def test_the_questions_lead_to_what_the_flags_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert init(tmp_path / "flags") == 0
    assert asked(tmp_path / "asked", DIALOGUE, monkeypatch) == 0
    flags, told = (tomllib.loads((tmp_path / d / "joint.toml").read_text()) for d in ("flags", "asked"))
    assert told == flags


def test_an_answer_that_will_not_do_is_asked_for_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = [
        *DIALOGUE[:2],
        "thirty",
        "-3",
        *DIALOGUE[2:5],
        "rope",
        *DIALOGUE[5:14],
        "50",
        "40",
        "60",
        *DIALOGUE[16:],
    ]
    assert asked(tmp_path, wrong, monkeypatch) == 0
    limits = load_joint(tmp_path / "joint.toml").limits
    assert (limits.joint_position_min_rad, limits.joint_position_max_rad) == pytest.approx(
        (math.radians(50.0), math.radians(60.0)), rel=1e-5
    )
    said = capsys.readouterr().out
    assert "a number is accepted" in said
    assert "'tungsten'" in said


@pytest.mark.parametrize("answered", [0, 5])
def test_who_has_enough_of_questions_gets_one_line(
    answered: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert asked(tmp_path, DIALOGUE[:answered], monkeypatch) == 130
    assert capsys.readouterr().err.strip().splitlines()[-1] == "cablecomp: stopped by the user"
    assert not list(tmp_path.iterdir())


def test_nothing_is_asked_where_a_joint_is_already(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert init(tmp_path) == 0
    capsys.readouterr()
    assert asked(tmp_path, DIALOGUE, monkeypatch) == 2
    said = capsys.readouterr()
    assert "is there already" in said.err
    assert "output_radius_mm" not in said.out
