"""Thermal pretension: cable and frame expand differently, so that the pretension follows the temperature."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import (
    LEAST_PRETENSION,
    Change,
    Effect,
    Parameter,
    Restated,
    cable_strain,
    pretension_moment,
)
from cablecomp.effects.compiled_term import term
from cablecomp.effects.lag import lagged


@term(
    parameters=("coefficient", "bend", "reference", "lag", "stick", "hanging"),
    state=("known", "time", "read", "warm", "slid"),
)
def _expand(c: Any, p: Any, s: Any) -> None:
    """p: coefficient [1/K], its growth [1/K], reference [degC], lag [s], by how much what expands sticks [K], moment
    R T0 that hangs [N m] (closed circuit: 0); s: whether a reading came before, its time [s], that reading,
    temperature of what expands then, and that which it had slid to [degC]. It goes straight from sample to sample.

    Without a temperature nothing is changed.
    """
    read = c.temperature
    if math.isnan(read):
        if c.first and c.commit:
            s.known = 0.0
    else:
        goes_on = s.known != 0.0 and not c.first
        warm = read
        if p.lag > 0.0 and goes_on:
            warm = lagged(s.warm, s.read, read, c.time - s.time, p.lag) if c.time > s.time else s.warm
        slid = warm
        if p.stick > 0.0 and goes_on:
            slid = min(max(s.slid, warm - p.stick), warm + p.stick)
        if c.commit:
            s.known, s.time, s.read, s.warm, s.slid = 1.0, c.time, read, warm, slid
        over = slid - p.reference
        factor = max(1.0 + p.coefficient * over * (1.0 + p.bend * over), LEAST_PRETENSION)
        if p.hanging > 0.0:
            c.moment += p.hanging * (1.0 - factor)
        else:
            c.pretension_h *= factor
            c.pretension_l *= factor


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    closed = config.drive.circuit == "closed"
    hanging = 0.0 if closed else pretension_moment(config)
    terms = _expand(
        coefficient=values["coefficient_per_K"],
        bend=values["bend_per_K"],
        reference=values["reference_degC"],
        lag=values["lag_s"],
        stick=values["stick_K"],
        hanging=hanging,
    )
    return Change(terms=terms, moves_pretension=closed)


def _per_strain(config: JointConfig) -> float:
    """EA/T0 [-]: share of the pretension per unit of strain that cable and frame differ by."""
    return 1.0 / cable_strain(config)


def _at_reference(values: Mapping[str, float], reference: float) -> Restated:
    """T0 (1 + k D (1 + b D)) keeps its values, D = ϑ - ϑ_ref: T0 -> T0 f, k -> k g/f, b -> b/g with d = ϑ_ref' - ϑ_ref,
    f = 1 + k d (1 + b d), g = 1 + 2 b d."""
    moved, bend = reference - values["reference_degC"], values.get("bend_per_K", 0.0)
    factor = 1.0 + values["coefficient_per_K"] * moved * (1.0 + bend * moved)
    steeper = 1.0 + 2.0 * bend * moved
    told = {"coefficient_per_K": values["coefficient_per_K"] * steeper / factor, "bend_per_K": bend / steeper}
    return Restated(told, pretension=factor)


EFFECT = Effect(
    id="thermal_pretension",
    statement="Cable and frame expand differently with temperature, and the pretension rises or falls with "
    "it.",
    equation="T0(ϑ) = T0 (1 + k D (1 + b D)), D = y - ϑ_ref, with k = (α_frame - α_cable) EA/T0 for a stiff frame, ϑ "
    "the temperature of what expands: t_l dϑ/dt = ϑ_measured - ϑ; y drawn along by ϑ, |y - ϑ| <= s; in an open circuit "
    "T = T0(ϑ) + M/R",
    source="thermal strain of a member held at constant length: S. Timoshenko, Strength of Materials, part "
    "I, 1930; coefficients of expansion themselves rise with temperature: R. K. Kirby, T. A. Hahn and B. D. "
    "Rothrock, in American Institute of Physics Handbook, 1972; bolted joints stick before they slide: L. Gaul and "
    "R. Nitsche, Appl. Mech. Rev. 54, 2001",
    parameters=(
        Parameter(
            "coefficient_per_K",
            "1/K",
            0.0,
            -1.5e-4,
            1.5e-4,
            "k; expansion coefficients (steel 1.2e-5, nylon 8e-5 per K) times EA/T0",
            scale=_per_strain,
            minimum=-1.0,
            maximum=1.0,
        ),
        Parameter(
            "reference_degC",
            "degC",
            0.0,
            0.0,
            40.0,
            "temperature at which T0 is the nominal one",
            role="reference",
            held=True,
        ),
        Parameter(
            "lag_s",
            "s",
            0.0,
            1.0,
            300.0,
            "t_l, by which what expands follows the temperature measured; 0: at once",
            log=True,
            role="shape",
            omitted=0.0,
            minimum=0.0,
            tries=(5.0, 20.0, 60.0),
            within_recording=True,
        ),
        Parameter(
            "bend_per_K",
            "1/K",
            0.0,
            -0.5,
            0.5,
            "b, share by which k grows per kelvin away from the reference",
            role="bend",
            omitted=0.0,
            minimum=-2.0,
            maximum=2.0,
            tries=(-0.5, 0.5),
        ),
        Parameter(
            "stick_K",
            "K",
            0.0,
            0.0,
            20.0,
            "s, up to which bolted joints of the frame stick before they slide, either way; 0: they do not stick",
            role="slack",
            omitted=0.0,
            minimum=0.0,
            tries=(0.2, 0.5),
            of_known_drive=True,
        ),
    ),
    acts_through=("temperature", "time"),
    needs=("temperature_degC",),
    bounded=True,
    change=_change,
    at_reference=_at_reference,
    rank=15,
)
