"""What the machine itself repeats: the joint angle at the same motor angle, load and distance from the last
reversals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from cablecomp.diagnosis.locate.covariates import Covariates
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.signal.smoothing import FloatArray

REACH = 0.02
"""How alike two rows have to be in each coordinate, as a share of its range."""
FEWEST = 30


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
        near = cKDTree(points).query_pairs(REACH * np.sqrt(points.shape[1]), output_type="ndarray")
        near = near[np.abs(time[near[:, 0]] - time[near[:, 1]]) > apart]
        if len(near) < FEWEST:
            continue
        joint = e.at_rows(JOINT)
        gain = np.polyfit(v["motor_angle"], joint, 1)[0] if np.ptp(v["motor_angle"]) > 0.0 else 0.0
        a, b = near[:, 0], near[:, 1]
        difference = joint[a] - joint[b] - gain * (v["motor_angle"][a] - v["motor_angle"][b])
        squares.append(difference**2)
    if not squares:
        return None
    return float(np.sqrt(0.5 * np.median(np.concatenate(squares)) / 0.455))
