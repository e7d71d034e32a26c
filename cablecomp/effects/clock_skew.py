"""Clock skew: the joint encoder's readings are stamped late (or early) against the other channels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, term
from cablecomp.mechanics.layout import X_COMMIT, X_JOINT, X_READING, X_TIME

SLOTS = 256
# The past is kept at steps of at least a 200th of the delay, so that the slots always reach back far enough.
STEPS_PER_DELAY = 200.0
COUNT, HEAD, CURSOR, TIMES = 0, 1, 2, 3
VALUES = TIMES + SLOTS


@term(parameters=1, state=VALUES + SLOTS)
def _look_back(c: Any, p: Any, s: Any) -> None:
    """p: delay [s]; s: count, place of the newest, of the last one read, then times and readings in a ring.

    Positive delay: straight interpolation of the past; before the first sample, that one. Negative delay:
    straight on by the mean velocity over a delay's length, which hardly amplifies noise.
    """
    span = abs(p[0])
    if span == 0.0:
        return
    now = c[X_TIME]
    value = c[X_JOINT] + c[X_READING]
    count, head, cursor = int(s[COUNT]), int(s[HEAD]), int(s[CURSOR])
    wanted = now - span
    past, past_time = value, now
    if count > 0:
        while cursor != head and s[TIMES + (cursor + 1) % SLOTS] <= wanted:
            cursor = (cursor + 1) % SLOTS
        past, past_time = s[VALUES + cursor], s[TIMES + cursor]
        after_time, after = now, value
        if cursor != head:
            after_time, after = s[TIMES + (cursor + 1) % SLOTS], s[VALUES + (cursor + 1) % SLOTS]
        if past_time < wanted and after_time > past_time:
            past += (after - past) * (wanted - past_time) / (after_time - past_time)
            past_time = wanted
    if p[0] > 0.0:
        c[X_READING] += past - value
    elif past_time < now:
        c[X_READING] += (value - past) * span / (now - past_time)
    if c[X_COMMIT] != 0.0:
        if count == 0:
            s[COUNT], s[HEAD], s[CURSOR], s[TIMES], s[VALUES] = 1.0, 0.0, 0.0, now, value
        elif now == s[TIMES + head]:
            s[VALUES + head] = value
        elif now - s[TIMES + head] >= span / STEPS_PER_DELAY:
            head = (head + 1) % SLOTS
            s[TIMES + head], s[VALUES + head], s[HEAD], s[CURSOR] = now, value, float(head), float(cursor)


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(terms=_look_back(values["delay_s"]))


EFFECT = Effect(
    id="clock_skew",
    statement="The joint encoder's samples are stamped late against motor and torque: what is read now was "
    "true a moment ago.",
    equation="joint(t) = joint_true(t - Δ)",
    source="pure delay between channels; a negative one is met by extrapolation along the last Δ",
    parameters=(
        Parameter(
            "delay_s",
            "s",
            0.0,
            -0.05,
            0.05,
            "Δ, positive if the joint's stamps are late",
            minimum=-1.0,
            maximum=1.0,
        ),
    ),
    acts_through=("velocity",),
    bounded=False,
    change=_change,
    rank=100,
)
