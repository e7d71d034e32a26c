"""Messages of a DBC table, taken apart once into shifts and masks, so that a frame costs microseconds.

cantools reads the table; its own decoder (tens of microseconds a frame) is left for checks. Intel and
Motorola signals, signed, unsigned, float32/64, and simple multiplexing are covered. Bit numbering: Vector's
DBC format.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import ceil, floor, isfinite
from pathlib import Path
from struct import pack
from typing import Any, NamedTuple

import cantools

from cablecomp.errors import InputError
from cablecomp.links.records import EXTENDED

_DECIMALS = 1e-9
"""Share by which a limit over a scale, both written in decimals, may miss a whole count."""


class Field(NamedTuple):
    """Where a signal lies in the message read as one integer, and what its counts mean.

    `counts = (word >> shift) & mask` (two's complement if `sign` is not 0), physical value = `scale counts +
    offset`. `low`, `high`: range of counts that the bits, and the table's own limits, allow.
    """

    name: str
    big: bool
    shift: int
    mask: int
    sign: int
    real: str
    scale: float
    offset: float
    low: int
    high: int
    unit: str
    choices: Mapping[int, str]
    multiplex: tuple[int, ...]


class Layout(NamedTuple):
    """One message: identifier with flags, length, its fields by name, and the field that selects a
    multiplexed part."""

    name: str
    identifier: int
    length: int
    fields: Mapping[str, Field]
    selector: Field | None


class Payload(NamedTuple):
    """Bytes of an encoded message, and the names of the signals that had to be saturated."""

    data: bytes
    clipped: tuple[str, ...]


@cache
def load_table(path: Path) -> Any:
    """Read a DBC file; raises InputError if it cannot be read or is none."""
    try:
        return cantools.database.load_file(path, strict=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give the path of a DBC file") from None
    except (cantools.database.Error, ValueError, KeyError) as error:
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{path}: is no usable message table: {text}; mend the file") from None


def layout(path: Path, message: str) -> Layout:
    """Take one message of a table apart; raises InputError with the messages there are, or for more than 8
    bytes."""
    table = load_table(path)
    try:
        found = table.get_message_by_name(message)
    except KeyError:
        names = ", ".join(m.name for m in table.messages[:12]) + (" …" if len(table.messages) > 12 else "")
        raise InputError(f"{path}: has no message `{message}`; it has {names}") from None
    if found.length > 8:
        raise InputError(f"{path}: message `{message}` has {found.length} bytes; 0 to 8 are accepted")
    fields = {s.name: _field(s, found.length) for s in found.signals}
    selector = next((fields[s.name] for s in found.signals if s.is_multiplexer), None)
    identifier = found.frame_id | (EXTENDED if found.is_extended_frame else 0)
    return Layout(found.name, identifier, found.length, fields, selector)


def _field(signal: Any, length: int) -> Field:
    big = signal.byte_order == "big_endian"
    if big:
        byte, bit = divmod(signal.start, 8)
        shift = 8 * length - (8 * byte + 7 - bit) - signal.length
    else:
        shift = signal.start
    n = signal.length
    real = {32: "f", 64: "d", 16: "e"}[n] if signal.is_float else ""
    low, high = (-(1 << n - 1), (1 << n - 1) - 1) if signal.is_signed else (0, (1 << n) - 1)
    scale, offset = float(signal.scale), float(signal.offset)
    if signal.minimum is not None and signal.maximum is not None and signal.maximum > signal.minimum:
        ends = sorted((float(x) - offset) / scale for x in (signal.minimum, signal.maximum))
        least, most = _inward(*ends)
        low, high = max(low, least), min(high, most)
    return Field(
        signal.name,
        big,
        shift,
        (1 << n) - 1,
        1 << (n - 1) if signal.is_signed and not real else 0,
        real,
        scale,
        offset,
        low,
        high,
        signal.unit or "",
        {int(k): str(v) for k, v in (signal.choices or {}).items()},
        tuple(signal.multiplexer_ids or ()),
    )


def _inward(least: float, most: float) -> tuple[int, int]:
    """The outermost counts that lie between the ends of a range, themselves in counts but for the rounding of the
    table's decimals; the nearest one where none does."""
    low, high = ceil(least - _DECIMALS * abs(least)), floor(most + _DECIMALS * abs(most))
    return (low, high) if low <= high else (round(0.5 * (least + most)),) * 2


def counts_in(field: Field, little: int, big: int) -> int:
    """Raw counts of an integer field in a frame that has been read as one integer, both ways."""
    n = (big if field.big else little) >> field.shift & field.mask
    return n - (field.sign << 1) if n & field.sign else n


def encode(message: Layout, values: Mapping[str, float]) -> Payload:
    """Bytes of a message; fields not named are zero counts; saturates and says so; raises InputError on NaN
    or infinity."""
    little = big = 0
    clipped: list[str] = []
    for name, value in values.items():
        field = message.fields[name]
        if not isfinite(value):
            raise InputError(
                f"{message.name}.{name} is {value}; a finite number is accepted; nothing was sent"
            )
        n, fits = raw(field, value)
        if not fits:
            clipped.append(name)
        if field.big:
            big |= (n & field.mask) << field.shift
        else:
            little |= (n & field.mask) << field.shift
    data = little.to_bytes(message.length, "little")
    if big:
        data = (int.from_bytes(data, "big") | big).to_bytes(message.length, "big")
    return Payload(data, tuple(clipped))


def raw(field: Field, value: float) -> tuple[int, bool]:
    """Nearest counts of a finite physical value, and whether they fit; floats are given as their bits."""
    x = (value - field.offset) / field.scale
    if field.real:
        top = {"e": 65504.0, "f": 3.4028234663852886e38, "d": 1.7976931348623157e308}[field.real]
        held = min(max(x, -top), top)
        return int.from_bytes(pack(">" + field.real, held), "big"), held == x
    n = round(x)
    if n < field.low:
        return field.low, False
    if n > field.high:
        return field.high, False
    return n, True


def choice(message: Layout, signal: str, value: float | str, where: str) -> float:
    """A value given as number, or as the table's own word; raises InputError with the words there are."""
    field = field_of(message, signal, where)
    if not isinstance(value, str):
        return float(value)
    for n, word in field.choices.items():
        if word == value:
            return field.scale * n + field.offset
    words = ", ".join(field.choices.values()) or "none (give a number)"
    raise InputError(f"{where}: `{value}` is no value of {message.name}.{signal}; it has {words}")


def field_of(message: Layout, signal: str, where: str) -> Field:
    """A field by name; raises InputError with the signals there are."""
    found = message.fields.get(signal)
    if found is None:
        raise InputError(
            f"{where}: message `{message.name}` has no signal `{signal}`; it has {', '.join(message.fields)}"
        )
    return found
