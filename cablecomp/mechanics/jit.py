"""The project's numba decorators: compiled code is cached on disk, under a key made of all sources it is compiled from.

Numba alone looks at the file of the compiled function only and would reuse machine code after a callee in another file
has changed.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np

from cablecomp.errors import InputError

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")
N = TypeVar("N", int, bool)

_PACKAGE = Path(__file__).resolve().parents[1]


def _source_key() -> str:
    digest = hashlib.sha256()
    for folder in ("mechanics", "effects", "observer"):
        for source in sorted((_PACKAGE / folder).glob("*.py")):
            digest.update(source.name.encode() + source.read_bytes())
    return digest.hexdigest()[:16]


def _base() -> Path:
    """The first folder that takes files: the one chosen, the user's cache, the user's own beside temporary files.

    Raises InputError where there is none.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    for place in (chosen, "~/.cache"):
        with suppress(OSError, RuntimeError):  # a user without a home
            if place and _takes_files(folder := Path(place).expanduser()):
                return folder
    with suppress(OSError):
        if _takes_files(folder := _own_temporary()):
            # for numba itself, which refuses what others cache (a simulated joint), here and in processes to come
            os.environ["NUMBA_CACHE_DIR"] = numba.config.CACHE_DIR = str(folder)
            return folder
    raise InputError(
        "no folder takes the compiled code: neither ~/.cache nor that of temporary files can be written; "
        "set NUMBA_CACHE_DIR to one that can"
    )


def _takes_files(folder: Path) -> bool:
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        return True


def _own_temporary() -> Path:
    """A folder that this user alone can write: who puts code there has it run. OSError where another has taken it."""
    folder = Path(tempfile.gettempdir()) / f"cablecomp-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    ours = not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & 0o022)
    if not (ours and stat.S_ISDIR(found.st_mode)):
        raise PermissionError(f"{folder}: is another's")
    return folder


CACHE = _base() / "cablecomp" / _source_key()
_DECORATING = threading.RLock()


def drop_cut_short(folder: Path) -> int:
    """Delete cached files that a power cut or a full disk cut short, so that they are made anew; returns how many.

    Numba's files are pickles, whose last byte is a stop code; it replaces them whole, but leaves them to the disk.
    """
    dropped = 0
    for path in folder.rglob("*.nb[ic]"):
        try:
            with path.open("rb") as file:
                file.seek(max(path.stat().st_size - 1, 0))
                whole = file.read(1) == b"."
            if not whole:
                path.unlink()
                dropped += 1
        except OSError:  # another process has just replaced it
            continue
    return dropped


drop_cut_short(CACHE)


def is_compiled(function: str = "step_rows") -> bool:
    """True if an earlier run left a function of these very sources on disk as machine code."""
    return any(CACHE.rglob(f"*.{function}-*.nbi"))


def constant(value: N) -> N:
    """A constant that compiled functions take as they take any integer, or any truth value.

    For a plain one numba compiles the function it is handed to, and all that this calls, once more for that very value.
    """
    return cast(N, np.bool_(value) if isinstance(value, bool) else np.int64(value))


def cached(decorate: Callable[[], T]) -> T:
    """Run a numba decorator with the project's cache folder, leaving numba's own setting as it was.

    The setting is the process's: of threads that make an effect's term at a time, one waits for the other, or its code
    would be kept in whatever folder the process runs in.
    """
    with _DECORATING:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(CACHE)
        try:
            return decorate()
        finally:
            numba.config.CACHE_DIR = before


def njit(function: F) -> F:
    """Compile to machine code on first call, cache on disk; IEEE arithmetic, no reordering."""
    compile_ = numba.njit(cache=True, error_model="numpy", nogil=True)
    return cached(lambda: compile_(function))


def kernel(function: F) -> F:
    """As `njit`, for the mechanics: arrays are borrowed from Python, none is made or returned.

    So no references need to be counted (`_nrt`); counting took longer than the mechanics itself. What a forced inline
    function calls is not forced inline with it, as numba has it where nothing is said (`forceinline`): law tables' code
    was five times as large for that, and took four times as long to compile.
    """
    compile_ = numba.njit(cache=True, error_model="numpy", nogil=True, forceinline=False, _nrt=False)
    return cached(lambda: compile_(function))


def leaf_kernel(function: F) -> F:
    """As `kernel`, for small leaf functions that belong inside their caller's machine code."""
    compile_ = numba.njit(cache=True, error_model="numpy", nogil=True, forceinline=True, _nrt=False)
    return cached(lambda: compile_(function))


def inner_kernel(function: F) -> F:
    """As `kernel`, for what takes a joint's records and kernels alone call.

    An entry from Python, which would have to take a dozen arrays apart, is left out: it took longer to compile than the
    function. Python must not call it.
    """
    compile_ = numba.njit(
        cache=True,
        error_model="numpy",
        nogil=True,
        forceinline=False,
        _nrt=False,
        no_cpython_wrapper=True,
        no_cfunc_wrapper=True,
    )
    return cached(lambda: compile_(function))


def inlined_kernel(function: F) -> F:
    """As `kernel`, for functions with one caller or with a view as result: their text becomes part of the caller's.

    Every level of calls costs one more optimisation of all the code below it.
    """
    compile_ = numba.njit(inline="always", error_model="numpy", nogil=True, _nrt=False)
    return cached(lambda: compile_(function))
