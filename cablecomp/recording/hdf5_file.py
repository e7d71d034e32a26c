"""Recordings in HDF5, MATLAB's own of version 7.3 among them (optional package `h5py`), streamed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from cablecomp.errors import InputError
from cablecomp.recording.array_file import columns_of, first_line
from cablecomp.recording.packages import package
from cablecomp.recording.raw import NumberRows, RawTable

_ROWS: Final = 1 << 17
_MOST_CHUNK: Final = 1 << 26


def open_hdf5(path: Path) -> RawTable:
    """Open HDF5: every numeric data set is a column (`GROUP/NAME`), one of n x k is k columns.

    MATLAB lays arrays down turned over; its vectors may lie either way. InputError if damaged or of unequal
    lengths.
    """
    h5py = package("h5py", path, "hdf5", "HDF5 (MATLAB 7.3)")
    shapes: dict[str, tuple[int, ...]] = {}
    turned: set[str] = set()

    def look(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or item.shape is None:  # a data set of nothing
            return
        if item.dtype.kind not in "fiub" or name.startswith("#"):
            return
        if item.chunks is not None and math.prod(item.chunks) * item.dtype.itemsize > _MOST_CHUNK:
            raise ValueError(f"{name!r} is stored in chunks of over {_MOST_CHUNK >> 20} MB")
        shape = tuple(int(n) for n in item.shape)
        if "MATLAB_class" in item.attrs and len(shape) == 2:
            turned.add(name)
            shape = (max(shape),) if 1 in shape else shape[::-1]
        shapes[name] = shape

    try:
        with h5py.File(path, "r") as file:
            file.visititems(look)
    except InputError:
        raise
    except Exception as error:  # whatever the package makes of a damaged file
        raise InputError(f"{path}: cannot be read as HDF5 ({first_line(error)}); save it anew") from None
    columns, notes = columns_of(path, shapes)

    def read(names: Sequence[str]) -> Iterator[NumberRows]:
        total = shapes[columns[names[0]][0]][0]
        try:
            with h5py.File(path, "r") as file:
                for done in range(0, total, _ROWS):
                    part = slice(done, min(done + _ROWS, total))
                    arrays = {}
                    for column in names:
                        name, k = columns[column]
                        arrays[column] = _values(file[name], part, k, name in turned)
                    yield NumberRows(done + 1, arrays, part.stop / total)
        except Exception as error:
            raise InputError(f"{path}: damaged HDF5 ({first_line(error)}); save it anew") from None

    return RawTable(tuple(columns), read, notes=notes)


def _values(data: Any, rows: slice, k: int, turned: bool) -> Any:
    if data.ndim == 1:
        values = data[rows]
    elif turned and 1 in data.shape:
        values = data[:, rows].ravel() if data.shape[0] == 1 else data[rows, :].ravel()
    else:
        values = data[k, rows] if turned else data[rows, k]
    return np.ascontiguousarray(values, dtype=np.float64)
