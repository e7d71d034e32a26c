"""Compiled kernels on disk: files that were cut short are made anew, whole ones stay; all lie in one folder."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numba
import pytest

from cablecomp.effects.clock_skew import SLOTS
from cablecomp.effects.clock_skew import _look_back as look_back
from cablecomp.effects.compiled_term import CompiledTerm
from cablecomp.mechanics.jit import CACHE, cached, drop_cut_short

STATE = ("start", "count", "cursor", "time", "reading")
RINGS = tuple((name, SLOTS) for name in ("times", "readings"))

MODULE = """
from cablecomp.mechanics.jit import njit

@njit
def twice(x):
    return 2.0 * x
"""


def base(chosen: str, home: Path, temporary: Path) -> subprocess.CompletedProcess[str]:
    """Where a process keeps compiled code by such an environment."""
    environment = {
        **os.environ,
        "NUMBA_CACHE_DIR": chosen,
        "HOME": str(home),
        "TMPDIR": str(temporary),
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    command = [sys.executable, "-c", "from cablecomp.mechanics.jit import CACHE; print(CACHE.parents[1])"]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600, check=False)


def test_compiled_code_is_kept_where_it_can_be(tmp_path: Path) -> None:
    """A chosen folder or a home that takes no files stops no command: here they lie below a file."""
    (tmp_path / "file").touch()
    none, home, temporary = tmp_path / "file" / "x", tmp_path / "home", tmp_path / "tmp"
    temporary.mkdir()
    own = temporary / f"cablecomp-{os.getuid()}"
    assert base(str(tmp_path / "chosen"), home, temporary).stdout.strip() == str(tmp_path / "chosen")
    assert base(str(none), home, temporary).stdout.strip() == str(home / ".cache")
    assert base(str(none), none, temporary).stdout.strip() == str(own)
    assert own.stat().st_mode & 0o777 == 0o700
    own.chmod(0o777)  # anybody may have put code there, which would be run
    assert "set NUMBA_CACHE_DIR to one that can" in base("", none, temporary).stderr


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


def test_threads_that_compile_at_a_time_keep_their_code_in_one_folder() -> None:
    """The folder is a setting of the whole process, and the terms of effects are made by threads."""

    def decorate() -> str:
        time.sleep(0.02)  # as long as numba takes to look for the folder
        return str(numba.config.CACHE_DIR)

    usual = numba.config.CACHE_DIR
    with ThreadPoolExecutor(4) as threads:
        folders = [w.result() for w in [threads.submit(cached, decorate) for _ in range(8)]]
    assert set(folders) == {str(CACHE)}
    assert usual == numba.config.CACHE_DIR


def test_the_term_of_an_effect_is_read_from_disk_once_it_is_compiled() -> None:
    """Not compiled again by every process that has the effect."""
    assert look_back.address
    again = CompiledTerm(look_back._function, ("delay", "of_load", "drift", "since"), STATE, RINGS)
    assert again.address != 0
    assert sum(again._entry.stats.cache_hits.values()) == 1
    assert not again._entry.stats.cache_misses
