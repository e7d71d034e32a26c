"""The command line as a whole: every command loads, help is had without waiting, a bare call is no error."""

from __future__ import annotations

import gzip
import json
import os
import re
import signal
import subprocess
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import ModuleType

import polars as pl
import pytest

from cablecomp import __version__
from cablecomp.cli import app, main
from cablecomp.errors import InputError

CONFIGS = Path(__file__).parents[2] / "configs"

HEAVY = {"numba", "scipy", "polars", "plotly", "control", "can", "pydantic"}


def test_help_lists_every_command_with_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    said = capsys.readouterr().out
    for name in app.COMMANDS:
        assert re.search(rf"^  {name} +[A-Z]", said, re.MULTILINE)


@pytest.mark.parametrize("name", app.COMMANDS)
def test_every_command_has_help_of_its_own(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "-h"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f" {name} " in said.split("Options:")[0]
    assert app.first_line(app.COMMANDS[name]) in said


def test_help_imports_no_solver_and_no_compiler() -> None:
    code = "import sys; from cablecomp.cli import main; main(['--help']); print(*sys.modules)"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not HEAVY & set(said.splitlines()[-1].split())


def test_ctrl_c_is_heard_though_what_is_imported_swallows_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As extension modules of packages do that others can do without: the joint of a run would have moved."""

    def swallowing(name: str) -> ModuleType:
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        return import_module(name)

    monkeypatch.setattr(app, "import_module", swallowing)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # else ignored, in the background
    try:
        assert main(["info", "nothing.toml"]) == app.INTERRUPTED
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert capsys.readouterr().err == "cablecomp: stopped by the user\n"


def test_a_bare_call_shows_help_and_is_no_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert "Commands:" in capsys.readouterr().out


def test_the_version_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"cablecomp {__version__}\n"


def test_an_unknown_command_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fly"]) == 2
    said = capsys.readouterr().err
    assert "fly" in said
    assert said.count("\n") == 1


def test_a_wrong_word_is_answered_with_the_nearest_and_whose_help_to_read(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["calibrat"]) == 2
    assert "did you mean `calibrate`?; see cablecomp --help" in capsys.readouterr().err
    assert main(["info"]) == 2
    said = capsys.readouterr().err
    assert "--config" in said
    assert said.endswith("; see cablecomp info --help\n")


def test_an_option_given_twice_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "--config", "capstan-arm", "--config", "wrist-capstan"]) == 2
    assert "--config is given 2 times" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["info", "design"])
def test_a_result_is_had_as_json(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--config", "capstan-arm", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["name"] == "capstan-arm"


@pytest.mark.parametrize("name", sorted(set(app.COMMANDS) - {"guide", "example"}))
def test_every_command_with_a_result_gives_it_as_json(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    main([name, "--help"])
    assert "--json" in capsys.readouterr().out


def test_what_is_written_is_said_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answers = {
        "output_radius_mm": 30, "input_radius_mm": 10, "cable": "steel-7x7", "cable_diameter_mm": 1,
        "free_length_mm": 200, "output_turns": 1, "input_turns": 3, "joint_torque_max_Nm": 2,
    }  # fmt: skip
    given = [word for key, value in answers.items() for word in ("--set", f"{key}={value}")]
    assert main(["init", *given, "--out", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["written"] == [str(tmp_path / "joint.toml")]
    rows = {"time_s": [0.0, 0.1, 0.2], "q_in": [0.0, 0.1, 0.0]}
    pl.DataFrame(rows).write_csv(tmp_path / "a.csv")
    read = ["--map", "motor_position_rad=q_in,unit=rad", "--map", "auto"]
    to = str(tmp_path / "b.csv")
    assert main(["convert", str(tmp_path / "a.csv"), to, *read, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["written"], found["rows"]) == (to, 3)
    assert found["channels"] == ["time_s", "motor_position_rad"]
    assert main(["inspect", str(tmp_path / "a.csv"), *read, "--save", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)


OUTS = {
    "calibrate": ["a.csv", "--config", "nowhere.toml"],
    "demo": [],
    "design": ["--config", "nowhere.toml"],
    "diagnose": ["a.csv", "--config", "nowhere.toml"],
    "export": ["--config", "nowhere.toml", "--c"],
    "init": ["--set", "circuit=square"],
    "prove": ["--kinds", "square"],
    "replay": ["a.csv", "--config", "nowhere.toml"],
    "run": ["--config", "nowhere.toml"],
    "study": [],
}


@pytest.mark.parametrize("name", OUTS)
@pytest.mark.parametrize("below", ["", "folder"])
def test_a_folder_that_cannot_be_one_is_refused_before_any_work(
    name: str, below: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    taken = tmp_path / "taken"
    taken.write_text("mine", encoding="utf-8")
    assert main([name, *OUTS[name], "--out", str(taken / below)]) == 2
    said = capsys.readouterr().err
    assert "is a file" in said
    assert str(taken) in said
    assert taken.read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize(("command", "option"), [("info", "--figures"), ("design", "--out")])
def test_the_option_that_takes_a_folder_is_named(
    command: str, option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    taken = tmp_path / "taken"
    taken.write_text("mine", encoding="utf-8")
    assert main([command, "--config", "wrist-capstan", option, str(taken)]) == 2
    assert f"{taken}: is a file; {option} takes a directory" in capsys.readouterr().err


@pytest.mark.parametrize("name", OUTS)
def test_a_folder_that_the_system_refuses_is_refused_before_any_work(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if not Path("/proc/self").is_dir():
        pytest.skip("there is no folder here that takes no file whoever writes it")
    assert main([name, *OUTS[name], "--out", "/proc/foo"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("cablecomp: /proc/foo: ")
    assert "written" in said
    assert "choose another directory" in said


def test_a_packed_recording_with_an_unpacked_name_is_taken_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = "".join(f"{1e-3 * k},{2e-3 * k},{7e-4 * k},0.1\n" for k in range(200))
    head = "time_s,motor_position_rad,joint_position_rad,joint_torque_Nm\n"
    packed = tmp_path / "night.csv"
    packed.write_bytes(gzip.compress((head + rows).encode()))
    out = str(tmp_path / "out")
    assert main(["replay", str(packed), "--config", "wrist-capstan", "--no-bounds", "--out", out]) == 0
    assert "note: is gzip although it is named .csv; read unpacked" in capsys.readouterr().out


def test_of_a_joint_without_a_load_no_straight_line_over_the_load_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stated = (CONFIGS / "joints" / "wrist-capstan.toml").read_text()
    (tmp_path / "joint.toml").write_text(f'{stated}\n[observer]\nload = "none"\n')
    rows = "".join(f"{1e-3 * k},{2e-3 * k},{7e-4 * k}\n" for k in range(200))
    (tmp_path / "free.csv").write_text(f"time_s,motor_position_rad,joint_position_rad\n{rows}")
    words = [str(tmp_path / "free.csv"), "--config", str(tmp_path / "joint.toml"), "--no-bounds"]
    assert main(["replay", *words, "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "prediction error" in said
    assert "best straight line" not in said


@pytest.mark.parametrize(
    "words", [["inspect", "a.csv"], ["guide"], ["example"], ["info", "--config", "wrist-capstan"]]
)
def test_who_has_read_enough_makes_no_error(words: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time_s,motor_position_rad\n0,0\n1,1\n2,0\n")
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "cablecomp.cli", *words]
    done = subprocess.run(
        command, stdout=writer, stderr=subprocess.PIPE, cwd=tmp_path, timeout=120, check=False
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"")


def test_an_effect_that_there_is_not_is_told_with_the_file_and_the_nearest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["example", "joints/wrist-capstan", "--out", str(tmp_path)]) == 0
    path = tmp_path / "wrist-capstan.toml"
    path.write_text(path.read_text() + '\n[[effect]]\nid = "viscous_slipp"\n')
    assert main(["info", "--config", str(path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"cablecomp: {path}: key `effect.id`")
    assert "did you mean `viscous_slip`?" in said


@pytest.mark.parametrize("words", [["run", "--config", "wrist-capstan", "--sim", "--fast"], ["demo"]])
def test_who_waits_for_a_compiler_is_told_so_first(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def compiler(*_: object) -> None:
        raise InputError("the compiler would begin here")

    monkeypatch.setattr("cablecomp.mechanics.jit.is_compiled", lambda name: False)
    monkeypatch.setattr("cablecomp.observer.first_use.compile_first", compiler)
    assert main([*words, "--out", str(tmp_path / "out")]) == 2
    first, last = capsys.readouterr().err.splitlines()
    assert first.startswith("compiling the kernels, once for this version")
    assert last == "cablecomp: the compiler would begin here"


@pytest.mark.skipif(os.name == "nt", reason="a shell that closes an output before a command begins")
@pytest.mark.parametrize("words", ["--version", "--help", "guide"])
def test_a_closed_output_is_no_error(words: str) -> None:
    command = f"exec '{sys.executable}' -m cablecomp.cli {words} >&-"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("place", [".", "/"])
def test_a_folder_for_a_file_is_said(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["guide", "--html", place]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"cablecomp: {place}: cannot be written")
    assert len(said.splitlines()) == 1
