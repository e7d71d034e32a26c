"""What each output channel alone would have of an effect's amount."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, MOTOR
from cablecomp.estimation.least_squares import Fit

NEXT_TO_NONE: Final = 1e-8
"""Singular values below this share of the largest are none."""


class Wish(NamedTuple):
    """By which share of itself a channel would change an amount, one standard deviation of that, and which part of what
    tells the amount the channel holds."""

    change: float
    deviation: float
    part: float


def wishes(fit: Fit, amount: str) -> dict[str, Wish]:
    """By channel that tells an amount of the fit, a linear step of it alone along what no other parameter can do.

    With s the derivative's column without what the other columns do, r the residual, of each channel's rows: a step
    -s·r/s·s of standard deviation 1/sqrt(s·s), over the amount; part s·s over all channels'.
    """
    problem = fit.problem
    names = [p.name for p in problem.parameters]
    if amount not in names:
        return {}
    k = names.index(amount)
    others = np.delete(fit.J, k, axis=1)
    size = np.linalg.norm(others, axis=0)
    others = others[:, size > 0.0] / size[size > 0.0]
    column = fit.J[:, k]
    own = column - others @ np.linalg.lstsq(others, column, rcond=NEXT_TO_NONE)[0]
    p, x = problem.parameters[k], float(fit.x[k])
    per_step = p.slope(x) / max(abs(p.value(x)), 1e-300)
    whole = float(own @ own)
    found = {}
    for channel, span in problem.spans().items():
        square = float(own[span] @ own[span])
        if square > 0.0:
            step = -float(own[span] @ fit.residual[span]) / square
            found[channel] = Wish(step * per_step, per_step / square**0.5, square / whole)
    return found


def borne_by_torque(fit: Fit, term: Hypothesis) -> str:
    """What is to be said of a joint's friction of which the joint's own angle would have less than the motor's torque,
    beyond chance; "" where they agree: what drags the joint loads the cable, what drags the motor shows in its torque.
    """
    if not term.effect.drags_joint:
        return ""
    found = wishes(fit, term.key(term.amount.name))
    if JOINT not in found or MOTOR not in found:
        return ""
    joint, motor = found[JOINT], found[MOTOR]
    apart = motor.change - joint.change
    if (
        -joint.change < LIMITS.less_by_angle
        or apart < LIMITS.z_channels * math.hypot(joint.deviation, motor.deviation)
        or motor.part < LIMITS.told_by_torque
    ):
        return ""
    if joint.change <= -1.0:
        return "the motor's torque bears it, the joint's angle alone would have none of it"
    return f"the motor's torque bears it, the joint's angle alone would have {-joint.change:.0%} less of it"
