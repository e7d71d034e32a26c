"""Every block of code in the README and in the guide runs as it stands, or says in the source why not.

A document's blocks run one after the other in a folder of their own. Commands of cablecomp and Python run in
this process, anything else in a shell. A Python or TOML block whose first line is a comment that names a file
is that file, too. A block after `<!-- not run: REASON -->` (which no reader sees) is not run.
"""

from __future__ import annotations

import importlib
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

import pytest

from cablecomp.cli import main
from cablecomp.guide.topics import FOLDER

ROOT = Path(__file__).parents[2]
DOCUMENTS = (ROOT / "README.md", *sorted(FOLDER.glob("*.md")))
KINDS = {"bash", "python", "toml", "text"}
MOST_NOT_RUN = 8
BLOCK = re.compile(
    r"(?:<!-- not run: (?P<reason>[^>]*?) -->\n(?:<!--[^>]*-->\n)*)?```(?P<kind>\w*)\n(?P<text>.*?)^```$",
    re.S | re.M,
)


class Block(NamedTuple):
    """A fenced block; `reason` why it is not run, or None."""

    kind: str
    text: str
    reason: str | None


def blocks(path: Path) -> list[Block]:
    found = BLOCK.finditer(path.read_text(encoding="utf-8"))
    return [Block(m["kind"], m["text"], m["reason"]) for m in found]


@pytest.fixture
def _no_effect_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    module = importlib.import_module("cablecomp.effects.catalogue")
    monkeypatch.setattr(module, "_registered", dict(module._registered))


@pytest.mark.usefixtures("_no_effect_stays")
@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_every_block_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for block in blocks(path):
        named = re.match(r"# (\S+\.(?:py|toml))\n", block.text)
        if named:
            Path(named[1]).write_text(block.text, encoding="utf-8")
        if block.kind == "toml":
            tomllib.loads(block.text)
        elif block.reason is None and block.kind == "python":
            exec(compile(block.text, path.name, "exec"), {"__name__": "block"})
        elif block.reason is None and block.kind == "bash":
            run(block.text)


def run(text: str) -> None:
    lines = [shlex.split(line, comments=True) for line in text.replace("\\\n", " ").splitlines()]
    if all(line[0] == "cablecomp" and not set("|&;<>$*`") & set("".join(line)) for line in lines if line):
        assert [main(line[1:]) for line in lines if line] == [0 for line in lines if line], text
        return
    tools = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", text],
        env={**os.environ, "PATH": tools, "PYTHONPATH": str(ROOT)},
        check=False,
    )
    assert done.returncode == 0, text


def test_few_blocks_are_not_run_and_each_says_why() -> None:
    every = [(path.stem, block) for path in DOCUMENTS for block in blocks(path)]
    left_out = [(name, block.text.split("\n")[0]) for name, block in every if block.reason is not None]
    assert len(left_out) <= MOST_NOT_RUN, left_out
    for name, block in every:
        assert block.reason is None or len(block.reason.split()) >= 4, (name, block.text)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_every_fence_is_a_block_of_a_known_kind(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(re.findall(r"^ *(?:```|~~~)", text, re.M)) == 2 * len(blocks(path))
    assert {block.kind for block in blocks(path)} <= KINDS
    assert text.count("<!-- not run") == sum(block.reason is not None for block in blocks(path))


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_lines_are_short_and_a_title_comes_first(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [number for number, line in enumerate(lines, 1) if len(line) > 120] == []
    assert lines[0].startswith("# ")


def test_the_readme_is_short() -> None:
    assert len(DOCUMENTS[0].read_text(encoding="utf-8").split()) <= 900


def test_what_is_referred_to_is_there() -> None:
    """Files that a document names, and topics that it sends to."""
    for path in DOCUMENTS:
        text = path.read_text(encoding="utf-8")
        for name in re.findall(r"\b(?:tests|cablecomp|firmware_sim|configs)/[\w./-]+\b", text):
            assert (ROOT / name).exists(), (path.name, name)
        for name in re.findall(r"`cablecomp guide ([a-z-]+)`", text):
            assert main(["guide", name]) == 0, (path.name, name)
