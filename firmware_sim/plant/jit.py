"""The plant's numba decorator: compiled code is cached on disk beside the sources."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])


def njit(function: F) -> F:
    """Compile to machine code on first call and cache it; IEEE arithmetic, no reordering."""
    compiled: F = numba.njit(cache=True, error_model="numpy", nogil=True)(function)
    return compiled
