"""What the joint is known to leave (`[remainder]`): an effect that is new has to stand out of it."""

from __future__ import annotations

from math import sqrt

from cablecomp.config import JointConfig
from cablecomp.diagnosis.thresholds import LIMITS


def usual_of(config: JointConfig, channel: str) -> float:
    """What the joint is known to leave of a channel (RMS, in its unit); 0 where nothing is."""
    return float(getattr(config.remainder, channel) or 0.0)


def least_square(config: JointConfig, channel: str) -> float:
    """Mean square of a channel, in its unit squared, that an effect has to take off to stand out of that."""
    return LIMITS.usual * usual_of(config, channel) ** 2


def lost_in_usual(config: JointConfig, channel: str, gone: float) -> str:
    """What is to be said of an effect that takes `gone` (mean square) off a channel, in words; "" of one that stands
    out of what the joint is known to leave."""
    if gone >= least_square(config, channel):
        return ""
    return (
        f"it takes off {sqrt(max(gone, 0.0)):.2g} of `{channel}` (RMS), where this joint is known to leave "
        f"{usual_of(config, channel):.2g}"
    )
