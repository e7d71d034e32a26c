"""Rows of numbers to a CSV file: appended at the loop's rate, formatted and written by another thread."""

from __future__ import annotations

import queue
import threading
import weakref
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from cablecomp.errors import DeviceError
from cablecomp.recording.table import FloatArray
from cablecomp.recording.writer import CsvWriter, check_canonical


class TableLog:
    """Appends rows of floats to a CSV file.

    `append` copies one row into a buffer, without waiting for the disk; each full buffer (`rows_per_write`,
    1 s at 1 kHz by default), and what has come until `flush`, is formatted and handed to the operating
    system by another thread. `close` writes the rest; it also happens at the end of a `with` block, on an
    unhandled exception and at the interpreter's exit. If the process is killed, the file holds what was
    handed over. A disk that fills ends the file with its last whole rows; `failure` says so. `header` is
    the order of the columns in the file, if another than that of the rows. DeviceError if the file cannot
    be opened.
    """

    def __init__(
        self,
        path: Path | str,
        columns: Sequence[str],
        rows_per_write: int = 1000,
        header: Sequence[str] | None = None,
    ) -> None:
        self.path = Path(path)
        writer = _opened(self.path, columns if header is None else header)
        self._store = _Store(writer, tuple(columns), rows_per_write)
        self._finish = weakref.finalize(self, self._store.finish)  # also runs at the interpreter's exit

    @property
    def rows(self) -> int:
        """Rows appended so far."""
        return self._store.rows

    @property
    def waiting(self) -> int:
        """Rows that have been appended and not yet been handed over."""
        return self._store.waiting

    def append(self, row: Sequence[float]) -> None:
        """Take in one row: values in the order of the columns."""
        self._store.append(row)

    def flush(self) -> None:
        """Hand over what has been appended so far, without waiting for the disk."""
        self._store.hand_over()

    def close(self) -> None:
        """Write the rest and finish the file; DeviceError if the disk refused. May be called again."""
        self._finish()
        if self.failure:
            raise DeviceError(self.failure)

    @property
    def failure(self) -> str:
        """Why the file takes no more, in one line ("" = it does)."""
        failure = self._store.failure
        if failure is None:
            return ""
        return f"{self.path}: is incomplete ({failure.strerror}); free some space"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class Recorder(TableLog):
    """Appends samples to a canonical CSV recording.

    A row must be finite in all channels but `temperature_degC` and `other_*`: the recorder writes what it is
    given (NaN too), and reading refuses NaN elsewhere.
    """

    def __init__(
        self,
        path: Path | str,
        channels: Sequence[str],
        rows_per_write: int = 1000,
    ) -> None:
        self.channels = tuple(channels)
        super().__init__(path, channels, rows_per_write, check_canonical(channels))


def _opened(path: Path, header: Sequence[str]) -> CsvWriter:
    try:
        return CsvWriter(path, tuple(header))
    except OSError as error:
        raise DeviceError(f"{path}: cannot be written ({error.strerror}); choose another place") from None


class _Store:
    """Buffer, queue and writing thread of a log."""

    def __init__(self, writer: CsvWriter, columns: tuple[str, ...], rows: int) -> None:
        self.rows = 0
        self.failure: OSError | None = None
        self._writer = writer
        self._columns = columns
        self._shape = (rows, len(columns))
        self._buffer: FloatArray = np.empty(self._shape)
        self.waiting = 0
        self._queue: queue.SimpleQueue[FloatArray | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._drain, name="table log", daemon=True)
        self._thread.start()

    def append(self, row: Sequence[float]) -> None:
        self._buffer[self.waiting] = row
        self.waiting += 1
        self.rows += 1
        if self.waiting == len(self._buffer):
            self.hand_over()

    def hand_over(self) -> None:
        if self.waiting:
            self._queue.put(self._buffer[: self.waiting])
            self._buffer = np.empty(self._shape)
            self.waiting = 0

    def finish(self) -> None:
        self.hand_over()
        self._queue.put(None)
        self._thread.join()

    def _drain(self) -> None:
        while (block := self._queue.get()) is not None:
            self._guarded(partial(self._write, block))
        self._guarded(self._writer.sync)
        try:
            self._writer.close()
        except OSError as error:
            self.failure = self.failure or error

    def _write(self, block: FloatArray) -> None:
        self._writer.write({name: block[:, k] for k, name in enumerate(self._columns)})

    def _guarded(self, action: Callable[[], None]) -> None:
        try:
            if self.failure is None:
                action()
        except OSError as error:
            self.failure = error
