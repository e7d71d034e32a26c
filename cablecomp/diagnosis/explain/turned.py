"""What goes with the angle of a pulley is told by its turning alone.

Where neither pulley is turned the joint moves by the drive's deflection only, which goes with the load: a weight, a
pulley out of true or a groove are then curves of the load, as any law of another form leaves, and an absurd amount of
them (a weight six times the greatest load) takes off what such a form leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import INPUT, Evidence

READ: Final = (0.01, 0.99)
"""Quantiles of an angle's readings between which it is turned: single readings may be anywhere."""


def told(pool: Sequence[Hypothesis], config: JointConfig, evidence: Sequence[Evidence]) -> list[Hypothesis]:
    """Those that these recordings can tell by what they act through; what another joint turns, its channel tells."""
    still = stands_still(config, evidence)
    return [h for h in pool if not (still and by_angle(h))]


def by_angle(h: Hypothesis) -> bool:
    """Whether what it does goes with an angle of this joint alone."""
    return h.acts_through[0] in ("joint_angle", "motor_angle") and not h.channel


def stands_still(config: JointConfig, evidence: Sequence[Evidence]) -> bool:
    """Whether neither pulley is turned, within a recording or from one to another, by as much as it takes."""
    low, high = np.quantile(np.concatenate([e.columns[INPUT] for e in evidence]), READ)
    return bool((high - low) * max(1.0, config.drive.ratio) < LIMITS.least_turn_rad)
