"""A simulated joint as a process of its own, started and ended from here."""

from __future__ import annotations

import json
import select
import subprocess
import sys
from collections.abc import Sequence
from types import TracebackType
from typing import Any

from firmware_sim.errors import SimError


class SimProcess:
    """`python -m firmware_sim ARGUMENTS` as a context manager; `where` says how to reach it (its first line).
    On a machine where the plant was never run, compiling it takes the better part of a minute.

    The child ends when its standard input closes, hence also when this process dies.
    """

    def __init__(self, arguments: Sequence[str], ready_s: float = 240.0) -> None:
        command = [sys.executable, "-m", "firmware_sim", *arguments, "--until-stdin-closes"]
        self._child = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.where: dict[str, Any] = {}
        self.ended: dict[str, Any] = {}
        try:
            self.where = self._first_line(ready_s)
        except BaseException:
            self.close()
            raise

    def _first_line(self, ready_s: float) -> dict[str, Any]:
        out = self._child.stdout
        assert out is not None
        heard = bool(select.select([out], [], [], ready_s)[0])
        line = out.readline() if heard else ""
        if not line:
            said = self._last_words() if heard else ""
            raise SimError(said or f"the simulated joint was not ready after {ready_s} s; try again")
        where: dict[str, Any] = json.loads(line)
        return where

    def _last_words(self) -> str:
        """What a child that closed its output said on its error stream."""
        self._child.wait(10.0)
        return "" if self._child.stderr is None else self._child.stderr.read().strip()

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._child.poll() is None

    def close(self, timeout_s: float = 5.0) -> int:
        """End it by closing its input, by force if it does not heed; returns its exit code."""
        child = self._child
        if child.stdin is not None and not child.stdin.closed:
            child.stdin.close()
        try:
            code = child.wait(timeout_s)
        except subprocess.TimeoutExpired:
            child.kill()
            code = child.wait()
        if child.stdout is not None and not child.stdout.closed:
            rest = child.stdout.read().strip().splitlines()
            if self.where and rest:
                self.ended = json.loads(rest[-1])
            child.stdout.close()
        if child.stderr is not None:
            child.stderr.close()
        return code

    def __enter__(self) -> SimProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
