"""The plant's numba decorator.

Machine code is kept on disk in a folder named after a digest of all of the plant's sources but those of effects
and their forms, which never are compiled: numba by itself watches only the file that a function stands in, and would
go on using code compiled from an older version of its callees.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])


def _digest() -> str:
    crc = 0
    for path in sorted(Path(__file__).parent.glob("*.py")):
        crc = zlib.crc32(path.read_bytes(), zlib.crc32(path.name.encode(), crc))
    return f"{crc:08x}"


def _root() -> Path:
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        if os.environ.get(name):
            return Path(os.environ[name])
    return Path.home() / ".cache"


CODE_FOLDER = _root() / "firmware_sim" / _digest()


def njit(function: F) -> F:
    """Compile to machine code on first call and keep it; IEEE arithmetic, no reordering; for what makes no arrays,
    so that no references need to be counted."""
    return _compiled(function)


def part(function: F) -> F:
    """As `njit`, for what compiled code alone calls: an entry from Python, which takes a joint's fifty arrays apart,
    is more to compile than the function."""
    return _compiled(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def _compiled(function: F, **options: bool) -> F:
    usual = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(CODE_FOLDER)
    try:
        compiled: F = numba.njit(cache=True, error_model="numpy", nogil=True, _nrt=False, **options)(function)
    finally:
        numba.config.CACHE_DIR = usual
    return compiled
