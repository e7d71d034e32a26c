"""Units and exact factors to SI, by the suffix that names a quantity (`rad`, `Nm`, `s`, ...)."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from fractions import Fraction
from itertools import product
from types import MappingProxyType
from typing import Final, NamedTuple

_LBF = Fraction("4.4482216152605")  # pound-force in N: 0.45359237 kg at 9.80665 m/s2, exact by definition
_INCH = Fraction("0.0254")
_KGF = Fraction("9.80665")


class Unit(NamedTuple):
    """SI value = factor * value + offset."""

    factor: float
    offset: float = 0.0


def _units(**factors: Fraction | int | str) -> Mapping[str, Unit]:
    return MappingProxyType({unit: Unit(float(Fraction(factor))) for unit, factor in factors.items()})


TIME: Final = _units(s=1, ms="1/1000", us="1/1000000", ns="1/1000000000", min=60, h=3600)
ANGLE: Final = MappingProxyType(
    {
        "rad": Unit(1.0),
        "mrad": Unit(1e-3),
        "urad": Unit(1e-6),
        "deg": Unit(math.pi / 180.0),
        "mdeg": Unit(math.pi / 180_000.0),
        "gon": Unit(math.pi / 200.0),
        "arcmin": Unit(math.pi / 10800.0),
        "rev": Unit(2.0 * math.pi),
    }
)
SPEED: Final = MappingProxyType(
    {
        "rad_s": Unit(1.0),
        "mrad_s": Unit(1e-3),
        "deg_s": Unit(math.pi / 180.0),
        "rev_s": Unit(2.0 * math.pi),
        "rpm": Unit(math.pi / 30.0),
    }
)
TORQUE: Final = _units(
    Nm=1,
    mNm="1/1000",
    uNm="1/1000000",
    Ncm="1/100",
    cNm="1/100",
    Nmm="1/1000",
    kNm=1000,
    inlbf=_LBF * _INCH,
    inozf=_LBF * _INCH / 16,
    ftlbf=_LBF * _INCH * 12,
    kgfcm=_KGF / 100,
)
CURRENT: Final = _units(A=1, mA="1/1000", uA="1/1000000")
FORCE: Final = _units(N=1, mN="1/1000", kN=1000, lbf=_LBF, ozf=_LBF / 16, kgf=_KGF, gf=_KGF / 1000)
TEMPERATURE: Final = MappingProxyType(
    {"degC": Unit(1.0), "K": Unit(1.0, -273.15), "degF": Unit(5.0 / 9.0, -160.0 / 9.0)}
)
LENGTH: Final = _units(m=1, mm="1/1000", um="1/1000000", cm="1/100", km=1000, inch=_INCH, ft=_INCH * 12)
FREQUENCY: Final = _units(Hz=1, kHz=1000, mHz="1/1000", per_min="1/60")

UNITS: Final[Mapping[str, Mapping[str, Unit]]] = MappingProxyType(
    {
        next(iter(table)): table
        for table in (SPEED, TIME, ANGLE, TORQUE, CURRENT, FORCE, TEMPERATURE, LENGTH, FREQUENCY)
    }
)
"""Quantity (the suffix of a name that says its SI unit) -> unit -> how to reach SI."""

_ARMS: Final = {
    "inlbf": (("in", "inch"), ("lb", "lbs", "lbf")),
    "inozf": (("in", "inch"), ("oz", "ozf")),
    "ftlbf": (("ft",), ("lb", "lbs", "lbf")),
    "kgfcm": (("cm",), ("kg", "kgf")),
}
"""Torques that are written arm first or force first, with anything between the two."""

_BETWEEN: Final = ("", "-", "·", ".", " ", "_")
_ALIKE: Final = str.maketrans(
    {
        **dict.fromkeys("∙•⋅×*", "·"),
        **dict.fromkeys("º˚", "°"),
        **dict.fromkeys("µμ", "u"),
        "℃": "°C",
        "℉": "°F",
        "⁻": "^-",
        "¹": "1",
    }
)
"""Signs that are taken for one another."""
_PER: Final = re.compile(r"(?:^|[ ·.]|(?<=°))(s|sec|min)\^?-1$")
_TURNS: Final = {
    "rad": ("rad", "radian", "radians"),
    "mrad": ("mrad",),
    "deg": ("deg", "degree", "degrees", "°"),
    "rev": ("rev", "revs", "revolution", "revolutions", "turn", "turns", "r", "U"),
}

_SPELT: Final = MappingProxyType(
    {
        **{
            f"{first}{between}{second}": unit
            for unit, parts in _ARMS.items()
            for first, second in (*product(*parts), *product(*parts[::-1]))
            for between in _BETWEEN
        },
        **{
            f"{force}{between}{arm}": f"{force}{arm}"
            for force, arm in (("N", "m"), ("mN", "m"), ("cN", "m"), ("kN", "m"), ("N", "mm"), ("N", "cm"))
            for between in _BETWEEN
            if between
        },
        **{word: unit for unit, words in _TURNS.items() for word in words if word not in ("r", "U")},
        **{
            f"{word}{per}{second}": f"{unit}_s"
            for unit, words in _TURNS.items()
            for word, per, second in product(words, ("/", " per "), ("s", "sec", "second", "seconds"))
        },
        **{
            f"{word}{per}{minute}": "rpm"
            for word, per, minute in product((*_TURNS["rev"], "1"), ("/", " per "), ("min", "minute"))
        },
        **{
            f"{force}{between}{arm}": "Nm"
            for force, between, arm in product(
                ("newton", "newtons"), _BETWEEN, ("meter", "meters", "metre", "metres")
            )
        },
        **{
            f"{unit}{between}{kind}": unit
            for unit, between, kind in product(("A", "mA"), ("", " ", "_"), ("rms", "RMS"))
        },
        "dps": "deg_s",
        "nm": "Nm",
        "grad": "gon",
        "grads": "gon",
        "gradian": "gon",
        "gradians": "gon",
        "sec": "s",
        "seconds": "s",
        "second": "s",
        "mins": "min",
        "minute": "min",
        "minutes": "min",
        "hr": "h",
        "hrs": "h",
        "hour": "h",
        "hours": "h",
        "msec": "ms",
        "usec": "us",
        "nsec": "ns",
        "amp": "A",
        "amps": "A",
        "C": "degC",
        "°C": "degC",
        "celsius": "degC",
        **dict.fromkeys(("deg C", "deg_C", "deg c", "degrees C", "degrees c"), "degC"),
        **dict.fromkeys(("deg F", "deg_F", "deg f", "degrees F", "degrees f"), "degF"),
        "F": "degF",
        "°F": "degF",
        "kelvin": "K",
        "newton": "N",
        "newtons": "N",
        "in": "inch",
    }
)
"""Ways to write a unit that cannot, or need not, stand in a name."""


def unit_named(text: str, table: Mapping[str, Unit]) -> Unit | None:
    """The unit of a quantity's table that a text means (`deg`, `°`, `degrees`); None if none does."""
    name = plain_signs(text)
    name = _PER.sub(r"/\1", name)
    name = f"1{name}" if name.startswith("/") else name
    return table.get(name) or table.get(_SPELT.get(name, _SPELT.get(name.lower(), "")))


def plain_signs(text: str) -> str:
    """A unit's text in the signs that are usual (`·` of all dots and crosses, `u` of micro), without a full stop."""
    return text.strip().rstrip(".").translate(_ALIKE)


class Stated(NamedTuple):
    """What the end of a name says: the rest of it, its unit, and the units of that quantity."""

    stem: str
    unit: Unit
    table: Mapping[str, Unit]


def stated_unit(name: str) -> Stated | None:
    """The unit at the end of a name, SI or not (`cable_diameter_mm`); None if there is none."""
    fitting = [(unit, table) for table in UNITS.values() for unit in table if name.endswith(f"_{unit}")]
    unit, table = max(fitting, key=lambda f: len(f[0]), default=("", TIME))
    if not unit or name.endswith(f"_per_{unit}"):
        return None
    return Stated(name.removesuffix(f"_{unit}"), table[unit], table)


def suffix_of(name: str) -> str | None:
    """The suffix of a name that says its SI unit (`motor_velocity_rad_s` -> `rad_s`); None if it has none."""
    fitting = [suffix for suffix in UNITS if name.endswith(f"_{suffix}")]
    found = max(fitting, key=len, default=None)
    return None if found is None or name.endswith(f"_per_{found}") else found
