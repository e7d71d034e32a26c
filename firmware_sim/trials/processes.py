"""Processes that write trials side by side, and end with whoever started them."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process
from threading import Thread


def processes(count: int) -> ProcessPoolExecutor:
    """A pool of fresh processes; killed with their starter, they would wait for its next word for ever."""
    return ProcessPoolExecutor(count, get_context("spawn"), _end_with_starter)


def _end_with_starter() -> None:
    def watch() -> None:
        starter = parent_process()
        assert starter is not None
        starter.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()
