"""Slip drag in other forms: a power of the speed, its arsinh, a coefficient that grows with it, one drum alone."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.effects.base import EffectKind, Parameter, form

_DRAG = Parameter("coefficient_Ns_per_m_rad", "c", low=0.0, neutral=0.0)
_SPEED = Parameter("speed_m_s", "v0", 1e-4, 1e-9, 10.0)
_ACTS = ("load_rate", "dwell")


def _power(build: Build, p: Mapping[str, float]) -> None:
    build.cables["viscous_out"] = p["coefficient_Ns_per_m_rad"] / build.cables["R"]
    build.cables["viscous_in"] = p["coefficient_Ns_per_m_rad"] / build.cables["r"]
    build.cables["drag_exponent"], build.cables["drag_speed"] = p["exponent"], p["speed_m_s"]


POWER_LAW = form(
    "viscous_slip",
    "power_law",
    "A film that thins with shear: a sliding point feels mu T + c v0 (v/v0)^p per radian.",
    (_DRAG, _SPEED, Parameter("exponent", "p", 0.5, 0.25, 1.0)),
    _ACTS,
    _power,
)


def _strengthening(build: Build, p: Mapping[str, float]) -> None:
    build.cables["strengthening"], build.cables["drag_speed"] = p["gain"], p["speed_m_s"]


STRENGTHENING = form(
    "viscous_slip",
    "strengthening",
    "The coefficient grows with the logarithm of the slip speed: mu (1 + a arsinh(v/v0)) T per radian.",
    (Parameter("gain", "a", low=0.0, high=2.0, neutral=0.0), _SPEED),
    _ACTS,
    _strengthening,
)


def _one_drum(build: Build, p: Mapping[str, float]) -> None:
    side, radius = ("viscous_in", "r") if p["on_input"] >= 0.5 else ("viscous_out", "R")
    build.cables[side] = p["coefficient_Ns_per_m_rad"] / build.cables[radius]


ONE_DRUM = form(
    "viscous_slip",
    "one_drum",
    "Grease on one of the two drums alone: mu T + c v per radian there, mu T on the other.",
    (_DRAG, Parameter("on_input", "1: the input drum", 0.0, 0.0, 1.0)),
    _ACTS,
    _one_drum,
)


def _eyring(build: Build, p: Mapping[str, float]) -> None:
    _power(build, {**p, "exponent": 0.0})


EYRING = form(
    "viscous_slip",
    "eyring",
    "A lubricant that shears as Eyring has it, in proportion at first and then by the logarithm: a sliding point feels "
    "mu T + c v0 arsinh(v/v0) per radian.",
    (_DRAG, _SPEED),
    _ACTS,
    _eyring,
)

KINDS: tuple[EffectKind, ...] = (POWER_LAW, STRENGTHENING, ONE_DRUM, EYRING)
