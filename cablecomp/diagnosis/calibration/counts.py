"""Where a motor stands inside one count of its encoder, which nobody sees: a place for each rest and way of the load.

A drive that rests leans on one edge of a count or the other, as the load pulls: that follows the load's direction, as
friction does, and would be taken for it. So each place is found beside the zeros, with a count's even spread as prior.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import INPUT, JOINT, Evidence
from cablecomp.estimation.simulate import load_of
from cablecomp.signal.noise import channel_noise, reading_sigma
from cablecomp.signal.smoothing import FloatArray

WITHIN: Final = 1.5
"""Counts within which a motor rests: one, and flickering to the next."""
LEAST_S: Final = 0.2
"""A rest lasts as long as this; what moves on averages out over its counts."""
TURNED: Final = 0.05
"""Share of the load's range by which it has come back when it has turned."""
MOST: Final = 100
"""Rests of a recording that get a place of their own, the longest."""


def count_rad(columns: Mapping[str, FloatArray]) -> float:
    """The motor angle's resolution as a recording shows it [rad]; 0 where it cannot be told."""
    try:
        return float(channel_noise(columns["time_s"], columns[INPUT]).resolution)
    except InputError:
        return 0.0


def with_places(config: JointConfig, e: Evidence, count: float) -> Evidence:
    """The recording with a carry-over of the joint's angle for each rest, of the size that a place drawn evenly from a
    count [rad of the motor] has in RMS."""
    rests = sorted(_rests(config, e, count), key=lambda r: r.start - r.stop)[:MOST]
    if not rests or JOINT not in e.counted:
        return e
    columns = np.zeros((len(e.rows), len(rests)))
    for k, rest in enumerate(rests):
        columns[rest, k] = config.drive.ratio * reading_sigma(None, count)
    known = e.carryover.get(JOINT)
    both = columns if known is None else np.column_stack((known, columns))
    return replace(e, carryover={**e.carryover, JOINT: both})


def _rests(config: JointConfig, e: Evidence, count: float) -> Iterator[slice]:
    """Judged rows through which the motor rests while the load goes one way."""
    time = e.at_rows("time_s")
    whole = np.broadcast_to(np.asarray(load_of(config, e.columns)), e.columns["time_s"].shape)
    motor, load = e.at_rows(INPUT).tolist(), whole[e.rows].tolist()
    back = TURNED * float(np.ptp(whole))
    begin = 0
    while begin < len(time) - 1:
        end = _end_of_rest(motor, load, begin, WITHIN * count, back)
        if time[end] - time[begin] >= LEAST_S:
            yield slice(begin, end + 1)
        begin = end + 1


def _end_of_rest(motor: list[float], load: list[float], begin: int, within: float, back: float) -> int:
    """The last row before the motor leaves where it rests at `begin`, or at which the load turns."""
    low = high = motor[begin]
    least = most = begin
    way = 0
    for k in range(begin, len(motor)):
        low, high = min(low, motor[k]), max(high, motor[k])
        if high - low > within:
            return k - 1
        m = load[k]
        least, most = (k if m < load[least] else least), (k if m > load[most] else most)
        rose, fell = m - load[least] > back, load[most] - m > back
        if way == 0:
            way = 1 if rose else -1 if fell else 0
        elif (way > 0 and fell) or (way < 0 and rose):
            return most if way > 0 else least
    return len(motor) - 1
