"""The table of numbers that decide: frozen, each with its reason, each read; no number elsewhere without one."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import pytest

import cablecomp
from cablecomp.diagnosis.thresholds import LIMITS, Thresholds

ROOT = Path(cablecomp.__file__).parent
SOURCES = {
    p: p.read_text()
    for d in ("diagnosis", "estimation", "trials", "report")
    for p in (ROOT / d).rglob("*.py")
}


def undocumented(body: list[ast.stmt]) -> Iterator[str]:
    """Names of capital constants with a number in them that no docstring follows."""
    for k, statement in enumerate(body):
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            target = statement.targets[0] if isinstance(statement, ast.Assign) else statement.target
            number = statement.value is not None and any(
                isinstance(n, ast.Constant) and isinstance(n.value, int | float)
                for n in ast.walk(statement.value)
            )
            if (
                isinstance(target, ast.Name)
                and target.id.strip("_").isupper()
                and number
                and not told(body[k + 1 :])
            ):
                yield target.id


def told(after: list[ast.stmt]) -> bool:
    """Whether a docstring comes first."""
    return bool(after) and isinstance(after[0], ast.Expr) and isinstance(after[0].value, ast.Constant)


def test_the_table_is_frozen() -> None:
    with pytest.raises(FrozenInstanceError):
        LIMITS.name = 0.9  # type: ignore[misc]  # wrong on purpose


def test_every_threshold_has_its_reason() -> None:
    (table,) = (
        n
        for n in ast.parse(SOURCES[ROOT / "diagnosis" / "thresholds.py"]).body
        if isinstance(n, ast.ClassDef)
    )
    body = table.body[1:]
    for k, statement in enumerate(body):
        if isinstance(statement, ast.AnnAssign):
            assert told(body[k + 1 :]), ast.unparse(statement.target)


@pytest.mark.parametrize("name", [f.name for f in fields(Thresholds)])
def test_every_threshold_is_read(name: str) -> None:
    assert any(re.search(rf"LIMITS\.{name}\b", text) for text in SOURCES.values())


@pytest.mark.parametrize("folder", ["diagnosis", "estimation"])
def test_a_number_of_an_algorithm_says_what_it_is(folder: str) -> None:
    for path, text in SOURCES.items():
        if path.is_relative_to(ROOT / folder):
            assert not list(undocumented(ast.parse(text).body)), path.name
