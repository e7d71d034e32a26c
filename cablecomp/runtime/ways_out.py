"""Signals that would end this process end the run instead: the drive is stopped first, whatever asks."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, Final

ASKED_BY_USER: Final = "asked by the user"
_NAMES: Final = (
    *("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGVTALRM"),
    *("SIGPROF", "SIGXCPU", "SIGPWR", "SIGIO", "SIGSTKFLT"),
)
"""All whose ordinary action is to end a process, or to halt it, and that can be taken (signal(7)); not those of
a broken program (SEGV, BUS, FPE, ILL, ABRT), nor PIPE and XFSZ, which Python turns into errors.
"""


class WaysOut:
    """While it is entered, such a signal asks what runs now (`ask`) to stop; where nothing runs, it ends the
    program by KeyboardInterrupt, once; what comes after a first one changes nothing, so that a stop is never
    cut short. `why`: what asked first ("" = nothing has).

    A signal that was ignored stays ignored (nohup). Only the main thread can take signals; elsewhere this
    does nothing.
    """

    def __init__(self) -> None:
        self.why = ""
        self._ask: Callable[[str], None] | None = None
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> WaysOut:
        if threading.current_thread() is threading.main_thread():
            for name in _NAMES:
                number = getattr(signal, name, None)
                if number is not None and signal.getsignal(number) not in (signal.SIG_IGN, None):
                    self._before[number] = signal.signal(number, self._heard)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before.clear()

    @contextmanager
    def asking(self, ask: Callable[[str], None]) -> Iterator[None]:
        """Ask this one to stop while inside; at once if a stop was asked for before."""
        self._ask = ask
        try:
            if self.why:
                ask(self.why)
            yield
        finally:
            self._ask = None

    def _heard(self, number: int, frame: FrameType | None) -> None:
        first = not self.why
        if first:
            self.why = ASKED_BY_USER
            if number != signal.SIGINT:
                self.why += f" ({signal.Signals(number).name})"
        if self._ask is not None:
            self._ask(self.why)
        elif first:
            raise KeyboardInterrupt
