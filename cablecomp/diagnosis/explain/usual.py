"""What the joint is known to leave (`[remainder]`): an effect that is new has to stand out of it."""

from __future__ import annotations

from math import sqrt

from cablecomp.config import JointConfig
from cablecomp.diagnosis.locate.covariates import FURTHER, UNITS
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT


def usual_of(config: JointConfig, channel: str) -> float:
    """What the joint is known to leave of a channel (RMS, in its unit); 0 where nothing is."""
    return float(getattr(config.remainder, channel) or 0.0)


def check_follows(config: JointConfig) -> None:
    """Raise InputError where the joint says of what it leaves that it goes by something that is no covariate."""
    for name in config.remainder.follows:
        if name not in UNITS and not name.startswith(FURTHER):
            accepted = ", ".join([*UNITS, *(f"{f}<name>" for f in FURTHER)])
            raise InputError(
                f"{config.name}: [remainder] follows {name!r}, no covariate; {accepted} are accepted"
            )


def least_square(config: JointConfig, channel: str, through: str = "") -> float:
    """Mean square of a channel, in its unit squared, that an effect has to take off to stand out of that; of all of it
    where that goes by the covariate that the effect acts through first (`through`)."""
    share = LIMITS.usual_alike if _goes_by(config, channel, through) else LIMITS.usual
    return share * usual_of(config, channel) ** 2


def lost_in_usual(config: JointConfig, channel: str, gone: float, through: str = "") -> str:
    """What is to be said of an effect that takes `gone` (mean square) off a channel, in words; "" of one that stands
    out of what the joint is known to leave."""
    if gone >= least_square(config, channel, through):
        return ""
    alike = (
        f" that goes by {through.replace('_', ' ')}, as it does" if _goes_by(config, channel, through) else ""
    )
    return (
        f"it takes off {sqrt(max(gone, 0.0)):.2g} of `{channel}` (RMS), where this joint is known to leave "
        f"{usual_of(config, channel):.2g}{alike}"
    )


def _goes_by(config: JointConfig, channel: str, covariate: str) -> bool:
    return channel == JOINT and covariate in config.remainder.follows
