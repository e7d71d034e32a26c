"""Excitations: motor angle and load over time, as a bench, a moving joint or a reaching arm makes them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from firmware_sim.plant.records import Floats

RATES_HZ = (100.0, 125.0)
KINDS = ("bench", "moving", "reaching")
HANDOVER_S = 0.03  # a contact's load builds up within this time at the least


@dataclass(frozen=True)
class Course:
    """What is done to a joint in one recording; SI units, one value per sample.

    `temperature_degC` and `other` (the load on a neighbouring joint, N·m, or its angle, rad) go along with it.
    The first `history` samples happen before the recording begins.
    """

    kind: str
    time_s: Floats
    motor_rad: Floats
    load_Nm: Floats
    temperature_degC: Floats
    other: Floats
    history: int = 0

    @property
    def seen(self) -> Course:
        """The course without its history."""
        if self.history == 0:
            return self
        return self.at(self.time_s[self.history :])

    def at(self, time_s: Floats, history: int = 0) -> Course:
        """The same course at other instants; the first `history` of them count as history."""

        def taken(values: Floats) -> Floats:
            return np.asarray(np.interp(time_s, self.time_s, values))

        return Course(
            self.kind,
            time_s,
            taken(self.motor_rad),
            taken(self.load_Nm),
            taken(self.temperature_degC),
            taken(self.other),
            history,
        )

    def later(self, start_s: float) -> Course:
        """The same course with its clock set on by `start_s`."""
        return replace(self, time_s=self.time_s + start_s)


@dataclass(frozen=True)
class Range:
    """What a course may use: greatest load, travel of the joint either way, motor turn per joint turn, and how far a
    neighbouring joint goes either way, in its channel's unit (None: it bears a load as great as this one)."""

    load_Nm: float
    travel_rad: float
    motor_per_joint: float
    one_sided: bool = False
    neighbour: float | None = None


def draw_course(
    rng: np.random.Generator,
    kind: str,
    within: Range,
    warm: bool = False,
    rate_Hz: float | None = None,
    lasts_s: float | None = None,
) -> Course:
    """Draw a course, of 40–60 s if nothing else is said: `bench` (ramps and holds, input locked), `moving` (sweeps of
    both pulleys under changing load) or `reaching` (least-jerk moves, load steps on contact).

    With `warm` the temperature swings by 6–12 K, else it drifts by about one; `within.one_sided` keeps the
    load from changing its sign.
    """
    rate = float(rng.choice(RATES_HZ)) if rate_Hz is None else rate_Hz
    lasts = float(rng.uniform(40.0, 60.0)) if lasts_s is None else lasts_s
    time = np.arange(round(lasts * rate)) / rate
    makers = {"bench": _bench, "moving": _moving, "reaching": _reaching}
    joint, load = makers[kind](rng, time)
    if within.one_sided:
        load = 0.5 * (load + np.max(np.abs(load)) * np.minimum(time / 2.0, 1.0))
    return Course(
        kind,
        time,
        joint * within.travel_rad * within.motor_per_joint,
        load * within.load_Nm,
        draw_temperature(rng, time, 6.0 if warm else 0.7),
        draw_neighbour(rng, time, within.load_Nm if within.neighbour is None else within.neighbour),
    )


def draw_temperature(rng: np.random.Generator, time: Floats, swing_K: float) -> Floats:
    """About 20 °C, warming up and cooling down again by one to two swings, in an order that no clock has."""
    span = time[-1] - time[0]
    phase = (time - time[0]) / span
    swing = swing_K * float(rng.uniform(1.0, 2.0)) * float(rng.choice((-1.0, 1.0)))
    turns = float(rng.uniform(0.8, 1.6))
    wave = np.sin(2.0 * math.pi * turns * phase + rng.uniform(0, 2 * math.pi))
    return np.asarray(20.0 + float(rng.uniform(-1, 1)) + 0.5 * swing * wave)


def draw_neighbour(rng: np.random.Generator, time: Floats, most: float) -> Floats:
    """A neighbouring joint's load or angle: holds and smooth changes of its own, up to `most` either way."""
    knots = _knots(rng, time, 0.6, 3.0)
    values = rng.uniform(-1.0, 1.0, len(knots))
    values[0] = 0.0
    return np.asarray(most * _eased(time, knots, values, 0.8))


def _bench(rng: np.random.Generator, time: Floats) -> tuple[Floats, Floats]:
    """Ramps at three rates between turning points, with holds; the first swings are wide, then nested."""
    end, at, load = float(time[-1]), 0.0, 0.0
    rates = (float(rng.uniform(1.2, 2.4)), float(rng.uniform(0.5, 0.9)), float(rng.uniform(0.18, 0.3)))
    times, loads = [0.0], [0.0]
    side, reach, turns = float(rng.choice((-1.0, 1.0))), 1.0, 0
    while at < end:
        goal = side * reach * float(rng.uniform(0.9, 1.0))
        at += abs(goal - load) / rates[turns % 3 if turns else 1] + 1e-3
        times.append(at)
        loads.append(goal)
        if rng.uniform() < 0.6:
            at += float(rng.uniform(0.4, 1.5)) if rng.uniform() < 0.75 else float(rng.uniform(2.5, 5.0))
            times.append(at)
            loads.append(goal)
        load, side, turns = goal, -side, turns + 1
        reach = 1.0 if reach < 0.3 else reach * float(rng.uniform(0.55, 0.95))
    return np.zeros_like(time), np.interp(time, times, loads)


def _moving(rng: np.random.Generator, time: Floats) -> tuple[Floats, Floats]:
    """Sweeps whose speed and reach change, with rests; load by slow sines, or by ramps and holds."""
    fast, slow = float(rng.uniform(0.25, 0.45)), float(rng.uniform(0.07, 0.14))
    pace = np.where((time // float(rng.uniform(6.0, 10.0))) % 2 == 0, fast, slow)
    for _ in range(int(rng.integers(1, 4))):
        start = float(rng.uniform(3.0, max(time[-1] - 5.0, 3.1)))
        pace = np.where((time > start) & (time < start + rng.uniform(1.0, 3.0)), 0.0, pace)
    phase = 2.0 * math.pi * _smooth(np.cumsum(pace) * (time[1] - time[0]), time, 0.2)
    wobble = 1.0 - float(rng.uniform(0.0, 0.4)) * np.sin(0.37 * phase) ** 2
    joint = np.sin(phase - phase[0]) * wobble
    if rng.uniform() < 0.5:
        f = float(rng.uniform(0.15, 0.35))
        load = np.sin(2 * math.pi * f * time) * np.cos(
            2 * math.pi * float(rng.uniform(0.02, 0.05)) * time + rng.uniform(0, 6)
        )
    else:
        _, load = _bench(rng, time)
    return joint, np.asarray(load * min(1.0, 1.0 / max(float(np.max(np.abs(load))), 1e-9)))


def _reaching(rng: np.random.Generator, time: Floats) -> tuple[Floats, Floats]:
    """Least-jerk moves to random places; on arrival a contact loads the joint, yields in part, lets go.

    A small load of one sign is left between contacts, as every tool has.
    """
    tool = float(rng.choice((-1.0, 1.0)) * rng.uniform(0.03, 0.12))
    knots, places, load_t, loads = [0.0], [0.0], [0.0, 0.3], [0.0, tool]
    at, place = float(rng.uniform(0.4, 0.8)), 0.0
    while at < time[-1]:
        goal = float(rng.uniform(-1.0, 1.0))
        if abs(goal - place) < 0.4:
            goal = place + math.copysign(0.4, -place)
        duration = float(rng.uniform(0.6, 1.6)) * (0.5 + 0.5 * abs(goal - place))
        knots += [at, at + duration]
        places += [place, goal]
        at, place = at + duration + float(rng.uniform(0.1, 0.4)), goal
        force = float(rng.choice((-1.0, 1.0)) * rng.uniform(0.3, 1.0))
        for level in (
            force,
            force * float(rng.uniform(0.2, 0.8)),
            force * float(rng.uniform(0.6, 1.0)),
            tool,
        ):
            rise = float(rng.choice((rng.uniform(HANDOVER_S, 0.1), rng.uniform(0.3, 0.8))))
            load_t += [at, at + rise]
            loads += [loads[-1], level]
            at += rise + float(rng.uniform(0.15, 0.9))
            if rng.uniform() < 0.35 and level != tool:
                load_t += [at, at + 0.3]
                loads += [level, tool]
                at += 0.3 + float(rng.uniform(0.1, 0.5))
                break
    joint = _least_jerk(time, np.asarray(knots), np.asarray(places))
    return joint, np.asarray(np.interp(time, load_t, loads))


def _least_jerk(time: Floats, knots: Floats, places: Floats) -> Floats:
    k = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(knots) - 2)
    span = np.maximum(knots[k + 1] - knots[k], 1e-9)
    x = np.clip((time - knots[k]) / span, 0.0, 1.0)
    share = x**3 * (10.0 + x * (6.0 * x - 15.0))
    return np.asarray(places[k] + share * (places[k + 1] - places[k]))


def _eased(time: Floats, knots: Floats, values: Floats, ease: float) -> Floats:
    """Hold each value from its knot on, arriving within the share `ease` of the interval before it."""
    starts = knots[1:] - ease * np.diff(knots)
    t = np.sort(np.concatenate([[knots[0]], starts, knots[1:]]))
    return _least_jerk(time, t, np.repeat(values, 2)[:-1])


def _knots(rng: np.random.Generator, time: Floats, shortest: float, longest: float) -> Floats:
    knots = [float(time[0])]
    while knots[-1] < time[-1]:
        knots.append(knots[-1] + float(rng.uniform(shortest, longest)))
    return np.asarray(knots)


def _smooth(values: Floats, time: Floats, width_s: float) -> Floats:
    """Moving average over `width_s`, twice, ends continued."""
    n = max(1, round(width_s / (time[1] - time[0])))
    for _ in range(2):
        padded = np.concatenate([np.full(n, values[0]), values, np.full(n, values[-1])])
        values = np.convolve(padded, np.ones(n) / n, mode="same")[n:-n]
    return np.asarray(values)
