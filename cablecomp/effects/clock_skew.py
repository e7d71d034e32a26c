"""Clock skew: the joint encoder's or the torque's readings are stamped late (or early) against the other channels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, term

SLOTS = 256
# The past is kept at steps of at least a 200th of the delay, so that the slots always reach back far enough.
STEPS_PER_DELAY = 200.0


@term(
    parameters=("delay", "of_load"),
    state=("count", "newest", "cursor", ("times", SLOTS), ("readings", SLOTS)),
)
def _look_back(c: Any, p: Any, s: Any) -> None:
    """p: delay [s], whether of the deflection alone; s: count, place of the newest, of the last one read, times and
    readings in a ring.

    Positive delay: straight interpolation of the past; before the first sample, that one. Negative delay: straight
    on by the mean velocity over a delay's length, which hardly amplifies noise. A torque that is stamped late gives
    the right tensions late: the deflection is carried on as an early reading is. Were the torque itself carried on,
    each of its corners would leave a bump that never was.
    """
    span = abs(p.delay)
    if span == 0.0:
        return
    times, readings = s.times, s.readings
    now = c.time
    value = c.joint + c.reading if p.of_load == 0.0 else c.joint - c.rigid * c.motor
    count, newest, cursor = int(s.count), int(s.newest), int(s.cursor)
    wanted = now - span
    past, past_time = value, now
    if count > 0:
        while cursor != newest and times[(cursor + 1) % SLOTS] <= wanted:
            cursor = (cursor + 1) % SLOTS
        past, past_time = readings[cursor], times[cursor]
        after_time, after = now, value
        if cursor != newest:
            after_time, after = times[(cursor + 1) % SLOTS], readings[(cursor + 1) % SLOTS]
        if past_time < wanted and after_time > past_time:
            past += (after - past) * (wanted - past_time) / (after_time - past_time)
            past_time = wanted
    if p.delay > 0.0:
        c.reading += past - value
    elif past_time < now:
        c.reading += (value - past) * span / (now - past_time)
    if c.commit:
        if count == 0:
            s.count, times[0], readings[0] = 1.0, now, value
            s.newest = s.cursor = 0.0
        elif now == times[newest]:
            readings[newest] = value
        elif now - times[newest] >= span / STEPS_PER_DELAY:
            newest = (newest + 1) % SLOTS
            times[newest], readings[newest] = now, value
            s.newest, s.cursor = float(newest), float(cursor)


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    delays = ((-values["load_delay_s"], 1.0), (values["delay_s"], 0.0))
    return Change(terms=tuple(t for s, load in delays if s for t in _look_back(delay=s, of_load=load)))


EFFECT = Effect(
    id="clock_skew",
    statement="Channels are stamped late against each other, or filtered: what the joint encoder or the torque sensor "
    "reads now was true a moment ago.",
    equation="joint(t) = joint_true(t - Δ), M(t) = M_true(t - Δ_M)",
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
        Parameter(
            "load_delay_s",
            "s",
            0.0,
            -0.1,
            0.1,
            "Δ_M, positive if the torque's stamps are late; 0 if left out",
            minimum=-1.0,
            maximum=1.0,
            omitted=0.0,
            of_load=True,
        ),
    ),
    acts_through=("velocity", "load_rate"),
    bounded=False,
    change=_change,
    rank=100,
)
