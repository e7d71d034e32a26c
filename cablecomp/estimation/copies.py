"""Readings that stand twice among those of a diagnosis: a copy, a log appended to itself, two exports that overlap."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from hashlib import blake2b
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cablecomp.signal.smoothing import BoolArray, FloatArray

FEWEST: Final = 100
"""Rows on end in which something changes that no sensor repeats to the last digit, and when."""
LEAST: Final = 0.1
"""Least share of a recording's changing rows that is worth a line."""

_Prints = NDArray[np.uint64]


def same_readings(recordings: Mapping[str, Mapping[str, FloatArray]]) -> Iterator[str]:
    """A line for each recording of which a tenth or more holds, number by number, what stands before it, there or in
    one before it, whatever its times: what is left out is no evidence where it is fitted elsewhere."""
    names, prints = list(recordings), [_prints(c) for c in recordings.values()]
    begins = np.cumsum([0, *map(len, prints)])
    rows = np.concatenate([*prints, np.zeros(0, dtype=np.uint64)])
    _, first, which = np.unique(rows, return_index=True, return_inverse=True)
    back = np.arange(len(rows)) - first[which]
    changes = np.concatenate(([True], rows[1:] != rows[:-1]))[: len(rows)]  # a joint at rest repeats itself
    for k, name in enumerate(names):
        own = slice(begins[k], begins[k + 1])
        lags, count = np.unique(back[own][changes[own] & (back[own] > 0)], return_counts=True)
        lag = int(lags[np.argmax(count)]) if len(lags) else 0
        if not lag:
            continue
        from_row = max(int(begins[k]), lag)
        again = from_row + _longest_run(rows[from_row : own.stop] == rows[from_row - lag : own.stop - lag])
        of = np.searchsorted(begins, again - lag, "right") - 1
        again = again[of == of[:1]]
        if changes[again].sum() >= max(FEWEST, LEAST * changes[own].sum()):
            source = names[of[0]]
            then = recordings[source]["time_s"][again - lag - begins[of[0]]]
            yield _line(name, recordings[name]["time_s"], again - begins[k], source, then)


def _prints(columns: Mapping[str, FloatArray]) -> _Prints:
    """A number for each row, of the names and bits of all that was read at it but the time."""
    found = np.zeros(len(columns["time_s"]), dtype=np.uint64)
    for channel in sorted(set(columns) - {"time_s"}):
        one, two = np.frombuffer(blake2b(channel.encode(), digest_size=16).digest(), dtype=np.uint64)
        bits = np.ascontiguousarray(columns[channel], dtype=np.float64).view(np.uint64)
        mixed = (bits ^ one) * (two | np.uint64(1))
        mixed ^= mixed >> np.uint64(29)
        found += mixed * (one | np.uint64(1))
    return found


def _longest_run(equal: BoolArray) -> NDArray[np.int64]:
    """Places of the longest run of equal rows; none where none is."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], equal, [False])).astype(np.int8)))
    begins, ends = edges[::2], edges[1::2]
    k = int(np.argmax(ends - begins)) if len(begins) else None
    return np.arange(0) if k is None else np.arange(begins[k], ends[k])


def _line(name: str, time: FloatArray, again: NDArray[np.int64], source: str, then: FloatArray) -> str:
    if source != name and len(again) == len(time):
        return f"{name}: holds the same readings as {source}, which count twice so: leave one of them out"
    which = "" if source == name else f" of {source}"
    return (
        f"{name}: {time[again[0]]:.6g} to {time[again[-1]]:.6g} s hold the same readings as {then[0]:.6g} to "
        f"{then[-1]:.6g} s{which}, which count twice so: cut one of them out"
    )
