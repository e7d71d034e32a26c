"""The command line as a whole: every command loads, help is had without waiting, a bare call is no error."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import pytest

from cablecomp import __version__
from cablecomp.cli import app, main

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


def test_an_option_given_twice_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "--config", "capstan-arm", "--config", "wrist-capstan"]) == 2
    assert "--config is given 2 times" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["info", "design"])
def test_a_result_is_had_as_json(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--config", "capstan-arm", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["name"] == "capstan-arm"
