"""Where the drive may have gone while nothing was recorded: detours in the gaps of a recording.

A model goes straight from the last reading before a gap to the first one after it. Motion and load may have gone
further and come back, or one before the other, and friction remembers it. How far they can have gone is told by how
fast they go elsewhere in the recording.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.estimation.evidence import INPUT, Evidence
from cablecomp.estimation.limits import DETOUR_BEYOND, DETOUR_LEAST, DETOUR_LEG, DETOUR_PARTS, GAPS_MOST
from cablecomp.estimation.simulate import Unrecorded, load_of
from cablecomp.estimation.thinning import gaps_of
from cablecomp.signal.smoothing import FloatArray, IntArray


def detours(config: JointConfig, recording: Evidence) -> dict[int, tuple[Unrecorded, ...]]:
    """By the fine row before each gap that leaves room, of the longest: the load, or the motor, out to either side and
    back, as far as there was time for and a part of that; and the one moved wholly before the other."""
    time, motor = recording.columns["time_s"], recording.columns[INPUT]
    load = np.broadcast_to(np.asarray(load_of(config, recording.columns), dtype=np.float64), time.shape)
    gaps = gaps_of(time)
    found: dict[int, tuple[Unrecorded, ...]] = {}
    if not len(gaps):
        return found
    steps = np.diff(time)
    fastest_load, fastest_motor = (_fastest(values, steps, gaps) for values in (load, motor))
    for k in gaps[np.argsort(steps[gaps])[::-1][:GAPS_MOST]]:
        (q0, m0), (q1, m1) = ((float(motor[j]), float(load[j])) for j in (k, k + 1))
        paths = [[(q0, m0), (q0, m), (q1, m1)] for m in _turns(load, int(k), fastest_load * steps[k])]
        paths += [[(q0, m0), (q, m0), (q1, m1)] for q in _turns(motor, int(k), fastest_motor * steps[k])]
        if min(_moved(motor, int(k)), _moved(load, int(k))) > DETOUR_LEAST:
            paths += [[(q0, m0), (q1, m0), (q1, m1)], [(q0, m0), (q0, m1), (q1, m1)]]
        if paths:
            found[int(k)] = tuple(Unrecorded(along(path, DETOUR_LEG), int(k)) for path in paths)
    return found


def along(corners: list[tuple[float, float]], leg: int) -> FloatArray:
    """Motor angle and load from corner to corner, `leg` rows each."""
    return np.concatenate([np.linspace(a, b, leg) for a, b in pairwise(corners)])


def _fastest(values: FloatArray, steps: FloatArray, gaps: IntArray) -> float:
    """Greatest speed that a channel shows outside of the gaps, per second."""
    speed = np.abs(np.diff(values)) / steps
    return float(np.max(np.delete(speed, gaps), initial=0.0))


def _turns(values: FloatArray, k: int, way: float) -> Iterator[float]:
    """Where a channel that could have gone so far in the gap after row k may have turned back: as far as that, little
    beyond its range, and a part of that."""
    low, high = float(np.min(values)), float(np.max(values))
    width = high - low
    low, high = low - DETOUR_BEYOND * width, high + DETOUR_BEYOND * width
    a, b = sorted((float(values[k]), float(values[k + 1])))
    beyond = 0.5 * (way - (b - a))
    for end, room in ((b, min(beyond, high - b)), (a, -min(beyond, a - low))):
        if abs(room) > DETOUR_LEAST * width:
            for part in DETOUR_PARTS:
                yield end + part * room


def _moved(values: FloatArray, k: int) -> float:
    """Share of its range by which a channel differs on both sides of the gap after row k."""
    return float(abs(values[k + 1] - values[k])) / max(float(np.ptp(values)), 1e-300)
