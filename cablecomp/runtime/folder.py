"""The folder of a run: one run at a time, and nothing of an earlier one between its files."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Sequence
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Final

from cablecomp.errors import InputError

SNAPSHOT: Final = "observer.snapshot"
"""The observer's state after the last sample, while a run goes on at most a second old."""
START: Final = "start.snapshot"
"""The state that a resumed run began with."""
_OURS: Final = (
    *("recording.csv", "prediction.csv", "cycles.csv", "events.jsonl", "joint.toml", "run.json"),
    *("report.html", SNAPSHOT, START, "mismatch-*"),
)


class RunFolder:
    """Opens the folders of a run (`out` itself with one joint, else one below it for each), keeps others out
    until `close`, and sets what an earlier run left in them aside, into `earlier-1`, `earlier-2`…

    InputError if a folder cannot be made, or if another run writes into it.
    """

    def __init__(self, out: Path, names: Sequence[str]) -> None:
        self.folders = (out,) if len(names) == 1 else tuple(out / name for name in names)
        self._locks: list[int] = []
        try:
            for folder in dict.fromkeys((out, *self.folders)):
                self._take(folder)
        except OSError as error:
            self.close()
            raise InputError(f"{out}: cannot be made ({error.strerror}); choose another --out") from None
        except BaseException:
            self.close()
            raise

    def _take(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder, os.O_RDONLY)
        self._locks.append(handle)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(f"{folder}: another run writes into it; choose another --out") from None
        left = [path for pattern in _OURS for path in folder.glob(pattern)]
        if left:
            aside = next(p for k in count(1) if not (p := folder / f"earlier-{k}").exists())
            aside.mkdir()
            for path in left:
                path.rename(aside / path.name)

    def close(self) -> None:
        """Let others in; may be called again."""
        while self._locks:
            with suppress(OSError):
                os.close(self._locks.pop())
