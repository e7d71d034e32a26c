"""Machine code that a process beside has made is taken over, what the cache holds already stays as it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from cablecomp.config import load_joint
from cablecomp.observer import first_use


def test_only_what_the_cache_lacks_is_taken_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made, cache = tmp_path / "made", tmp_path / "cache"
    monkeypatch.setattr(first_use, "CACHE", cache)
    for place in (made, cache):
        (place / "observer").mkdir(parents=True)
        for name in ("step_rows-1.py.nbi", "step_rows-1.py.1.nbc"):
            (place / "observer" / name).write_text(place.name)
    for name in ("bounds_step-2.py.nbi", "bounds_step-2.py.1.nbc", "bounds_step-2.py.2.nbc"):
        (made / "observer" / name).write_text("made")
    first_use._take_over(made)
    found = {p.name: p.read_text() for p in (cache / "observer").iterdir()}
    assert found == {
        "step_rows-1.py.nbi": "cache",
        "step_rows-1.py.1.nbc": "cache",
        "bounds_step-2.py.nbi": "made",
        "bounds_step-2.py.1.nbc": "made",
        "bounds_step-2.py.2.nbc": "made",
    }


def test_what_is_compiled_starts_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_use, "is_compiled", lambda function: True)
    monkeypatch.setattr(first_use.subprocess, "Popen", None)
    first_use.compile_first(load_joint("capstan-arm"), bounds=True)


def test_a_process_beside_that_fails_leaves_the_work_to_this_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_use, "is_compiled", lambda function: False)
    monkeypatch.setattr(first_use.sys, "executable", "/bin/false")
    monkeypatch.setattr(first_use, "_take_over", None)  # nothing was made
    first_use.compile_first(load_joint("capstan-arm"), bounds=True)
