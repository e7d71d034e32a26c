"""Faults from text: `drop:p=0.1,start=2,stop=5,direction=tx`."""

from __future__ import annotations

from dataclasses import Field, fields
from typing import Any

from firmware_sim.errors import SimError
from firmware_sim.faults.base import Fault
from firmware_sim.faults.device import (
    DeviceReset,
    JumpingEncoder,
    SaturatedTorque,
    SensorOffset,
    SilentNode,
    StuckEncoder,
)
from firmware_sim.faults.line import BusOff, CablePull, SerialNoise
from firmware_sim.faults.wire import Corrupt, Drop, Late, Reorder, Repeat

FAULTS: dict[str, type[Fault]] = {
    "drop": Drop,
    "late": Late,
    "repeat": Repeat,
    "reorder": Reorder,
    "corrupt": Corrupt,
    "bus_off": BusOff,
    "noise": SerialNoise,
    "cable_pull": CablePull,
    "silent": SilentNode,
    "stuck": StuckEncoder,
    "jump": JumpingEncoder,
    "saturate": SaturatedTorque,
    "offset": SensorOffset,
    "reset": DeviceReset,
}


def describe_faults() -> str:
    """One line for each fault: name, keys with their defaults, what it does."""
    return "\n".join(f"{name}:{_keys(kind)}  {_first_line(kind)}" for name, kind in FAULTS.items())


def parse_fault(text: str, seed: int = 0) -> Fault:
    """A fault from `name:key=value,…`; `seed` unless the text gives its own. Raises SimError."""
    name, _, rest = text.partition(":")
    if name not in FAULTS:
        raise SimError(f"fault {text!r}: unknown name {name!r}; one of {', '.join(FAULTS)} is accepted")
    known = {f.name: f for f in _public(FAULTS[name])}
    values: dict[str, Any] = {"seed": seed}
    for pair in filter(None, rest.split(",")):
        key, equals, value = pair.partition("=")
        if not equals or key not in known:
            raise SimError(f"fault {text!r}: {pair!r}; KEY=VALUE with KEY of {', '.join(known)} is accepted")
        values[key] = _value(known[key], value, text)
    return FAULTS[name](**values)


def _value(known: Field[Any], value: str, text: str) -> Any:
    try:
        if known.type == "float":
            return float(value)
        return int(value, 0) if known.type == "int" else value
    except ValueError:
        raise SimError(f"fault {text!r}: {known.name} = {value!r}; a number is accepted") from None


def _public(kind: type[Fault]) -> list[Field[Any]]:
    return [f for f in fields(kind) if f.init]


def _keys(kind: type[Fault]) -> str:
    return ",".join(f"{f.name}={f.default}" for f in _public(kind))


def _first_line(kind: type[Fault]) -> str:
    return " ".join((kind.__doc__ or "").split())
