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

import numpy as np

from cablecomp.effects.base import Late
from cablecomp.effects.clock_skew import LONGEST_S
from cablecomp.estimation.evidence import INPUT, Evidence
from cablecomp.estimation.thinning import TURN, turns
from cablecomp.observer.rows import Readings, readings
from cablecomp.signal.between import rate_of, read_at
from cablecomp.signal.smoothing import BoolArray, FloatArray


def with_felt_loads(
    read: Readings, recording: Evidence, channel: str, load: FloatArray, late_s: float
) -> tuple[Readings, BoolArray]:
    """The readings under the loads that were felt when they were stamped, `load` [N m] on fine rows, out of `channel`,
    being stamped `late_s` [s] late, with a row for each turning point; and which rows are the readings' own."""
    time = recording.columns["time_s"]
    rate, turned = _course(recording, channel, load)
    turning = turned - late_s
    turning = turning[(turning > read.time[0]) & (turning < read.time[-1])]
    before = np.searchsorted(read.time, turning, side="right")
    own = np.ones(len(read.time) + len(turning), dtype=np.bool_)
    own[before + np.arange(len(turning))] = False
    felt = readings(len(own), 0)
    felt.rows[own], felt.rows[~own] = read.rows, read.rows[before - 1]
    felt.time[~own] = turning
    felt.motor[~own] = read_at(turning, time, recording.columns[INPUT], recording.motor_rate)
    felt.motor_rate[~own] = np.interp(turning, time, recording.motor_rate)
    felt.load[:] = read_at(felt.time + late_s, time, load, rate)
    return felt, own


def _course(recording: Evidence, channel: str, load: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How fast the load changes on fine rows, and when it turns [s]: the same whatever its zero is, and kept."""
    if channel not in recording.load_rates:
        time = recording.columns["time_s"]
        turned = time[turns(load, TURN * float(np.ptp(load)))]
        recording.load_rates[channel] = rate_of(load, time), turned
    return recording.load_rates[channel]


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
    bent = joint - N * read_at(at, time, motor, recording.motor_rate)
    return N * read_at(seen, time, motor, recording.motor_rate) + read_at(seen, at, bent, rate_of(bent, at))
