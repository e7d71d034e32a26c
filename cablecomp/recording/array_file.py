"""Recordings in arrays: NumPy .npz, streamed, and MATLAB .mat; a row is counted from 1."""

from __future__ import annotations

import math
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any, Final, Literal, NamedTuple

import numpy as np
from numpy.lib import format as npy

from cablecomp.errors import InputError
from cablecomp.recording.channels import is_channel
from cablecomp.recording.raw import NumberRows, RawTable
from cablecomp.recording.table import FloatArray

_ROWS: Final = 1 << 17
_MOST_VALUES: Final = 1 << 27
_MOST_COLUMNS: Final = 4096
_EXPECTED: Final = "expected one numeric array per channel, all of one length"


def open_npz(path: Path) -> RawTable:
    """Open .npz; an array of n x k is k columns `name[0]`..., one of no numbers (a remark) is left out and named.

    InputError if damaged, or of unequal lengths.
    """
    heads: dict[str, tuple[tuple[int, ...], np.dtype[Any]]] = {}
    odd = []
    try:
        with zipfile.ZipFile(path) as archive:
            if "[Content_Types].xml" in archive.namelist():
                raise InputError(f"{path}: is an Excel workbook; save its sheet as CSV")
            for info in archive.infolist():
                try:
                    heads[info.filename] = _npy_head(archive, info)
                except _NotRowsError as error:
                    if is_channel(info.filename.removesuffix(".npy")):
                        raise
                    odd.append(str(error))
    except (
        OSError,
        ValueError,
        EOFError,
        NotImplementedError,  # packed in a way that zipfile does not know
        RuntimeError,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise InputError(f"{path}: cannot be read as .npz ({first_line(error)}); {_EXPECTED}") from None
    shapes = {name.removesuffix(".npy"): shape for name, (shape, _) in heads.items()}
    columns, notes = columns_of(path, shapes)

    def read(names: Sequence[str]) -> Iterator[NumberRows]:
        members = list(dict.fromkeys(columns[name][0] for name in names))
        try:
            yield from _read_npz(path, members, {name: columns[name] for name in names}, heads)
        except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
            raise InputError(f"{path}: damaged .npz ({first_line(error)}); save it anew") from None

    return RawTable(
        tuple(columns), read, notes=(*notes, *([f"left out: {', '.join(odd[:12])}"] if odd else []))
    )


class _NotRowsError(ValueError):
    """An array is none of rows of numbers."""


class ArrayColumns(NamedTuple):
    """`columns`: name -> (array, column in it); `notes`: what was left out."""

    columns: dict[str, tuple[str, int]]
    notes: tuple[str, ...]


def columns_of(path: Path, shapes: Mapping[str, tuple[int, ...]]) -> ArrayColumns:
    """The columns of arrays that share the length that most have; others (parameters, say) are left out.

    InputError if there is no array, or one that is named as a channel is of another length.
    """
    lengths = Counter(shape[0] for shape in shapes.values() if shape and 0 not in shape)
    if not lengths:
        raise InputError(f"{path}: holds no array; {_EXPECTED}")
    rows = max(lengths, key=lambda n: (n > 1, lengths[n], n))
    found: dict[str, tuple[str, int]] = {}
    left_out = []
    for name, shape in shapes.items():
        width = math.prod(shape[1:])
        if not shape or len(shape) > 2 or shape[0] != rows:
            if is_channel(name):
                raise InputError(f"{path}: array {name!r} has shape {shape}; {_EXPECTED}, here {rows}")
            left_out.append(f"{name} {shape}")
            continue
        if len(found) + width > _MOST_COLUMNS:
            raise InputError(f"{path}: has more than {_MOST_COLUMNS} columns; is it turned over? {_EXPECTED}")
        found |= {(name if width == 1 else f"{name}[{k}]"): (name, k) for k in range(width)}
    words = f"arrays of another length left out: {', '.join(left_out[:12])}"
    return ArrayColumns(found, (words,) if left_out else ())


def _npy_head(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> tuple[tuple[int, ...], np.dtype[Any]]:
    with archive.open(info) as file:
        return _read_head(file, info.filename)


def _read_head(file: IO[bytes], name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    version = npy.read_magic(file)
    reader = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, fortran, dtype = reader(file)
    if dtype.kind not in "fiub":
        raise _NotRowsError(f"array {name.removesuffix('.npy')!r} holds {dtype}, not numbers")
    if fortran and len(shape) > 1 and math.prod(shape[1:]) > 1:
        raise _NotRowsError(f"array {name.removesuffix('.npy')!r} is stored by columns (Fortran order)")
    return tuple(int(n) for n in shape), dtype


def _read_npz(
    path: Path,
    members: Sequence[str],
    columns: Mapping[str, tuple[str, int]],
    heads: Mapping[str, tuple[tuple[int, ...], np.dtype[Any]]],
) -> Iterator[NumberRows]:
    """Read all members side by side, a block of rows at a time: memory does not grow with the file."""
    with zipfile.ZipFile(path) as archive, ExitStack() as stack:
        files = {}
        for name in members:
            files[name] = stack.enter_context(archive.open(f"{name}.npy"))
            _read_head(files[name], name)
        total = heads[f"{members[0]}.npy"][0][0]
        for done in range(0, total, _ROWS):
            count = min(_ROWS, total - done)
            parts = {name: _rows_of(files[name], *heads[f"{name}.npy"], count) for name in members}
            arrays = {
                column: np.ascontiguousarray(parts[name][:, k]) for column, (name, k) in columns.items()
            }
            yield NumberRows(done + 1, arrays, (done + count) / total)


def _rows_of(file: IO[bytes], shape: tuple[int, ...], dtype: np.dtype[Any], count: int) -> FloatArray:
    width = math.prod(shape[1:])
    data = file.read(count * width * dtype.itemsize)
    return np.frombuffer(data, dtype).astype(np.float64).reshape(count, width)


def open_mat(path: Path) -> RawTable:
    """Open a MATLAB file up to version 7.2; InputError if damaged or it holds no numeric arrays of one length.

    Vectors may lie either way; structures are not looked into.
    """
    from scipy.io import loadmat, whosmat  # a slow import, for this format alone

    try:
        numeric = ("double", "single", "logical")
        listed = whosmat(str(path))
        held = {
            name: tuple(int(n) for n in shape)
            for name, shape, kind in listed
            if kind in numeric or kind.startswith(("int", "uint"))
        }
    except Exception as error:  # whatever scipy's parser makes of a damaged file
        raise InputError(f"{path}: is a damaged MATLAB file ({first_line(error)}); save it anew") from None
    if _is_cut(path):
        raise InputError(f"{path}: MATLAB file without its end, it was cut short; copy or save it anew")
    structures = [name for name, _, kind in listed if kind == "struct"]
    if structures and not any(max(shape, default=0) > 1 for shape in held.values()):
        raise InputError(
            f"{path}: holds structures ({', '.join(structures[:12])}), which are not looked into; save one's fields as "
            f"arrays: save('recording.mat', '-struct', '{structures[0]}')"
        )
    if sum(math.prod(shape) for shape in held.values()) > _MOST_VALUES:
        raise InputError(f"{path}: holds more than {_MOST_VALUES:,} numbers; save it in parts, or as CSV")
    shapes = {name: _upright(shape) for name, shape in held.items()}
    columns, notes = columns_of(path, shapes)

    def read(names: Sequence[str]) -> Iterator[NumberRows]:
        wanted = list(dict.fromkeys(columns[name][0] for name in names))
        try:
            content = loadmat(str(path), variable_names=wanted)
            whole = {
                name: np.asarray(content[name], dtype=np.float64).reshape(shapes[name][0], -1)
                if 1 in held[name]
                else np.asarray(content[name], dtype=np.float64)
                for name in wanted
            }
        except Exception as error:
            raise InputError(
                f"{path}: is a damaged MATLAB file ({first_line(error)}); save it anew"
            ) from None
        arrays = {name: np.ascontiguousarray(whole[columns[name][0]][:, columns[name][1]]) for name in names}
        yield NumberRows(1, arrays, 1.0)

    return RawTable(tuple(columns), read, notes=notes)


def _is_cut(path: Path) -> bool:
    """Whether the last of the file's elements (MAT-file level 5: type and size of 32 bits each, then the data) ends
    beyond the file."""
    size, place = path.stat().st_size, 128
    with path.open("rb") as file:
        order: Literal["little", "big"] = "little" if file.read(128).endswith(b"IM") else "big"
        while place + 8 <= size:
            file.seek(place + 4)
            place += 8 + int.from_bytes(file.read(4), order)
    return place != size


def _upright(shape: tuple[int, ...]) -> tuple[int, ...]:
    """MATLAB's vectors are 1 x n or n x 1: both are n rows."""
    return (max(shape),) if len(shape) == 2 and 1 in shape else shape


def first_line(error: BaseException) -> str:
    """The first line of a foreign error's text, else its kind."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
