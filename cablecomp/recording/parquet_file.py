"""Recordings in Parquet, streamed; what we write states a checksum of every column, which reading checks."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
import polars.selectors as cs

from cablecomp.errors import InputError
from cablecomp.recording.array_file import first_line
from cablecomp.recording.native import held_errors
from cablecomp.recording.raw import NumberRows, RawTable
from cablecomp.recording.table import FloatArray

_ROWS: Final = 1 << 17
_CHECKSUMS: Final = "cablecomp.crc32"
_FAILURES: Final = (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError)


def open_parquet(path: Path) -> RawTable:
    """Open Parquet; InputError if damaged or a column is not of numbers. Dates (from 1970) and durations are in s.

    Damage that changes values shows only in a file that states checksums; a note says if it does not.
    """
    try:
        with held_errors():
            schema = pl.read_parquet_schema(path)
            total = int(pl.scan_parquet(path).select(pl.len()).collect().item())
            stated = pl.read_parquet_metadata(path).get(_CHECKSUMS)
        sums = {} if stated is None else {str(k): int(v) for k, v in json.loads(stated).items()}
    except (*_FAILURES, ValueError, AttributeError) as error:
        raise InputError(f"{path}: is damaged or cut Parquet ({first_line(error)}); export it anew") from None

    dated = [name for name, kind in schema.items() if isinstance(kind, pl.Datetime | pl.Duration)]

    def read(names: Sequence[str]) -> Iterator[NumberRows]:
        for name in names:
            if not (schema[name].is_numeric() or schema[name] == pl.Boolean or name in dated):
                raise InputError(f"{path}: column {name!r} holds {schema[name]}; numbers are expected")
        found = dict.fromkeys(names, 0)
        for done in range(0, total, _ROWS):
            arrays = _slice(path, done, names)
            found = {name: zlib.crc32(_bits(arrays[name]), crc) for name, crc in found.items()}
            yield NumberRows(done + 1, arrays, min(done + _ROWS, total) / total)
        for name, crc in found.items():
            if sums and sums.get(name) != crc:
                raise InputError(
                    f"{path}: damaged Parquet (the checksum of {name!r} is wrong); export it anew"
                )

    notes = (
        () if sums else ("Parquet that states no checksums: a value that was damaged would not be noticed",)
    )
    return RawTable(tuple(schema), read, units=dict.fromkeys(dated, "s"), notes=notes)


def write_parquet(path: Path, columns: Mapping[str, FloatArray]) -> None:
    """Write columns with their checksums; OSError if the disk does not take them."""
    sums = {name: zlib.crc32(_bits(values)) for name, values in columns.items()}
    try:
        pl.DataFrame(dict(columns)).write_parquet(path, metadata={_CHECKSUMS: json.dumps(sums)})
    except _FAILURES as error:
        raise OSError(first_line(error)) from None


def _slice(path: Path, first: int, names: Sequence[str]) -> dict[str, FloatArray]:
    times = [cs.datetime().dt.timestamp("ns") / 1e9, cs.duration().dt.total_nanoseconds() / 1e9]
    try:
        with held_errors():
            rows = pl.scan_parquet(path).slice(first, _ROWS).select(names)
            frame = rows.with_columns(times).cast(pl.Float64).collect()
    except _FAILURES as error:
        where = f"{path}: row {first + 1} or after"
        raise InputError(f"{where}: damaged Parquet ({first_line(error)}); export it anew") from None
    return {name: frame[name].to_numpy() for name in names}


def _bits(values: FloatArray) -> bytes:
    """The bytes of the values, little endian, every NaN alike."""
    return np.where(np.isnan(values), np.nan, values).astype("<f8").tobytes()
