"""Thermal pretension in other forms: late, bent, one way, behind a play, and gone once all is warm."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import TEMPERATURE, TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import low_passed
from firmware_sim.plant.forms.crosstalk import dragged_along
from firmware_sim.plant.forms.pretension_relaxation import lowered
from firmware_sim.plant.records import Floats

_RATE = Parameter("coefficient_per_K", "k", low=-0.5, high=0.5, neutral=0.0)
_REFERENCE = Parameter("reference_degC", "ϑ_ref", 20.0)


def _lagged(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        warm = low_passed(inputs[:, TEMPERATURE], inputs[:, TIME], p["lag_s"])
        return np.asarray(-p["coefficient_per_K"] * (warm - p["reference_degC"]))

    lowered(build, loss)


LAGGED = form(
    "thermal_pretension",
    "lagged",
    "The frame takes time to warm up: T0 (1 + k (ϑ_f − ϑ_ref)), t_l dϑ_f/dt = ϑ − ϑ_f.",
    (_RATE, _REFERENCE, Parameter("lag_s", "t_l", 15.0, 0.0)),
    ("temperature", "time"),
    _lagged,
)


def _quadratic(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        over = inputs[:, TEMPERATURE] - p["reference_degC"]
        return np.asarray(-p["coefficient_per_K"] * over * (1.0 + p["bend_per_K"] * over))

    lowered(build, loss)


QUADRATIC = form(
    "thermal_pretension",
    "quadratic",
    "Expansion that is not in proportion (polymer beside steel): T0 (1 + k Δ (1 + b Δ)), Δ = ϑ − ϑ_ref.",
    (_RATE, _REFERENCE, Parameter("bend_per_K", "b", 0.0, -2.0, 2.0)),
    ("temperature",),
    _quadratic,
)


def _transient(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        quick = low_passed(inputs[:, TEMPERATURE], inputs[:, TIME], p["quick_s"])
        slow = low_passed(inputs[:, TEMPERATURE], inputs[:, TIME], p["slow_s"])
        return np.asarray(-p["coefficient_per_K"] * (quick - slow))

    lowered(build, loss)


TRANSIENT = form(
    "thermal_pretension",
    "transient",
    "Cable and frame expand alike, but the cable follows sooner: T0 (1 + k (ϑ_c − ϑ_f)), each late by its own lag.",
    (_RATE, Parameter("quick_s", "the cable's lag", 2.0, 0.0), Parameter("slow_s", "the frame's", 40.0, 0.0)),
    ("temperature", "time"),
    _transient,
)


def _from_contact(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        over = inputs[:, TEMPERATURE] - p["contact_degC"]
        return np.asarray(-p["coefficient_per_K"] * np.maximum(over, 0.0))

    lowered(build, loss)


FROM_CONTACT = form(
    "thermal_pretension",
    "from_contact",
    "The frame expands into a gap before it pulls at the cable: T0 (1 + k max(ϑ − ϑ_c, 0)).",
    (_RATE, Parameter("contact_degC", "ϑ_c, at which the gap is closed", 20.0)),
    ("temperature",),
    _from_contact,
)


def _sticking(build: Build, p: Mapping[str, float]) -> None:
    def loss(inputs: Floats) -> Floats:
        followed = dragged_along(inputs[:, TEMPERATURE], p["stick_K"])
        return np.asarray(-p["coefficient_per_K"] * (followed - p["reference_degC"]))

    lowered(build, loss)


STICKING = form(
    "thermal_pretension",
    "sticking",
    "Bolted joints of the frame stick and then slide: T0 (1 + k (ϑ_p − ϑ_ref)), ϑ_p follows ϑ through a play of ± ΔK, "
    "from its middle on.",
    (_RATE, _REFERENCE, Parameter("stick_K", "ΔK", 1.0, 0.0, 100.0)),
    ("temperature",),
    _sticking,
)

KINDS: tuple[EffectKind, ...] = (LAGGED, QUADRATIC, TRANSIENT, FROM_CONTACT, STICKING)
