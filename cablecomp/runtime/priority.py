"""What the system grants a loop that must be on time: real-time scheduling, locked memory, no garbage
collection."""

from __future__ import annotations

import ctypes
import ctypes.util
import gc
import os
import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

_MCL_CURRENT, _MCL_FUTURE = 1, 2
_SWITCH_S = 2e-4


@dataclass(frozen=True)
class Policy:
    """What is asked for: SCHED_FIFO at `fifo_priority` (None = not asked), memory lock, collection of cyclic
    garbage off."""

    fifo_priority: int | None = 50
    lock_memory: bool = True
    collect_garbage: bool = False


QUIET = Policy(fifo_priority=None, lock_memory=False, collect_garbage=True)
"""For stepped time, where nothing can be late."""


@dataclass
class Granted:
    """What was had, in words, one line each."""

    lines: list[str] = field(default_factory=list)


@contextmanager
def armed(policy: Policy) -> Iterator[Granted]:
    """Apply a policy for the length of a run, as far as it is permitted; everything is put back
    afterwards."""
    granted = Granted()
    undo = [_fifo(policy, granted), _memory(policy, granted), _garbage(policy, granted)]
    try:
        yield granted
    finally:
        for action in reversed(undo):
            action()


def _fifo(policy: Policy, granted: Granted) -> _Undo:
    if policy.fifo_priority is None:
        granted.lines.append("ordinary scheduling, as asked")
        return _Undo()
    before, parameter = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(policy.fifo_priority))
    except OSError as error:
        granted.lines.append(
            f"SCHED_FIFO not permitted ({error.strerror}); give the user rtprio in limits.conf"
        )
        return _Undo()
    granted.lines.append(f"SCHED_FIFO at priority {policy.fifo_priority}")
    return _Undo(lambda: os.sched_setscheduler(0, before, parameter))


def _memory(policy: Policy, granted: Granted) -> _Undo:
    if not policy.lock_memory:
        granted.lines.append("memory not locked, as asked")
        return _Undo()
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if limit != resource.RLIM_INFINITY and os.geteuid() != 0:
        # Locking under a finite limit would make some later allocation fail in the middle of the run.
        granted.lines.append(
            f"memory not locked: RLIMIT_MEMLOCK is {limit // 1024} KiB; give memlock unlimited in limits.conf"
        )
        return _Undo()
    libc = ctypes.CDLL(ctypes.util.find_library("c"), use_errno=True)
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE) != 0:
        granted.lines.append(f"memory not locked ({os.strerror(ctypes.get_errno())})")
        return _Undo()
    granted.lines.append("memory locked")
    return _Undo(lambda: libc.munlockall())


def _garbage(policy: Policy, granted: Granted) -> _Undo:
    interval = sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH_S)
    if policy.collect_garbage:
        granted.lines.append("garbage collection left on, as asked")
        return _Undo(lambda: sys.setswitchinterval(interval))
    was_on = gc.isenabled()
    gc.collect()  # whoever is there by now is young no more
    gc.disable()
    granted.lines.append("garbage collection off in the loop; young objects are collected in its idle time")

    def back() -> None:
        sys.setswitchinterval(interval)
        if was_on:
            gc.enable()

    return _Undo(back)


class _Undo:
    """An action, or none, to be called once."""

    def __init__(self, action: object = None) -> None:
        self._action = action

    def __call__(self) -> None:
        if callable(self._action):
            self._action()
