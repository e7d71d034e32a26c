"""Pressure-dependent friction: the coefficient falls as the cable is pressed harder against the pulley, by a power, to
a floor, or where a coat is pressed through."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Floats, Parameter, Restated
from cablecomp.mechanics.change import Law

NEUTRAL_PLACE: Final = 1.0
"""Tension over T0 at which it gives way, where none is given."""
SUDDEN: Final = 10.0
"""Power of the pressure by which a coat gives way: from a tenth to nine tenths of it within a factor of 1.55."""
NEUTRAL_POWER: Final = 1.0
"""Power of the pressure by which a coat that sticks as much under any pressure lowers the coefficient."""
GROWS: Final = -0.1
"""Exponent below which it grows with the pressure."""
LEAST_PRESSED: Final = 0.1
"""Tension over T0 below which the coefficient goes on neither by its power nor by what sticks: no table of the law
would resolve it."""


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    numbers = ("exponent", "lost", "place", "adhesion", "adhesion_power")
    return Change(tension_factor=Law(_factor, tuple(values[name] for name in numbers)))


def _factor(tau: Floats, exponent: float, lost: float, place: float, adhesion: float, power: float) -> Floats:
    pressed = np.maximum(tau, LEAST_PRESSED)
    by_power = pressed**-exponent
    stuck = 1.0 + adhesion * (pressed**-power - 1.0)
    return np.asarray(by_power * stuck * (1.0 - lost / (1.0 + (place / tau) ** SUDDEN)), dtype=np.float64)


def _grows_and_turns(values: Mapping[str, float], _on_high: bool) -> bool:
    """A coefficient that grows by a power and, beyond a pressure, once more (trials seeds 700 to 801: four of five such
    names were wrong) or is lost again (a weight concealed in the jaw's `L_4`, seed 125: exponent -0.54, and 0.8 of it
    lost from 4.7 T0 on) is what another friction, or a load, makes of it."""
    return values["lost"] != 0.0 and values["exponent"] < GROWS


def _at_pretension(values: Mapping[str, float], factor: float) -> Restated:
    """mu0 (T/T0)^-n (1 - a + a (T/T0)^-k) keeps its values: mu0 -> mu0 t^-n g, g = 1 - a + a t^-k, a -> a t^-k/g, t =
    T0'/T0; a place in T/T0 is t times as near."""
    place = {"place": values.get("place", NEUTRAL_PLACE) / factor} if "lost" in values else {}
    adhesion = values.get("adhesion", 0.0)
    sticks = adhesion * factor ** -values.get("adhesion_power", NEUTRAL_POWER)
    gain = 1.0 - adhesion + sticks
    stuck = {"adhesion": sticks / gain} if "adhesion" in values else {}
    return Restated({**values, **place, **stuck}, mu=gain * factor ** -values.get("exponent", 0.0))


EFFECT = Effect(
    id="pressure_dependent_friction",
    statement="The coefficient of friction falls (or rises) with the pressure between cable and pulley, as "
    "polymer coats do; or to a floor, where part of it sticks and does not grow with the pressure; or it is another "
    "one beyond a pressure at which a coat or a film of grease is pressed through.",
    equation="mu = mu0 (T/T0)^-n (1 - a + a (T/T0)^-k) (1 - w/(1 + (T0 u/T)^10)) at every place, of n and a: from "
    "T = T0/10 on; pressure goes with T/R",
    source="n = 1/3 for elastic contact of a soft coat (F. P. Bowden and D. Tabor, The Friction and "
    "Lubrication of Solids, 1950); capstans with mu as a power of pressure: H. G. Howell, J. "
    "Textile Inst. 44 (1953); friction beside adhesion, F = mu (N + A): B. V. Derjaguin, Z. Phys. 88 (1934)",
    parameters=(
        Parameter(
            "exponent",
            "-",
            0.0,
            -0.4,
            0.8,
            "n, 1/3 for elastic contact",
            minimum=-0.9,
            maximum=0.9,
            omitted=0.0,
        ),
        Parameter(
            "adhesion",
            "-",
            0.0,
            0.0,
            0.9,
            "a, share of mu at T0 that falls with the pressure, to the rest as a floor",
            minimum=0.0,
            maximum=0.95,
            omitted=0.0,
            by_itself=True,
            of_known_drive=True,
        ),
        Parameter(
            "adhesion_power",
            "-",
            NEUTRAL_POWER,
            0.5,
            2.5,
            "k, power by which it falls; 1: what sticks does so under any pressure",
            log=True,
            role="shape",
            minimum=0.2,
            maximum=4.0,
            omitted=NEUTRAL_POWER,
            of="adhesion",
            reach=2.0,
        ),
        Parameter(
            "lost",
            "-",
            0.0,
            -1.0,
            0.8,
            "w, share of mu that is lost where it is pressed through (below 0: gained)",
            minimum=-3.0,
            maximum=0.95,
            omitted=0.0,
            of_known_drive=True,
            is_another=_grows_and_turns,
        ),
        Parameter(
            "place",
            "-",
            NEUTRAL_PLACE,
            0.4,
            2.5,
            "u, tension over T0 where half of that is lost",
            log=True,
            role="shape",
            minimum=0.05,
            maximum=20.0,
            omitted=NEUTRAL_PLACE,
            of="lost",
        ),
    ),
    acts_through=("load", "load_direction", "reversal"),
    bounded=True,
    change=_change,
    at_pretension=_at_pretension,
)
