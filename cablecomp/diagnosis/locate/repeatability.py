"""What the machine itself repeats: the joint angle at the same motor angle, load and distance from the last
reversals, what creeps with time taken off (a slip or a drift is something to explain, not what cannot be repeated)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from cablecomp.diagnosis.locate.covariates import Covariates
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.signal.smoothing import FloatArray


def repeatability(evidence: Sequence[Evidence], covariates: Sequence[Covariates]) -> float | None:
    """RMS difference [rad] between repeats of the same state in one recording, over sqrt 2; None where nothing
    repeats."""
    squares: list[FloatArray] = []
    for e, c in zip(evidence, covariates, strict=True):
        v = c.values
        state = np.column_stack((v["motor_angle"], v["load"], c.motion_reversal, v["reversal"]))
        span = np.ptp(state, axis=0)
        used = span > 0.0
        points = np.column_stack((state[:, used] / span[used], c.motion_direction, v["load_direction"]))
        time = v["time"]
        apart = 0.1 * float(time[-1] - time[0])
        near = cKDTree(points).query_pairs(LIMITS.repeats * np.sqrt(points.shape[1]), output_type="ndarray")
        near = near[np.abs(time[near[:, 0]] - time[near[:, 1]]) > apart]
        if len(near) < LIMITS.repeats_fewest:
            continue
        joint = e.at_rows(JOINT)
        a, b = near[:, 0], near[:, 1]
        alike = used.sum()
        slow = _hats(time)
        apart_by = np.column_stack((points[a, :alike] - points[b, :alike], slow[a] - slow[b]))
        squares.append(_beside(apart_by, joint[a] - joint[b]) ** 2)
    if not squares:
        return None
    return float(np.sqrt(0.5 * np.median(np.concatenate(squares)) / 0.455))


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
