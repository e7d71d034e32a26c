"""What a recording holds and how good it is: channels, rate, gaps, duplicates, stuck and clipped sensors, noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from cablecomp.counting import counted
from cablecomp.errors import InputError
from cablecomp.recording.table import FloatArray
from cablecomp.signal.noise import channel_noise

IntArray = npt.NDArray[np.intp]
_GAP: Final = 10.0
_PLATEAU: Final = 5
_ALIKE: Final = 0.02
_TURN: Final = 2.0 * np.pi
NOISE_ROWS: Final = 200_000
"""Rows out of which a channel's noise is told."""


@dataclass(frozen=True)
class ChannelQuality:
    """One channel, in its own unit.

    `noise`: 1 sigma of a reading, quantisation included (None = cannot be told); `coloured`: filtered, so that
    the noise is a lower bound; `step`: resolution seen (0 = none); `stuck_s`: longest time without any change
    while the motor moved by over 1 % of its range; `clipped`: share of rows that rest on the greatest or least
    value for 5 rows and more and came there at once (never of positions: joints have stops and backlash); `turns`:
    jumps by a whole turn (of positions).
    """

    name: str
    least: float
    greatest: float
    empty: int
    noise: float | None
    coloured: bool
    step: float
    stuck_s: float
    clipped: float
    turns: int


@dataclass(frozen=True)
class Repeats:
    """How well the joint repeats itself: RMS difference of its angle between `cycles` of like motion and load."""

    cycles: int
    period_s: float
    joint_rad: float


@dataclass(frozen=True)
class Inspection:
    """What a recording shows of itself; times in s, `jitter` = sd of the step over the step."""

    rows: int
    duration_s: float
    rate_Hz: float
    jitter: float
    gaps: tuple[tuple[int, float], ...]
    duplicates: int
    channels: tuple[ChannelQuality, ...]
    repeats: Repeats | None


def stuck_words(seconds: float, end: str = "motor") -> str:
    """What is said of a channel that rests while the motor, or the joint, goes on."""
    return f"rests {seconds:.3g} s while the {end} moves: stuck?"


def clipped_words(share: float) -> str:
    """What is said of a channel that stops at an extreme value."""
    return f"clipped in {100 * share:.2g} % of the rows"


def turns_words(count: int) -> str:
    """What is said of an angle that begins anew at each turn."""
    return f"jumps by a whole turn {counted(count, 'time')}: begun anew at each turn?"


def whole_turns(angle_rad: FloatArray) -> IntArray:
    """Places after which an angle jumps by 2 pi, give or take what it moves by from row to row; none in one whose usual
    steps are of that size themselves."""
    steps = np.abs(np.diff(angle_rad))
    usual = float(np.percentile(steps, 95.0)) if len(steps) else 0.0
    if usual > _TURN / 4.0:
        return np.zeros(0, dtype=np.intp)
    return np.flatnonzero(np.abs(steps - _TURN) < max(3.0 * usual, 1e-3 * _TURN))


def require_motion(columns: Mapping[str, FloatArray], where: object) -> None:
    """Raise InputError if motor or joint never move: nothing about the drive follows from such a recording."""
    for name in ("motor_position_rad", "joint_position_rad"):
        read = columns.get(name)
        values = np.empty(0) if read is None else read[np.isfinite(read)]  # a gap is no rest
        if len(values) and not np.ptp(values) > 0.0:
            raise InputError(
                f"{where}: {name} is {values[0]:g} in every row; a recording in which the joint moves is needed "
                "(is the sensor stuck?)"
            )


def inspect(columns: Mapping[str, FloatArray]) -> Inspection:
    """Look at a recording's columns (canonical names, with `time_s`); raises InputError for fewer than 2 rows."""
    time = columns["time_s"]
    if len(time) < 2:
        raise InputError("one row tells nothing; at least 2 are needed")
    steps = np.diff(time)
    usual = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    even = steps[(steps > 0.0) & (steps < _GAP * usual)]
    wide = np.flatnonzero(steps > _GAP * usual) if usual > 0.0 else np.zeros(0, dtype=np.intp)
    motor = columns.get("motor_position_rad")
    return Inspection(
        rows=len(time),
        duration_s=float(time[-1] - time[0]),
        rate_Hz=1.0 / usual if usual > 0.0 else 0.0,
        jitter=float(even.std() / usual) if len(even) else 0.0,
        gaps=tuple((int(k) + 1, float(steps[k])) for k in wide[:100]),
        duplicates=int(np.sum(steps == 0.0)),
        channels=tuple(_quality(n, v, time, motor) for n, v in columns.items() if n != "time_s"),
        repeats=_repeats(columns, usual),
    )


def _quality(name: str, values: FloatArray, time: FloatArray, motor: FloatArray | None) -> ChannelQuality:
    known = values[np.isfinite(values)]
    noise, coloured, step = None, False, 0.0
    try:
        found = channel_noise(time[:NOISE_ROWS], values[:NOISE_ROWS])
        noise, coloured, step = found.sigma, found.coloured, found.resolution
    except InputError:  # too short to tell
        pass
    return ChannelQuality(
        name,
        float(known.min()) if len(known) else np.nan,
        float(known.max()) if len(known) else np.nan,
        len(values) - len(known),
        noise,
        coloured,
        step,
        _stuck(values, time, values if motor is None else motor),
        0.0 if "position" in name else clipped_share(known, step),
        len(whole_turns(known)) if "position" in name else 0,
    )


def runs(same: FloatArray) -> list[tuple[int, int]]:
    """(first, last) of each stretch of true."""
    padded = np.concatenate(([False], same.astype(bool), [False]))
    edges = np.flatnonzero(padded[1:] != padded[:-1])
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _stuck(values: FloatArray, time: FloatArray, motor: FloatArray) -> float:
    """Longest time in which the channel shows no change at all while the motor moves by over 1 % of its range."""
    reach = 0.01 * float(np.ptp(motor)) if len(motor) else 0.0
    longest = 0.0
    if reach <= 0.0 or not np.any(np.diff(values) != 0.0):
        return float(time[-1] - time[0]) if reach > 0.0 and len(values) > 1 else 0.0
    for first, last in runs(np.diff(values) == 0.0):
        moved = float(np.ptp(motor[first : last + 1]))
        if moved > reach:
            longest = max(longest, float(time[last] - time[first]))
    return longest


def clipped_share(known: FloatArray, step: float) -> float:
    """Share of rows on plateaus at the very greatest and least value into or out of which the channel jumps.

    A turning point read in steps rests on an extreme value too, but comes near it slowly: over half of its rest's
    length it moves by three steps or so.
    """
    reach = float(np.ptp(known)) if len(known) else 0.0
    if len(known) < 2 * _PLATEAU or reach == 0.0:
        return 0.0
    rows = 0
    for extreme in (known.min(), known.max()):
        for first, last in runs(known == extreme):
            half = (last - first) // 2
            before, after = known[max(first - half, 0)], known[min(last + half, len(known)) - 1]
            off = max(abs(before - extreme), abs(after - extreme))
            rows += last - first if last - first >= _PLATEAU and off > max(8.0 * step, 0.02 * reach) else 0
    return rows / len(known)


def _repeats(columns: Mapping[str, FloatArray], step_s: float) -> Repeats | None:
    """Compare cycles of like motor motion and load: the motor's period by its autocorrelation, then one by one."""
    motor, joint = columns.get("motor_position_rad"), columns.get("joint_position_rad")
    if motor is None or joint is None or step_s <= 0.0 or not np.all(np.isfinite(motor) & np.isfinite(joint)):
        return None
    time = columns["time_s"]
    even = np.arange(time[0], time[-1], max(step_s, (time[-1] - time[0]) / 50_000))
    q, out = np.interp(even, time, motor), np.interp(even, time, joint)
    period = _period(q)
    count = len(q) // period if period else 0
    if count < 2:
        return None
    inputs = [q, *(np.interp(even, time, columns[n]) for n in ("joint_torque_Nm",) if n in columns)]
    like = np.ones(count - 1, dtype=bool)
    for values in inputs:
        folded = values[: count * period].reshape(count, period)
        apart = np.sqrt(np.mean(np.diff(folded, axis=0) ** 2, axis=1))
        like &= apart <= _ALIKE * float(np.ptp(values)) + 1e-12
    if not np.any(like):
        return None
    between = np.diff(out[: count * period].reshape(count, period), axis=0)[like]
    return Repeats(
        int(like.sum()) + 1, float(period * (even[1] - even[0])), float(np.sqrt(np.mean(between**2)))
    )


def _period(q: FloatArray) -> int:
    """The least shift at which a motion repeats itself nearly whole; 0 if it does not."""
    q = q - q.mean()
    size = 1 << int(np.ceil(np.log2(2 * len(q))))
    power = np.abs(np.fft.rfft(q, size)) ** 2
    raw = np.fft.irfft(power, size)[: len(q) // 2 + 1]
    square = np.concatenate(([0.0], np.cumsum(q**2)))
    shifts = np.arange(len(raw))
    whole = np.sqrt(np.maximum((square[len(q) - shifts]) * (square[-1] - square[shifts]), 1e-300))
    likeness = raw / whole
    below = np.flatnonzero(likeness < 0.5)
    if not len(below):
        return 0
    after = likeness[below[0] :]
    if not len(after) or after.max() < 0.98:
        return 0
    peaks = np.flatnonzero(after >= max(0.98, after.max() - 0.01))
    first = int(peaks[0])
    while first + 1 < len(after) and after[first + 1] > after[first]:
        first += 1
    return int(below[0]) + first
