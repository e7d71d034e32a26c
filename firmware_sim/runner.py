"""Loops around a bench: real time with absolute ticks, or stepped by what arrives."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

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
