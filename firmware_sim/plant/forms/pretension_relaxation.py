"""Relaxation in other forms; the clock is the one that all recordings of a joint share."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from scipy.integrate import cumulative_trapezoid

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import (
    JOINT_TORQUE,
    MOTOR_ANGLE,
    PRETENSION_H,
    PRETENSION_L,
    TEMPERATURE,
    TIME,
)
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.records import Floats

_FRACTION = Parameter("fraction", "a", low=-0.5, high=0.9, neutral=0.0)
_ROOM_DEGC = 20.0


def lowered(build: Build, loss: Callable[[Floats], Floats]) -> None:
    """Take `loss`, over T0, off the pretension of both cables."""

    def fill(inputs: Floats) -> None:
        lost = loss(inputs)
        inputs[:, PRETENSION_H] -= lost
        inputs[:, PRETENSION_L] -= lost

    build.schedules.append(fill)


def _power(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        age = np.maximum(inputs[:, TIME] + p["age_s"], 0.0) / p["scale_s"]
        return np.asarray(
            p["fraction"] * (age ** p["exponent"] - (p["age_s"] / p["scale_s"]) ** p["exponent"])
        )

    lowered(build, loss)


POWER_LAW = form(
    "pretension_relaxation",
    "power_law",
    "Creep by a power of time, begun long ago and going on from recording to recording: T0 (1 − a (((t + t_a)/t_s)^p "
    "− (t_a/t_s)^p)), t the clock's time.",
    (
        _FRACTION,
        Parameter("exponent", "p", 0.33, 0.1, 1.0),
        Parameter("scale_s", "t_s", 100.0, 1e-3),
        Parameter("age_s", "t_a, how long before the clock's zero it began", 0.0, 0.0),
    ),
    ("time",),
    _power,
)


def _exponential(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        return np.asarray(-p["fraction"] * np.expm1(-np.maximum(inputs[:, TIME], 0.0) / p["time_constant_s"]))

    lowered(build, loss)


EXPONENTIAL = form(
    "pretension_relaxation",
    "exponential",
    "A termination beds in and comes to rest: T0 (1 − a (1 − e^(−t/t_c))), t the clock's time.",
    (_FRACTION, Parameter("time_constant_s", "t_c", 30.0, 1e-3)),
    ("time",),
    _exponential,
)


def _warm(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        time = np.maximum(inputs[:, TIME], 0.0)
        quicker = np.exp2((inputs[:, TEMPERATURE] - _ROOM_DEGC) / p["doubling_K"])
        rate = quicker / (p["time_constant_s"] + time)
        before = np.log1p(time[0] / p["time_constant_s"])
        return np.asarray(p["fraction"] * (before + cumulative_trapezoid(rate, time, initial=0.0)))

    lowered(build, loss)


WARM = form(
    "pretension_relaxation",
    "warm_creep",
    "Creep that the temperature drives: dT0/dt = −a T0 2^((ϑ − 20 °C)/ΔK)/(t_c + t), t the clock's time.",
    (
        _FRACTION,
        Parameter("time_constant_s", "t_c", 10.0, 1e-3),
        Parameter("doubling_K", "ΔK, by which the rate doubles", 5.0, 0.5, 100.0),
    ),
    ("time", "temperature"),
    _warm,
)


def _in_two(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        time = np.maximum(inputs[:, TIME], 0.0)
        bedded = -np.expm1(-time / p["time_constant_s"])
        crept = time / p["lasts_s"]
        return np.asarray(p["fraction"] * (p["share"] * bedded + (1.0 - p["share"]) * crept))

    lowered(build, loss)


IN_TWO = form(
    "pretension_relaxation",
    "in_two",
    "A termination beds in while the cable creeps on evenly: T0 (1 − a (s (1 − e^(−t/t_c)) + (1 − s) t/t_l)), t the "
    "clock's time.",
    (
        _FRACTION,
        Parameter("share", "s, of the bedding in", 0.5, 0.0, 1.0),
        Parameter("time_constant_s", "t_c", 5.0, 1e-3),
        Parameter("lasts_s", "t_l", 60.0, 1e-3),
    ),
    ("time",),
    _in_two,
)


def _by_travel(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        time = inputs[:, TIME]
        went = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(inputs[:, MOTOR_ANGLE])))])
        # before the recording it went as it goes in it
        before = max(time[0], 0.0) * went[-1] / max(time[-1] - time[0], 1e-9)
        return np.asarray(-p["fraction"] * np.expm1(-(before + went) / p["travel_rad"]))

    lowered(build, loss)


BY_TRAVEL = form(
    "pretension_relaxation",
    "by_travel",
    "A new cable beds in as it is run: T0 (1 − a (1 − e^(−s/s_c))), s the way of the motor since the clock's zero.",
    (_FRACTION, Parameter("travel_rad", "s_c", 20.0, 1e-3)),
    ("time",),
    _by_travel,
)


def _under_load(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        time = np.maximum(inputs[:, TIME], 0.0)
        load = np.abs(inputs[:, JOINT_TORQUE]) / p["usual_Nm"]
        borne = time[0] * float(np.mean(load)) + cumulative_trapezoid(load, time, initial=0.0)
        return np.asarray(p["fraction"] * np.cbrt(borne / p["time_constant_s"]))

    lowered(build, loss)


UNDER_LOAD = form(
    "pretension_relaxation",
    "under_load",
    "Creep that the load drives: T0 (1 − a (∫|M| dt/(M_u t_c))^(1/3)) since the clock's zero, before the recording "
    "under its mean load.",
    (
        _FRACTION,
        Parameter("usual_Nm", "M_u", 1.0, 1e-9),
        Parameter("time_constant_s", "t_c", 30.0, 1e-3),
    ),
    ("time", "load"),
    _under_load,
)


def _stretched(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        age = np.maximum(inputs[:, TIME], 0.0) / p["time_constant_s"]
        return np.asarray(-p["fraction"] * np.expm1(-(age ** p["exponent"])))

    lowered(build, loss)


STRETCHED = form(
    "pretension_relaxation",
    "stretched",
    "A polymer line relaxes by Kohlrausch's stretched exponential: T0 (1 − a (1 − e^(−(t/t_c)^b))), t the clock's "
    "time.",
    (
        _FRACTION,
        Parameter("time_constant_s", "t_c", 20.0, 1e-3),
        Parameter("exponent", "b", 0.5, 0.1, 1.0),
    ),
    ("time",),
    _stretched,
)

KINDS: tuple[EffectKind, ...] = (
    POWER_LAW,
    EXPONENTIAL,
    WARM,
    IN_TWO,
    BY_TRAVEL,
    UNDER_LOAD,
    STRETCHED,
)
