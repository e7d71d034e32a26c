"""Which further channels may be a neighbour's: not what goes with the joint's own motion.

Tensions of the joint's own cables, a second encoder of its motor, a neighbour that moves in step: of such a channel any
law of friction that the drive lacks makes a "neighbour" that loads it. The load does not count as the joint's own: a
torque channel may hold what a neighbour puts on it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import INPUT, Evidence, varies
from cablecomp.signal.smoothing import FloatArray


def neighbours(config: JointConfig, evidence: Sequence[Evidence]) -> list[str]:
    """Further channels that vary, are no condition, and do not go with the joint's own motion."""
    return [c for c in _further(config, evidence) if own_share(evidence, c) < LIMITS.own_motion]


def not_told_apart(config: JointConfig, evidence: Sequence[Evidence]) -> dict[str, float]:
    """Further channels that do, and the share of each that the joint's own motion tells."""
    shares = {c: own_share(evidence, c) for c in _further(config, evidence)}
    return {c: share for c, share in shares.items() if share >= LIMITS.own_motion}


def own_share(evidence: Sequence[Evidence], channel: str) -> float:
    """Share of a channel's variance within recordings that a linear law of the motor's angle, its square, and what
    follows it through plays of several widths, each recording's own, accounts for."""
    left = whole = 0.0
    for e in evidence:
        y = e.columns[channel] - np.mean(e.columns[channel])
        motor = e.columns[INPUT] - e.columns[INPUT][0]
        motor = motor / (float(np.ptp(motor)) or 1.0)
        A = np.stack([np.ones(len(y)), motor, motor**2, *(_play(motor, r) for r in LIMITS.own_plays)], axis=1)
        left += float(np.sum((y - A @ np.linalg.lstsq(A, y, rcond=None)[0]) ** 2))
        whole += float(np.sum(y**2))
    return 1.0 - left / whole


def _further(config: JointConfig, evidence: Sequence[Evidence]) -> list[str]:
    names = [n for n in evidence[0].columns if n.startswith("other_") and n not in config.condition.values()]
    return [n for n in names if varies(evidence, n)]


def _play(x: FloatArray, half_width: float) -> FloatArray:
    """What follows x through a play."""
    found, at = [], float(x[0])
    for value in x.tolist():
        at = min(max(at, value - half_width), value + half_width)
        found.append(at)
    return np.array(found)
