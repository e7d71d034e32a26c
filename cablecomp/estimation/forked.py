"""Work side by side in forks of a process, whose interpreters do not wait for each other.

A fork has all that its starter has, so nothing goes there but the numbers of the items, through a pipe from which
whoever is free takes the next. What comes back is pickled, but what was there before is told by its address: it is the
starter's own object again, not a copy of it.
"""

from __future__ import annotations

import gc
import os
import pickle
import select
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from types import BuiltinFunctionType, ModuleType
from typing import BinaryIO, Final, NoReturn, TypeVar

import numpy as np

A = TypeVar("A")
B = TypeVar("B")

NUMBER: Final = 4
"""Bytes of an item's number in the pipe that hands them out."""
LEFT_OUT: Final = (type, ModuleType, BuiltinFunctionType)
"""What lives outside of the work: it is found by its name."""
PATIENCE_S: Final = 60.0
"""How long a fork may go on when all else is done, beside ten times what that took: then it hangs, in a lock that a
library held when the process was forked."""

_HELPING = False
"""Set where a fork begins."""


def helping() -> bool:
    """Whether this process is a fork that works for another: what it tells is told twice, or to nobody."""
    return _HELPING


def forkable(items: int) -> bool:
    """Whether this process can be forked for so many items: on Linux, while no other thread of it could hold a lock
    meanwhile, and where their numbers fit into a pipe."""
    return sys.platform == "linux" and threading.active_count() == 1 and NUMBER * items <= select.PIPE_BUF


def forked(
    work: Callable[[A], B], items: Sequence[A], processes: int, dear: Callable[[A], float] = lambda _: 0.0
) -> list[B]:
    """Results in the order of the items, done by this process and by forks of it, `dear` ones first. What a fork
    that was killed, or hangs, has not done is done here, in order, and what raised something once more: so that is
    raised here, and of several the first in order, whoever met it first."""
    began = time.monotonic()
    known = reachable([work, *items])
    take, put = os.pipe()
    order = sorted(range(len(items)), key=lambda k: -dear(items[k]))
    os.write(put, b"".join(k.to_bytes(NUMBER, "little") for k in order))
    os.close(put)
    helpers: list[tuple[int, BinaryIO]] = []
    try:
        with suppress(OSError):  # no room for a further process: with those there are
            for _ in range(processes - 1):
                helpers.append(_helper(work, items, take, known))
        done = _taken(work, items, take)
        patience = PATIENCE_S + 10.0 * (time.monotonic() - began)
        for _, told in helpers:
            if not select.select([told], [], [], patience)[0]:
                continue
            with suppress(EOFError, pickle.UnpicklingError):
                done |= _Told(told, known).load()
    finally:
        os.close(take)
        for helper, told in helpers:
            told.close()
            os.kill(helper, signal.SIGKILL)
            os.waitpid(helper, 0)
    return [done[k] if k in done else work(item) for k, item in enumerate(items)]


def reachable(roots: Sequence[object]) -> dict[int, object]:
    """By its address, all that these hold, without what is found by a name."""
    found: dict[int, object] = {}
    left = list(roots)
    while left:
        here = left.pop()
        if id(here) in found or isinstance(here, LEFT_OUT):
            continue
        if isinstance(here, np.ndarray):
            found[id(here)] = here
        elif gc.is_tracked(here):
            found[id(here)] = here
            own = getattr(here, "__globals__", None)
            left += [r for r in gc.get_referents(here) if r is not own]
    return found


def _taken(work: Callable[[A], B], items: Sequence[A], take: int, starter: int | None = None) -> dict[int, B]:
    """What was done of the items while there were any to take, by their numbers; where one raises, nobody takes a
    further one. A fork ends where its `starter` has."""
    done: dict[int, B] = {}
    for k in iter(lambda: _next(take), None):
        try:
            done[k] = work(items[k])
        except Exception:  # whatever it is, it is raised where the item is done again
            while _next(take) is not None:
                pass
        if starter is not None and os.getppid() != starter:
            os._exit(1)
    return done


def _next(take: int) -> int | None:
    number = os.read(take, NUMBER)
    return int.from_bytes(number, "little") if number else None


def _helper(
    work: Callable[[A], B], items: Sequence[A], take: int, known: Mapping[int, object]
) -> tuple[int, BinaryIO]:
    """A fork that takes items until there is none: its id, and where it tells what it found."""
    read, write = os.pipe()
    starter = os.getpid()
    try:
        with warnings.catch_warnings():
            # threads of linear algebra, which are what it warns of, see to forks themselves
            warnings.simplefilter("ignore", DeprecationWarning)
            helper = os.fork()
    except OSError:
        os.close(read)
        os.close(write)
        raise
    if helper == 0:
        os.close(read)
        _help(work, items, take, write, known, starter)
    os.close(write)
    return helper, os.fdopen(read, "rb")


def _help(
    work: Callable[[A], B],
    items: Sequence[A],
    take: int,
    write: int,
    known: Mapping[int, object],
    starter: int,
) -> NoReturn:
    """What a fork does. It ends with its work, after the item at hand where its starter has ended, or at once where it
    is asked to; how the starter ends is not its own to do."""
    global _HELPING
    try:
        _HELPING = True
        for each in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(each) != signal.SIG_IGN:
                signal.signal(each, signal.SIG_DFL)
        gc.freeze()  # what was there before is not looked through again, whose pages would be copied for it
        found = _taken(work, items, take, starter)
        with os.fdopen(write, "wb") as told:
            _Tell(told, known).dump(found)
        os._exit(0)
    finally:
        os._exit(1)


class _Tell(pickle.Pickler):
    """Pickles what is new, and tells what was there before by its address."""

    def __init__(self, told: BinaryIO, known: Mapping[int, object]) -> None:
        super().__init__(told, pickle.HIGHEST_PROTOCOL)
        self._known = known

    def persistent_id(self, obj: object) -> int | None:
        """Its address, of what was there before."""
        return id(obj) if id(obj) in self._known else None


class _Told(pickle.Unpickler):
    """Reads that."""

    def __init__(self, told: BinaryIO, known: Mapping[int, object]) -> None:
        super().__init__(told)
        self._known = known

    def persistent_load(self, pid: int) -> object:
        """What is there."""
        return self._known[pid]
