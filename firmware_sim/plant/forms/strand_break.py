"""Wires that break in other forms: one after another, fraying, ever faster or more slowly, the other cable's."""

from __future__ import annotations

from firmware_sim.plant.columns import SOFTENED_H, SOFTENED_L
from firmware_sim.plant.effects.base import EffectKind, Parameter
from firmware_sim.plant.forms.events import Event

_BREAK = Event(
    "strand_break",
    Parameter("fraction", "share of EA lost in the end", low=0.0, high=0.95, neutral=0.0),
    Parameter("cable_l", "1: wires of cable l", 0.0, 0.0, 1.0),
    (SOFTENED_H, SOFTENED_L),
    ("time", "load"),
)
_LASTS = Parameter("duration_s", "how long", 15.0, 0.0)

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
)
