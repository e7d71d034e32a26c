"""Independent fits side by side: in threads, as the compiled kernels let go of the interpreter, or in processes, whose
interpreters do not wait for each other. Linear algebra has no threads of its own meanwhile."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

from cablecomp.estimation.forked import forkable, forked

A = TypeVar("A")
B = TypeVar("B")
P = ParamSpec("P")

MOST = 4
"""Threads or processes: with more, threads wait for the interpreter, and forks for what goes one after another."""


_HERE = threading.local()
"""`aside`: whether this thread is one of those that do the work."""
_FORKS: ContextVar[bool] = ContextVar("forks", default=False)
"""Whether this process lets itself be forked."""


def side_by_side(work: Callable[[A], B], items: Sequence[A]) -> Iterator[B]:
    """Results in the order of the items; `work` must not depend on the order in which they are done. As many threads as
    the process has cores, or as `OMP_NUM_THREADS` allows it; of work that is itself done so, this one alone."""
    threads = 1 if getattr(_HERE, "aside", False) else min(MOST, _threads(), len(items))
    if threads < 2:
        yield from map(work, items)
        return
    with ThreadPoolExecutor(threads, initializer=_aside) as pool:
        yield from pool.map(work, items)


def in_processes(
    work: Callable[[A], B], items: Sequence[A], dear: Callable[[A], float] = lambda _: 0.0
) -> list[B]:
    """As `side_by_side`, of work that takes a tenth of a second and more in all: in forks of this process, where it
    lets itself be forked (`forks_allowed`). What `work` changes is not seen here then, only what it returns. `dear`:
    which items take longest, and are begun with."""
    several = 1 if getattr(_HERE, "aside", False) else min(MOST, _threads(), len(items))
    if several < 2 or not (_FORKS.get() and forkable(len(items))):
        return list(side_by_side(work, items))
    _HERE.aside = True
    try:
        return forked(work, items, several, dear)
    finally:
        _HERE.aside = False


@contextmanager
def forks_allowed() -> Iterator[None]:
    """Meanwhile work may go to forks of this process. For who owns it: a program that drives a joint, or has a library
    in it that cannot be forked, had better not."""
    token = _FORKS.set(True)
    try:
        yield
    finally:
        _FORKS.reset(token)


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
