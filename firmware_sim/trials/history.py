"""What came before a recording, and instants at which nobody's clock was even."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from firmware_sim.plant.records import Floats
from firmware_sim.trials.courses import Course, Range, draw_course

RATE_HZ = 50.0
_HANDOVER_S = 1.0
_REST_S = 0.1


def with_history(
    rng: np.random.Generator, course: Course, within: Range, kind: str, lasts_s: float
) -> Course:
    """The same course after `lasts_s` of another one, which leaves its history in the cable and is not recorded.

    Motor and load go from the end of one to the beginning of the other within a second and rest there for a moment.
    """
    before = draw_course(rng, kind, within, rate_Hz=RATE_HZ, lasts_s=lasts_s)
    start = course.time_s[0] - lasts_s - _HANDOVER_S - _REST_S
    lead = round((lasts_s + _HANDOVER_S) * RATE_HZ)
    time = start + np.arange(lead) / RATE_HZ
    share = np.clip((time - start - lasts_s) / (_HANDOVER_S - 1.0 / RATE_HZ), 0.0, 1.0)
    ease = share**3 * (10.0 + share * (6.0 * share - 15.0))

    def joined(first: Floats, then: Floats) -> Floats:
        led = np.concatenate([first, np.full(lead - len(first), first[-1])])
        return np.concatenate([led + ease * (then[0] - led), then])

    return replace(
        course,
        time_s=np.concatenate([time, course.time_s]),
        motor_rad=joined(before.motor_rad, course.motor_rad),
        load_Nm=joined(before.load_Nm, course.load_Nm),
        temperature_degC=joined(np.full(1, course.temperature_degC[0]), course.temperature_degC),
        other=joined(before.other, course.other),
        history=lead,
    )


def uneven(rng: np.random.Generator, course: Course, jitter: float) -> Course:
    """The same course at instants that are off the even ones by up to `jitter` of a step, each stamped as it was."""
    step = float(np.median(np.diff(course.time_s)))
    shift = step * jitter * rng.uniform(-1.0, 1.0, len(course.time_s))
    shift[[0, -1]] = 0.0
    return course.at(course.time_s + shift)
