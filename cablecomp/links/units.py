"""Factors from the units that message tables use to the canonical channels' SI units."""

from __future__ import annotations

from math import pi
from typing import Final, NamedTuple

from cablecomp.errors import InputError

_TURN = 2.0 * pi
_INCH_POUND = 0.0254 * 4.4482216152605


class Linear(NamedTuple):
    """SI value = `gain * x + offset`."""

    gain: float
    offset: float = 0.0


_ANGLE = {
    "rad": 1.0,
    "mrad": 1e-3,
    "urad": 1e-6,
    "deg": pi / 180,
    "°": pi / 180,
    "rev": _TURN,
    "turn": _TURN,
    "turns": _TURN,
}
_RATE = {
    "rad/s": 1.0,
    "mrad/s": 1e-3,
    "deg/s": pi / 180,
    "°/s": pi / 180,
    "rev/s": _TURN,
    "turns/s": _TURN,
    "rpm": _TURN / 60,
}
_TORQUE = {
    "Nm": 1.0,
    "N.m": 1.0,
    "N·m": 1.0,
    "mNm": 1e-3,
    "kNm": 1e3,
    "inlbf": _INCH_POUND,
    "inozf": _INCH_POUND / 16,
}
_FORCE = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605}
_CURRENT = {"A": 1.0, "mA": 1e-3}
_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_STIFFNESS = {"Nm/rad": 1.0, "mNm/rad": 1e-3, "Nm/deg": 180 / pi, "Nm/rev": 1 / _TURN}
_DAMPING = {"Nms/rad": 1.0, "Nm/(rad/s)": 1.0, "mNms/rad": 1e-3}
_TEMPERATURE = {
    "degC": Linear(1.0),
    "°C": Linear(1.0),
    "C": Linear(1.0),
    "K": Linear(1.0, -273.15),
    "degF": Linear(5 / 9, -160 / 9),
}

UNITS: Final[dict[str, dict[str, Linear]]] = {
    "rad": {k: Linear(v) for k, v in _ANGLE.items()},
    "rad_s": {k: Linear(v) for k, v in _RATE.items()},
    "Nm": {k: Linear(v) for k, v in _TORQUE.items()},
    "N": {k: Linear(v) for k, v in _FORCE.items()},
    "A": {k: Linear(v) for k, v in _CURRENT.items()},
    "s": {k: Linear(v) for k, v in _TIME.items()},
    "Nm_per_rad": {k: Linear(v) for k, v in _STIFFNESS.items()},
    "Nms_per_rad": {k: Linear(v) for k, v in _DAMPING.items()},
    "degC": _TEMPERATURE,
}
"""Quantity (the suffix of a channel's name) -> unit -> how to reach SI."""


def quantity_of(channel: str) -> str | None:
    """The suffix of a channel's name that says its unit (`motor_velocity_rad_s` -> `rad_s`); None if it has
    none."""
    for quantity in sorted(UNITS, key=len, reverse=True):
        if channel.endswith("_" + quantity):
            return quantity
    return None


def to_si(quantity: str | None, unit: str, where: str) -> Linear:
    """How to reach SI from `unit`; raises InputError with the units accepted. A quantity without suffix takes
    any unit as it is."""
    if quantity is None:
        return Linear(1.0)
    table = UNITS[quantity]
    found = table.get(unit.strip())
    if found is None:
        raise InputError(
            f"{where}: unit `{unit}` is not one for {quantity}; accepted: {', '.join(table)}; state `unit`"
        )
    return found
