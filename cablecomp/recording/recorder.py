"""The live recorder: samples are appended at the loop's rate, another thread formats and writes them."""

from __future__ import annotations

import queue
import threading
import weakref
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from types import TracebackType

import numpy as np

from cablecomp.errors import DeviceError
from cablecomp.recording.table import FloatArray
from cablecomp.recording.writer import CsvWriter, check_canonical


class Recorder:
    """Appends samples to a canonical CSV recording.

    `append` copies one row into a buffer, without waiting for the disk; each full buffer (`rows_per_write`,
    1 s at 1 kHz by default) is formatted and flushed to the operating system by another thread. `close`
    writes the rest; it also happens at the end of a `with` block, on an unhandled exception and at the
    interpreter's exit. If the process is killed, the file holds every full buffer. A row must be
    finite in all channels but `temperature_degC` and `other_*`: the recorder writes what it is given (NaN as
    an empty cell), and reading refuses empty cells elsewhere.
    """

    def __init__(
        self,
        path: Path | str,
        channels: Sequence[str],
        comments: Iterable[str] = (),
        rows_per_write: int = 1000,
    ) -> None:
        self.path = Path(path)
        self.channels = tuple(channels)
        self._store = _Store(self.path, self.channels, tuple(comments), rows_per_write)
        self._finish = weakref.finalize(self, self._store.finish)  # also runs at the interpreter's exit

    @property
    def rows(self) -> int:
        """Rows appended so far."""
        return self._store.rows

    def append(self, row: Sequence[float]) -> None:
        """Take in one sample: values in the order of `channels`."""
        self._store.append(row)

    def flush(self) -> None:
        """Hand over what has been appended so far, without waiting for the disk."""
        self._store.hand_over()

    def close(self) -> None:
        """Write the rest and finish the file; DeviceError if the disk refused. May be called again."""
        self._finish()
        failure = self._store.failure
        if failure is not None:
            raise DeviceError(
                f"{self.path}: the recording is incomplete ({failure.strerror}); free some space"
            )

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Store:
    """Buffer, queue and writing thread of a recorder."""

    def __init__(self, path: Path, channels: tuple[str, ...], comments: tuple[str, ...], rows: int) -> None:
        names = check_canonical(channels)
        self.rows = 0
        self.failure: OSError | None = None
        self._channels = channels
        self._shape = (rows, len(channels))
        self._buffer: FloatArray = np.empty(self._shape)
        self._filled = 0
        self._queue: queue.SimpleQueue[FloatArray | None] = queue.SimpleQueue()
        try:
            self._writer = CsvWriter(path, names, comments)
            self._writer.flush()
        except OSError as error:
            raise DeviceError(f"{path}: cannot be written ({error.strerror}); choose another place") from None
        self._thread = threading.Thread(target=self._drain, name="recorder", daemon=True)
        self._thread.start()

    def append(self, row: Sequence[float]) -> None:
        self._buffer[self._filled] = row
        self._filled += 1
        self.rows += 1
        if self._filled == len(self._buffer):
            self.hand_over()

    def hand_over(self) -> None:
        if self._filled:
            self._queue.put(self._buffer[: self._filled])
            self._buffer = np.empty(self._shape)
            self._filled = 0

    def finish(self) -> None:
        self.hand_over()
        self._queue.put(None)
        self._thread.join()

    def _drain(self) -> None:
        while (block := self._queue.get()) is not None:
            self._guarded(partial(self._write, block))
        self._guarded(self._writer.close)

    def _write(self, block: FloatArray) -> None:
        self._writer.write({name: block[:, k] for k, name in enumerate(self._channels)})
        self._writer.flush()

    def _guarded(self, action: Callable[[], None]) -> None:
        try:
            if self.failure is None:
                action()
        except OSError as error:
            self.failure = error
