"""Friction between strands in other forms: many small plays (Masing), most of them weak (graded), one that takes time,
one that grows with T, half of either, one behind which the wires come to lie, and one that yields little by
little (Bouc–Wen)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.records import PLAYS

_FRACTION = Parameter(
    "fraction", "extra stretch over elastic stretch of the free span", low=0.0, high=10.0, neutral=0.0
)
_YIELD = Parameter("yield_N", "radius of the play in tension", low=0.0)
_ACTS = ("load_direction", "reversal")


def _in_plays(build: Build, fraction: float, count: int) -> None:
    """That much extra stretch, shared alike by so many plays of each free span."""
    build.cables["plays"] = count
    whole = fraction * build.cables["free_m"] / build.cables["EA"]
    build.plays["compliance"][:, :count] = whole[:, None] / count


def _masing(build: Build, p: Mapping[str, float]) -> None:
    _in_plays(build, p["fraction"], PLAYS)
    build.plays["radius"] = p["yield_N"] * (np.arange(PLAYS) + 0.5) / PLAYS


MASING = form(
    "strand_friction",
    "masing",
    "Many contacts, each with its own limit from 0 to yield_N (Masing, Iwan): the loop rounds off at every reversal.",
    (_FRACTION, _YIELD),
    _ACTS,
    _masing,
)


_LESS = 3.0


def _graded(build: Build, p: Mapping[str, float]) -> None:
    _in_plays(build, p["fraction"], PLAYS)
    build.plays["radius"] = p["yield_N"] * _LESS ** -np.arange(float(PLAYS))


GRADED = form(
    "strand_friction",
    "graded",
    "Layers that grip ever less from the core outwards: as Masing's contacts, each limit a third of the next.",
    (_FRACTION, _YIELD),
    _ACTS,
    _graded,
)


def _slow(build: Build, p: Mapping[str, float]) -> None:
    _in_plays(build, p["fraction"], 1)
    build.plays["radius"][:, 0], build.plays["time_s"][:, 0] = p["yield_N"], p["time_s"]


RATE_DEPENDENT = form(
    "strand_friction",
    "rate_dependent",
    "Greased strands: the play yields not at once but in its own time, t_y ṗ = T − p − yield beyond the yield.",
    (_FRACTION, _YIELD, Parameter("time_s", "t_y", 0.2, 0.0)),
    (*_ACTS, "load_rate"),
    _slow,
)


def _proportional(build: Build, p: Mapping[str, float]) -> None:
    _in_plays(build, p["fraction"], 1)
    build.plays["share"][:, 0] = p["share"]


PROPORTIONAL = form(
    "strand_friction",
    "proportional",
    "The lay presses the strands together: the radius of the play is a share of the tension.",
    (_FRACTION, Parameter("share", "radius over tension", 0.1, 0.0, 0.9)),
    _ACTS,
    _proportional,
)


def _mixed(build: Build, p: Mapping[str, float]) -> None:
    _in_plays(build, p["fraction"], PLAYS)
    core = PLAYS // 2
    build.plays["share"][:, :core] = p["share"] * (np.arange(core) + 1.0) / core
    build.plays["radius"][:, core:], build.plays["time_s"][:, core:] = p["yield_N"], p["time_s"]


MIXED_LAY = form(
    "strand_friction",
    "mixed_lay",
    "A core that the lay presses together, its radii shares of the tension up to one of them, in a greased cover that "
    "yields in its own time: half of the stretch each.",
    (
        _FRACTION,
        Parameter("share", "the core's greatest radius over tension", 0.1, 0.0, 0.9),
        _YIELD,
        Parameter("time_s", "t_y of the cover", 0.2, 0.0),
    ),
    (*_ACTS, "load_rate"),
    _mixed,
)


def _seating(build: Build, p: Mapping[str, float]) -> None:
    _in_plays(build, p["fraction"], 1)
    build.plays["radius"][:, 0], build.plays["seats"][:, 0] = p["yield_N"], p["seats_N"]


SEATING = form(
    "strand_friction",
    "seating",
    "Wires that come to lie against each other: what yields beyond the grip ends at S, as S tanh(play/S).",
    (_FRACTION, _YIELD, Parameter("seats_N", "S", 10.0, 1e-6)),
    _ACTS,
    _seating,
)


def _bouc_wen(build: Build, p: Mapping[str, float]) -> None:
    _in_plays(build, p["fraction"], 1)
    build.plays["radius"][:, 0], build.plays["rounded"][:, 0] = p["yield_N"], 1


BOUC_WEN = form(
    "strand_friction",
    "bouc_wen",
    "Bouc and Wen's loop of wire ropes: the strands hold back Z of the tension, dZ/dT = 1 − |Z|/yield_N away from zero "
    "and 1 towards it, so that they yield little by little; e = fraction · L/EA · (T − T0 − Z).",
    (_FRACTION, Parameter("yield_N", "what Z tends to", low=1e-6)),
    _ACTS,
    _bouc_wen,
)

KINDS: tuple[EffectKind, ...] = (
    MASING,
    GRADED,
    RATE_DEPENDENT,
    PROPORTIONAL,
    MIXED_LAY,
    SEATING,
    BOUC_WEN,
)
