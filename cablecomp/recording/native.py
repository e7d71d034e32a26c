"""What native code prints to the process's error output past Python, kept back while it reads."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Final

_STDERR: Final = 2
_ONE_AT_A_TIME: Final = Lock()


@contextmanager
def held_errors() -> Iterator[None]:
    """Hold what is written to file descriptor 2: passed on at the end, dropped if the block raises.

    For readers whose failure the caller words itself, and that print a panic before they raise it (Polars).
    """
    with _ONE_AT_A_TIME:
        try:
            real = os.dup(_STDERR)
        except OSError:  # closed: there is nothing to keep back
            yield
            return
        with open(real, "wb") as out, tempfile.TemporaryFile() as held:
            sys.stderr.flush()
            os.dup2(held.fileno(), _STDERR)
            try:
                yield
                sys.stderr.flush()
            finally:
                os.dup2(real, _STDERR)
            held.seek(0)
            shutil.copyfileobj(held, out)
