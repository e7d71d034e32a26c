"""Clamps that slip in other forms: slowly, in steps, the other cable's, whenever they are pulled too hard, a bit
at every pull."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import JOINT_TORQUE, RELEASED_H, RELEASED_L, TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import ratcheted
from firmware_sim.plant.forms.events import Event, Values
from firmware_sim.plant.records import Floats

_SLIP = Event(
    "clamp_slip",
    Parameter("slip_m", "length released in all", low=0.0, high=0.1, neutral=0.0),
    Parameter("cable_l", "1: cable l slips", 0.0, 0.0, 1.0),
    (RELEASED_H, RELEASED_L),
    ("time",),
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


def _ratchet(inputs: Floats, p: Values) -> Floats:
    pulls = inputs[:, JOINT_TORQUE] * (-1.0 if p["cable_l"] >= 0.5 else 1.0)
    return ratcheted(inputs[:, TIME], pulls, p["time_s"], p["duration_s"], p["holds_Nm"])


KINDS: tuple[EffectKind, ...] = (
    _SLIP.for_a_while(
        "gradual",
        "A clamp slides for a while: one cable gains length at a steady rate, then no more.",
        Parameter("duration_s", "how long it slides", 8.0, 0.0),
    ),
    _SLIP.in_steps("A clamp lets go again and again: one cable gains length in equal steps."),
    _SLIP.in_unequal_steps(
        "A clamp lets go again and again, each time by more or less than the last, after a longer or a shorter wait."
    ),
    _SLIP.settling(
        "A clamp that gives way and bites again: one cable gains length fast at first and ever more slowly."
    ),
    _SLIP.worked(
        "worked_loose", "A clamp that the load works loose: one cable gains length whenever the load moves."
    ),
    _SLIP.of_cable_l("The clamp of cable l slips at once: the joint stands off the other way."),
    OVERLOAD,
    _SLIP.driven(
        "ratcheting",
        "A clamp that walks, as joints held by friction do: every pull beyond what it holds takes a bit, by how far "
        "it goes beyond, however quickly; letting go takes nothing back.",
        (
            Parameter("duration_s", "how long it walks", 15.0, 0.0),
            Parameter("holds_Nm", "moment that pulls this cable, beyond which it walks", 0.0),
        ),
        _ratchet,
        ("load",),
    ),
)
