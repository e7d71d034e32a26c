"""The observer's state on disk while a run goes on: a thread of its own writes it, old or new and whole."""

from __future__ import annotations

import threading
from pathlib import Path
from time import perf_counter
from typing import Final

from cablecomp.durable import write_durably

EVERY_S: Final = 0.5
"""Wall time between two snapshots: with the time to write one, none is older than a second."""


class Keeper:
    """Writes the newest snapshot that it was given; one that the disk is too slow for is passed over.

    `failure` says why the last one could not be written ("" = it was).
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.failure = ""
        self.written = 0
        self._newest: bytes | None = None
        self._due_s = perf_counter() + EVERY_S
        self._over = False
        self._wake = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="snapshots", daemon=True)
        self._thread.start()

    @property
    def due(self) -> bool:
        """Whether a snapshot is wanted."""
        return perf_counter() >= self._due_s

    def offer(self, snapshot: bytes) -> None:
        """Have this one written, without waiting."""
        self._due_s = perf_counter() + EVERY_S
        with self._wake:
            self._newest = snapshot
            self._wake.notify()

    def close(self) -> None:
        """Write what is left and end; may be called again."""
        with self._wake:
            self._over = True
            self._wake.notify()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._wake:
                while self._newest is None and not self._over:
                    self._wake.wait()
                snapshot, self._newest = self._newest, None
            if snapshot is None:
                return
            try:
                write_durably(self.path, snapshot)
            except OSError as error:
                self.failure = f"{self.path}: cannot be written ({error.strerror}); free some space"
            else:
                self.failure = ""
                self.written += 1
