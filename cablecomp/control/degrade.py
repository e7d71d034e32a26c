"""What happens as data grow old: feed-forward is held, then faded out, then the joint is stopped safely."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from cablecomp.control.command import Feed


class Phase(IntEnum):
    """How a joint is being run."""

    NORMAL = 0
    HELD = 1
    FADING = 2
    RECOVERING = 3
    STOPPED = 4


class DegradeTimes(NamedTuple):
    """Ages in s at which the descent goes on, and how long the way back takes.

    Up to `fresh_s` all is normal; up to `hold_s` the feed-forward is held; from there to `fade_s` it fades
    out linearly; from `stop_s` on the joint is stopped. When data return before that, feed-forward comes back
    within `recover_s`. `motor_stop_s`: age of the motor position at which the joint is stopped at once.
    """

    fresh_s: float
    hold_s: float
    fade_s: float
    stop_s: float
    recover_s: float
    motor_stop_s: float


class DegradeState(NamedTuple):
    """Phase, weight of the feed-forward, and the age (s) that led there."""

    phase: Phase = Phase.NORMAL
    weight: float = 1.0
    age_s: float = 0.0


NORMAL = DegradeState()


def degrade(
    state: DegradeState, period_s: float, motor_age_s: float, load_age_s: float, times: DegradeTimes
) -> DegradeState:
    """One cycle of the descent; pure. STOPPED is left only by starting anew.

    `motor_age_s`: age of the newest plausible motor position; `load_age_s`: oldest age among the channels
    that the feed-forward lives on. A data gap that ends during the fade costs no step: the weight grows from
    where it is.
    """
    if state.phase is Phase.STOPPED:
        return state
    age = load_age_s if load_age_s > motor_age_s else motor_age_s
    if age <= times.fresh_s:
        weight = state.weight + period_s / times.recover_s
        return NORMAL if weight >= 1.0 else DegradeState(Phase.RECOVERING, weight, age)
    if state.phase not in (Phase.NORMAL, Phase.RECOVERING):
        age = max(age, state.age_s + period_s)  # data that keep coming, but keep being old, are no better
    if not (motor_age_s <= times.motor_stop_s and age < times.stop_s):
        return DegradeState(Phase.STOPPED, 0.0, age)
    if age <= times.hold_s:
        return DegradeState(Phase.HELD, state.weight, age)
    left = max((times.fade_s - age) / (times.fade_s - times.hold_s), 0.0)
    return DegradeState(Phase.FADING, min(state.weight, left), age)


def feed_of(state: DegradeState) -> Feed:
    """What the compensator is told in this phase."""
    return Feed(state.weight, state.phase in (Phase.HELD, Phase.FADING, Phase.STOPPED))
