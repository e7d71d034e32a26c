"""Wires that break in other forms: one after another, fraying, ever faster or more slowly, the other cable's, as they
are bent over the drums."""

from __future__ import annotations

from firmware_sim.plant.columns import MOTOR_ANGLE, SOFTENED_H, SOFTENED_L, TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter
from firmware_sim.plant.forms.courses import worn_by_travel
from firmware_sim.plant.forms.events import Event, Values
from firmware_sim.plant.records import Floats

_BREAK = Event(
    "strand_break",
    Parameter("fraction", "share of EA lost in the end", low=0.0, high=0.95, neutral=0.0),
    Parameter("cable_l", "1: wires of cable l", 0.0, 0.0, 1.0),
    (SOFTENED_H, SOFTENED_L),
    ("time", "load"),
)
_LASTS = Parameter("duration_s", "how long", 15.0, 0.0)


def _bent(inputs: Floats, p: Values) -> Floats:
    time, motor = inputs[:, TIME], inputs[:, MOTOR_ANGLE]
    return worn_by_travel(time, motor, p["time_s"], p["pace_rad_s"], p["travel_rad"], p["power"])


KINDS: tuple[EffectKind, ...] = (
    _BREAK.in_steps("Wires break one after another: EA of one cable falls in equal steps."),
    _BREAK.in_unequal_steps(
        "Wires break one after another, each time more or fewer than the last, and after a longer or a shorter wait."
    ),
    _BREAK.for_a_while("fraying", "A cable frays: its EA falls at a steady rate for a while.", _LASTS),
    _BREAK.worked(
        "fatigued", "Wires break as the load comes and goes: EA of one cable falls whenever it moves."
    ),
    _BREAK.of_cable_l("Wires of cable l break at once: its EA falls by the fraction."),
    _BREAK.settling("The wires that lie badly break first: a cable's EA falls fast and ever more slowly."),
    _BREAK.for_a_while(
        "accelerating",
        "Each wire that breaks loads the others: EA falls ever faster, by the square of the time, and then no more.",
        _LASTS,
        power=2.0,
    ),
    _BREAK.driven(
        "bent_over_drums",
        "Wires break as they are bent over the drums, their lives spread as Weibull has it: of the fraction "
        "1 − e^(−(s/s_w)^k) is gone, s the way of the motor since then.",
        (
            Parameter("travel_rad", "s_w", 20.0, 1e-3),
            Parameter("power", "k", 2.5, 0.5, 10.0),
            Parameter("pace_rad_s", "how fast the motor went before the recording", 0.0, 0.0),
        ),
        _bent,
        ("motor_angle",),
    ),
)
