"""A stranger finds his room: the README names every folder, every package says what it is and where to start."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = [
    p.parent for top in ("cablecomp", "firmware_sim") for p in sorted((ROOT / top).rglob("__init__.py"))
]
NAMES = [str(p.relative_to(ROOT)) for p in PACKAGES]


def test_the_readme_names_every_folder_in_one_line() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`.*`) \| .+ \|$", text.partition("## Where things are")[2], re.M)
    named = set()
    for row in rows:
        first, *others = re.findall(r"`([\w/]+)`", row)
        parent = first.rpartition("/")[0]
        named |= {first, *(f"{parent}/{o}" if parent else o for o in others)}
    rooms = {n for n in NAMES if n.count("/") == 1}
    assert rooms <= named, sorted(rooms - named)
    assert all((ROOT / n).is_dir() for n in named), sorted(n for n in named if not (ROOT / n).is_dir())


@pytest.mark.parametrize("package", PACKAGES, ids=NAMES)
def test_a_package_says_what_it_is_what_it_imports_and_where_to_start(package: Path) -> None:
    text = " ".join((ast.get_docstring(ast.parse((package / "__init__.py").read_text())) or "").split())
    assert re.search(r"\b[Ii]mports? |each imported when", text), text
    assert re.search(r"[Ss]tart reading at (any|`[\w./]+`)|One sample's way", text), text
    for name in re.findall(r"`([\w/]+(?:\.py|/))`", text):
        assert (package / name).exists() or (package.parent / name).exists(), name


@pytest.mark.parametrize("package", PACKAGES, ids=NAMES)
def test_no_line_is_longer_than_a_page_is_wide(package: Path) -> None:
    for path in package.iterdir():
        if path.suffix in (".py", ".pyi", ".js", ".css", ".md", ".toml"):
            long = [
                k
                for k, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
                if len(line) > 120
            ]
            assert not long, (path.name, long)
