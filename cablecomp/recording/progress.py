"""A progress bar on the terminal, only for what takes long."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn


@contextmanager
def progress_bar(
    title: str,
    console: Console | None = None,
    delay_s: float = 2.0,
    clock: Callable[[], float] = time.monotonic,
) -> Iterator[Callable[[float, int], None]]:
    """Give a function to call with (share done, samples done); a bar appears once `delay_s` have passed. It never runs
    backwards. Where there is no terminal, every tenth is a plain line.

    `console` is where to draw (standard error by default).
    """
    console = console or Console(stderr=True, markup=False, emoji=False, highlight=False)
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[samples]:,} samples"),
        TimeRemainingColumn(),
        console=console,
        transient=True,
    )
    task = bar.add_task(title, total=1.0, samples=0)
    started = clock()
    done, tenths = 0.0, 0

    def progress(fraction: float, samples: int) -> None:
        nonlocal done, tenths
        done = fraction = max(done, fraction)
        if not console.is_terminal:
            if int(10.0 * done) > tenths and clock() - started >= delay_s:
                tenths = int(10.0 * done)
                console.print(f"{title}: {10 * tenths} %, {samples:,} samples", soft_wrap=True)
            return
        bar.update(task, completed=fraction, samples=samples)
        if not bar.live.is_started and clock() - started >= delay_s:
            bar.start()

    try:
        yield progress
    finally:
        if bar.live.is_started:
            bar.stop()
