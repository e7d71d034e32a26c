"""Wires that break in other forms: one after another, fraying, ever faster or more slowly, the other cable's."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import SOFTENED_H, SOFTENED_L
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import STEPS, UNEQUAL, ramp, schedule, settling, stairs, unequal_stairs

_LOST = Parameter("fraction", "share of EA lost in the end", low=0.0, high=0.95, neutral=0.0)
_TIME = Parameter("time_s", "when it begins")
_WHICH = Parameter("cable_l", "1: wires of cable l", 0.0, 0.0, 1.0)


def _column(p: Mapping[str, float]) -> int:
    return SOFTENED_L if p["cable_l"] >= 0.5 else SOFTENED_H


def _stepwise(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, _column(p), p["fraction"], lambda t: stairs(t, p["time_s"], p["duration_s"], p["steps"]))


IN_STEPS = form(
    "strand_break",
    "in_steps",
    "Wires break one after another: EA of one cable falls in equal steps.",
    (
        _LOST,
        _TIME,
        *STEPS,
        _WHICH,
    ),
    ("time", "load"),
    _stepwise,
)


def _unequal(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, _column(p), p["fraction"], lambda t: unequal_stairs(t, p))


UNEQUAL_STEPS = form(
    "strand_break",
    "unequal_steps",
    "Wires break one after another, each time more or fewer than the last, and after a longer or a shorter wait.",
    (
        _LOST,
        _TIME,
        *STEPS,
        *UNEQUAL,
        _WHICH,
    ),
    ("time", "load"),
    _unequal,
)


def _fraying(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, _column(p), p["fraction"], lambda t: ramp(t, p["time_s"], p["duration_s"]))


FRAYING = form(
    "strand_break",
    "fraying",
    "A cable frays: its EA falls at a steady rate for a while.",
    (_LOST, _TIME, Parameter("duration_s", "how long", 15.0, 0.0), _WHICH),
    ("time", "load"),
    _fraying,
)


def _wearing_in(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, _column(p), p["fraction"], lambda t: settling(t, p["time_s"], p["lag_s"]))


SETTLING = form(
    "strand_break",
    "settling",
    "The wires that lie badly break first: a cable's EA falls fast and ever more slowly.",
    (_LOST, _TIME, Parameter("lag_s", "until 63 % of it is gone", 5.0, 0.0), _WHICH),
    ("time", "load"),
    _wearing_in,
)


def _faster(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, _column(p), p["fraction"], lambda t: ramp(t, p["time_s"], p["duration_s"]) ** 2)


ACCELERATING = form(
    "strand_break",
    "accelerating",
    "Each wire that breaks loads the others: EA falls ever faster, by the square of the time, and then no more.",
    (_LOST, _TIME, Parameter("duration_s", "how long", 15.0, 0.0), _WHICH),
    ("time", "load"),
    _faster,
)


def _other(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, SOFTENED_L, p["fraction"], lambda t: ramp(t, p["time_s"], 0.0))


OTHER_CABLE = form(
    "strand_break",
    "other_cable",
    "Wires of cable l break at once: its EA falls by the fraction.",
    (_LOST, _TIME),
    ("time", "load"),
    _other,
)

KINDS: tuple[EffectKind, ...] = (IN_STEPS, UNEQUAL_STEPS, FRAYING, OTHER_CABLE, SETTLING, ACCELERATING)
