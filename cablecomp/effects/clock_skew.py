"""Clock skew: the joint encoder's or the torque's readings are stamped late (or early) against the other channels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Late, Parameter
from cablecomp.effects.compiled_term import term
from cablecomp.effects.shared_shapes import begun

SLOTS = 256
# The past is kept at steps of at least a 200th of the delay, so that the slots always reach back far enough.
STEPS_PER_DELAY = 200.0
LONGEST_S = 1.0
"""What a delay grows to at most, however long a clock drifts."""


@term(
    parameters=("delay", "of_load", "drift", "since"),
    state=("start", "count", "cursor", "time", "reading"),
    rings=(("times", SLOTS), ("readings", SLOTS)),
)
def _look_back(c: Any, p: Any, s: Any) -> None:
    """p: delay [s], whether of the deflection alone, by how much it grows in a second, since when [s] (none: with the
    first sample); s: since when, how many readings are kept, number of the last one read, the newest one (its time, the
    reading), and in rings those before.

    Positive delay: straight interpolation of the past; before the first sample, that one. Negative delay: straight on
    by the mean velocity over a delay's length, which hardly amplifies noise. A torque that is stamped late gives the
    right tensions late: the deflection is carried on as an early reading is. Were the torque itself carried on, each of
    its corners would leave a bump that never was.
    """
    now = c.time
    start = s.start
    if c.first:
        start = now if math.isnan(p.since) else p.since
    delay = min(max(p.delay + p.drift * (now - start), -LONGEST_S), LONGEST_S)
    span = abs(delay)
    times, readings = s.times, s.readings
    value = c.joint + c.reading if p.of_load == 0.0 else c.joint - c.rigid * c.motor
    count, cursor = int(s.count), int(s.cursor)
    newest = count - 1
    wanted = now - span
    past, past_time = value, now
    if count > 0:
        while cursor < newest and (s.time if cursor == newest - 1 else times[(cursor + 1) % SLOTS]) <= wanted:
            cursor += 1
        past_time, past = s.time, s.reading
        after_time, after = now, value
        if cursor < newest:
            at = cursor % SLOTS
            past_time, past = times[at], readings[at]
            after_time, after = s.time, s.reading
            if cursor < newest - 1:
                at = (cursor + 1) % SLOTS
                after_time, after = times[at], readings[at]
        if past_time < wanted and after_time > past_time:
            past += (after - past) * (wanted - past_time) / (after_time - past_time)
            past_time = wanted
    if delay > 0.0:
        c.reading += past - value
    elif past_time < now:
        c.reading += (value - past) * span / (now - past_time)
    if c.commit:
        s.start = start
        same = count > 0 and now == s.time
        if count == 0 or same or now - s.time >= span / STEPS_PER_DELAY:
            if count > 0 and not same:
                at = newest % SLOTS
                times[at], readings[at] = s.time, s.reading
                s.cursor = float(cursor)
            s.count = float(count if same else count + 1)
            s.time, s.reading = now, value


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    drift, since = values["drift"], values["drift_since_s"]
    load = _look_back(delay=-values["load_delay_s"], of_load=1.0, drift=0.0, since=math.nan)
    joint = _look_back(delay=values["delay_s"], of_load=0.0, drift=drift, since=since)
    late = values["delay_s"] or drift
    return Change(terms=(*(load if values["load_delay_s"] else ()), *(joint if late else ())))


def _late(values: Mapping[str, float]) -> Late:
    return Late(values["delay_s"], values["drift"], values["drift_since_s"], values["load_delay_s"])


EFFECT = Effect(
    id="clock_skew",
    statement="Channels are stamped late against each other, or filtered: what the joint encoder or the torque sensor "
    "reads now was true a moment ago; where two clocks run at unlike speed, ever longer ago.",
    equation="joint(t) = joint_true(t - Δ - ρ (t - t0)), M(t) = M_true(t - Δ_M); t0 the recording's first sample "
    "unless it is given (clocks that go on from recording to recording)",
    source="pure delay between channels; live, a negative one (and a late torque) is met by extrapolation along the "
    "last Δ, in a recording that is whole by what was read later; crystals of loggers are off by 10 to 50 in a million",
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
        Parameter(
            "drift",
            "-",
            0.0,
            -5e-4,
            5e-4,
            "ρ, seconds by which the joint's stamps fall back in a second; 0 if left out",
            minimum=-0.01,
            maximum=0.01,
            omitted=0.0,
            goes_on=True,
        ),
        begun("drift_since_s", of="drift"),
    ),
    acts_through=("velocity", "load_rate"),
    bounded=False,
    change=_change,
    late=_late,
    rank=100,
)
