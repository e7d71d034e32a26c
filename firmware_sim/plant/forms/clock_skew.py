"""Clocks that disagree in other forms: drifting apart, jittering, another channel late, stale values, set right
again and again."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import JOINT_NM, Q_IN, Q_OUT, TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.late import read_late
from firmware_sim.plant.records import Floats

_DELAY = Parameter("delay_s", "Δ", low=-1.0, high=1.0, neutral=0.0)


def _late(column: int, delay: Callable[[Floats, Mapping[str, float]], Floats]) -> Callable[..., None]:
    """Stamp a channel late: what it shows at t was true at t − Δ(t)."""

    def apply(build: Build, p: Mapping[str, float]) -> None:
        def read(inputs: Floats, outputs: Floats) -> None:
            time = inputs[:, TIME]
            outputs[:, column] = read_late(time, outputs[:, column], delay(time, p))

        build.stamps.append(read)

    return apply


def _constant(time: Floats, p: Mapping[str, float]) -> Floats:
    return np.full_like(time, p["delay_s"])


def _growing(time: Floats, p: Mapping[str, float]) -> Floats:
    return np.asarray(p["delay_s"] * (p["at_start"] + (1.0 - p["at_start"]) * time / p["span_s"]))


DRIFT = form(
    "clock_skew",
    "drift",
    "The joint encoder's clock runs slow: its delay grows from d Δ at the clock's zero to Δ after span_s.",
    (
        _DELAY,
        Parameter("at_start", "d", 0.0, -1.0, 1.0),
        Parameter("span_s", "when it has come to Δ", 60.0, 1e-3),
    ),
    ("velocity", "time"),
    _late(Q_OUT, _growing),
)


def _jittering(time: Floats, p: Mapping[str, float]) -> Floats:
    count = int((time[-1] - time[0]) / p["packet_s"]) + 2
    drawn = np.random.default_rng(int(p["seed"])).exponential(1.0, count)
    return np.asarray(p["delay_s"] * drawn[((time - time[0]) / p["packet_s"]).astype(int)])


JITTER = form(
    "clock_skew",
    "jitter",
    "Packets of the joint encoder wait in a queue: each is late by its own delay, exponential with mean Δ.",
    (
        Parameter("delay_s", "Δ", low=0.0, high=1.0, neutral=0.0),
        Parameter("packet_s", "length of a packet", 0.05, 1e-3),
        Parameter("seed", "of what is drawn", 0.0, 0.0),
    ),
    ("velocity",),
    _late(Q_OUT, _jittering),
)

TORQUE_LATE = form(
    "clock_skew",
    "torque_late",
    "The torque sensor is stamped late: M(t) = M_true(t − Δ).",
    (_DELAY,),
    ("load_rate", "velocity"),
    _late(JOINT_NM, _constant),
)

MOTOR_LATE = form(
    "clock_skew",
    "motor_late",
    "The motor encoder is stamped late: q_in(t) = q_in,true(t − Δ).",
    (_DELAY,),
    ("velocity",),
    _late(Q_IN, _constant),
)


def _held(time: Floats, p: Mapping[str, float]) -> Floats:
    if p["delay_s"] == 0.0:
        return np.zeros_like(time)
    period, since = 2.0 * p["delay_s"], time - time[0]
    return np.asarray(since - period * np.floor(since / period + 1e-9))


STALE = form(
    "clock_skew",
    "stale",
    "The joint encoder is read more seldom than it is recorded: every value is held for 2 Δ.",
    (Parameter("delay_s", "Δ, mean age of what is shown", low=0.0, high=1.0, neutral=0.0),),
    ("velocity",),
    _late(Q_OUT, _held),
)


def _set_right(time: Floats, p: Mapping[str, float]) -> Floats:
    since = (time - p["start_s"]) / p["period_s"]
    return np.asarray(2.0 * p["delay_s"] * (since - np.floor(since)))


RESYNCHRONISED = form(
    "clock_skew",
    "resynchronised",
    "The joint encoder's clock drifts and is set right every p seconds, as network time is: its delay is 2 Δ times the "
    "share of p that has passed since.",
    (
        _DELAY,
        Parameter("period_s", "p", 5.0, 1e-3),
        Parameter("start_s", "one instant at which it is set right", 0.0),
    ),
    ("velocity", "time"),
    _late(Q_OUT, _set_right),
)

KINDS: tuple[EffectKind, ...] = (DRIFT, JITTER, TORQUE_LATE, MOTOR_LATE, STALE, RESYNCHRONISED)
