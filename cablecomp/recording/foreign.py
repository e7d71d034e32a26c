"""Recordings in binary tables: Parquet (streamed) and NumPy .npz; a row is counted from 1."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl

from cablecomp.errors import InputError
from cablecomp.recording.table import FloatArray

_ROWS: Final = 1 << 18


@dataclass(frozen=True)
class BinaryRows:
    """Rows of a binary table, one float64 array per column, NaN where empty."""

    first_line: int
    arrays: list[FloatArray]
    fraction: float
    ends_with_break: bool = True

    def cell(self, row: int, column: int) -> str:
        """Return a value as text, for messages; an empty one is an empty text."""
        value = self.arrays[column][row]
        return "" if np.isnan(value) else repr(float(value))


RowStream = Callable[[], Iterator[BinaryRows]]


def open_parquet(path: Path) -> tuple[tuple[str, ...], RowStream]:
    """Return column names and a stream of rows; InputError if damaged or a column is not of numbers."""
    try:
        schema = pl.read_parquet_schema(path)
        total = int(pl.scan_parquet(path).select(pl.len()).collect().item())
    except (pl.exceptions.PolarsError, OSError) as error:
        raise InputError(
            f"{path}: is damaged or cut Parquet ({_first_line(error)}); export it anew"
        ) from None
    for name, dtype in schema.items():
        if not dtype.is_numeric():
            raise InputError(f"{path}: column {name!r} holds {dtype}; numbers are expected")

    def rows() -> Iterator[BinaryRows]:
        for done in range(0, total, _ROWS):
            part = pl.scan_parquet(path).slice(done, _ROWS).select(pl.all().cast(pl.Float64))
            try:
                frame = part.collect()
            except (pl.exceptions.PolarsError, OSError) as error:
                where = f"{path}: row {done + 1} or after"
                raise InputError(f"{where}: damaged Parquet ({_first_line(error)}); export it anew") from None
            yield BinaryRows(done + 1, [c.to_numpy() for c in frame], (done + frame.height) / total)

    return tuple(schema), rows


def open_npz(path: Path) -> tuple[tuple[str, ...], RowStream]:
    """Return array names and a stream of one piece; InputError if damaged, not 1-D, or of unequal lengths."""
    arrays: dict[str, FloatArray] = {}
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            for name in archive.files:
                arrays[name] = np.asarray(archive[name], dtype=np.float64)
    except (OSError, ValueError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path}: cannot be read as .npz ({_first_line(error)}); expected one numeric array per channel"
        ) from None
    if not arrays:
        raise InputError(f"{path}: holds no array; expected one numeric array per channel")
    lengths = {name: value.shape for name, value in arrays.items()}
    first = next(iter(lengths.values()))
    for name, shape in lengths.items():
        if len(shape) != 1 or shape != first:
            raise InputError(
                f"{path}: array {name!r} has shape {shape}; expected {first[:1]} like the first one"
            )

    def rows() -> Iterator[BinaryRows]:
        yield BinaryRows(1, list(arrays.values()), 1.0)

    return tuple(arrays), rows


def _first_line(error: BaseException) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
