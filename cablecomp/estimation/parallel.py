"""Independent fits side by side in threads: the compiled kernels let go of the interpreter. Linear algebra has none of
its own meanwhile."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

A = TypeVar("A")
B = TypeVar("B")
P = ParamSpec("P")

MOST = 4
"""Threads; beyond, the interpreter between kernel calls is what they wait for."""


_HERE = threading.local()
"""`aside`: whether this thread is one of those that do the work."""


def side_by_side(work: Callable[[A], B], items: Sequence[A]) -> Iterator[B]:
    """Results in the order of the items; `work` must not depend on the order in which they are done. As many threads as
    the process has cores, or as `OMP_NUM_THREADS` allows it; of work that is itself done so, this one alone."""
    threads = 1 if getattr(_HERE, "aside", False) else min(MOST, _threads(), len(items))
    if threads < 2:
        yield from map(work, items)
        return
    with ThreadPoolExecutor(threads, initializer=_aside) as pool:
        yield from pool.map(work, items)


def _aside() -> None:
    _HERE.aside = True


def _threads() -> int:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    allowed = os.environ.get("OMP_NUM_THREADS", "")
    return min(cores, int(allowed)) if allowed.isdecimal() else cores


def algebra_in_one_thread(work: Callable[P, B]) -> Callable[P, B]:
    """The function, done while NumPy's and SciPy's linear algebra keeps to one thread: its systems are small here, and
    its threads only wait for each other."""

    @functools.wraps(work)
    def alone(*args: P.args, **kwargs: P.kwargs) -> B:
        with threadpool_limits(limits=1, user_api="blas"):
            return work(*args, **kwargs)

    return alone
