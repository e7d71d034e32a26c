"""The last stretch of a running loop's channels, kept so that an alarm comes with the data around it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cablecomp.diagnosis.locate.covariates import covariates
from cablecomp.diagnosis.locate.location import Location, locate
from cablecomp.diagnosis.locate.series import make_series
from cablecomp.errors import InputError
from cablecomp.signal.smoothing import FloatArray


class Ring:
    """A ring of rows of fixed channels: constant memory, O(1) per row.

    `channels`: names of the columns, `time_s` first; `capacity`: rows kept. Raises InputError if either
    is unusable.
    """

    def __init__(self, channels: Sequence[str], capacity: int) -> None:
        if not channels or channels[0] != "time_s" or capacity < 2:
            raise InputError("a ring needs time_s as its first channel and room for 2 rows or more")
        self.channels = tuple(channels)
        self._rows = np.full((capacity, len(channels)), np.nan)
        self._next = 0
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def extend(self, rows: FloatArray) -> None:
        """Keep rows, an array of (rows, channels), oldest first; the oldest go when the ring is full."""
        rows = rows[-len(self._rows) :]
        self._rows[(self._next + np.arange(len(rows))) % len(self._rows)] = rows
        self._next = (self._next + len(rows)) % len(self._rows)
        self._count = min(self._count + len(rows), len(self._rows))

    def columns(self) -> dict[str, FloatArray]:
        """Return the rows kept, oldest first, as columns that a recording is written from."""
        order = (self._next - self._count + np.arange(self._count)) % len(self._rows)
        return {name: self._rows[order, index].copy() for index, name in enumerate(self.channels)}


def locate_in_ring(
    ring: Ring, sigma_rad: float, rng: np.random.Generator, since_s: float | None = None
) -> Location:
    """Locate the mismatch in the ring's rows (with a `residual_rad` channel), from `since_s` on if that
    leaves enough.

    Raises InputError if there is no `residual_rad` channel or fewer than 200 complete rows.
    """
    columns = ring.columns()
    residual = columns.pop("residual_rad", None)
    if residual is None:
        raise InputError("the ring has no residual_rad channel; put it among its channels")
    needed = [
        columns[name] for name in ("time_s", "motor_position_rad", "joint_torque_Nm") if name in columns
    ]
    good = np.isfinite(residual) & np.all(np.isfinite(needed), axis=0)
    if since_s is not None and int(np.sum(good & (columns["time_s"] >= since_s))) >= 200:
        good &= columns["time_s"] >= since_s
    if int(good.sum()) < 200:
        raise InputError(
            f"locating needs 200 complete rows, the ring holds {int(good.sum())}; wait, or widen it"
        )
    kept = {name: values[good] for name, values in columns.items()}
    return locate(make_series(residual[good], sigma_rad, covariates(kept)), rng)
