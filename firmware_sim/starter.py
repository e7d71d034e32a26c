"""A process that ends with the one that started it."""

from __future__ import annotations

import os
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from threading import Thread
from time import sleep


def parsed(parser: ArgumentParser, given: Sequence[str] | None) -> Namespace:
    """The arguments of a command that may be told by which process it was started, with which it ends then."""
    parser.add_argument("--starter", type=int, help="number of the process with which this one ends")
    found = parser.parse_args(given)
    if found.starter is not None:
        end_with(found.starter)
    return found


def end_with(starter: int) -> None:
    """Have this process end once the one of that number, which started it, has gone: killed, that can tell nobody."""

    def watch() -> None:
        while os.getppid() == starter:
            sleep(0.1)
        os._exit(1)

    Thread(target=watch, daemon=True).start()
