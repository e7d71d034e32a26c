"""Names and units of a recording's columns: what is accepted, and the exact factors to SI."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable, Mapping
from fractions import Fraction
from types import MappingProxyType
from typing import Final, NamedTuple

from cablecomp.errors import InputError

_LBF = Fraction("4.4482216152605")  # pound-force in N: 0.45359237 kg at 9.80665 m/s2, exact by definition
_INCH = Fraction("0.0254")
_KGF = Fraction("9.80665")


class Unit(NamedTuple):
    """canonical value = factor * value + offset."""

    factor: float
    offset: float = 0.0


class Column(NamedTuple):
    """What a column of a file means: `name` is canonical, canonical value = factor * value + offset."""

    column: str
    name: str
    factor: float
    offset: float


def _units(**factors: Fraction | int | str) -> Mapping[str, Unit]:
    return MappingProxyType({unit: Unit(float(Fraction(factor))) for unit, factor in factors.items()})


_TIME = _units(s=1, ms="1/1000", us="1/1000000", ns="1/1000000000", min=60)
_ANGLE = MappingProxyType(
    {
        "rad": Unit(1.0),
        "mrad": Unit(1e-3),
        "deg": Unit(math.pi / 180.0),
        "arcmin": Unit(math.pi / 10800.0),
        "rev": Unit(2.0 * math.pi),
    }
)
_SPEED = MappingProxyType(
    {
        "rad_s": Unit(1.0),
        "mrad_s": Unit(1e-3),
        "deg_s": Unit(math.pi / 180.0),
        "rev_s": Unit(2.0 * math.pi),
        "rpm": Unit(math.pi / 30.0),
    }
)
_TORQUE = _units(
    Nm=1,
    mNm="1/1000",
    uNm="1/1000000",
    Ncm="1/100",
    Nmm="1/1000",
    kNm=1000,
    inlbf=_LBF * _INCH,
    inozf=_LBF * _INCH / 16,
    ftlbf=_LBF * _INCH * 12,
    kgfcm=_KGF / 100,
)
_CURRENT = _units(A=1, mA="1/1000", uA="1/1000000")
_FORCE = _units(N=1, mN="1/1000", kN=1000, lbf=_LBF, ozf=_LBF / 16, kgf=_KGF, gf=_KGF / 1000)
_TEMPERATURE = MappingProxyType(
    {"degC": Unit(1.0), "K": Unit(1.0, -273.15), "degF": Unit(5.0 / 9.0, -160.0 / 9.0)}
)

QUANTITIES: Final[Mapping[str, Mapping[str, Unit]]] = MappingProxyType(
    {
        "time": _TIME,
        "motor_position": _ANGLE,
        "joint_position": _ANGLE,
        "joint_torque": _TORQUE,
        "motor_torque": _TORQUE,
        "motor_velocity": _SPEED,
        "joint_velocity": _SPEED,
        "motor_current": _CURRENT,
        "tension_h": _FORCE,
        "tension_l": _FORCE,
        "temperature": _TEMPERATURE,
    }
)
"""Accepted units of each quantity; the first one is the canonical one."""

CANONICAL: Final = tuple(f"{quantity}_{next(iter(units))}" for quantity, units in QUANTITIES.items())
"""Canonical channel names, in the order in which they are written."""

OTHER: Final = "other_"
"""Prefix of any further channel, passed through as it is."""

_OTHER_NAME = re.compile(r"other_[A-Za-z0-9][A-Za-z0-9_.:/+-]*")


def is_other(name: str) -> bool:
    """Whether a channel is a further one (`other_<name>`)."""
    return name.startswith(OTHER)


def may_be_empty(name: str) -> bool:
    """Whether a cell of this channel may be empty or NaN: only in channels that no prediction rests on."""
    return is_other(name) or name == "temperature_degC"


def order(names: Iterable[str]) -> tuple[str, ...]:
    """Return channel names in the order in which a canonical file holds them: canonical ones, then others."""
    given = list(names)
    return tuple(n for n in CANONICAL if n in given) + tuple(n for n in given if n not in CANONICAL)


def parse_column(column: str) -> Column:
    """Say what a column's name means; InputError (without the file's name) if it means nothing."""
    name = column.strip()
    if is_other(name):
        if not _OTHER_NAME.fullmatch(name):
            raise InputError(
                f"column {name!r} is not a usable name; accepted is other_<name> "
                "with letters, digits and _.:/+-"
            )
        return Column(name, name, 1.0, 0.0)
    for quantity, units in QUANTITIES.items():
        if name == quantity or name.startswith(f"{quantity}_"):
            return _with_unit(name, quantity, units)
    raise InputError(
        f"column {name!r} is not a known channel{_near(name)}; accepted are "
        f"{', '.join(CANONICAL)}, and other_<name> for any further channel"
    )


def parse_header(columns: Iterable[str]) -> tuple[Column, ...]:
    """Say what each column means; InputError if one means nothing or two mean the same channel."""
    parsed: dict[str, Column] = {}
    for position, text in enumerate(columns, start=1):
        if not text.strip():
            raise InputError(f"column {position} has no name; give it one, such as other_{position}")
        column = parse_column(text)
        earlier = parsed.get(column.name)
        if earlier is not None:
            pair = (
                f"column {column.column!r} occurs twice"
                if earlier.column == column.column
                else f"columns {earlier.column!r} and {column.column!r} are the same channel ({column.name})"
            )
            raise InputError(f"{pair}; keep one of them")
        parsed[column.name] = column
    return tuple(parsed.values())


def _with_unit(name: str, quantity: str, units: Mapping[str, Unit]) -> Column:
    suffix = name[len(quantity) + 1 :]
    unit = units.get(suffix)
    if unit is None:
        accepted = ", ".join(f"_{known}" for known in units)
        found = f"has unit {suffix!r}, which is not known for {quantity}" if suffix else "carries no unit"
        raise InputError(f"column {name!r} {found}; accepted: {accepted}{_near(name, quantity)}")
    return Column(name, f"{quantity}_{next(iter(units))}", unit.factor, unit.offset)


def _near(name: str, quantity: str | None = None) -> str:
    every = [f"{q}_{unit}" for q, units in QUANTITIES.items() for unit in units]
    if quantity is None:
        groups, cutoff = [list(CANONICAL), every], 0.7
    else:
        groups, cutoff = [[f"{quantity}_{unit}" for unit in QUANTITIES[quantity]]], 0.9
    for known in groups:
        folded = {candidate.lower(): candidate for candidate in known}
        match = difflib.get_close_matches(name.lower(), folded, n=1, cutoff=cutoff)
        if match:
            return f" (did you mean {folded[match[0]]!r}?)"
    return ""
