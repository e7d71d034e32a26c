"""Change the last gate, the descent and the health watch in every way that Cosmic Ray knows, one at a time, and see
whether their tests notice: `nice -n 19 python tests/mutation/nightly.py [--module gate] [--most 50] [--workers 2]`.

Exit code 1 where fewer than 95 % of a module's mutants are killed, or one survives that `survivors.txt` does not
explain. Every mutant runs in a process of its own that is forked from this one, with everything else imported, up to
the first test that fails, whose example is not made smaller; it never touches a file.
"""

from __future__ import annotations

import argparse
import ast
import gc
import importlib
import importlib.abc
import importlib.util
import os
import random
import resource
import sys
from collections.abc import Iterable, Iterator, Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
EXPLAINED = Path(__file__).with_name("survivors.txt")
TESTS = {
    "cablecomp.control.gate": [
        "tests/control/test_gate_in_numbers.py",
        "tests/control/test_gate.py",
    ],
    "cablecomp.control.degrade": ["tests/control/test_descent.py"],
    "cablecomp.runtime.health": [
        "tests/runtime/test_health_in_numbers.py",
        "tests/runtime/test_health_of_encoders.py",
        "tests/runtime/test_health_watch.py",
    ],
    "cablecomp.runtime.channel": [
        "tests/runtime/test_channel_in_numbers.py",
        "tests/runtime/test_health_in_numbers.py",
        "tests/runtime/test_health_of_encoders.py",
        "tests/runtime/test_health_watch.py",
    ],
}
LOADED_BEFORE = ("pytest", "hypothesis", "control", "cablecomp.observer", "cablecomp.links.link")
"""What the tests import that imports none of the modules that are changed."""
LEAST_KILLED = 0.95
CPU_S = 60
"""After which a mutant has run into a loop without end; of its own time, which a busy computer does not shorten."""


class Mutant(NamedTuple):
    """A module's text with one change; `key` names it in `survivors.txt`."""

    key: str
    text: str


def mutants(module: str, text: str) -> Iterator[Mutant]:
    """Every mutant of every operator; those that change nothing but annotations are left out."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator, operator_names

    same = meaning(text)
    seen = {same}
    for name in operator_names():
        kind = get_operator(name)
        if kind.arguments():
            continue
        place = 0
        while (changed := mutate_code(text, kind(), place)) is not None:
            place += 1
            try:
                found = meaning(changed)
            except SyntaxError:  # an operator that took `**more` for a product
                continue
            if found not in seen:
                seen.add(found)
                yield Mutant(f"{module.rpartition('.')[2]}: {difference(text, changed)}", changed)


def meaning(text: str) -> str:
    """What of a source text can be run: without annotations, which nothing evaluates here."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(None)
        elif isinstance(node, ast.arg):
            node.annotation = None
        elif isinstance(node, ast.FunctionDef):
            node.returns = None
    return ast.dump(tree)


def difference(before: str, after: str) -> str:
    """The lines that differ, as they were and as they are."""
    old, new = before.splitlines(), after.splitlines()
    k = next(
        (k for k, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), min(len(old), len(new)) - 1
    )
    return f"{old[k].strip()}  ->  {new[k].strip()}"


class Instead(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives one module another text."""

    def __init__(self, module: str, text: str) -> None:
        self._module, self._text = module, text

    def find_spec(self, name: str, path: object, target: ModuleType | None = None) -> ModuleSpec | None:
        return importlib.util.spec_from_loader(name, self) if name == self._module else None

    def exec_module(self, module: ModuleType) -> None:
        exec(compile(self._text, f"<{self._module}, changed>", "exec"), module.__dict__)


def survivors(module: str, every: Iterable[Mutant], workers: int = 1) -> Iterator[tuple[int, Mutant]]:
    """Those that the module's tests do not notice, with their places, as they are found."""
    running: dict[int, tuple[int, Mutant]] = {}
    for place, mutant in enumerate(every):
        if len(running) == workers:
            yield from _first_to_end(running)
        child = os.fork()
        if child == 0:
            os._exit(_in_child(module, mutant.text))
        running[child] = place, mutant
    while running:
        yield from _first_to_end(running)


def _first_to_end(running: dict[int, tuple[int, Mutant]]) -> Iterator[tuple[int, Mutant]]:
    child, status = os.wait()
    ended = running.pop(child)
    if status == 0:
        yield ended


def _in_child(module: str, text: str) -> int:
    import pytest
    from hypothesis import Phase, settings

    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 1))
    nowhere = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(nowhere, number)
    sys.meta_path.insert(0, Instead(module, text))
    settings.register_profile("first failure", deadline=None, phases=[Phase.explicit, Phase.generate])
    options = ["-x", "-q", "--tb=no", "--assert=plain", "-p", "no:cacheprovider", "-p", "no:benchmark"]
    options += ["--hypothesis-seed=1", "--hypothesis-profile=first failure", "-o", "addopts="]
    try:
        code = pytest.main([*options, *TESTS[module]])
    except BaseException:
        return 1
    return int(code)


def explained() -> set[str]:
    """Survivors that are accounted for."""
    lines = EXPLAINED.read_text(encoding="utf-8").splitlines()
    return {line.strip() for line in lines if "  ->  " in line}


def main(arguments: Sequence[str] | None = None) -> int:
    """Try all mutants of the modules asked for; returns 1 if too many live."""
    for needed in LOADED_BEFORE:
        importlib.import_module(needed)
    assert not set(TESTS) & set(sys.modules), "a module to be changed is loaded already"
    known = [module.rpartition(".")[2] for module in TESTS]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--module", action="append", choices=known)
    parser.add_argument(
        "--most", type=int, default=10**6, help="so many mutants of a module, drawn at random"
    )
    parser.add_argument("--workers", type=int, default=1, help="processes at a time")
    asked = parser.parse_args(arguments)
    os.chdir(ROOT)
    gc.freeze()
    accounted, fine = explained(), True
    for module in TESTS:
        name = module.rpartition(".")[2]
        if asked.module and name not in asked.module:
            continue
        text = (ROOT / f"{module.replace('.', '/')}.py").read_text(encoding="utf-8")
        if not list(survivors(module, [Mutant(name, text)])):
            print(f"{name}: its tests fail without any change", flush=True)
            return 1
        every = list(mutants(module, text))
        every = random.Random(1).sample(every, min(asked.most, len(every)))
        left = []
        for place, mutant in survivors(module, every, asked.workers):
            left.append(mutant.key)
            word = "explained" if mutant.key in accounted else "SURVIVES"
            print(f"  {place + 1} of {len(every)}, {word}: {mutant.key}", flush=True)
        share = 1.0 - len(left) / len(every)
        print(f"{name}: {len(every)} mutants, {100.0 * share:.1f} % killed", flush=True)
        fine = fine and share >= LEAST_KILLED and accounted.issuperset(left)
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
