"""A simulated bench in a thread of its own, for clients that are called in this one."""

from __future__ import annotations

import threading
from types import TracebackType

from firmware_sim.bench import Bench
from firmware_sim.runner import LoopReport, run_real_time, run_stepped


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
