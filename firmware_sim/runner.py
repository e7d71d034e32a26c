"""Loops around a bench: real time with absolute ticks, or stepped by what arrives; in this thread or in one
of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType

from firmware_sim.bench import Bench

Clock = Callable[[], float]
IDLE_S = 0.05  # how long a stepped loop sleeps in the port before it looks at its stop signal


@dataclass
class LoopReport:
    """What a loop did: ticks run, ticks skipped because it was late, the worst lateness (s)."""

    ticks: int = 0
    skipped: int = 0
    worst_late_s: float = 0.0


def run_real_time(
    bench: Bench, stop: Callable[[], bool], period_s: float = 1e-3, clock: Clock = time.perf_counter
) -> LoopReport:
    """Follow `clock` until `stop()`: one tick a period on an absolute grid, and one whenever frames arrive
    between."""
    report, start, due = LoopReport(), clock(), 0.0
    while not stop():
        now = clock() - start
        if now >= due:
            late = now - due
            missed = int(late / period_s)
            report.ticks += 1
            report.skipped += missed
            report.worst_late_s = max(report.worst_late_s, late)
            due += (missed + 1) * period_s
        bench.tick(now)
        bench.port.wait(max(due - (clock() - start), 0.0))
    return report


def run_stepped(bench: Bench, stop: Callable[[], bool]) -> LoopReport:
    """Advance only by what arrives, until `stop()`."""
    report = LoopReport()
    while not stop():
        report.ticks += bench.pump()
        bench.port.wait(IDLE_S)
    return report


class BenchThread:
    """A bench in a thread of its own; a context manager that ends the thread and closes the port."""

    def __init__(self, bench: Bench, stepped: bool = False, period_s: float = 1e-3) -> None:
        self.bench = bench
        self.report: LoopReport | None = None
        self.error: BaseException | None = None
        self._stop = threading.Event()
        self._stepped = stepped
        self._period_s = period_s
        self._thread = threading.Thread(target=self._run, name="firmware_sim", daemon=True)

    def _run(self) -> None:
        try:
            if self._stepped:
                self.report = run_stepped(self.bench, self._stop.is_set)
            else:
                self.report = run_real_time(self.bench, self._stop.is_set, self._period_s)
        except BaseException as error:  # kept for `stop`, which raises it in the caller's thread
            self.error = error

    def start(self) -> BenchThread:
        """Start the loop."""
        self._thread.start()
        return self

    def stop(self) -> None:
        """End the loop, close the port; raises what ended the loop by itself."""
        self._stop.set()
        self._thread.join(timeout=5.0)
        self.bench.close()
        if self.error is not None:
            raise self.error

    def __enter__(self) -> BenchThread:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
