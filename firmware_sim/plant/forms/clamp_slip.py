"""Clamps that slip in other forms: slowly, in steps, the other cable's, whenever they are pulled too hard."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import RELEASED_H, RELEASED_L
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import STEPS, UNEQUAL, ramp, schedule, settling, stairs, unequal_stairs

_SLIP = Parameter("slip_m", "length released in all", low=0.0, high=0.1, neutral=0.0)
_TIME = Parameter("time_s", "when it begins")
_WHICH = Parameter("cable_l", "1: cable l slips", 0.0, 0.0, 1.0)


def _column(p: Mapping[str, float]) -> int:
    return RELEASED_L if p["cable_l"] >= 0.5 else RELEASED_H


def _gradual(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, _column(p), p["slip_m"], lambda t: ramp(t, p["time_s"], p["duration_s"]))


GRADUAL = form(
    "clamp_slip",
    "gradual",
    "A clamp slides for a while: one cable gains length at a steady rate, then no more.",
    (_SLIP, _TIME, Parameter("duration_s", "how long it slides", 8.0, 0.0), _WHICH),
    ("time",),
    _gradual,
)


def _stepwise(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, _column(p), p["slip_m"], lambda t: stairs(t, p["time_s"], p["duration_s"], p["steps"]))


IN_STEPS = form(
    "clamp_slip",
    "in_steps",
    "A clamp lets go again and again: one cable gains length in equal steps.",
    (
        _SLIP,
        _TIME,
        *STEPS,
        _WHICH,
    ),
    ("time",),
    _stepwise,
)


def _unequal(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, _column(p), p["slip_m"], lambda t: unequal_stairs(t, p))


UNEQUAL_STEPS = form(
    "clamp_slip",
    "unequal_steps",
    "A clamp lets go again and again, each time by more or less than the last, after a longer or a shorter wait.",
    (
        _SLIP,
        _TIME,
        *STEPS,
        *UNEQUAL,
        _WHICH,
    ),
    ("time",),
    _unequal,
)


def _settles(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, _column(p), p["slip_m"], lambda t: settling(t, p["time_s"], p["lag_s"]))


SETTLING = form(
    "clamp_slip",
    "settling",
    "A clamp that gives way and bites again: one cable gains length fast at first and ever more slowly.",
    (_SLIP, _TIME, Parameter("lag_s", "until 63 % of it is gone", 5.0, 0.0), _WHICH),
    ("time",),
    _settles,
)


def _other(build: Build, p: Mapping[str, float]) -> None:
    schedule(build, RELEASED_L, p["slip_m"], lambda t: ramp(t, p["time_s"], 0.0))


OTHER_CABLE = form(
    "clamp_slip",
    "other_cable",
    "The clamp of cable l slips at once: the joint stands off the other way.",
    (_SLIP, _TIME),
    ("time",),
    _other,
)


def _overload(build: Build, p: Mapping[str, float]) -> None:
    cable = build.cables[0]
    cable["overload_N"], cable["overload_rate"] = p["holds_N"], p["rate_m_per_Ns"]


OVERLOAD = form(
    "clamp_slip",
    "overload",
    "A clamp that holds so much and no more: while T_h exceeds it, cable h gains length at rate · (T_h − T_c).",
    (
        Parameter("rate_m_per_Ns", "m/(N s)", low=0.0, neutral=0.0),
        Parameter("holds_N", "T_c", low=0.0),
    ),
    ("time", "load"),
    _overload,
)

KINDS: tuple[EffectKind, ...] = (GRADUAL, IN_STEPS, UNEQUAL_STEPS, SETTLING, OTHER_CABLE, OVERLOAD)
