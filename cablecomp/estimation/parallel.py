"""Independent fits side by side in threads: the compiled kernels let go of the interpreter."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")

MOST = 4
"""Threads; beyond, the interpreter between kernel calls is what they wait for."""


def side_by_side(work: Callable[[A], B], items: Sequence[A]) -> Iterator[B]:
    """Results in the order of the items; `work` must not depend on the order in which they are done. As many threads as
    the process has cores, or as `OMP_NUM_THREADS` allows it."""
    with ThreadPoolExecutor(max(1, min(MOST, _threads(), len(items)))) as pool:
        yield from pool.map(work, items)


def _threads() -> int:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    allowed = os.environ.get("OMP_NUM_THREADS", "")
    return min(cores, int(allowed)) if allowed.isdecimal() else cores
