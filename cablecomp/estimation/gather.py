"""From a recording's columns to the rows that a fit takes: what was read, cleaned, thinned by travel.

What has no finite reading is bridged for the inputs and does not count for the outputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import (
    FEWEST,
    INPUT,
    JOINT,
    MOTOR,
    NEEDED,
    OUTPUTS,
    OVERFLOWN,
    Evidence,
    load_channel,
)
from cablecomp.estimation.outliers import outliers, outliers_in_motion
from cablecomp.estimation.thinning import APART, thinned
from cablecomp.signal.noise import channel_noise, grid_step, reading_sigma
from cablecomp.signal.smoothing import BoolArray, FloatArray, IntArray, group_means, keep_corners

FINE_ROWS: Final = 6_000
"""Rows of all recordings together that are kept after cleaning."""
LEAST_FINE: Final = 1_000
"""Rows that a recording keeps of these, however many there are."""
SPARSE: Final = 0.6
"""Share of readings below which an input counts as a channel of a lower rate, which is bridged."""
DIED: Final = 10.0
"""Usual steps of such a channel beyond which it was not read for a while, or no more; those that a gap counts for in
the time that rows stand for."""


def gather(
    config: JointConfig,
    name: str,
    columns: Mapping[str, FloatArray],
    session: str,
    *,
    fine_rows: int,
    judged_rows: int,
) -> Evidence:
    """Clean and thin one recording (canonical channels -> columns).

    Raises InputError where a channel that is needed is missing or has hardly a finite reading.
    """
    for key in NEEDED:
        if key not in columns:
            raise InputError(f"{name}: channel `{key}` is missing; a diagnosis needs {', '.join(NEEDED)}")
    raw = _in_order(name, {k: np.asarray(v, dtype=np.float64) for k, v in columns.items()})
    load = load_channel(config, raw)
    good, set_aside = _good(name, raw, load, config.drive.ratio)
    unread = tuple(k for k in raw if k != "time_s" and k not in good)
    raw = {k: v for k, v in raw.items() if k not in unread}
    noise = {k: _noise(raw["time_s"][g], raw[k][g]) for k, g in good.items()}
    noise |= _unresolved(config.drive.ratio, raw, good, noise)
    drivable = _drivable(raw, good, load)
    if drivable.sum() < FEWEST:
        raise InputError(
            f"{name}: motor angle and load were read together at {int(drivable.sum())} instants; {FEWEST} are needed"
        )
    raw, finite = _bridged(raw, good, drivable)
    means, read = _fine(raw, finite, noise, fine_rows, load)
    drivers = [means[k] for k in (INPUT, *([load] if load else []))]
    rows = thinned(means["time_s"], drivers, means[JOINT], judged_rows)
    weight = _weight(means["time_s"], rows)
    return Evidence(
        name, session, {}, means, rows, {k: v[rows] for k, v in read.items()}, weight, noise=noise,
        outliers=set_aside, samples=len(raw["time_s"]), unread=unread, read=read,
    )  # fmt: skip


def _good(
    name: str, raw: Mapping[str, FloatArray], load: str | None, ratio: float
) -> tuple[dict[str, BoolArray], int]:
    """Which readings of each channel are to be trusted, and how many were set aside as outliers; without the channels
    that may be missing and were hardly read."""
    good = {k: np.abs(v) < OVERFLOWN for k, v in raw.items() if k != "time_s"}
    set_aside = 0
    for key, kept in list(good.items()):
        if kept.sum() < FEWEST:
            if key in NEEDED or key == load:
                raise InputError(
                    f"{name}: channel `{key}` has {int(kept.sum())} finite readings; {FEWEST} are needed"
                )
            del good[key]
            continue
        spikes = outliers(raw[key], kept)
        set_aside += int(spikes.sum())
        kept &= ~spikes
    both = good[JOINT] & good[INPUT]
    in_motion = outliers_in_motion(raw["time_s"], raw[JOINT], ratio * raw[INPUT], both)
    for key, spikes in zip((JOINT, INPUT), in_motion, strict=True):
        set_aside += int(spikes.sum())
        good[key] &= ~spikes
    return good, set_aside


def _drivable(raw: Mapping[str, FloatArray], good: Mapping[str, BoolArray], load: str | None) -> BoolArray:
    """Rows at which the inputs were read: the drive goes from reading to reading, and where an input has none, a
    bridged value would be an error of the prediction. Of a channel of a lower rate, rows between two readings of it."""
    time = raw["time_s"]
    kept = np.ones(len(time), dtype=np.bool_)
    for key in (INPUT, *([load] if load else [])):
        kept &= good[key] if good[key].mean() > SPARSE else _between(time, time[good[key]])
    return kept


def _between(time: FloatArray, read: FloatArray) -> BoolArray:
    """Rows between two readings (at these times) that are no further apart than `DIED` times what is usual."""
    steps = np.diff(read)
    after = np.searchsorted(read, time, side="right")
    inside = (after > 0) & ((after < len(read)) | (time == read[-1]))
    step = steps[np.clip(after - 1, 0, len(steps) - 1)]
    return np.asarray(inside & (step <= DIED * np.median(steps)), dtype=np.bool_)


def _bridged(
    raw: Mapping[str, FloatArray], good: Mapping[str, BoolArray], kept: BoolArray
) -> tuple[dict[str, FloatArray], dict[str, BoolArray]]:
    """The rows kept, other channels bridged where they have no reading; and where an output has one."""
    time = raw["time_s"]
    bridged = {
        k: v[kept] if k == "time_s" else np.interp(time[kept], time[good[k]], v[good[k]])
        for k, v in raw.items()
    }
    return bridged, {k: good[k][kept] for k in OUTPUTS if k in raw}


def _fine(
    raw: Mapping[str, FloatArray],
    finite: Mapping[str, BoolArray],
    noise: Mapping[str, float],
    fine_rows: int,
    load: str | None,
) -> tuple[dict[str, FloatArray], dict[str, BoolArray]]:
    """Means of as many readings as leave `fine_rows`, inputs cleaned; and which of these were read, by output channel.
    Of readings on both sides of a gap nothing is made."""
    group = max(1, -(-len(raw["time_s"]) // fine_rows))
    whole = len(raw["time_s"]) // group * group
    time = raw["time_s"][:whole].reshape(-1, group)
    span = time[:, -1] - time[:, 0]
    near = span <= APART * np.median(span)
    means = {k: group_means(v[:whole], group)[near] for k, v in raw.items()}
    read = {k: _read(raw["time_s"][:whole], v[:whole], group)[near] for k, v in finite.items()}
    for key in raw:
        is_input = key != "time_s" and (key not in OUTPUTS or key == load)
        if is_input and np.ptp(means[key]) > 0.0:
            means[key] = keep_corners(means["time_s"], means[key], noise[key] / np.sqrt(group))
    if load == MOTOR:
        read.pop(MOTOR)
    return means, read


def _read(time: FloatArray, read: BoolArray, group: int) -> BoolArray:
    """Which means of so many rows are of readings: those of readings alone or, where few are (an output of a lower
    rate, one that loses many), those that hold one and bridge no hole."""
    share = group_means(read.astype(np.float64), group)
    alone = share > 0.99
    if np.mean(alone) > SPARSE or not read.any():
        return alone
    between = group_means(_between(time, time[read]).astype(np.float64), group) > 0.99
    return np.asarray(alone | ((share > 0.0) & between), dtype=np.bool_)


def _weight(time: FloatArray, rows: IntArray) -> FloatArray:
    """Root of the time that each judged row stands for, over its mean: a gap, in which nothing was read, counts as
    `DIED` usual steps, or the two rows beside a long one would outweigh all others."""
    if len(rows) < 2:
        return np.ones(len(rows))
    steps = np.diff(time)
    recorded = np.append(0.0, np.cumsum(np.minimum(steps, DIED * np.median(steps))))[rows]
    share = np.gradient(recorded)
    return np.asarray(np.sqrt(share / share.mean()), dtype=np.float64)


def rows_for(samples: Sequence[int], judged: int) -> tuple[list[int], list[int]]:
    """(fine, judged) rows of each recording, out of its samples and of what all together may have."""
    total = sum(samples)
    fine = [max(LEAST_FINE, int(FINE_ROWS * n / total)) for n in samples]
    return fine, [max(60, min(int(judged * n / total), f)) for n, f in zip(samples, fine, strict=True)]


def _in_order(name: str, columns: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Rows with a finite time, one of each instant."""
    time = columns["time_s"]
    kept = np.isfinite(time)
    kept[1:] &= np.diff(np.maximum.accumulate(np.where(kept, time, -np.inf))) > 0.0
    if kept.sum() < FEWEST:
        raise InputError(f"{name}: {int(kept.sum())} samples with a time of their own; {FEWEST} are needed")
    return {k: v[kept] for k, v in columns.items()}


def _unresolved(
    ratio: float, raw: Mapping[str, FloatArray], good: Mapping[str, BoolArray], noise: Mapping[str, float]
) -> dict[str, float]:
    """Noise of the angles that were read so seldom that motion looks like noise (twice as much): that of the joint's
    angle beyond the rigid drive, which holds both, but for the steps of a coarse encoder, which it lies on no more."""
    both = good[JOINT] & good[INPUT]
    if both.sum() < FEWEST:
        return {}
    beyond = _noise(raw["time_s"][both], raw[JOINT][both] - ratio * raw[INPUT][both])
    if beyond == 0.0:
        return {}
    steps = {k: reading_sigma(None, grid_step(raw[k][good[k]])) for k in (JOINT, INPUT)}
    found = {JOINT: max(beyond, steps[JOINT]), INPUT: max(beyond / abs(ratio), steps[INPUT])}
    return {k: v for k, v in found.items() if v < 0.5 * noise[k]}


def _noise(time: FloatArray, values: FloatArray) -> float:
    if np.ptp(values) == 0.0:
        return 0.0
    try:
        return float(channel_noise(time, values).sigma)
    except InputError:
        return 0.0
