"""Writing tables and canonical recordings as CSV: shortest text that reads back to the very same float64."""

from __future__ import annotations

import gzip
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from io import BytesIO, FileIO
from pathlib import Path
from types import TracebackType

import numpy as np
import polars as pl

from cablecomp.errors import InternalError
from cablecomp.recording.atomic import atomic_file
from cablecomp.recording.channels import order, parse_header
from cablecomp.recording.table import FloatArray


class CsvWriter:
    """Streams columns to a CSV file (gzip if the name ends in .gz).

    Every finite number is written with as few digits as identify it: reading gives back the same bits. The first
    line holds the names, what is absent is NaN: pandas and polars read it as it is, each column as numbers.
    Rows that the disk does not take whole are taken back: OSError, and the file ends with the rows before.
    """

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        self._names = tuple(names)
        self._file = _open(path)
        self._put((",".join(self._names) + "\n").encode())

    def write(self, columns: Mapping[str, FloatArray]) -> None:
        """Append rows; every column named at the start must be there, all of one length."""
        frame = pl.DataFrame({name: columns[name] for name in self._names})
        rows = BytesIO()
        frame.write_csv(rows, include_header=False)
        self._put(rows.getvalue())

    def _put(self, data: bytes) -> None:
        """All of it at once, to the operating system: it outlives a crash of this process."""
        if isinstance(self._file, gzip.GzipFile):
            self._file.write(data)
            return
        left, end = memoryview(data), self._file.tell()
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError:
            with suppress(OSError):
                self._file.truncate(end)
                self._file.seek(end)
            raise

    def sync(self) -> None:
        """Wait until all of it is on the disk."""
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Finish the file; may be called again."""
        self._file.close()

    def __enter__(self) -> CsvWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _open(path: Path) -> gzip.GzipFile | FileIO:
    if path.suffix == ".gz":
        return gzip.GzipFile(path, "wb", compresslevel=4, mtime=0)
    return path.open("wb", buffering=0)


def check_canonical(names: Iterable[str]) -> tuple[str, ...]:
    """Return channel names in canonical order; InternalError if one is not canonical."""
    names = tuple(names)
    for column in parse_header(names):
        if column.name != column.column:
            raise InternalError(f"channel {column.column!r} must be written as {column.name!r}")
    if "time_s" not in names:
        raise InternalError("a recording must hold time_s")
    return order(names)


def write_canonical(path: Path | str, columns: Mapping[str, FloatArray]) -> None:
    """Write a recording whole (gzip if the name ends in .gz); the file appears only when it is complete.

    `columns` maps canonical names to float64 arrays of one length.
    """
    path = Path(path)
    names = check_canonical(columns)
    ready = {name: np.asarray(columns[name], dtype=np.float64) for name in names}
    if len({values.shape for values in ready.values()}) != 1:
        raise InternalError(f"columns of {path.name} differ in length")
    with atomic_file(path) as temporary:
        packed = temporary.with_name(f"{temporary.name}.gz") if path.suffix == ".gz" else temporary
        with CsvWriter(packed, names) as writer:
            writer.write(ready)
        if packed != temporary:
            packed.rename(temporary)
