"""Choosing rows of a long stream for display, so that no extreme is lost and loops stay true."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cablecomp.recording.table import FloatArray


class RowThinner:
    """Keeps whole rows: in each of up to 2 `buckets` equal stretches the first and the extremes of `keys`.

    The number of rows need not be known: when there are too many stretches they are joined in pairs. Rows are
    taken whole, so that a loop of two channels drawn from them goes through measured points only.
    """

    def __init__(self, channels: Sequence[str], keys: Sequence[str], buckets: int = 700) -> None:
        self.channels = tuple(channels)
        self._keys = [self.channels.index(key) + 1 for key in keys]
        self._limit = buckets
        self._stride = 1
        self._rows = 0
        self._kept: FloatArray = np.empty((0, 1 + 2 * len(keys), len(channels) + 1))
        self._rest: FloatArray = np.empty((0, len(channels) + 1))

    def add(self, columns: Mapping[str, FloatArray]) -> None:
        """Take in rows; NaN is allowed and is never an extreme."""
        count = len(columns[self.channels[0]])
        index = np.arange(self._rows, self._rows + count, dtype=np.float64)
        self._rows += count
        rows = np.concatenate(
            [self._rest, np.stack([index, *(columns[name] for name in self.channels)], axis=1)]
        )
        while len(self._kept) + len(rows) // self._stride > 2 * self._limit:
            self._join()
        full = len(rows) // self._stride * self._stride
        self._rest = rows[full:]
        if full:
            fresh = self._extremes(rows[:full].reshape(-1, self._stride, rows.shape[1]))
            self._kept = np.concatenate([self._kept, fresh])

    def rows(self) -> dict[str, FloatArray]:
        """Return the rows kept, in their order; `row` is the index in the stream."""
        everything = np.concatenate([self._kept.reshape(-1, self._rest.shape[1]), self._tail()])
        _, first = np.unique(everything[:, 0], return_index=True)
        kept = everything[first]
        return {"row": kept[:, 0]} | {name: kept[:, k + 1] for k, name in enumerate(self.channels)}

    def _tail(self) -> FloatArray:
        if len(self._rest) < 2:
            return self._rest
        extremes = self._extremes(self._rest[None])[0]
        return np.concatenate([extremes, self._rest[-1:]])

    def _join(self) -> None:
        self._stride *= 2
        if not len(self._kept):
            return
        if len(self._kept) % 2:  # an odd one out is joined with itself: order and extremes stay
            self._kept = np.concatenate([self._kept, self._kept[-1:]])
        pairs = self._kept.reshape(len(self._kept) // 2, -1, self._kept.shape[2])
        self._kept = self._extremes(pairs)

    def _extremes(self, buckets: FloatArray) -> FloatArray:
        chosen: list[NDArray[np.intp]] = [np.zeros(len(buckets), dtype=np.intp)]
        for key in self._keys:
            values = buckets[:, :, key]
            chosen.append(np.where(np.isnan(values), np.inf, values).argmin(axis=1))
            chosen.append(np.where(np.isnan(values), -np.inf, values).argmax(axis=1))
        picked: FloatArray = np.take_along_axis(buckets, np.stack(chosen, axis=1)[:, :, None], axis=1)
        return picked
