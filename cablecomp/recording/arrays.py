"""Recordings that are in memory already: arrays by name, or a frame of pandas or polars."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from cablecomp.errors import InputError
from cablecomp.recording.channels import parse_header
from cablecomp.recording.mapping import ColumnMap, columns_by
from cablecomp.recording.raw import NumberRows, RawRows
from cablecomp.recording.reader import Recording, open_recording
from cablecomp.recording.table import FloatArray

BLOCK = 65_536


def as_recording(source: Any, mapping: ColumnMap | None = None, name: str = "recording") -> Recording:
    """A path opened, or columns in memory taken as a recording: the same names, units and checks as in a file.

    `source`: a path; or columns by name, such as `{"time_ms": ..., "motor_position_deg": ...}`; or a frame with
    `columns` and `[name]`. Raises InputError for columns that are not channels, not numbers, or of unequal length.
    """
    if isinstance(source, str | Path):
        return open_recording(source, mapping)
    if isinstance(source, pl.LazyFrame):
        source = source.collect()
    names = list(source) if isinstance(source, Mapping) else list(getattr(source, "columns", ()))
    if not names or not all(isinstance(n, str) for n in names):
        raise InputError(
            f"{name}: a path, arrays by name, or a frame with named columns is accepted, not {type(source).__name__}"
        )
    arrays = {n: _numbers(name, n, source[n]) for n in names}
    if len({len(a) for a in arrays.values()}) != 1:
        shown = ", ".join(f"{n}: {len(a)}" for n, a in arrays.items())
        raise InputError(f"{name}: columns of one length are accepted; found {shown}")
    try:
        columns = parse_header(names) if mapping is None else columns_by(mapping, names, {})
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    found = Recording(Path(name), columns, (), "arrays", "row", lambda: _blocks(arrays))
    found.require(["time_s"], "as the clock of every recording (time_s, time_ms, time_us, ...)")
    return found


def _numbers(name: str, column: str, values: Any) -> FloatArray:
    try:
        kept = values if hasattr(getattr(values, "dtype", None), "kind") else np.asarray(values)
        if kept.dtype.kind in "mM":  # as numbers they would be ticks of whatever unit they are kept in
            raise InputError(
                f"{name}: column {column!r} holds dates or durations; numbers in the unit of its name are accepted, "
                "such as (t - t[0]) / np.timedelta64(1, 's')"
            )
        if kept.dtype.kind == "c":
            raise InputError(
                f"{name}: column {column!r} holds complex numbers; real ones are accepted, such as z.real"
            )
        found = np.ma.filled(np.ma.asanyarray(kept, dtype=np.float64), np.nan)  # masked: no reading
    except (TypeError, ValueError):
        raise InputError(f"{name}: column {column!r} does not hold numbers") from None
    if found.ndim != 1 or not len(found):
        raise InputError(f"{name}: column {column!r} has shape {found.shape}; one row of numbers is accepted")
    return found


def _blocks(arrays: Mapping[str, FloatArray]) -> Iterator[RawRows]:
    count = len(next(iter(arrays.values())))
    for first in range(0, count, BLOCK):
        last = min(first + BLOCK, count)
        yield NumberRows(first + 1, {n: a[first:last] for n, a in arrays.items()}, last / count)


def columns_of(
    sources: Any, mapping: ColumnMap | None = None, gaps: bool = True
) -> dict[str, dict[str, FloatArray]]:
    """Canonical columns of one recording or several (a list, or by name), by name."""
    several = _several(sources)
    found = {}
    for name, source in several.items():
        recording = replace(as_recording(source, mapping, name), gaps=gaps)
        blocks = list(recording.blocks())
        found[name] = {c: np.concatenate([b.columns[c] for b in blocks]) for c in recording.channels}
    return found


def _several(sources: Any) -> dict[str, Any]:
    if isinstance(sources, str | Path):
        return {str(sources): sources}
    if isinstance(sources, Mapping) and sources and all(_is_recording(v) for v in sources.values()):
        return {str(k): v for k, v in sources.items()}
    if isinstance(sources, Sequence):
        return {
            str(s) if isinstance(s, str | Path) else f"recording-{k + 1}": s for k, s in enumerate(sources)
        }
    return {"recording": sources}


def _is_recording(value: Any) -> bool:
    """Whether a value is a recording by itself: a path, arrays by name, a frame."""
    return isinstance(value, str | Path | Mapping | pl.LazyFrame) or (
        hasattr(value, "columns") and not hasattr(value, "dtype")
    )
