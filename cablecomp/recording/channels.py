"""Names and units of a recording's columns: what is accepted, and the exact factors to SI."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from cablecomp.errors import InputError
from cablecomp.units import ANGLE, CURRENT, FORCE, SPEED, TEMPERATURE, TIME, TORQUE, Unit


class Column(NamedTuple):
    """What a column of a file means: `name` is canonical, canonical value = factor * value + offset."""

    column: str
    name: str
    factor: float
    offset: float


QUANTITIES: Final[Mapping[str, Mapping[str, Unit]]] = MappingProxyType(
    {
        "time": TIME,
        "motor_position": ANGLE,
        "joint_position": ANGLE,
        "joint_torque": TORQUE,
        "motor_torque": TORQUE,
        "motor_velocity": SPEED,
        "joint_velocity": SPEED,
        "motor_current": CURRENT,
        "tension_h": FORCE,
        "tension_l": FORCE,
        "temperature": TEMPERATURE,
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
    if name.startswith("(column "):
        raise InputError(f"{name.strip('()')} has no name; give it one, such as other_x")
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
    for text in columns:
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


def is_channel(name: str) -> bool:
    """Whether a column's name is that of a channel, in any of its units."""
    try:
        parse_column(name)
    except InputError:
        return False
    return True


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
