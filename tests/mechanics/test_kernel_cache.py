"""Compiled kernels on disk: files that were cut short are made anew, whole ones stay."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cablecomp.mechanics.jit import drop_cut_short

MODULE = """
from cablecomp.mechanics.jit import njit

@njit
def twice(x):
    return 2.0 * x
"""


@pytest.mark.parametrize(("kind", "size"), [("nbi", 0), ("nbc", 40)])
def test_a_cache_that_was_cut_short_breaks_nothing(kind: str, size: int, tmp_path: Path) -> None:
    """A process that finds it compiles anew; `size` = bytes left."""
    (tmp_path / "program.py").write_text(MODULE)
    base = {
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
        "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path]),
    }
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"} | base

    def run() -> str:
        command = [sys.executable, "-c", "import program; print(program.twice(4.0))"]
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=600, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    assert run() == "8.0"
    (file,) = (tmp_path / "cache").rglob(f"*.{kind}")
    whole = file.stat().st_size
    os.truncate(file, size)
    assert run() == "8.0"
    (again,) = (tmp_path / "cache").rglob(f"*.{kind}")
    assert again.stat().st_size == whole
    assert drop_cut_short(tmp_path / "cache") == 0
