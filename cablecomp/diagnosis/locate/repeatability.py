"""What the machine itself repeats: the joint angle at the same motor angle, load and distance from the last
reversals (where no load is recorded, at the same speed and acceleration, which a weight or an inertia goes with), what
creeps with time taken off (a slip or a drift is something to explain, not what cannot be repeated), and
what a model tells apart (a late channel differs at another speed, and that repeats)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from cablecomp.diagnosis.locate.covariates import Covariates
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.signal.smoothing import BoolArray, FloatArray, IntArray


def repeatability(
    evidence: Sequence[Evidence], covariates: Sequence[Covariates], told: Sequence[FloatArray] | None = None
) -> float | None:
    """RMS difference [rad] between repeats of the same state in one recording, over sqrt 2: of the joint's angle, or of
    what a model with named effects leaves of it on the judged rows (`told`, by recording), whichever is less; None
    where nothing repeats. Rows that do not count (the angle was not read there, or they are kept for the end) say
    nothing of it."""
    joint = [e.at_rows(JOINT) for e in evidence]
    views = (joint,) if told is None else (joint, told)
    squares: list[list[FloatArray]] = [[] for _ in views]
    for k, (e, c) in enumerate(zip(evidence, covariates, strict=True)):
        pairs, apart_by = _repeats(c, e.counted[JOINT])
        if len(pairs):
            a, b = pairs[:, 0], pairs[:, 1]
            for found, seen in zip(squares, views, strict=True):
                found.append(_beside(apart_by, seen[k][a] - seen[k][b]) ** 2)
    if not squares[0]:
        return None
    return min(float(np.sqrt(0.5 * np.median(np.concatenate(s)) / 0.455)) for s in squares)


def _repeats(c: Covariates, counted: BoolArray) -> tuple[IntArray, FloatArray]:
    """Pairs of counted rows of a recording, far apart in time, in the same state, and by what their states and times
    still lie apart; none where too few repeat."""
    v = c.values
    loaded = np.ptp(v["load"]) > 0.0
    loads = (v["load"], v["reversal"]) if loaded else (v["velocity"], v["acceleration"])
    state = np.column_stack((v["motor_angle"], c.motion_reversal, *loads))
    span = np.ptp(state, axis=0)
    used = span > 0.0
    points = np.column_stack((state[:, used] / span[used], c.motion_direction, v["load_direction"]))
    time = v["time"]
    apart = 0.1 * float(time[-1] - time[0])
    near = cKDTree(points).query_pairs(LIMITS.repeats * np.sqrt(points.shape[1]), output_type="ndarray")
    near = near[np.abs(time[near[:, 0]] - time[near[:, 1]]) > apart]
    near = near[counted[near].all(axis=1)]
    if len(near) < LIMITS.repeats_fewest:
        return np.empty((0, 2), dtype=np.int64), np.empty((0, 0))
    a, b = near[:, 0], near[:, 1]
    slow = _hats(time)
    return near, np.column_stack((points[a, : used.sum()] - points[b, : used.sum()], slow[a] - slow[b]))


def _hats(time: FloatArray) -> FloatArray:
    """A straight line between knots in time for each knot, the first left out: together any slow course."""
    knots = np.linspace(time[0], time[-1], LIMITS.repeats_knots)
    width = knots[1] - knots[0]
    return np.asarray(np.maximum(1.0 - np.abs(time[:, None] - knots[1:]) / width, 0.0), dtype=np.float64)


def _beside(apart: FloatArray, difference: FloatArray) -> FloatArray:
    """What is left of the differences once what the states still lie apart is taken off by a straight line; pairs
    whose history differs further back do not draw it."""
    found = np.linalg.lstsq(apart, difference, rcond=None)[0]
    left = np.abs(difference - apart @ found)
    kept = left <= 4.5 * np.median(left)
    found = np.linalg.lstsq(apart[kept], difference[kept], rcond=None)[0]
    return np.asarray(difference - apart @ found, dtype=np.float64)
