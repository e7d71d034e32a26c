"""A recording that is whole read in time: what comes late there is known, not guessed.

Live, a joint whose torque is stamped late can but carry its deflection on along the last of its way
(`effects/clock_skew.py`), and is wrong at every corner. A recording holds what was read afterwards. So the drive is run
under the loads that were felt, M(t + d_M), turning points of the load between two rows among them, and its joint is
read when that was stamped:

    joint(t) = N q(t - d) + bent(t - d),  bent(t) = joint of the drive - N q(t)

with d the joint's delay, d_M the torque's, N the rigid drive's ratio, q the motor's angle, on fine rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cablecomp.effects.base import Late
from cablecomp.effects.clock_skew import LONGEST_S
from cablecomp.estimation.evidence import INPUT, Evidence
from cablecomp.estimation.thinning import TURN, turns
from cablecomp.observer.rows import Readings, readings
from cablecomp.signal.smoothing import BoolArray, FloatArray, rate_of

EVENLY: Final = 0.2
"""Of what a rate changes by from row to row, how far off its mean may be where it bends evenly; twice as far off it
counts as straight, and in between as partly bent (at a corner it is off by half)."""
LEAST: Final = 1e-300
"""So that a rate that does not change at all divides nothing by zero."""


def with_felt_loads(
    read: Readings, recording: Evidence, load: FloatArray, late_s: float
) -> tuple[Readings, BoolArray]:
    """The readings under the loads that were felt when they were stamped, `load` [N m] on fine rows being stamped
    `late_s` [s] late, with a row for each turning point; and which rows are the readings' own."""
    time = recording.columns["time_s"]
    turning = time[turns(load, TURN * float(np.ptp(load)))] - late_s
    turning = turning[(turning > read.time[0]) & (turning < read.time[-1])]
    before = np.searchsorted(read.time, turning, side="right")
    own = np.ones(len(read.time) + len(turning), dtype=np.bool_)
    own[before + np.arange(len(turning))] = False
    felt = readings(len(own), 0)
    felt.rows[own], felt.rows[~own] = read.rows, read.rows[before - 1]
    felt.time[~own] = turning
    felt.motor[~own] = read_at(turning, time, recording.columns[INPUT], recording.motor_rate)
    felt.motor_rate[~own] = np.interp(turning, time, recording.motor_rate)
    felt.load[:] = read_at(felt.time + late_s, time, load, rate_of(load, time))
    return felt, own


def joint_as_stamped(
    joint: FloatArray, at: FloatArray, recording: Evidence, late: Sequence[Late], N: float
) -> FloatArray:
    """The readings [rad] that are stamped at these times [s] of a joint that stood at `joint` [rad], behind a drive of
    ratio N."""
    time, motor = recording.columns["time_s"], recording.columns[INPUT]
    seen = at.copy()
    for one in late:
        since = at[0] if np.isnan(one.since_s) else one.since_s
        seen -= np.clip(one.joint_s + one.drift * (at - since), -LONGEST_S, LONGEST_S)
    bent = joint - N * np.interp(
        at, time, motor
    )  # of these times each is a row's, or lies between two of a corner
    return N * read_at(seen, time, motor, recording.motor_rate) + read_at(seen, at, bent, rate_of(bent, at))


def read_at(wanted: FloatArray, time: FloatArray, values: FloatArray, rate: FloatArray) -> FloatArray:
    """Values at other times: between two of them by a cubic where their `rate` (a second's change; NaN: unknown) bends
    evenly and straight at corners, the first before all, and on beyond the last as over the last so much time.

    Straight throughout, a step h of the time hides h^2/8 of an acceleration, which seems an inertia.
    """
    k = np.clip(np.searchsorted(time, wanted, side="right") - 1, 0, max(len(time) - 2, 0))
    after = np.minimum(k + 1, len(time) - 1)
    length = np.maximum(time[after] - time[k], LEAST)
    part = np.clip((wanted - time[k]) / length, 0.0, 1.0)
    straight = (values[after] - values[k]) / length
    begins, ends = rate[k] - straight, rate[after] - straight
    even = np.clip(2.0 - np.abs(begins + ends) / (EVENLY * np.abs(ends - begins) + LEAST), 0.0, 1.0)
    bent = np.where(np.isfinite(even), even * ((1.0 - part) * begins - part * ends), 0.0)
    found = values[k] + length * part * (straight + (1.0 - part) * bent)
    over = wanted - time[-1]
    most = float(over.max(initial=0.0))
    if most > 0.0 and time[-1] > time[0]:
        back = min(max(most, float(time[-1] - time[-2])), float(time[-1] - time[0]))
        slope = (values[-1] - np.interp(time[-1] - back, time, values)) / back
        found = np.where(over > 0.0, values[-1] + slope * over, found)
    return np.asarray(found, dtype=np.float64)
